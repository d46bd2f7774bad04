"""Orders of a flight on the wire: COMMAND_LONG with MAV_CMD_USER_1 to 3, which MAVLink leaves to each vehicle.

    USER_1, a leg      number from 0, seconds, transient, alternate, axes, first and second value
    USER_2, limits     row, six numbers of the limits and the plan's depth
    USER_3, an order   what, its number, checksum of the rows before it, countdown, their count

Every leg and row is acknowledged, with its number in result_param2; an order names the checksum of all that it needs,
so that a half-heard manoeuvre is never flown. An order repeated under the same number is acknowledged and not obeyed
again. The ground that flies says HERE all the while, so that its silence is noticed where another ground beats.
"""

import math
import struct
import zlib
from collections.abc import Sequence
from dataclasses import astuple
from enum import IntEnum
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import ConfigError
from bridge.flight.limits import FlightLimits, limits_of
from bridge.vehicle.legs import MIRRORED, Leg

LEG: Final[int] = dialect.MAV_CMD_USER_1
LIMITS: Final[int] = dialect.MAV_CMD_USER_2
ORDER: Final[int] = dialect.MAV_CMD_USER_3
COMMANDS: Final = (LEG, LIMITS, ORDER)
MOST_LEGS: Final = 100
ROW: Final = 6
_AXES: Final = {name: 1 << place for place, name in enumerate(MIRRORED)}
"""Bit of each key of a leg that drives an axis; a leg drives up to two."""

Seven = tuple[float, float, float, float, float, float, float]


class Order(IntEnum):
    """An order of the ground on a flight."""

    BEGIN = 1
    FLY = 2
    FINISH = 3
    END = 4
    HERE = 5


def leg_numbers(number: int, leg: Leg) -> Seven:
    """A leg as the numbers of its command. Raises ConfigError for a leg that drives more than two axes."""
    values = {name: getattr(leg, name) for name in _AXES}
    driven = {n: v for n, v in values.items() if v is not None and (v or n.startswith("push"))}
    if len(driven) > 2:
        raise ConfigError(
            f"leg '{leg.name}': drives {len(driven)} axes, and a leg that is flown drives up to two"
        )
    first, second = (*driven.values(), 0.0, 0.0)[:2]
    axes = sum(_AXES[name] for name in driven)
    return float(number), leg.duration_s, leg.transient_s, float(leg.alternate), float(axes), first, second


def leg_of(numbers: Sequence[float]) -> Leg:
    """The leg in the numbers of its command. Raises ConfigError if they are none."""
    _, duration_s, transient_s, alternate, axes, *values = numbers
    if not all(map(math.isfinite, numbers)):
        raise ConfigError("a leg's number is no finite one")
    if not (
        axes.is_integer()
        and alternate.is_integer()
        and 1 <= alternate <= 1000
        and 0 <= axes < 1 << len(_AXES)
    ):
        raise ConfigError("a leg's axes or alternation are none")
    driven = [name for name, bit in _AXES.items() if int(axes) & bit]
    if len(driven) > 2 or not 0.0 < duration_s <= 600.0:
        raise ConfigError("a leg drives up to two axes, for up to 600 s")
    try:
        given = dict(zip(driven, values, strict=False))
        return Leg(duration_s, "", "steady", transient_s=transient_s, alternate=int(alternate), **given)
    except ValueError as error:
        raise ConfigError(str(error)) from None


def limit_rows(limits: FlightLimits, depth_m: float) -> list[Seven]:
    """Limits and the plan's depth as the numbers of their commands."""
    numbers = (*astuple(limits), depth_m)
    rows = [numbers[start : start + ROW] for start in range(0, len(numbers), ROW)]
    return [(float(row), *values) for row, values in enumerate(rows)]


def limits_in(rows: Sequence[Sequence[float]]) -> tuple[FlightLimits, float]:
    """Limits and the plan's depth in the numbers of their commands. Raises ConfigError if they are none."""
    numbers = [value for row in rows for value in row[1:]]
    return limits_of(tuple(numbers[:-1])), numbers[-1]


def checksum(rows: Sequence[Sequence[float]]) -> float:
    """A number of 24 bits, which a float32 holds, of the rows as they arrive."""
    data = b"".join(struct.pack(f"<{len(row)}f", *row) for row in rows)
    return float(zlib.crc32(data) & 0xFFFFFF)
