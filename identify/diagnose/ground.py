"""A dive's regression by filters of given noise levels: causes fitted and weighed on it, many of them, quickly.

The filters stay as they are: a force that is taken out of the dive is taken out of the innovations through them
(`Whitened.columns`), some milliseconds a column, where a new climb of all noise levels takes half a second.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bridge.effects.effect import Effect
from identify.diagnose.blocks import Blocks
from identify.diagnose.cause import Cause, Setting
from identify.diagnose.columns import Columns, Key, key_of
from identify.diagnose.evidence import FOLDS, SCARCE, Pieces, Sums, inverse, pieces_of, products_of, sums
from identify.diagnose.nominal import Nominal
from identify.diagnose.whitened import Whitened, whitened

Array = NDArray[np.float64]

MOST_STEPS = 8
SETTLED = 0.1
SHORTER = 0.3


@dataclass(frozen=True)
class Fitted:
    """Causes with the best values at a ground's noise levels.

    value (rows,): what is left to the nominal model; slopes (rows, k): of the parameters `at` (k of cause and
    parameter); covariance (k, k). left: squares that the best nominal model leaves of `value`. gain: nats saved on
    pieces held out, `std` its standard error over pieces; felt: what the vehicle's motion alone saves, in sample.
    """

    causes: tuple[Cause, ...]
    at: tuple[tuple[int, int], ...]
    value: Array
    slopes: Array
    covariance: Array
    left: float
    gain: float
    std: float
    felt: float


@dataclass(frozen=True)
class Beside:
    """All candidates beside some causes: the sums of their columns, with the settings that these belong to."""

    sums: Sums
    settings: tuple[Setting, ...]


@dataclass(frozen=True)
class Ground:
    """now: the filters; rows: their regression, with all that was taken out of the dive put back."""

    now: Nominal
    rows: Whitened
    library: tuple[Effect, ...]

    @cached_property
    def _columns(self) -> Columns:
        """What causes add."""
        return Columns(self.rows, self.now.course, self.library)

    @cached_property
    def _candidates(self) -> Blocks:
        """The columns of all ways to try the library, behind the nominal ones."""
        return self._columns.candidates.after(self.rows.nominal)

    @cached_property
    def _nominal(self) -> Blocks:
        """The nominal columns, most of which are zero on most rows."""
        return self.rows.blocks([], self.now.course).after(self.rows.nominal)

    @cached_property
    def _by_piece(self) -> Array:
        """(P, m, m): the products of the nominal columns."""
        return self._nominal.products(self.rows.piece)

    @cached_property
    def _square(self) -> Array:
        """The nominal columns' normal equations, with what is known beforehand."""
        return np.asarray(self._by_piece.sum(axis=0) + np.diag(self.rows.nominal_precision))

    @cached_property
    def _inverse_square(self) -> Array:
        return inverse(self._square)

    @cached_property
    def _moving(self) -> tuple[Blocks, Array]:
        """The nominal columns where the vehicle's own motion tells, and their products (m, m)."""
        own = Blocks(self._nominal.parts[: len(self.rows.own)], self._nominal.width)
        return own, own.products(np.zeros(own.places[-1].stop, dtype=np.intp))[0]

    @cached_property
    def _found(self) -> dict[tuple[Key, ...], Fitted]:
        """Fits by what they began with, without their rows: these are long."""
        return {}

    @cached_property
    def _besides(self) -> dict[tuple[int, tuple[Key, ...]], Beside]:
        return {}

    def fitted(self, causes: Sequence[Cause]) -> Fitted:
        """The causes with their best values beside the best nominal model, which a search asks for more than once."""
        key = tuple(key_of(cause) for cause in causes)
        if key not in self._found:
            fit = self._fitted(causes)
            self._found[key] = replace(fit, value=np.zeros(0), slopes=np.zeros((0, len(fit.at))))
            return fit
        known = self._found[key]
        rows, _ = self._weighed(known.causes)
        return replace(known, value=rows.value, slopes=rows.slopes)

    def _fitted(self, causes: Sequence[Cause]) -> Fitted:
        """By Gauss and Newton; a step that leaves more unexplained is shortened."""
        best, step = self._weighed(tuple(cause for cause in causes if cause.present.any()))
        for _ in range(MOST_STEPS if best.at else 0):
            tried, further = self._moved(best, step)
            if tried.left >= best.left:
                tried, further = self._moved(best, SHORTER * step)
            if tried.left >= best.left:
                break
            small = bool(np.all(np.abs(step) < SETTLED * np.sqrt(np.diag(best.covariance))))
            best, step = tried, further
            if small or not best.at or all(cause.effect.linear for cause in best.causes):
                break
        gain, std, felt = self._held(best)
        return replace(best, gain=gain, std=std, felt=felt)

    def _moved(self, fit: Fitted, step: Array) -> tuple[Fitted, Array]:
        moved = list(fit.causes)
        for (k, p), by in zip(fit.at, step.tolist(), strict=True):
            moved[k] = moved[k].moved(p, by)
        return self._weighed(tuple(cause for cause in moved if cause.present.any()))

    def beside(self, fit: Fitted) -> Beside:
        """All candidates beside a fit, with what its causes' other values would add taken out."""
        return self._weighed_beside(fit, fit.slopes)

    def beyond(self, fit: Fitted) -> Beside:
        """The same with what other forms of its causes would add taken out, too."""
        return self._weighed_beside(fit, self.known(fit))

    def known(self, fit: Fitted) -> Array:
        """(rows, k): what other values and other forms of a fit's causes would add."""
        others = [self._columns.forms_of(cause) for cause in fit.causes]
        return np.vstack([fit.slopes.T, *others]).T

    def _weighed_beside(self, fit: Fitted, known: Array) -> Beside:
        key = known.shape[1], tuple(key_of(cause) for cause in fit.causes)
        if key not in self._besides:
            self._besides[key] = self._beside(fit.value, known)
        return self._besides[key]

    def _beside(self, value: Array, known: Array) -> Beside:
        """The sums from what is made once for the ground and the products with what is new here."""
        m, n = self.rows.nominal.shape[1], known.shape[1]
        new = np.vstack([known.T, value]).T
        cross, own = self._candidates.products_with(new, self.rows.piece), products_of(new, self._pieces)
        square = np.block(
            [
                [self._products[:, :m, :m], cross[:, :m, :n], self._products[:, :m, m:]],
                [cross[:, :m, :n].mT, own[:, :n, :n], cross[:, m:, :n].mT],
                [self._products[:, m:, :m], cross[:, m:, :n], self._products[:, m:, m:]],
            ]
        )
        right = np.concatenate([cross[:, :m, n], own[:, :n, n], cross[:, m:, n]], axis=1)
        precision = np.concatenate([self.rows.nominal_precision, np.zeros(n)])
        return Beside(sums(square, right, precision), self._columns.settings)

    @cached_property
    def _pieces(self) -> Pieces:
        return pieces_of(self.rows.piece)

    @cached_property
    def _products(self) -> Array:
        """(P, m + c, m + c): of the nominal columns and the candidates'."""
        return self._candidates.products(self.rows.piece)

    def _weighed(self, causes: tuple[Cause, ...]) -> tuple[Fitted, Array]:
        """The causes as they are; and the step (k,) of their parameters to where they would fit best."""
        at = tuple((k, p) for k, cause in enumerate(causes) for p in np.flatnonzero(cause.present).tolist())
        columns = [self._columns.of(cause) for cause in causes]
        value = self.rows.value.copy()
        for own in columns:
            value -= own[0]
        new = np.vstack([*(own[1:] for own in columns), value])
        cross, products = self._nominal.crossed(new.T), new @ new.T
        square = np.block([[self._square, cross[:, :-1]], [cross[:, :-1].T, products[:-1, :-1]]])
        m, free = len(self._square), inverse(square)
        step = free[m:] @ np.concatenate([cross[:, -1], products[:-1, -1]])
        left = float(products[-1, -1] - cross[:, -1] @ self._inverse_square @ cross[:, -1])
        return Fitted(causes, at, new[-1], new[:-1].T, free[m:, m:], left, 0.0, 0.0, 0.0), step

    def _held(self, fit: Fitted) -> tuple[float, float, float]:
        """Nats that the causes save on pieces held out, over the nominal model alone, and their standard error; and in
        sample, where the vehicle's own motion tells of them."""
        columns = np.vstack([fit.slopes.T, self.rows.value, fit.value]).T
        cross = self._nominal.products_with(columns, self.rows.piece)
        taken = self._inverse_square @ cross.sum(axis=0)
        both = cross.mT @ taken
        products = products_of(columns, self._pieces) - both - both.mT + taken.T @ self._by_piece @ taken
        k = fit.slopes.shape[1]
        square, right = products[:, :k, :k], products[:, :k, -1]
        scarce = SCARCE * np.diag(np.einsum("pii->i", square))
        gains = 0.5 * (products[:, -2, -2] - products[:, -1, -1])
        for fold in range(min(FOLDS, len(products))):
            out = np.arange(len(products)) % FOLDS == fold
            size = inverse(square[~out].sum(axis=0) + scarce) @ right[~out].sum(axis=0)
            gains[out] += right[out] @ size - 0.5 * np.einsum("i,pij,j->p", size, square[out], size)
        nominal, in_motion = self._moving
        moved, lean = columns[: nominal.places[-1].stop, -2:], taken[:, -2:]
        left = (moved**2).sum(axis=0) - 2.0 * (lean * nominal.crossed(moved)).sum(axis=0)
        left += (lean * (in_motion @ lean)).sum(axis=0)
        return float(gains.sum()), float(np.std(gains) * np.sqrt(len(gains))), 0.5 * float(left[0] - left[1])


def ground_of(now: Nominal, library: tuple[Effect, ...]) -> Ground:
    """The ground by the filters of `now`."""
    rows = whitened(now.joint, now.theta, now.doubted).with_witnesses(now.witnesses, now.acts, now.course)
    back = rows.columns(now.acts, now.course).sum(axis=1)
    return Ground(now, replace(rows, value=rows.value + back), library)
