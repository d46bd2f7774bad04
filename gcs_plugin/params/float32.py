"""Single-precision values as sent over MAVLink: rounding, comparison bit by bit, shortest text."""

import math
import struct
from typing import Final

import numpy as np

LARGEST: Final = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]


def rounded(value: float) -> float:
    """The nearest float32. Raises ValueError for NaN, inf, and a value beyond the largest float32."""
    if not math.isfinite(value):
        raise ValueError(f"{value} is not a finite number")
    try:
        return float(struct.unpack("<f", struct.pack("<f", float(value)))[0])
    except OverflowError:
        raise ValueError(f"{value:g} does not fit a float32 (largest {LARGEST:.6g})") from None


def from_user(value: float) -> float:
    """The nearest float32 of a user's value.

    Raises ValueError for a value without a finite float32, and for a nonzero value that would round to 0, since 0 means
    "not set".
    """
    single = rounded(value)
    if single == 0.0 and value != 0.0:
        raise ValueError(f"{value:g} is too small for a float32, which would hold 0")
    return single


def bits(value: float) -> bytes:
    """The four bytes of a value that was received; the payload of a NaN is not kept."""
    try:
        return struct.pack("<f", value)
    except OverflowError:
        return struct.pack("<f", math.copysign(math.inf, value))


def same(value: float, other: float) -> bool:
    """Whether two values are the same float32, bit by bit."""
    return bits(value) == bits(other)


def text(value: float) -> str:
    """The shortest text that reads back to the same float32. Raises ValueError for NaN and inf."""
    single = np.float32(rounded(value))
    plain = np.format_float_positional(single, unique=True, trim="-")
    scientific = np.format_float_scientific(single, unique=True, trim="-")
    shortest = plain if len(plain) <= len(scientific) + 2 else scientific
    # A reader that parses to float64 first rounds twice; nine digits are always enough for that.
    return shortest if same(float(shortest), float(single)) else f"{float(single):.9g}"
