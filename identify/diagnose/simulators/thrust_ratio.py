"""A vehicle's thrust over its simulator's, and how much later it comes, by one model fitted to a recording of each.

Thrust that is k times the vehicle file's gives every mass and drag of a degree of freedom 1/k times as large. So a mass
and a drag each tell k, and the hull is the same in both. Where the two disagree beyond their errors, so that more than
thrust differs, the interval grows by as much. Roll and pitch tell no k: by as much as their righting moment moves them,
and no thrust does, their inertia and drag stay as they are.

The ratio of the whole vehicle is a robust mean (Huber 1964): a single degree of freedom that is far off, by a thruster
that fails, moves it little.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import DAMPINGS, DOFS, MASSES, QUADRATICS
from identify.diagnose.result import Diagnosis, Value
from identify.statistics import Z95, birge_mean, bulk_std

SCALED = (0, 1, 2, 5)
"""Surge, sway, heave and yaw: degrees of freedom whose masses and drags are known by thrust alone."""

SIGNIFICANT = 3.0
"""Standard errors of a significant difference, among some dozen that are compared."""

LEAST_SHARE = 0.01
"""Smaller relative differences are good enough, however precise."""

LEAST_LATER_S = 0.005
"""A shorter delay is good enough: commands last longer."""

HUBER = 1.345
"""Standard errors beyond which a value pulls no harder (Huber 1981, section 4.5)."""

TURNS = 30


@dataclass(frozen=True)
class ThrustRatio:
    """How much more a vehicle's thrusters push than a simulator's, and how much later.

    whole: the vehicle's thrust over the simulator's, None if no degree of freedom tells; by_axis: by name of the
    degree of freedom. later: delay of the vehicle's thrust beyond the simulator's, s, None if either recording doesn't
    tell. scatter: relative standard deviation of the ratios that single masses and drags give, about the whole.
    """

    whole: Value | None = None
    by_axis: Mapping[str, Value] = field(default_factory=dict)
    later: Value | None = None
    scatter: float = 0.0

    @property
    def differs(self) -> bool:
        """Whether the vehicle as a whole, or a degree of freedom, has other thrust."""
        every = (self.whole, *self.by_axis.values())
        return any(value is not None and _is_other(value) for value in every)

    @property
    def is_later(self) -> bool:
        """Whether the delay differs, either way."""
        return self.later is not None and (
            abs(self.later.value) > max(SIGNIFICANT * _std(self.later), LEAST_LATER_S)
        )

    def at(self, dof: int) -> Value:
        """The ratio that other thrust gives the masses and drags of a degree of freedom: the whole's, with the scatter
        of single numbers in its interval, or its own where it is off that. 1 where thrust is alike or unknown; in roll
        and pitch from 1 to the whole's."""
        if not self.differs or self.whole is None:
            return Value(1.0, "1", 1.0, 1.0)
        log, std = math.log(self.whole.value), math.hypot(_log_std(self.whole), self.scatter)
        if dof not in SCALED:
            thrust = _ratio(log, std)
            return Value(math.exp(0.5 * log), "1", min(1.0, thrust.low95), max(1.0, thrust.high95))
        alone = self.by_axis.get(DOFS[dof], self.whole)
        if abs(math.log(alone.value) - log) > SIGNIFICANT * math.hypot(_log_std(alone), std):
            return alone
        return _ratio(log, std)


def thrust_ratio(simulator: Diagnosis, vehicle: Diagnosis) -> ThrustRatio:
    """Compare the thrust of two recordings of one hull."""
    by_axis, each, logs, stds = {}, [], [], []
    for dof in SCALED:
        names = [
            group[dof].name
            for group in (MASSES, DAMPINGS, QUADRATICS)
            if all(_tells(diagnosis, group[dof].name) for diagnosis in (simulator, vehicle))
        ]
        if not names:
            continue
        ratios = [simulator.numbers[name].value / vehicle.numbers[name].value for name in names]
        covariance = _covariance(simulator, names) + _covariance(vehicle, names)
        log, std = birge_mean(np.log(ratios), covariance)
        each += ratios
        by_axis[DOFS[dof]] = _ratio(log, std)
        logs.append(log)
        stds.append(std)
    later = _later(simulator.late, vehicle.late)
    if not logs:
        return ThrustRatio(later=later)
    whole = _ratio(*_robust_mean(np.array(logs), np.array(stds)))
    return ThrustRatio(whole, by_axis, later, bulk_std(np.log(np.array(each) / whole.value)))


def _tells(diagnosis: Diagnosis, name: str) -> bool:
    value = diagnosis.numbers.get(name)
    return value is not None and 0.0 < value.low95 < value.high95


def _covariance(diagnosis: Diagnosis, names: list[str]) -> Array:
    """Covariance of the logarithms of coefficients."""
    values = [diagnosis.numbers[name] for name in names]
    std = np.array([_log_std(value) for value in values])
    correlation = [
        [1.0 if a == b else diagnosis.correlation.get(frozenset((a, b)), 0.0) for b in names] for a in names
    ]
    return np.asarray(np.array(correlation) * np.outer(std, std))


def _robust_mean(value: Array, std: Array) -> tuple[float, float]:
    """Mean of values (n,) by Huber's weights, and its standard error, grown where the values disagree."""
    mean = float(np.median(value))
    loose = std
    for _ in range(TURNS):
        off = np.abs(value - mean) / std
        loose = std * np.sqrt(np.maximum(off / HUBER, 1.0))
        before, mean = mean, float(np.average(value, weights=loose**-2.0))
        if abs(mean - before) < 1e-6:
            break
    return birge_mean(value, np.diag(loose**2))


def _later(simulator: Value | None, vehicle: Value | None) -> Value | None:
    if simulator is None or vehicle is None:
        return None
    later, reach = vehicle.value - simulator.value, Z95 * math.hypot(_std(simulator), _std(vehicle))
    return Value(later, "s", later - reach, later + reach)


def _ratio(log: float, std: float) -> Value:
    return Value(math.exp(log), "1", math.exp(log - Z95 * std), math.exp(log + Z95 * std))


def _std(value: Value) -> float:
    return (value.high95 - value.low95) / (2.0 * Z95)


def _is_other(ratio: Value) -> bool:
    return abs(math.log(ratio.value)) > max(SIGNIFICANT * _log_std(ratio), LEAST_SHARE)


def _log_std(ratio: Value) -> float:
    return math.log(ratio.high95 / ratio.low95) / (2.0 * Z95)
