"""One row of a vehicle's table of parameters, and what a number becomes in it."""

import math
import struct
from dataclasses import dataclass

FLOAT = struct.Struct("<f")


def to_float32(value: float) -> float:
    """`value` as the wire carries it; an infinity where it is too large, and one zero only."""
    try:
        return float(FLOAT.unpack(FLOAT.pack(value))[0]) + 0.0
    except OverflowError:
        return math.copysign(math.inf, value)


@dataclass(frozen=True, slots=True)
class Parameter:
    """One row of the vehicle's table. 0.0 means: not set, whatever the bounds. `later`: a store of an earlier version
    lacks it."""

    name: str
    low: float
    high: float
    default: float
    veh_cfg: int = 0
    coefficient: str = ""
    later: bool = False

    def admits(self, value: float) -> bool:
        return value == 0.0 or self.low <= value <= self.high
