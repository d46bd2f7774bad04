"""Which motors are reversed, or which two are swapped, by the recorded motion against the thrust.

Each wiring with reversed motors, one swapped pair, or both faults in one pair is tried. With the right wiring the
velocities and rates of turn correlate with its thrust, behind the vehicle's lag, and their changes have its sign. A
wiring is named if the motion follows it clearly better than the given wiring, in all degrees of freedom that follow
either; two faults only if they do clearly better than one. Speed alone has no sign to go by: a controller that brakes
against a sea pushes against the motion.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.coefficients import DOFS, YAW
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.thrusters import allocation_matrix
from identify.checks.actuation.thrust_response import LAGS_S, behind
from identify.dive import Dive, Signal
from identify.doubt import Doubt, Outcome, coefficients_of
from identify.statistics import left_of
from identify.thrust.wrench import asked_thrusts
from identify.words import fixed, listed

Order = NDArray[np.int64]
_Faults = tuple[tuple[int, ...], tuple[int, ...]]
"""Motors reversed and motors swapped, as in `Miswired`."""

FOLLOWS = 0.5
"""Least correlation of a motion that follows a thrust."""
HAS_SIGN = 0.1
"""Least correlation of the changes."""
CLEARLY = 0.15
"""Margin in mean correlation over the given wiring, in the degrees of freedom that it changes, of one that is named."""
NEAR = 0.01
"""Margin in mean correlation within which two wirings are as good."""
FEWEST = 60
"""Steps of a degree of freedom that are judged."""
LEAST_CHANGE = 0.05
"""By how much, N or N m, a thruster's newton gives more or less in a degree of freedom that a wiring changes."""
STEPS_S = (0.5, 1.0, 2.0)
"""Steps over which speeds change."""
MOST_OF_ANY = 8
"""Motors of which any may be reversed: of more, at most two."""


@dataclass(frozen=True)
class Miswired:
    """A wiring that the motion follows better than the vehicle file's: thrusters reversed, two swapped, or both.

    reversed, swapped: thruster numbers in the vehicle file, from 1. If both are given, the pair is swapped first, and
    `reversed` counts in the new order. follows: mean correlation of the motion with the thrust of this wiring;
    followed: the same with the wiring before (the vehicle file's, or one with the first of two faults mended); both
    over the degrees of freedom whose thrust differs and that follow either. mirrors: the degree of freedom whose
    thrust this wiring reverses, if it changes no other; None otherwise.
    """

    reversed: tuple[int, ...]
    swapped: tuple[int, ...]
    follows: float
    followed: float
    mirrors: int | None = None

    @property
    def agreement(self) -> str:
        """How well the motion follows the thrust of both wirings."""
        before = "with one of both mended at most" if self.swapped and self.reversed else "as it is"
        return (
            f"so wired, the recorded motion follows the thrust by {fixed(self.follows, 2)}, and by "
            f"{fixed(self.followed, 2)} {before}"
        )

    @property
    def problem(self) -> str:
        numbers = listed([str(number) for number in self.swapped or self.reversed])
        if self.swapped:
            wrong = f"Thrusters {numbers} push in each other's place"
            if self.reversed:
                wrong += f", and {'both' if len(self.reversed) > 1 else 'one of them'} the other way round"
        elif len(self.reversed) == 1:
            wrong = f"Thruster {numbers} pushes the other way than the vehicle file says"
        else:
            wrong = f"Thrusters {numbers} push the other way than the vehicle file says"
        return f"{wrong} ({self.agreement})"

    @property
    def mend(self) -> str:
        if not self.swapped:
            return "turn their directions round in the vehicle file"
        if not self.reversed:
            return "exchange the two in the vehicle file, or their plugs on the vehicle"
        turned = "both" if len(self.reversed) > 1 else f"what is then number {self.reversed[0]}"
        mend = f"exchange the two in the vehicle file, and turn round the direction of {turned}"
        if self.mirrors is None:
            return mend
        sensor = "velocity" if self.mirrors < 3 else "rate of turn"
        return f"{mend}; or it is the sign of the recorded {sensor} in {DOFS[self.mirrors]} that is wrong"


@dataclass(frozen=True)
class _Related:
    """Covariances of a quantity with the thrusts (k,), and among these (k, k), and the quantity's deviation."""

    with_thrust: Array
    among: Array
    std: float

    def correlations(self, effects: Array) -> Array:
        """With the effect of the thrusts by each of w wirings (w, k); 0 for a wiring without an effect."""
        variance = np.einsum("wi,ij,wj->w", effects, self.among, effects)
        some = variance > 0
        std = self.std * np.sqrt(np.where(some, variance, 1.0))
        return np.asarray(np.where(some, effects @ self.with_thrust / std, 0.0))


@dataclass(frozen=True)
class _Driven:
    """Of a degree of freedom: its speed against the thrusts behind each of LAGS_S, and the change of its speed against
    the thrusts, beyond those of the speed, over each of STEPS_S."""

    dof: int
    speed: tuple[_Related, ...]
    change: tuple[_Related, ...]

    def size_and_sign(self, effects: Array) -> tuple[Array, Array]:
        """Correlations (w,) with the thrusts' effects by each of w wirings (w, k) at the best lag.

        First of the speed, without its sign; then of the speed's changes.
        """
        size = np.max([np.abs(related.correlations(effects)) for related in self.speed], axis=0)
        signed = np.array([related.correlations(effects) for related in self.change])
        return size, np.take_along_axis(signed, np.abs(signed).argmax(axis=0)[None], axis=0)[0]

    def follows(self, effects: Array) -> Array:
        """Correlation (w,) of the speed; 0 where it does not follow, or its changes go against it."""
        size, sign = self.size_and_sign(effects)
        return np.asarray(np.where((size > FOLLOWS) & (sign > HAS_SIGN), size, 0.0))

    def followed(self, effects: Array) -> Array:
        """Correlation (w,) of the speed with the first wiring, to be held against each of w wirings: not 0 either where
        its changes go with the first as well as with the other, however little the speed follows."""
        size, sign = self.size_and_sign(effects)
        as_well = (sign[0] > HAS_SIGN) & (sign[0] >= sign)
        return np.asarray(np.where(as_well, size[0], self.follows(effects)[0]))


def following(dive: Dive, file: VehicleFile, configuration_name: str) -> float:
    """Mean correlation of the motion with the thrust of the vehicle file's wiring, over the degrees of freedom that
    follow it; 0 for none."""
    matrix = allocation_matrix(file.vehicle.configurations[configuration_name])
    driven = _driven_by(dive, file, configuration_name)
    follows = [float(each.follows(matrix[[each.dof]])[0]) for each in driven]
    return float(np.mean([value for value in follows if value > 0])) if any(follows) else 0.0


def miswired(dive: Dive, file: VehicleFile, configuration_name: str) -> Miswired | None:
    """The motors reversed, and the pair swapped, that the motion of a dive shows; None for none.

    Motors whose sign makes no clear difference are left as they are.
    """
    driven = _driven_by(dive, file, configuration_name)
    if not driven:
        return None
    matrix = allocation_matrix(file.vehicle.configurations[configuration_name])
    count = matrix.shape[1]
    pairs = list(combinations(range(1, count + 1), 2))
    one_fault: list[_Faults] = [
        *((motors, ()) for motors in _reversals(count)),
        *(((), pair) for pair in pairs),
    ]
    two_faults: list[_Faults] = [(motors, pair) for pair in pairs for motors in (pair[:1], pair[1:], pair)]
    once = _best_wiring(driven, matrix, matrix, one_fault)
    before = matrix if once is None else _wired(matrix, once.reversed, once.swapped)
    twice = _best_wiring(driven, matrix, before, two_faults)
    if twice is None:
        return once
    return replace(twice, mirrors=_mirrored(matrix, _wired(matrix, twice.reversed, twice.swapped)))


def _best_wiring(
    driven: Sequence[_Driven], given: Array, before: Array, faults: Sequence[_Faults]
) -> Miswired | None:
    """The wiring, among those with some faults, that the motion follows clearly better than the wiring before; None
    if there is none, or if several are equally good and share no reversed motor.

    given, before: allocation matrices (6, k), the vehicle file's, and the same with the faults found so far mended.
    """
    if not faults:
        return None
    wirings = np.array([_wired(given, *each) for each in faults])
    effects = np.concatenate([before[None], wirings])
    of_before, *each_follows = np.column_stack([each.follows(effects[:, each.dof]) for each in driven])
    _, *each_followed = np.column_stack([each.followed(effects[:, each.dof]) for each in driven])
    judged = (max(each_follows, key=lambda values: float(values.sum())) > 0) | (of_before > 0)
    if not judged.any():
        return None
    dofs = [each.dof for each in driven]
    tried: list[Miswired] = []
    means = [float(values[judged].mean()) for values in each_follows]
    for (motors, pair), wired, values, followed in zip(
        faults, wirings, each_follows, each_followed, strict=True
    ):
        # Where the wiring changes nothing, the motion follows both alike, however wrong the one before is.
        changed = judged & (np.abs(wired - before)[dofs].max(axis=1) > LEAST_CHANGE)
        of = changed if changed.any() else judged
        tried.append(Miswired(motors, pair, float(values[of].mean()), float(followed[of].mean())))
    top = max(means)
    best = tried[means.index(top)]
    if best.follows <= best.followed + CLEARLY:
        return None
    near = [each for each, mean in zip(tried, means, strict=True) if mean > top - NEAR]
    if len(near) == 1:
        return best
    agreed = tuple(motor for motor in best.reversed if all(motor in each.reversed for each in near))
    return next((each for each in tried if agreed and each.reversed == agreed and not each.swapped), None)


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


def _wired(matrix: Array, motors: tuple[int, ...], pair: tuple[int, ...]) -> Array:
    """An allocation matrix (6, k) with a pair of its thrusters exchanged, and then some turned round."""
    count = matrix.shape[1]
    order = _exchanged(pair, count) if pair else np.arange(count, dtype=np.int64)
    return np.asarray(matrix[:, order] * _signs(motors, count))


def _mirrored(given: Array, wired: Array) -> int | None:
    """The degree of freedom whose thrust alone another wiring (6, k) changes, if it turns it round."""
    changed = np.flatnonzero(np.abs(wired - given).max(axis=1) > LEAST_CHANGE)
    return int(changed[0]) if len(changed) == 1 and np.allclose(wired[changed], -given[changed]) else None


def _signs(motors: Sequence[int], count: int) -> Array:
    return np.where(np.isin(np.arange(1, count + 1), motors), -1.0, 1.0)


def _exchanged(pair: tuple[int, ...], count: int) -> Order:
    first, second = pair[0] - 1, pair[1] - 1
    order = np.arange(count, dtype=np.int64)
    order[[first, second]] = second, first
    return order


def _driven_by(dive: Dive, file: VehicleFile, configuration_name: str) -> list[_Driven]:
    if dive.thruster_commands is None or not len(dive.thruster_commands):
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
    known = np.isfinite(speed.value[:, 0])
    known &= (speed.time_s >= thrust.time_s[0]) & (speed.time_s <= thrust.time_s[-1])
    value, at_s = speed.value[known, 0], speed.time_s[known]
    if len(value) < FEWEST or np.std(value) == 0.0:
        return None
    step_s = np.diff(thrust.time_s, append=thrust.time_s[-1])
    behind_lag = (
        [np.interp(at_s, thrust.time_s, behind(column, step_s, lag_s)) for column in thrust.value.T]
        for lag_s in LAGS_S
    )
    always = np.ones((len(value), 1))
    lagged = tuple(_related(value, np.column_stack(columns), always) for columns in behind_lag)
    steps = tuple(step for step_s in STEPS_S if (step := _over_steps(value, at_s, thrust, step_s)))
    return _Driven(dof, lagged, steps) if steps else None


def _over_steps(value: Array, at_s: Array, thrust: Signal, step_s: float) -> _Related | None:
    """The change of a speed (n,) against the thrusts over steps of that length; None for too few steps."""
    bins = np.floor((at_s - at_s[0]) / step_s).astype(np.int64)
    count = np.bincount(bins)
    mean = np.bincount(bins, value) / np.maximum(count, 1)
    full = (count[1:] > 0) & (count[:-1] > 0)
    if np.count_nonzero(full) < FEWEST:
        return None
    middle_s = at_s[0] + step_s * (np.flatnonzero(full) + 0.5)
    pushed = np.cumsum(thrust.value[:-1] * np.diff(thrust.time_s)[:, None], axis=0)
    pushed = np.vstack([np.zeros(thrust.value.shape[1]), pushed])
    force = np.column_stack(
        [
            np.interp(middle_s + step_s, thrust.time_s, column) - np.interp(middle_s, thrust.time_s, column)
            for column in pushed.T
        ]
    )
    speed = 0.5 * (mean[1:] + mean[:-1])[full]
    alike = np.column_stack([np.ones(len(speed)), speed, speed * np.abs(speed)])
    return _related(np.diff(mean)[full], force, alike)


def _related(value: Array, force: Array, beyond: Array) -> _Related:
    """A quantity (n,) against forces (n, k), both beyond some columns (n, m)."""
    value, force = left_of(beyond, value), left_of(beyond, force)
    return _Related(
        force.T @ value / len(value), force.T @ force / len(value), max(float(np.std(value)), 1e-300)
    )
