"""References for the controller: double-S (jerk-limited) speed profiles, and the setpoint of one instant.

Biagiotti & Melchiorri (2008), section 3.4: the acceleration is a trapezoid, so that jerk stays finite.
"""

import math
from collections import deque
from dataclasses import dataclass
from itertools import pairwise

Six = tuple[float, float, float, float, float, float]
ZERO6: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
Push = tuple[float | None, float | None, float | None, float | None, float | None, float | None]
NO_PUSH: Push = (None, None, None, None, None, None)


@dataclass(frozen=True, slots=True)
class Reference:
    """Wanted body velocity and its derivative (SI, FRD), heading (rad, unwrapped) and depth (m).

    `push` is a wrench in N and N m that replaces the controller's, as a pilot's stick does; None for an axis that the
    controller keeps. `time_s` is the boot time at which the reference was made. A process that passes on a reference
    of another process stamps it, so that an old one is recognized. NaN for a reference made for the current tick.
    """

    nu: Six
    nu_dot: Six
    heading_rad: float
    depth_m: float
    push: Push = NO_PUSH
    time_s: float = math.nan


class Trail:
    """Recent references: each reading is compared with the reference of the time at which the reading was valid."""

    def __init__(self, span_s: float) -> None:
        self._span_s = span_s
        self._kept: deque[tuple[float, Reference]] = deque()

    def add(self, time_s: float, reference: Reference) -> None:
        """Store a reference and drop those older than the span; a time that does not rise clears the trail first."""
        if self._kept and not time_s > self._kept[-1][0]:
            self._kept.clear()
        self._kept.append((time_s, reference))
        while self._kept[0][0] < time_s - self._span_s:
            self._kept.popleft()

    def at(self, time_s: float) -> Reference:
        """Return the reference at a time: linear between ticks, held before the oldest and after the latest.

        For a NaN time, the latest. Raises IndexError if the trail is empty.
        """
        latest_s, latest = self._kept[-1]
        if not time_s < latest_s:
            return latest
        for (after_s, after), (before_s, before) in pairwise(reversed(self._kept)):
            if time_s >= before_s:
                return _between(before, after, (time_s - before_s) / (after_s - before_s))
        return self._kept[0][1]


def _between(before: Reference, after: Reference, share: float) -> Reference:
    def mix(a: Six, b: Six) -> Six:
        x, y, z, k, m, n = (p + share * (q - p) for p, q in zip(a, b, strict=True))
        return x, y, z, k, m, n

    return Reference(
        mix(before.nu, after.nu),
        mix(before.nu_dot, after.nu_dot),
        before.heading_rad + share * shorter_turn(before.heading_rad, after.heading_rad),
        before.depth_m + share * (after.depth_m - before.depth_m),
        after.push,
    )


def shorter_turn(from_rad: float, to_rad: float) -> float:
    """The turn without full revolutions: a heading that was unwrapped afresh in between has not turned."""
    turn = to_rad - from_rad
    return math.remainder(turn, math.tau) if math.isfinite(turn) else math.nan


@dataclass(frozen=True, slots=True)
class DoubleS:
    """A value that moves from `start` to `end` in `duration_s`, with zero derivative at both ends.

    `ramp` is the share of the duration in which the derivative rises, and again in which it falls (0 < ramp <= 0.5).
    Before and after, the value holds.
    """

    start: float
    end: float
    duration_s: float
    ramp: float = 0.25

    def __post_init__(self) -> None:
        if self.duration_s <= 0 or not 0 < self.ramp <= 0.5:
            raise ValueError(f"a double-S takes a duration > 0 and a ramp in (0, 0.5], not {self}")

    def at(self, time_s: float) -> tuple[float, float, float]:
        """Value, derivative and integral since time 0, at `time_s` >= 0 after the start."""
        if time_s >= self.duration_s:
            half = 0.5 * (self.start + self.end) * self.duration_s
            return self.end, 0.0, half + self.end * (time_s - self.duration_s)
        x, r = time_s / self.duration_s, self.ramp
        p = 1 / (1 - r)
        if x < r:
            value, slope, integral = p * x * x / (2 * r), p * x / r, p * x**3 / (6 * r)
        elif x <= 1 - r:
            value, slope, integral = p * (x - r / 2), p, p * (x * x / 2 - r * x / 2 + r * r / 6)
        else:
            y = 1 - x
            value, slope, integral = 1 - p * y * y / (2 * r), p * y / r, x - 0.5 + p * y**3 / (6 * r)
        step = self.end - self.start
        return (
            self.start + step * value,
            step * slope / self.duration_s,
            self.start * time_s + step * integral * self.duration_s,
        )
