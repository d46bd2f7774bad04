"""The gain-scheduled PID: a gain table for each configuration, with gains interpolated over the reference's speed."""

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from bridge import schema
from bridge.attitude import roll_pitch
from bridge.errors import ConfigError
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import CONFIGS, Configuration
from bridge.vehicle.navigation import Navigation
from bridge.vehicle.references import Reference, Six, shorter_turn

GAINS = CONFIGS / "gains.yaml"


@dataclass(frozen=True)
class Gains:
    """Proportional, integral and derivative gain at each speed of the table, per unit of mass or inertia."""

    kp: tuple[float, ...]
    ki: tuple[float, ...]
    kd: tuple[float, ...]


@dataclass(frozen=True)
class FeedForwardSettings:
    """Settings while the feed-forward is applied: the thrust below which its thrusters stay in the dead zone, and the
    factor on the PID gains of surge and sway."""

    gain: float = 1.0
    straight_below_n: float = 0.0

    def __post_init__(self) -> None:
        if not self.gain > 0 or self.straight_below_n < 0:
            raise ValueError("the gain must be above 0, straight_below_n not negative")


@dataclass(frozen=True)
class GainTable:
    """A table of configs/gains.yaml.

    - speeds_m_s: horizontal speeds of the reference, rising, to which the values of each gain belong.
    - surge to yaw: gains by degree of freedom; surge and sway act on velocity (1/s, 1/s2), heave on depth, roll, pitch
      and yaw on angles (1/s2, 1/s3, 1/s).
    - straight_below_n: thrust, N, below which the pulses run straight to neutral, and so into the thruster's dead zone.
    - integral_share: share of the vehicle's reach beyond which no integral grows.
    - fed: what differs while the feed-forward is applied.
    """

    speeds_m_s: tuple[float, ...]
    surge: Gains
    sway: Gains
    heave: Gains
    roll: Gains
    pitch: Gains
    yaw: Gains
    straight_below_n: float = 0.0
    integral_share: float = 0.5
    fed: FeedForwardSettings = field(default_factory=FeedForwardSettings)

    def __post_init__(self) -> None:
        if not self.speeds_m_s or list(self.speeds_m_s) != sorted(set(self.speeds_m_s)):
            raise ValueError(f"speeds_m_s must rise, it is {list(self.speeds_m_s)}")
        for dof in DOFS:
            gains: Gains = getattr(self, dof)
            for row in (gains.kp, gains.ki, gains.kd):
                if len(row) != len(self.speeds_m_s) or min(row) < 0:
                    raise ValueError(f"{dof}: every gain needs {len(self.speeds_m_s)} values, none negative")


def load_gains(name: str, path: Path = GAINS) -> GainTable:
    """Load the gain table of that name. Raises ConfigError with the known names."""
    data = schema.load_yaml(path)
    if not isinstance(data, dict) or name not in data:
        known = ", ".join(data) if isinstance(data, dict) else "none"
        raise ConfigError(
            f"{path}: no gain table '{name}'; there are {known}; correct the vehicle file's 'gains'"
        )
    return schema.build(GainTable, data[name], f"{path}: {name}")


class Controller:
    """PID on six degrees of freedom: velocity in surge and sway, position in depth, roll, pitch and heading.

    `reach` (6,) is the vehicle's largest wrench in N and N m; the output stays within it.
    """

    def __init__(self, table: GainTable, configuration: Configuration, reach: Sequence[float]) -> None:
        self._table = table
        self._gains: tuple[Gains, ...] = tuple(getattr(table, dof) for dof in DOFS)
        self._scale = (configuration.dry_mass_kg,) * 3 + configuration.inertia_kgm2
        self._reach = tuple(float(limit) for limit in reach)
        self._integral = [0.0] * 6

    def reset(self, dofs: Sequence[int]) -> None:
        """Reset the integrals of these degrees of freedom."""
        for dof in dofs:
            self._integral[dof] = 0.0

    def step(
        self,
        navigation: Navigation,
        reference: Reference,
        dt_s: float,
        saturated: bool,
        velocity_gain: float = 1.0,
    ) -> Six:
        """Return the wrench of this tick, N and N m; an axis whose measurement is NaN gets zero and keeps its
        integral.

        `velocity_gain` multiplies the gains of surge and sway.

        Depth is held without a measured velocity too, with less damping: a DVL that lost the bottom must not let the
        vehicle rise.

        If the thrusters were `saturated` in the previous tick, integrals may shrink but not grow.
        """
        place = self._place(math.hypot(reference.nu[0], reference.nu[1]))
        errors = _errors(navigation, reference)
        times = (velocity_gain, velocity_gain, 1.0, 1.0, 1.0, 1.0)
        x, y, z, k, m, n = (self._axis(i, *errors[i], place, times[i], dt_s, saturated) for i in range(6))
        return x, y, z, k, m, n

    def _place(self, speed_m_s: float) -> tuple[int, int, float]:
        """Indices of two neighbours in the table and the weight of the second; a speed that is not finite counts as
        zero."""
        speeds = self._table.speeds_m_s
        if not math.isfinite(speed_m_s):
            speed_m_s = 0.0
        right = min(bisect_right(speeds, speed_m_s), len(speeds) - 1)
        left = max(right - 1, 0)
        if right == left:
            return left, right, 0.0
        return left, right, min(max((speed_m_s - speeds[left]) / (speeds[right] - speeds[left]), 0.0), 1.0)

    def _axis(
        self,
        dof: int,
        error: float,
        slope: float,
        place: tuple[int, int, float],
        times: float,
        dt_s: float,
        saturated: bool,
    ) -> float:
        if not (math.isfinite(error) and math.isfinite(slope)):
            return 0.0
        gains, scale, reach = self._gains[dof], times * self._scale[dof], self._reach[dof]
        left, right, share = place
        kp = scale * ((1 - share) * gains.kp[left] + share * gains.kp[right])
        ki = scale * ((1 - share) * gains.ki[left] + share * gains.ki[right])
        kd = scale * ((1 - share) * gains.kd[left] + share * gains.kd[right])
        before = self._integral[dof]
        bound = self._table.integral_share * reach
        after = min(max(before + ki * error * dt_s, -bound), bound)
        total = kp * error + after + kd * slope
        if abs(after) > abs(before) and (saturated or abs(total) > reach):
            after = before
        self._integral[dof] = after
        return min(max(kp * error + after + kd * slope, -reach), reach)


def _errors(navigation: Navigation, reference: Reference) -> tuple[tuple[float, float], ...]:
    """Error and its derivative for each degree of freedom.

    Velocity loops have no derivative, because a DVL's velocity differentiates to noise. The setpoint of roll and
    pitch is zero.
    """
    u, v, w = navigation.velocity
    p, q, r = navigation.rate
    roll, pitch = roll_pitch(navigation.attitude)
    nu = reference.nu
    return (
        (nu[0] - u, 0.0),
        (nu[1] - v, 0.0),
        (reference.depth_m - navigation.depth_m, nu[2] - w if math.isfinite(w) else 0.0),
        (-roll, -p),
        (-pitch, -q),
        # A heading unwrapped differently elsewhere must not spin the vehicle.
        (shorter_turn(navigation.heading_rad, reference.heading_rad), nu[5] - r),
    )
