"""What accepted effects do to the thrust: losses of each thruster, a falling supply; effects of the hull by name.

Asked for a (N), a thruster gives T = s g a'. Here a' is a less the loss in its dead zone, g is its gain (times the
gain astern), and s = (1 - R I / V)^2 comes from the sagging supply, with I proportional to |a|^1.5.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import (
    ASTERN,
    LEAST,
    LEAST_GAIN,
    MOST_GAIN,
    RESISTANCE,
    START,
    VOLTAGE,
    VOLTAGE_SHARE,
    effect_coefficients,
    gain_name,
)
from bridge.vehicle.config import Configuration

NOMINAL_V = 16.0
AHEAD_A_N15, ASTERN_A_N15 = 0.062, 0.095
"""Current over |thrust|^1.5 of a T200 at `NOMINAL_V`, from Blue Robotics' bollard pull of 2019: within 5 % from 18 N
to 51 N ahead, and 28 N to 40 N astern."""
LEAST_LEFT = 0.5
"""Least share of thrust assumed to remain under a sagging supply: a resistance that leaves less is not plausible."""
ITERATIONS = 12


@dataclass(frozen=True)
class Losses:
    """The thrusters' losses against their curves.

    gain (n,): thrust of each thruster relative to its curve; astern: a common factor for all that push astern.
    start_n: thrust asked before any thrust begins. least_n: a smaller demand gives nothing, a larger one all of it.
    resistance_ohm: of supply and cables.
    """

    gain: Array
    astern: float = 1.0
    start_n: float = 0.0
    least_n: float = 0.0
    resistance_ohm: float = 0.0

    def given(self, asked_n: Array, supply: float = 1.0) -> Array:
        """Thrusts (n,) in N that result from the thrusts asked for; `supply` is the factor of `Supply`."""
        return np.asarray(self.turned(asked_n) * self._gains(asked_n, supply))

    def turned(self, asked_n: Array) -> Array:
        """Thrusts (n,) that the shaft speeds indicate: a weak propeller turns as fast as a good one."""
        size = np.abs(asked_n)
        passed = np.where(size < self.least_n, 0.0, np.maximum(size - self.start_n, 0.0))
        return np.asarray(np.sign(asked_n) * passed * self._left(asked_n))

    def made_up(
        self, thrust_n: Array, supply: float, gentle_n: Array, limits_n: tuple[float, float]
    ) -> tuple[Array, float]:
        """Return the thrusts (n,) to ask for, within the limits, so that `thrust_n` (n,) results, and the share of it
        that is achieved: if any thruster would exceed its limit, all are scaled down together.

        Below `gentle_n` (n,) the dead zone's width is added in proportion to the wanted thrust: jumping over it near
        zero, noise would throw the propellers to and fro. An unavailable thrust is rounded to zero or to the least
        available thrust, whichever is nearer.
        """
        # Several losses together must not raise the command more than the worst single loss.
        gains = np.maximum(self._gains(thrust_n, supply), LEAST_GAIN)
        limit_n = np.where(thrust_n < 0, -limits_n[0], limits_n[1])
        size, left, share = np.abs(thrust_n), 1.0, 1.0
        for _ in range(ITERATIONS if self.resistance_ohm else 1):
            able = np.maximum(limit_n - self.start_n, 0.0) * gains * left
            over = size > able
            share = float((able[over] / size[over]).min()) if over.any() else 1.0
            asked = np.sign(thrust_n) * self._through_dead_zone(share * size / (gains * left), gentle_n)
            left = self._left(asked)
        return np.clip(asked, *limits_n), share

    def _gains(self, sign: Array, supply: float) -> Array:
        return np.asarray(self.gain * np.where(sign < 0, self.astern, 1.0) * supply)

    def _left(self, asked_n: Array) -> float:
        if not self.resistance_ohm:
            return 1.0
        current = float((np.where(asked_n > 0, AHEAD_A_N15, ASTERN_A_N15) * np.abs(asked_n) ** 1.5).sum())
        return max((1.0 - min(self.resistance_ohm * current / NOMINAL_V, 1.0)) ** 2, LEAST_LEFT)

    def _through_dead_zone(self, size_n: Array, gentle_n: Array) -> Array:
        """Return the magnitudes to ask for, given the magnitudes wanted beyond the dead zone."""
        share = np.where(size_n < gentle_n, size_n / np.where(gentle_n > 0, gentle_n, 1.0), 1.0)
        asked = np.where(size_n > 0, size_n + self.start_n * share, 0.0)
        between = (asked < self.least_n) & (asked >= 0.5 * self.least_n)
        return np.where(between, self.least_n, asked)


SLOW_S = 20.0
"""Time constant for averaging the measured voltage: faster changes come from the load."""
LOWEST_SHARE, HIGHEST_SHARE = 0.5, 1.5
"""Shares of the reference voltage: a reading outside of them comes from a broken sensor."""


@dataclass(frozen=True)
class VoltageLaw:
    """T = T_nominal (1 - share (1 - (V / reference_v)^2))."""

    reference_v: float
    share: float

    def factor(self, voltage_v: float) -> float:
        """Thrust relative to that at the reference voltage, limited to the range of a thruster's gain."""
        fallen = 1.0 - self.share * (1.0 - (voltage_v / self.reference_v) ** 2)
        return min(max(fallen, LEAST_GAIN), MOST_GAIN)


class Supply:
    """Share of thrust left as the battery empties, from its measured voltage averaged over `SLOW_S`.

    A missing or impossible reading counts as the reference voltage, averaged in slowly, so that a sensor that comes
    and goes does not make the thrust jump.
    """

    def __init__(self) -> None:
        self._slow_v = math.nan

    def step(self, law: VoltageLaw, voltage_v: float, dt_s: float) -> float:
        """Return the factor of this tick; `voltage_v` is NaN if unknown."""
        share = voltage_v / law.reference_v
        now_v = voltage_v if LOWEST_SHARE <= share <= HIGHEST_SHARE else law.reference_v
        if math.isnan(self._slow_v):
            self._slow_v = now_v
        elif dt_s > 0:
            self._slow_v += (1.0 - math.exp(-dt_s / SLOW_S)) * (now_v - self._slow_v)
        return law.factor(self._slow_v)


@dataclass(frozen=True)
class Known:
    """Accepted effects by place of action: hull effects by name; losses None if the thrusters follow their curve;
    voltage None if thrust does not depend on it. faults: why a coefficient was left out."""

    hull: Mapping[str, float]
    losses: Losses | None
    voltage: VoltageLaw | None
    faults: tuple[str, ...]


def known_effects(coefficients: Mapping[str, float], configuration: Configuration) -> Known:
    """Return the effects among the active coefficients; a value that is not finite or out of bounds is left out and
    listed in `faults`."""
    fit, faults = {}, []
    for coefficient in effect_coefficients(configuration):
        value = coefficients.get(coefficient.name, 0.0)
        if value == 0.0:
            continue
        fault = coefficient.fault(value)
        if fault:
            faults.append(fault)
        else:
            fit[coefficient.name] = value
    gains = [gain_name(number) for number in range(1, len(configuration.thrusters) + 1)]
    losses = Losses(
        np.array([fit.get(name, 1.0) for name in gains]),
        fit.get(ASTERN, 1.0),
        fit.get(START, 0.0),
        fit.get(LEAST, 0.0),
        fit.get(RESISTANCE, 0.0),
    )
    voltage = VoltageLaw(fit[VOLTAGE], fit[VOLTAGE_SHARE]) if {VOLTAGE, VOLTAGE_SHARE} <= set(fit) else None
    of_losses = {ASTERN, START, LEAST, RESISTANCE, *gains}
    hull = {name: value for name, value in fit.items() if name not in of_losses | {VOLTAGE, VOLTAGE_SHARE}}
    is_lossy = voltage is not None or not of_losses.isdisjoint(fit)
    return Known(hull, losses if is_lossy else None, voltage, tuple(faults))
