"""Single-precision values as they go over the wire: rounding, comparing by bits, the shortest text."""

import math
import struct
from typing import Final

import numpy as np

LARGEST: Final = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]


def rounded(value: float) -> float:
    """The nearest float32. Raises ValueError where there is none that is finite."""
    if not math.isfinite(value):
        raise ValueError(f"{value} is not a finite number")
    try:
        return float(struct.unpack("<f", struct.pack("<f", float(value)))[0])
    except OverflowError:
        raise ValueError(f"{value:g} does not fit a float32 (largest {LARGEST:.6g})") from None


def given(value: float) -> float:
    """What somebody gives, as the wire has it: 0, which says "not set", of 0 alone. Raises ValueError for what is no
    finite float32."""
    single = rounded(value)
    if single == 0.0 and value != 0.0:
        raise ValueError(f"{value:g} is too small for a float32, which would hold 0")
    return single


def bits(value: float) -> bytes:
    """The four bytes of a value that came over the wire; a NaN keeps none of its payload."""
    try:
        return struct.pack("<f", value)
    except OverflowError:
        return struct.pack("<f", math.copysign(math.inf, value))


def same(one: float, other: float) -> bool:
    """Whether two values are one float32, bit by bit."""
    return bits(one) == bits(other)


def text(value: float) -> str:
    """The shortest text that reads back to the same float32. Raises ValueError for NaN and inf."""
    single = np.float32(rounded(value))
    plain = np.format_float_positional(single, unique=True, trim="-")
    scientific = np.format_float_scientific(single, unique=True, trim="-")
    shortest = plain if len(plain) <= len(scientific) + 2 else scientific
    # A float64 reader rounds twice; nine digits are always enough for it.
    return shortest if same(float(shortest), float(single)) else f"{float(single):.9g}"
