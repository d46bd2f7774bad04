"""Legs of a mission, and the reference that they make.

A mission is a list of legs; each brings the reference velocity from the previous leg's value to its own by a
double-S, and holds it. Heading and depth are the exact integrals. A leg may push instead: a force held open loop.
"""

import math
from bisect import bisect_right
from dataclasses import dataclass, field, fields, replace
from itertools import accumulate, pairwise
from typing import Literal

import yaml

from bridge.vehicle.references import DoubleS, Push, Reference

Phase = Literal["rest", "acceleration", "steady", "deceleration", "turning", "diving"]
Velocity = tuple[float, float, float, float]

DEPTH_M = 0.6
STILL: Velocity = (0.0, 0.0, 0.0, 0.0)
MIRRORED = (
    "surge_m_s", "sway_m_s", "heave_m_s", "yaw_rad_s",
    "push_surge_n", "push_sway_n", "push_heave_n", "push_yaw_nm",
)  # fmt: skip


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
        if self.alternate < 1:
            raise ValueError(f"leg '{self.name}': alternate stands for 1 leg or more, not {self.alternate}")
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

    def expanded(self) -> list["Leg"]:
        """The legs that it stands for, one after the other."""
        ahead = replace(self, alternate=1)
        wanted = {name: getattr(self, name) for name in MIRRORED}
        back = replace(ahead, **{name: -value for name, value in wanted.items() if value is not None})
        return [back if number % 2 else ahead for number in range(self.alternate)]

    def yaml_line(self) -> str:
        """The leg as a line of a mission file, without the fields at their defaults."""
        values = ((key.name, getattr(self, key.name), key.default) for key in fields(self))
        given = {name: value for name, value, default in values if value != default}
        return f"- {yaml.safe_dump(given, default_flow_style=True, sort_keys=False, width=math.inf).strip()}"


@dataclass(frozen=True)
class Mission:
    """Legs in order, starting from rest at a heading and depth. A pure function of time.

    `legs`: on construction, alternating legs are expanded and unnamed ones numbered. `vehicle`: NAME:CONFIGURATION that
    a plan was made for, "" for any.
    """

    name: str
    legs: tuple[Leg, ...]
    start_depth_m: float = DEPTH_M
    start_heading_rad: float = 0.0
    vehicle: str = ""
    _starts: tuple[float, ...] = field(init=False)
    _poses: tuple[tuple[float, float], ...] = field(init=False)

    def __post_init__(self) -> None:
        named = (
            leg if leg.name else replace(leg, name=f"leg {number}") for number, leg in enumerate(self.legs, 1)
        )
        object.__setattr__(self, "legs", tuple(each for leg in named for each in leg.expanded()))
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

    def reference(self, time_s: float) -> Reference:
        """Return the reference at a time; before and after the mission, the reference at its start or end."""
        index = min(max(bisect_right(self._starts, time_s) - 1, 0), len(self.legs) - 1)
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


def _axis(start: float, end: float, leg: Leg, since_s: float) -> tuple[float, float, float]:
    """Value, derivative and integral since the leg's start."""
    if leg.transient_s == 0 or start == end:
        return end, 0.0, end * since_s
    return DoubleS(start, end, leg.transient_s).at(since_s)
