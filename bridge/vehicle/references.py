"""What the vehicle is asked to do: double-S (jerk-limited) speed profiles, and the reference of one instant.

Biagiotti & Melchiorri (2008), section 3.4: the acceleration is a trapezoid, so that jerk stays finite.
"""

from dataclasses import dataclass

Six = tuple[float, float, float, float, float, float]
ZERO6: Six = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
Push = tuple[float | None, float | None, float | None, float | None, float | None, float | None]
NO_PUSH: Push = (None, None, None, None, None, None)


@dataclass(frozen=True, slots=True)
class Reference:
    """Wanted body velocity and its derivative (SI, FRD), heading (rad, unwrapped) and depth (m).

    `push` is a wrench in N and N m to give in place of the controller's, as a pilot's stick does; None for an axis
    that the controller keeps.
    """

    nu: Six
    nu_dot: Six
    heading_rad: float
    depth_m: float
    push: Push = NO_PUSH


@dataclass(frozen=True, slots=True)
class DoubleS:
    """A value that goes from `start` to `end` in `duration_s`, at rest in its derivative at both ends.

    `ramp` is the share of the duration in which the derivative rises, and again in which it falls
    (0 < ramp <= 0.5). Before and after, the value holds.
    """

    start: float
    end: float
    duration_s: float
    ramp: float = 0.25

    def __post_init__(self) -> None:
        if self.duration_s <= 0 or not 0 < self.ramp <= 0.5:
            raise ValueError(f"a double-S takes a duration > 0 and a ramp in (0, 0.5], not {self}")

    @property
    def peak_rate(self) -> float:
        """The largest derivative, with its sign."""
        return (self.end - self.start) / (self.duration_s * (1 - self.ramp))

    @property
    def peak_jerk(self) -> float:
        """The largest second derivative, as a magnitude."""
        return abs(self.peak_rate) / (self.ramp * self.duration_s)

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
