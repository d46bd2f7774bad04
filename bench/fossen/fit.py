"""One linear model of two runs, with an effect that only one of them holds: fit, and check on pieces held out."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from bench.fossen.runs import STATES, STEP_S, Columns, Water, moving, terms

Array = NDArray[np.float64]

PIECE_S, FOLDS = 20.0, 5
ROUNDED = 1e-10


@dataclass(frozen=True)
class Candidate:
    """An effect that one run may hold and the other not.

    causes: names of its effects; water: the current or sensor offset for values (p,); own: for each state, the terms
    that have sizes of their own in this run, for a change of drag, mass or thrust.
    """

    name: str
    causes: tuple[str, ...]
    units: tuple[tuple[str, str], ...]
    start: tuple[float, ...]
    water: Callable[[Array], Water]
    own: tuple[tuple[int, ...], ...] = ((), (), ())


@dataclass(frozen=True)
class Pair:
    """The run that is assumed to be plain, and the run that may hold an effect."""

    vehicle: str
    plain: Columns
    other: Columns


@dataclass(frozen=True)
class Weighed:
    """A candidate with its values, std (p,), and its fit on pieces held out.

    left (3,): for each of STATES, rms of the other run's residual acceleration over the standard deviation of the plain
    run's acceleration; pieces: number of pieces.
    """

    candidate: Candidate
    values: Array
    std: Array
    left: Array
    pieces: int

    @property
    def mean_square(self) -> float:
        """Mean square of `left` over all states."""
        return float(np.mean(self.left**2))


def accelerations(vehicle: str, run: Columns, water: Water) -> list[tuple[Array, Array]]:
    """For each of STATES, the mean acceleration between two instants (n,) and the mean terms (n, k)."""
    return [
        (np.diff(state) / STEP_S, 0.5 * (table[1:] + table[:-1]))
        for state, table in zip(moving(run, water), terms(vehicle, run, water), strict=True)
    ]


def sizes(value: Array, columns: Array) -> Array:
    """Least squares, with the columns scaled to one length first."""
    scale = np.maximum(np.abs(columns).max(axis=0), 1e-12)
    return np.asarray(np.linalg.lstsq(columns / scale, value, rcond=ROUNDED)[0] / scale)


def left_of(pair: Pair, candidate: Candidate, values: Array, held: NDArray[np.bool_]) -> list[Array]:
    """Residual acceleration of each state in both runs, the plain run first (n + n,).

    The sizes of the terms are learnt from the whole plain run and the part of the other run that is not `held` (n,).
    """
    out = []
    for wanted, table in _stacked(pair, candidate, values):
        taught = np.concatenate([np.ones(len(wanted) - len(held), np.bool_), ~held])
        out.append(wanted - table @ sizes(wanted[taught], table[taught]))
    return out


def learnt(
    pair: Pair, candidate: Candidate, values: Array, held: NDArray[np.bool_]
) -> tuple[list[Array], list[Array]]:
    """Sizes (k,) of each state's terms in the plain run and in the other run, learnt as in `left_of`."""
    plain, other = [], []
    for (wanted, table), more in zip(_stacked(pair, candidate, values), candidate.own, strict=True):
        taught = np.concatenate([np.ones(len(wanted) - len(held), np.bool_), ~held])
        size = sizes(wanted[taught], table[taught])
        plain_sizes, extra = np.split(size, [table.shape[1] - len(more)])
        plain.append(plain_sizes)
        changed = plain_sizes.copy()
        changed[list(more)] += extra
        other.append(changed)
    return plain, other


def _stacked(pair: Pair, candidate: Candidate, values: Array) -> list[tuple[Array, Array]]:
    """For each state, the acceleration of both runs, the plain run first (n + n,), and the terms (n + n, k + own).

    The last columns are the terms that have a size of their own in the other run; they are 0 in the plain run.
    """
    plain = accelerations(pair.vehicle, pair.plain, Water())
    other = accelerations(pair.vehicle, pair.other, candidate.water(values))
    out = []
    for (value, columns), (other_value, other_columns), more in zip(plain, other, candidate.own, strict=True):
        extra = other_columns[:, list(more)]
        zeros = np.zeros((len(columns), extra.shape[1]))
        table = np.vstack([np.hstack([columns, zeros]), np.hstack([other_columns, extra])])
        out.append((np.concatenate([value, other_value]), table))
    return out


def scales(pair: Pair) -> Array:
    """Spread (3,) of each state's acceleration in the plain run."""
    return np.array([np.std(value) for value, _ in accelerations(pair.vehicle, pair.plain, Water())])


def folds(run: Columns) -> NDArray[np.intp]:
    """Fold (n,) of each step of a run; consecutive pieces go to consecutive folds."""
    return np.asarray((np.arange(len(run["t"]) - 1) * STEP_S / PIECE_S).astype(np.intp) % FOLDS)


def weigh(pair: Pair, candidate: Candidate) -> Weighed:
    """Fit a candidate's values to everything, and evaluate it on pieces held out with values fitted without these."""
    scale = scales(pair)
    fold = folds(pair.other)
    count = len(fold)
    values, std = best_values(pair, candidate, np.array(candidate.start), np.zeros(count, np.bool_), scale)
    squares = np.zeros(len(STATES))
    for k in range(FOLDS):
        held = fold == k
        fold_values, _ = best_values(pair, candidate, values, held, scale)
        left = left_of(pair, candidate, fold_values, held)
        squares += [float(np.sum(of_state[-count:][held] ** 2)) for of_state in left]
    pieces = int(np.ceil(count * STEP_S / PIECE_S))
    return Weighed(candidate, values, std, np.sqrt(squares / count) / scale, pieces)


def best_values(
    pair: Pair, candidate: Candidate, start: Array, held: NDArray[np.bool_], scale: Array
) -> tuple[Array, Array]:
    """Best values and their standard errors, widened for the autocorrelation of the residuals."""
    if not len(start):
        return start, start
    taught = np.concatenate([np.ones(len(held), np.bool_), ~held])

    def off(values: Array) -> Array:
        left = left_of(pair, candidate, values, held)
        return np.concatenate(
            [of_state[taught] / spread for of_state, spread in zip(left, scale, strict=True)]
        )

    best_fit = least_squares(off, start, x_scale=0.1)
    longer = (1.0 + _memory(best_fit.fun)) / (1.0 - _memory(best_fit.fun))
    variance = 2.0 * best_fit.cost / len(best_fit.fun) * longer
    return best_fit.x, np.sqrt(np.diag(np.linalg.inv(best_fit.jac.T @ best_fit.jac)) * variance)


def _memory(left: Array) -> float:
    return float(np.clip(np.mean(left[1:] * left[:-1]) / np.mean(left**2), 0.0, 0.98))
