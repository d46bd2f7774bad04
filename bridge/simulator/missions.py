"""Missions of the simulated vehicle: `survey` and `hovering` of the paper, `validation`, or a YAML file.

A mission is a list of legs; each brings the reference velocity from the previous leg's value to its own by a
double-S, and holds it. Heading and depth are the exact integrals. A leg may push instead: a force held open loop.
"""

import math
from bisect import bisect_right
from dataclasses import dataclass, field, fields, replace
from itertools import accumulate, pairwise
from pathlib import Path
from typing import Literal

import yaml

from bridge import schema
from bridge.errors import ConfigError
from bridge.vehicle.config import Configuration
from bridge.vehicle.references import DoubleS, Push, Reference
from bridge.vehicle.thrusters import allocation_matrix

Phase = Literal["rest", "acceleration", "steady", "deceleration", "turning", "diving"]
HeadingReference = Literal["smooth", "linear"]
Velocity = tuple[float, float, float, float]

TRANSIENT_S = 5.0
DEPTH_M = 0.6
AFLOAT_M = 0.2
STILL: Velocity = (0.0, 0.0, 0.0, 0.0)
MIRRORED = (
    *("surge_m_s", "sway_m_s", "heave_m_s", "yaw_rad_s"),
    *("push_surge_n", "push_sway_n", "push_heave_n", "push_yaw_nm"),
)


@dataclass(frozen=True)
class Leg:
    """A stretch of `duration_s`: the velocity wanted at its end, reached after `transient_s`.

    surge, sway and heave in m/s (body axes, heave down), yaw in rad/s. A `transient_s` of 0 jumps. `push_surge_n` to
    `push_yaw_nm`: during the leg the thrusters hold that force (N, N m; 0 lets the vehicle coast) and the controller
    leaves the axis alone. `alternate` stands for so many legs, of which every second is mirrored (a square wave).
    """

    duration_s: float
    name: str = ""
    phase: Phase = "steady"
    surge_m_s: float = 0.0
    sway_m_s: float = 0.0
    heave_m_s: float = 0.0
    yaw_rad_s: float = 0.0
    transient_s: float = 0.0
    push_surge_n: float | None = None
    push_sway_n: float | None = None
    push_heave_n: float | None = None
    push_yaw_nm: float | None = None
    alternate: int = 1

    def __post_init__(self) -> None:
        if not self.duration_s > 0 or not 0 <= self.transient_s <= self.duration_s:
            raise ValueError(f"leg '{self.name}': needs a duration above 0 and a transient no longer than it")
        pushes = (self.push_surge_n, self.push_sway_n, self.push_heave_n, self.push_yaw_nm)
        if any(push is not None and wanted for push, wanted in zip(pushes, self.velocity, strict=True)):
            raise ValueError(f"leg '{self.name}': an axis is pushed or has a velocity to keep, not both")

    @property
    def velocity(self) -> Velocity:
        return self.surge_m_s, self.sway_m_s, self.heave_m_s, self.yaw_rad_s

    @property
    def push(self) -> Push:
        """The pushes in the form of `Reference.push`."""
        return self.push_surge_n, self.push_sway_n, self.push_heave_n, None, None, self.push_yaw_nm

    def each(self) -> list["Leg"]:
        """The legs that it stands for, one after the other."""
        ahead = replace(self, alternate=1)
        wanted = {name: getattr(self, name) for name in MIRRORED}
        back = replace(ahead, **{name: -value for name, value in wanted.items() if value is not None})
        return [back if number % 2 else ahead for number in range(self.alternate)]

    def line(self) -> str:
        """The leg as a line of a mission file, without the fields at their defaults."""
        values = ((key.name, getattr(self, key.name), key.default) for key in fields(self))
        given = {name: value for name, value, default in values if value != default}
        return f"- {yaml.safe_dump(given, default_flow_style=True, sort_keys=False, width=math.inf).strip()}"


@dataclass(frozen=True)
class Mission:
    """Legs in order, starting from rest at a heading and depth. A pure function of time.

    `legs` are as a mission file lists them; an instance has each alternation of theirs, and a name for each.
    """

    name: str
    legs: tuple[Leg, ...]
    start_depth_m: float = DEPTH_M
    start_heading_rad: float = 0.0
    _starts: tuple[float, ...] = field(init=False, repr=False)
    _poses: tuple[tuple[float, float], ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        named = (
            leg if leg.name else replace(leg, name=f"leg {number}") for number, leg in enumerate(self.legs, 1)
        )
        object.__setattr__(self, "legs", tuple(each for leg in named for each in leg.each()))
        if not self.legs:
            raise ValueError("legs: a mission needs at least one")
        starts = (0.0, *accumulate(leg.duration_s for leg in self.legs))
        poses = [(self.start_heading_rad, self.start_depth_m)]
        for before, leg in pairwise((Leg(1.0), *self.legs)):
            motion = [
                _axis(a, b, leg, leg.duration_s) for a, b in zip(before.velocity, leg.velocity, strict=True)
            ]
            heading, depth = poses[-1]
            poses.append((heading + motion[3][2], depth + motion[2][2]))
        object.__setattr__(self, "_starts", starts)
        object.__setattr__(self, "_poses", tuple(poses))

    @property
    def duration_s(self) -> float:
        return self._starts[-1]

    def leg_at(self, time_s: float) -> Leg:
        return self.legs[self._index(time_s)]

    def reference(self, time_s: float) -> Reference:
        """Return the reference at a time; before and after the mission, the reference at its start or end."""
        index = self._index(time_s)
        leg, since = self.legs[index], min(max(time_s, 0.0), self.duration_s) - self._starts[index]
        before = self.legs[index - 1].velocity if index else STILL
        heading, depth = self._poses[index]
        (u, du, _), (v, dv, _), (w, dw, sunk), (r, dr, turned) = (
            _axis(a, b, leg, since) for a, b in zip(before, leg.velocity, strict=True)
        )
        nu, nu_dot = (u, v, w, 0.0, 0.0, r), (du, dv, dw, 0.0, 0.0, dr)
        return Reference(nu, nu_dot, heading + turned, depth + sunk, leg.push)

    def spans(self) -> tuple[tuple[Leg, float, float], ...]:
        """Every leg with its start and end in seconds."""
        return tuple(zip(self.legs, self._starts, self._starts[1:], strict=False))

    def _index(self, time_s: float) -> int:
        return min(max(bisect_right(self._starts, time_s) - 1, 0), len(self.legs) - 1)


def _axis(start: float, end: float, leg: Leg, since_s: float) -> tuple[float, float, float]:
    """Value, derivative and integral since the leg's start."""
    if leg.transient_s == 0 or start == end:
        return end, 0.0, end * since_s
    return DoubleS(start, end, leg.transient_s).at(since_s)


def rest(name: str, duration_s: float) -> list[Leg]:
    return [Leg(duration_s, name, "rest")]


def run(name: str, surge_m_s: float, sway_m_s: float, distance_m: float) -> list[Leg]:
    """Legs from rest to rest along a straight line, at a constant heading, with double-S transients."""
    steady_s = distance_m / math.hypot(surge_m_s, sway_m_s) - TRANSIENT_S
    if steady_s <= 0:
        raise ValueError(f"leg '{name}': {distance_m} m are too short for its speed; make it longer")
    steady = Leg(round(steady_s, 1), name, "steady", surge_m_s=surge_m_s, sway_m_s=sway_m_s)
    return [
        replace(steady, duration_s=TRANSIENT_S, phase="acceleration", transient_s=TRANSIENT_S),
        steady,
        Leg(TRANSIENT_S, name, "deceleration", transient_s=TRANSIENT_S),
    ]


def turn(name: str, angle_rad: float, rate_rad_s: float, heading: HeadingReference) -> list[Leg]:
    """Legs that turn on the spot. `smooth` reaches the rate by a double-S; `linear`, as in the paper, jumps to it."""
    rate = math.copysign(rate_rad_s, angle_rad)
    if heading == "linear":
        return [Leg(abs(angle_rad) / rate_rad_s, name, "turning", yaw_rad_s=rate)]
    steady_s = abs(angle_rad) / rate_rad_s - TRANSIENT_S
    if steady_s <= 0:
        raise ValueError(f"turn '{name}': over before {rate_rad_s} rad/s is reached; lower the rate")
    return [
        Leg(TRANSIENT_S, name, "turning", yaw_rad_s=rate, transient_s=TRANSIENT_S),
        Leg(steady_s, name, "turning", yaw_rad_s=rate),
        Leg(TRANSIENT_S, name, "turning", transient_s=TRANSIENT_S),
    ]


def dive(name: str, down_m: float, heave_m_s: float = 0.05, transient_s: float = 2.0) -> list[Leg]:
    """Legs that descend by `down_m` metres (ascend if negative), from rest to rest."""
    rate = math.copysign(heave_m_s, down_m)
    steady_s = abs(down_m) / heave_m_s - transient_s
    return [
        Leg(transient_s, name, "diving", heave_m_s=rate, transient_s=transient_s),
        Leg(steady_s, name, "diving", heave_m_s=rate),
        Leg(transient_s, name, "diving", transient_s=transient_s),
    ]


def survey(heading: HeadingReference = "smooth") -> Mission:
    """The paper's survey: four waypoints, four laps, a stop and a quarter turn at each waypoint (1055 s)."""
    legs = rest("afloat", 8.0) + dive("descent", DEPTH_M - AFLOAT_M) + rest("settle", 6.0)
    for speed in (0.5, 0.4, 0.3, 0.2):
        for side, length_m in enumerate((14.0, 8.0, 14.0, 8.0)):
            legs += run(f"lap {speed} m/s, side {side + 1}", speed, 0.0, length_m)
            legs += turn(f"lap {speed} m/s, turn {side + 1}", math.pi / 2, math.radians(6), heading)
            legs += rest(f"lap {speed} m/s, waypoint {side + 1}", 3.0)
    legs += dive("ascent", AFLOAT_M - DEPTH_M) + rest("afloat again", 8.0)
    return Mission("survey", tuple(legs), start_depth_m=AFLOAT_M)


def hovering(heading: HeadingReference = "smooth") -> Mission:
    """The paper's hovering: a lawnmower at constant heading, then turns on the spot in both directions (804 s)."""
    legs = rest("afloat", 8.0) + dive("descent", DEPTH_M - AFLOAT_M) + rest("settle", 6.0)
    for speed in (0.4, 0.3, 0.2):
        for row, ahead in enumerate((1.0, -1.0, 1.0, -1.0)):
            legs += run(f"rows at {speed} m/s, row {row + 1}", ahead * speed, 0.0, 7.0)
            legs += rest(f"rows at {speed} m/s, end {row + 1}", 2.5)
            legs += run(f"rows at {speed} m/s, step {row + 1}", 0.0, math.copysign(speed, 1.5 - row), 4.5)
            legs += rest(f"rows at {speed} m/s, start {row + 1}", 2.5)
    for number, degrees in enumerate((90.0, -90.0, 180.0, -180.0)):
        legs += turn(f"turn {number + 1}", math.radians(degrees), math.radians(10), heading)
        legs += rest(f"after turn {number + 1}", 3.0)
    legs += dive("ascent", AFLOAT_M - DEPTH_M) + rest("afloat again", 8.0)
    return Mission("hovering", tuple(legs), start_depth_m=AFLOAT_M)


def validation(heading: HeadingReference = "smooth", *, sways: bool) -> Mission:
    """Out and back in surge, in sway if the vehicle can sway, and a quarter turn in both directions."""
    legs = rest("start", 4.0)
    legs += run("surge out", 0.4, 0.0, 4.8) + rest("surge turn", 3.0) + run("surge back", -0.4, 0.0, 4.8)
    if sways:
        legs += rest("sway start", 3.0) + run("sway out", 0.0, 0.3, 3.0)
        legs += rest("sway turn", 3.0) + run("sway back", 0.0, -0.3, 3.0)
    for name, angle in (("turn right", math.pi / 2), ("turn left", -math.pi / 2)):
        legs += rest(f"before {name}", 3.0) + turn(name, angle, math.radians(12), heading)
    return Mission("validation", tuple(legs + rest("end", 4.0)))


def can_sway(configuration: Configuration) -> bool:
    """Whether the thrust in sway is more than three tenths of the thrust in surge."""
    ahead, aside = abs(allocation_matrix(configuration)).sum(axis=1)[:2]
    return bool(aside > 0.3 * ahead)


def mission_named(name: str, configuration: Configuration, heading: HeadingReference = "smooth") -> Mission:
    """Return one of the three missions, or the mission in the YAML file of that name. Raises ConfigError for any
    other name."""
    if name == "survey":
        return survey(heading)
    if name == "hovering":
        if not can_sway(configuration):
            raise ConfigError("mission 'hovering' moves sideways and this configuration can't; dive 'survey'")
        return hovering(heading)
    if name == "validation":
        return validation(heading, sways=can_sway(configuration))
    if not Path(name).exists():
        if Path(name).suffix or Path(name).name != name:
            raise ConfigError(f"mission file '{name}' is not found; check its name and its folder")
        raise ConfigError(f"no mission '{name}'; there are survey, hovering, validation, or give a YAML file")
    return load_mission(Path(name))


def load_mission(path: Path) -> Mission:
    """Load a mission from the user's file. Raises ConfigError with the file and the key."""
    return schema.build(Mission, schema.load_yaml(path), str(path))
