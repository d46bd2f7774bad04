"""Which motor is reversed, or which two are swapped, by the recorded motion against the thrust.

Each wiring that differs from the given one by one reversed motor or one swapped pair is tried: the velocities and the
rate of turn should follow the thrust that it gives, behind the vehicle's lag. It is named where they follow it clearly
better than the given wiring, and better than any other.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.config import VehicleFile
from bridge.vehicle.thrusters import allocation_matrix
from identify.diagnose.mounting import LAGS_S, PUSHED, behind
from identify.dive import Dive
from identify.estimators.axes import Axis
from identify.estimators.innovations import POSITION
from identify.forces import asked_thrusts

Array = NDArray[np.float64]
Order = NDArray[np.int64]

FOLLOWS = 0.5
"""Least mean correlation of the motion with the thrust of a wiring that is named."""
CLEARLY = 0.15
"""Margin in mean correlation over the given wiring."""
FEWEST = 50


@dataclass(frozen=True)
class Miswired:
    """A wiring that the motion follows better than the vehicle file's: a thruster reversed, or two swapped.

    motors: their numbers in the vehicle file, from 1. follows: mean correlation of the motion with the thrust of this
    wiring; followed: with that of the vehicle file's.
    """

    motors: tuple[int, ...]
    follows: float
    followed: float


@dataclass(frozen=True)
class _Driven:
    """Of a degree of freedom: covariances of its speed with the lagged thrusts (k, lags), and among these."""

    dof: int
    with_speed: Array
    among: Array
    speed_std: float

    def follows(self, effect: Array, order: Order) -> float:
        """Correlation of the speed with the thrusts' effect (k,), output `order` (k,) driving each, at its best lag."""
        best = 0.0
        for with_speed, among in zip(self.with_speed.T, self.among, strict=True):
            variance = float(effect @ among[np.ix_(order, order)] @ effect)
            if variance > 0:
                correlation = float(effect @ with_speed[order]) / (self.speed_std * np.sqrt(variance))
                best = max(best, correlation, key=abs)
        return best


def miswired(
    dive: Dive, file: VehicleFile, configuration_name: str, axes: tuple[Axis, ...]
) -> Miswired | None:
    """The one motor reversed, or the pair swapped, that the motion of a dive shows; None for none."""
    thrust = asked_thrusts(dive, file, configuration_name)
    driven = [
        each for axis in axes if axis.dof in PUSHED and (each := _driven(axis, thrust.time_s, thrust.value))
    ]
    if not driven:
        return None
    matrix = allocation_matrix(file.vehicle.configurations[configuration_name])
    count = matrix.shape[1]

    def mean(signs: Array, order: Order) -> float:
        return float(np.mean([each.follows(matrix[each.dof] * signs, order) for each in driven]))

    as_given = mean(np.ones(count), np.arange(count, dtype=np.int64))
    tried = sorted(
        (Miswired(motors, mean(signs, order), as_given) for motors, signs, order in _wirings(count)),
        key=lambda each: each.follows,
    )
    *_, second, best = tried
    is_clear = best.follows > max(FOLLOWS, as_given + CLEARLY) and best.follows > second.follows + 1e-3
    return best if is_clear else None


def _wirings(count: int) -> Iterator[tuple[tuple[int, ...], Array, Order]]:
    for motor in range(count):
        signs = np.ones(count)
        signs[motor] = -1.0
        yield (motor + 1,), signs, np.arange(count, dtype=np.int64)
    for first, second in combinations(range(count), 2):
        order = np.arange(count, dtype=np.int64)
        order[[first, second]] = second, first
        yield (first + 1, second + 1), np.ones(count), order


def _driven(axis: Axis, time_s: Array, thrust: Array) -> _Driven | None:
    moving = np.isfinite(axis.reading) & (axis.state_read != POSITION)
    moving &= (axis.time_s >= time_s[0]) & (axis.time_s <= time_s[-1])
    speed, at_s = axis.reading[moving], axis.time_s[moving]
    if len(speed) < FEWEST or np.std(speed) == 0.0:
        return None
    step_s = np.diff(time_s, append=time_s[-1])
    with_speed, among = [], []
    for lag_s in LAGS_S:
        lagged = np.column_stack(
            [np.interp(at_s, time_s, behind(column, step_s, lag_s)) for column in thrust.T]
        )
        lagged -= lagged.mean(axis=0)
        with_speed.append(lagged.T @ (speed - speed.mean()) / len(speed))
        among.append(lagged.T @ lagged / len(speed))
    return _Driven(axis.dof, np.column_stack(with_speed), np.array(among), float(np.std(speed)))
