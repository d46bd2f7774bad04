"""One row of a vehicle's parameter table, and the rounding of values to float32."""

import math
import struct
from dataclasses import dataclass

FLOAT = struct.Struct("<f")


def to_float32(value: float) -> float:
    """Return `value` as the wire carries it: infinity if it is too large, and never -0."""
    try:
        return float(FLOAT.unpack(FLOAT.pack(value))[0]) + 0.0
    except OverflowError:
        return math.copysign(math.inf, value)


@dataclass(frozen=True, slots=True)
class Parameter:
    """One row of the vehicle's parameter table.

    The value 0.0 means not set, whatever the bounds. `later`: a store of an earlier version lacks this row.
    """

    name: str
    low: float
    high: float
    default: float
    veh_cfg: int = 0
    coefficient: str = ""
    later: bool = False

    def admits(self, value: float) -> bool:
        return value == 0.0 or self.low <= value <= self.high
