"""One linear model of two runs, with what only one of them holds: fitted, and held to pieces that it never saw."""

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
    """What the one run may hold beyond the other. causes: the effects that it comes to, by name; water: what a current
    or a sensor of values (p,) comes to; own: which of each state's terms it has with sizes of its own, for a change of
    drag, mass or thrust."""

    name: str
    causes: tuple[str, ...]
    units: tuple[tuple[str, str], ...]
    start: tuple[float, ...]
    water: Callable[[Array], Water]
    own: tuple[tuple[int, ...], ...] = ((), (), ())


@dataclass(frozen=True)
class Pair:
    """The run that is taken to be plain, and the one that may hold something."""

    vehicle: str
    plain: Columns
    other: Columns


@dataclass(frozen=True)
class Weighed:
    """values, std (p,); left (3,): rms of what acceleration of the other run is left on pieces held out, over that of
    the acceleration itself, of STATES; pieces: how many of these there are."""

    candidate: Candidate
    values: Array
    std: Array
    left: Array
    pieces: int

    @property
    def mean_square(self) -> float:
        """Of what is left, over all states."""
        return float(np.mean(self.left**2))


def accelerations(vehicle: str, run: Columns, water: Water) -> list[tuple[Array, Array]]:
    """For each of STATES the mean acceleration between two instants (n,), and the mean terms (n, k)."""
    return [
        (np.diff(state) / STEP_S, 0.5 * (own[1:] + own[:-1]))
        for state, own in zip(moving(run, water), terms(vehicle, run, water), strict=True)
    ]


def sizes(value: Array, columns: Array) -> Array:
    """Least squares, columns brought to one length first."""
    scale = np.maximum(np.abs(columns).max(axis=0), 1e-12)
    return np.asarray(np.linalg.lstsq(columns / scale, value, rcond=ROUNDED)[0] / scale)


def left_of(pair: Pair, candidate: Candidate, values: Array, held: NDArray[np.bool_]) -> list[Array]:
    """What is left of each state's acceleration in both runs, the plain one's first (n + n,), with the terms' sizes
    learnt from all of the plain run and from what is not `held` (n,) of the other."""
    out = []
    for wanted, both in _stacked(pair, candidate, values):
        taught = np.concatenate([np.ones(len(wanted) - len(held), np.bool_), ~held])
        out.append(wanted - both @ sizes(wanted[taught], both[taught]))
    return out


def learnt(
    pair: Pair, candidate: Candidate, values: Array, held: NDArray[np.bool_]
) -> tuple[list[Array], list[Array]]:
    """The sizes (k,) of each state's terms in the plain run, and those in the other, learnt as in `left_of`."""
    plain, other = [], []
    for (wanted, both), more in zip(_stacked(pair, candidate, values), candidate.own, strict=True):
        taught = np.concatenate([np.ones(len(wanted) - len(held), np.bool_), ~held])
        size = sizes(wanted[taught], both[taught])
        own, extra = np.split(size, [both.shape[1] - len(more)])
        plain.append(own)
        changed = own.copy()
        changed[list(more)] += extra
        other.append(changed)
    return plain, other


def _stacked(pair: Pair, candidate: Candidate, values: Array) -> list[tuple[Array, Array]]:
    """For each state the acceleration of both runs, the plain one's first (n + n,), and the terms (n + n, k + own) with
    those that the other run has for its own behind them."""
    plain = accelerations(pair.vehicle, pair.plain, Water())
    other = accelerations(pair.vehicle, pair.other, candidate.water(values))
    out = []
    for (value, columns), (mine, own), more in zip(plain, other, candidate.own, strict=True):
        extra = own[:, list(more)]
        none = np.zeros((len(columns), extra.shape[1]))
        both = np.vstack([np.hstack([columns, none]), np.hstack([own, extra])])
        out.append((np.concatenate([value, mine]), both))
    return out


def scales(pair: Pair) -> Array:
    """(3,): the spread of each state's acceleration in the plain run."""
    return np.array([np.std(value) for value, _ in accelerations(pair.vehicle, pair.plain, Water())])


def folds(run: Columns) -> NDArray[np.intp]:
    """The fold (n,) that each step of a run belongs to, piece by piece."""
    return np.asarray((np.arange(len(run["t"]) - 1) * STEP_S / PIECE_S).astype(np.intp) % FOLDS)


def weigh(pair: Pair, candidate: Candidate) -> Weighed:
    """A candidate's values from all that there is, and what it leaves of pieces held out, found anew without these."""
    scale = scales(pair)
    fold = folds(pair.other)
    count = len(fold)
    values, std = best_values(pair, candidate, np.array(candidate.start), np.zeros(count, np.bool_), scale)
    squares = np.zeros(len(STATES))
    for k in range(FOLDS):
        held = fold == k
        own, _ = best_values(pair, candidate, values, held, scale)
        left = left_of(pair, candidate, own, held)
        squares += [float(np.sum(one[-count:][held] ** 2)) for one in left]
    pieces = int(np.ceil(count * STEP_S / PIECE_S))
    return Weighed(candidate, values, std, np.sqrt(squares / count) / scale, pieces)


def best_values(
    pair: Pair, candidate: Candidate, start: Array, held: NDArray[np.bool_], scale: Array
) -> tuple[Array, Array]:
    """The best values and their standard errors, widened by how long what is left remembers itself."""
    if not len(start):
        return start, start
    taught = np.concatenate([np.ones(len(held), np.bool_), ~held])

    def off(values: Array) -> Array:
        left = left_of(pair, candidate, values, held)
        return np.concatenate([one[taught] / by for one, by in zip(left, scale, strict=True)])

    found = least_squares(off, start, x_scale=0.1)
    longer = (1.0 + _memory(found.fun)) / (1.0 - _memory(found.fun))
    variance = 2.0 * found.cost / len(found.fun) * longer
    return found.x, np.sqrt(np.diag(np.linalg.inv(found.jac.T @ found.jac)) * variance)


def _memory(left: Array) -> float:
    return float(np.clip(np.mean(left[1:] * left[:-1]) / np.mean(left**2), 0.0, 0.98))
