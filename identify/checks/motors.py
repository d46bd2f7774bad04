"""Which motors are reversed, or which two are swapped, by the recorded motion against the thrust.

Each wiring that differs from the given one by reversed motors, or by one swapped pair, is tried: the velocities and the
rate of turn should follow the thrust that it gives, behind the vehicle's lag. It is named where they follow it clearly
better than the given wiring.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.config import VehicleFile
from bridge.vehicle.thrusters import allocation_matrix
from identify.checks.mounting import LAGS_S, behind
from identify.dive import Dive, Signal
from identify.forces import asked_thrusts
from identify.identification import Doubt, Outcome, coefficients_of
from identify.words import fixed, listed

Array = NDArray[np.float64]
Order = NDArray[np.int64]

YAW = 5

FOLLOWS = 0.5
"""Least mean correlation of the motion with the thrust of a wiring that is named."""
CLEARLY = 0.15
"""Margin in mean correlation over the given wiring."""
NEAR = 0.01
"""Margin in mean correlation within which two wirings are as good."""
FEWEST = 50
MOST_OF_ANY = 8
"""Motors of which any may be reversed: of more, at most two."""


@dataclass(frozen=True)
class Miswired:
    """A wiring that the motion follows better than the vehicle file's: thrusters reversed, or two swapped.

    reversed, swapped: their numbers in the vehicle file, from 1. follows: mean correlation of the motion with the
    thrust of this wiring; followed: with that of the vehicle file's.
    """

    reversed: tuple[int, ...]
    swapped: tuple[int, ...]
    follows: float
    followed: float

    @property
    def agreement(self) -> str:
        """How well the motion follows the thrust of both wirings."""
        return (
            f"so wired, the recorded motion follows the thrust by {fixed(self.follows, 2)}, and by "
            f"{fixed(self.followed, 2)} as it is"
        )

    @property
    def problem(self) -> str:
        """The contradiction."""
        numbers = listed([str(number) for number in self.reversed or self.swapped])
        if len(self.reversed) == 1:
            wrong = f"Thruster {numbers} pushes the other way than the vehicle file says"
        elif self.reversed:
            wrong = f"Thrusters {numbers} push the other way than the vehicle file says"
        else:
            wrong = f"Thrusters {numbers} push in each other's place"
        return f"{wrong} ({self.agreement})"

    @property
    def mend(self) -> str:
        """The change that ends it."""
        if self.reversed:
            return "give each the opposite `direction` in the vehicle file"
        return "exchange the two in the vehicle file, or their plugs on the vehicle"


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


def following(dive: Dive, file: VehicleFile, configuration_name: str) -> float:
    """Mean correlation of the motion with the thrust of the vehicle file's wiring; 0 without a motion or a command."""
    matrix = allocation_matrix(file.vehicle.configurations[configuration_name])
    order = np.arange(matrix.shape[1], dtype=np.int64)
    driven = _driven_by(dive, file, configuration_name)
    return float(np.mean([each.follows(matrix[each.dof], order) for each in driven])) if driven else 0.0


def miswired(dive: Dive, file: VehicleFile, configuration_name: str) -> Miswired | None:
    """The motors reversed, or the pair swapped, that the motion of a dive shows; None for none.

    Motors whose sign makes no clear difference are left as they are.
    """
    driven = _driven_by(dive, file, configuration_name)
    if not driven:
        return None
    matrix = allocation_matrix(file.vehicle.configurations[configuration_name])
    count = matrix.shape[1]
    in_order = np.arange(count, dtype=np.int64)

    def mean(signs: Array, order: Order) -> float:
        return float(np.mean([each.follows(matrix[each.dof] * signs, order) for each in driven]))

    as_given = mean(np.ones(count), in_order)
    if as_given > 1.0 - CLEARLY:
        return None
    tried = [
        *(
            Miswired(motors, (), mean(_signs(motors, count), in_order), as_given)
            for motors in _reversals(count)
        ),
        *(
            Miswired((), pair, mean(np.ones(count), _exchanged(pair, in_order)), as_given)
            for pair in combinations(range(1, count + 1), 2)
        ),
    ]
    best = max(tried, key=lambda each: each.follows)
    if best.follows <= max(FOLLOWS, as_given + CLEARLY):
        return None
    near = [each for each in tried if each.follows > best.follows - NEAR]
    if len(near) == 1:
        return best
    agreed = tuple(motor for motor in best.reversed if all(motor in each.reversed for each in near))
    return next((each for each in tried if agreed and each.reversed == agreed), None)


def miswired_doubts(dive: Dive, file: VehicleFile, configuration_name: str) -> tuple[Doubt, ...]:
    """A doubt about all masses and dampings where the motion contradicts the thrusters' wiring."""
    wrong = miswired(dive, file, configuration_name)
    if wrong is None:
        return ()
    return (Doubt(coefficients_of(range(6)), wrong.problem, f"{wrong.mend}.", Outcome.DISAGREES),)


def _reversals(count: int) -> Iterator[tuple[int, ...]]:
    """Sets of motors, numbers from 1, that may be reversed together."""
    most = count if count <= MOST_OF_ANY else 2
    for size in range(1, most + 1):
        yield from combinations(range(1, count + 1), size)


def _signs(motors: Sequence[int], count: int) -> Array:
    return np.where(np.isin(np.arange(1, count + 1), motors), -1.0, 1.0)


def _exchanged(pair: tuple[int, ...], order: Order) -> Order:
    first, second = pair[0] - 1, pair[1] - 1
    exchanged = order.copy()
    exchanged[[first, second]] = order[[second, first]]
    return exchanged


def _driven_by(dive: Dive, file: VehicleFile, configuration_name: str) -> list[_Driven]:
    if dive.thruster_commands is None:
        return []
    thrust = asked_thrusts(dive, file, configuration_name)
    if thrust.value.shape[1] < len(file.vehicle.configurations[configuration_name].thrusters):
        return []
    return [each for dof, speed in _speeds(dive) if (each := _driven(dof, speed, thrust))]


def _speeds(dive: Dive) -> Iterator[tuple[int, Signal]]:
    """Velocities and rate of turn (n, 1) by degree of freedom."""
    if dive.velocity is not None:
        for dof in range(3):
            yield dof, Signal(dive.velocity.time_s, dive.velocity.value[:, dof : dof + 1])
    if dive.yaw_rate is not None:
        yield YAW, dive.yaw_rate


def _driven(dof: int, speed: Signal, thrust: Signal) -> _Driven | None:
    moving = np.isfinite(speed.value[:, 0])
    moving &= (speed.time_s >= thrust.time_s[0]) & (speed.time_s <= thrust.time_s[-1])
    value, at_s = speed.value[moving, 0], speed.time_s[moving]
    if len(value) < FEWEST or np.std(value) == 0.0:
        return None
    step_s = np.diff(thrust.time_s, append=thrust.time_s[-1])
    with_speed, among = [], []
    for lag_s in LAGS_S:
        lagged = np.column_stack(
            [np.interp(at_s, thrust.time_s, behind(column, step_s, lag_s)) for column in thrust.value.T]
        )
        lagged -= lagged.mean(axis=0)
        with_speed.append(lagged.T @ (value - value.mean()) / len(value))
        among.append(lagged.T @ lagged / len(value))
    return _Driven(dof, np.column_stack(with_speed), np.array(among), float(np.std(value)))
