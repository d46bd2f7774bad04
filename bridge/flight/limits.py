"""Limits of a flight: the file that a person writes, and the numbers that the vehicle holds."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bridge import schema
from bridge.errors import ConfigError

MOST: Final = {
    "deepest_m": 6000.0,
    "altitude_m": 100.0,
    "distance_m": 200.0,
    "speed_m_s": 3.0,
    "tilt_deg": 60.0,
    "battery_v": 1000.0,
    "time_s": 7200.0,
    "link_s": 10.0,
    "hold_s": 600.0,
    "travel_m_s": 1.0,
}
"""Largest value of each limit; beyond it nothing would be limited, or a unit is wrong."""
ZERO_IS_NONE: Final = ("altitude_m", "battery_v")


@dataclass(frozen=True)
class FlightLimits:
    """Where and how a vehicle may fly by itself.

    `shallowest_m` and `deepest_m`: depth; `altitude_m`: least height over the bottom, 0 for a vehicle that does not
    measure it; `distance_m` from where the flight began, horizontally; `speed_m_s` over the bottom; `tilt_deg` from
    level; `battery_v`: least voltage, 0 for a vehicle that does not measure it; `time_s` from the start until it goes
    home. Without a word from the ground for `link_s` the vehicle goes back. It goes to and fro at `travel_m_s`. At its
    end it holds its place for `hold_s`, and then disarms by itself. Raises ValueError for a value that limits nothing.
    """

    shallowest_m: float
    deepest_m: float
    altitude_m: float
    distance_m: float
    speed_m_s: float
    tilt_deg: float
    battery_v: float
    time_s: float
    link_s: float = 3.0
    hold_s: float = 60.0
    travel_m_s: float = 0.2

    def __post_init__(self) -> None:
        for name, most in MOST.items():
            value, may_be_zero = getattr(self, name), name in ZERO_IS_NONE
            if not (value >= 0.0 if may_be_zero else value > 0.0) or not value <= most:
                least = "from 0, for none," if may_be_zero else "above 0,"
                raise ValueError(f"{name} is {value:g}; give a value {least} up to {most:g}")
        if not 0.0 <= self.shallowest_m < self.deepest_m:
            raise ValueError(
                f"shallowest_m is {self.shallowest_m:g}; give a depth from 0 to less than deepest_m, {self.deepest_m:g}"
            )
        if self.travel_m_s > self.speed_m_s:
            raise ValueError(f"travel_m_s is {self.travel_m_s:g}, more than speed_m_s, {self.speed_m_s:g}")

    @property
    def tilt_rad(self) -> float:
        return math.radians(self.tilt_deg)


def load_limits(path: Path) -> FlightLimits:
    """Load the limit file. Raises ConfigError with the file and the key."""
    try:
        there = path.exists()
    except OSError as error:
        raise ConfigError(f"{path}: {schema.why_unread(error)}; name another") from None
    if not there:
        raise ConfigError(
            f"{path}: no such file; write the limits into it as docs/howto/fly_a_plan.md has them, or name another"
        )
    return schema.build(FlightLimits, schema.load_yaml(path), str(path))


def limits_of(numbers: tuple[float, ...]) -> FlightLimits:
    """The limits in the order of their fields. Raises ConfigError if they are none."""
    if not all(map(math.isfinite, numbers)):
        raise ConfigError("a limit is no finite number")
    try:
        return FlightLimits(*numbers)
    except (TypeError, ValueError) as error:
        raise ConfigError(f"limits: {error}") from None
