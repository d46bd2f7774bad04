"""Candidates fitted and weighed on a dive's regression at fixed noise levels, fast enough for a search.

The filters stay fixed: a force is removed from the innovations through them (`Regression.columns`) in milliseconds a
column, while a refit of all noise levels takes half a second. Columns are made once and kept, because a search asks for
most of them many times.

No form of a library is exact, and the remainder of a cause's form is no evidence for a further cause (`FormRemainder`).
In each cell of axis and piece, the remainder is bounded by a share of the cause's own contribution and by the savings
of its other forms. The Cauchy-Schwarz inequality turns that bound into nats.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache, partial

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.effects.effect import Act, Effect
from bridge.vehicle.coefficients import DOFS
from identify.diagnose.candidates import Cause, Setting, other_forms, other_variants, settings_of
from identify.diagnose.evidence import (
    FOLDS,
    SCARCE,
    Blocks,
    NormalEquations,
    Pieces,
    equations_from_products,
    inverse,
    pieces_of,
    products_of,
)
from identify.diagnose.nominal import Nominal
from identify.diagnose.regression import Regression, regression_of

Array = NDArray[np.float64]
Key = tuple[Effect, bytes]

KEPT = 32
"""Number of causes whose columns are kept: those of a long dive take a megabyte per cause."""

MOST_STEPS = 8
SETTLED = 0.1
SHORTER = 0.3


def key_of(cause: Cause) -> Key:
    """Causes with equal keys have equal columns."""
    return cause.effect, cause.values.tobytes()


@dataclass(frozen=True)
class CandidateColumns:
    """Regression columns of the causes of a library along a course."""

    rows: Regression
    course: Course
    library: tuple[Effect, ...]

    @cached_property
    def settings(self) -> tuple[Setting, ...]:
        """All settings of the library."""
        return self._tried[0]

    @cached_property
    def candidates(self) -> Blocks:
        """The columns of the settings."""
        return self.rows.blocks(self._tried[1], self.course)

    @cached_property
    def _tried(self) -> tuple[tuple[Setting, ...], list[Act]]:
        return settings_of(self.library, self.course)

    def of(self, cause: Cause) -> Array:
        """Columns (1 + k, rows): a cause's column, and its slopes by each parameter present."""
        if cause.effect.linear:
            return self._of_linear(cause)
        return self._last(*key_of(cause))

    def forms_of(self, cause: Cause) -> Array:
        """Columns (k, rows) of a cause's other forms."""
        key = key_of(cause)
        if key not in self._other:
            forms = [*other_forms(self.course, cause), *other_variants(self.course, cause, self.library)]
            self._other[key] = self.rows.columns(forms, self.course).T
        return self._other[key]

    @cached_property
    def _last(self) -> Callable[[Effect, bytes], Array]:
        """The cache of the latest causes' columns."""
        return lru_cache(KEPT)(partial(_columns_of, self.rows, self.course))

    def _of_linear(self, cause: Cause) -> Array:
        """Columns of a linear cause by superposition of unit columns."""
        if cause.effect not in self._by_unit:
            self._by_unit[cause.effect] = self._units(cause.effect)
        slopes, present = self._by_unit[cause.effect], cause.present
        column = (cause.values - cause.effect.none())[present] @ slopes[present]
        return np.vstack([column, slopes[present]])

    def _units(self, effect: Effect) -> Array:
        """Unit columns (p, rows), taken from the trial columns if these exist."""
        if "candidates" in vars(self) and effect in self.library:
            setting = next(trial for trial in self.settings if trial.effect == effect)
            tried = self.candidates.some(setting.columns)
        else:
            (setting,), acts = settings_of((effect,), self.course)
            tried = self.rows.columns(acts, self.course)
        return tried.T / np.diag(setting.steps)[:, None]

    @cached_property
    def _other(self) -> dict[Key, Array]:
        return {}

    @cached_property
    def _by_unit(self) -> dict[Effect, Array]:
        return {}


def _columns_of(rows: Regression, course: Course, effect: Effect, values: bytes) -> Array:
    cause = Cause(effect, np.frombuffer(values))
    acts = [cause.act(course)]
    acts += [cause.slope(course, p) for p in np.flatnonzero(cause.present).tolist()]
    return rows.columns(acts, course).T


@dataclass(frozen=True)
class Fitted:
    """Causes at their best values for given noise levels.

    value (rows,): the remainder left to the nominal model. slopes (rows, k): of the parameters `at` (k pairs of cause
    and parameter), with covariance (k, k). residual_squares: sum of squares of `value` less the best nominal model.
    gain: nats saved on held-out pieces, `std` its standard error over pieces. motion_nats: nats saved in sample by
    the vehicle's motion alone.
    """

    causes: tuple[Cause, ...]
    at: tuple[tuple[int, int], ...]
    value: Array
    slopes: Array
    covariance: Array
    residual_squares: float
    gain: float
    std: float
    motion_nats: float


@dataclass(frozen=True)
class CandidateEquations:
    """Normal equations of all candidates given some fitted causes, and the settings that the columns belong to."""

    equations: NormalEquations
    settings: tuple[Setting, ...]


@dataclass(frozen=True)
class Weighing:
    """Candidates of a library weighed by fixed filters. now: the filters. rows: their regression, before any effect
    was removed."""

    now: Nominal
    rows: Regression
    library: tuple[Effect, ...]

    @cached_property
    def _columns(self) -> CandidateColumns:
        """Candidate columns."""
        return CandidateColumns(self.rows, self.now.course, self.library)

    @cached_property
    def _candidates(self) -> Blocks:
        """The columns of all settings, after the nominal columns."""
        return self._columns.candidates.after(self.rows.nominal)

    @cached_property
    def _nominal(self) -> Blocks:
        """The nominal columns, sparse."""
        return self.rows.blocks([], self.now.course).after(self.rows.nominal)

    @cached_property
    def _by_piece(self) -> Array:
        """Products (P, m, m) of the nominal columns within each piece, each with a part of their prior precision."""
        products = self._nominal.products(self.rows.piece)
        return np.asarray(products + np.diag(self.rows.nominal_precision) / len(products))

    @cached_property
    def _square(self) -> Array:
        """Normal equations of the nominal columns."""
        return np.asarray(self._by_piece.sum(axis=0))

    @cached_property
    def _inverse_square(self) -> Array:
        return inverse(self._square)

    @cached_property
    def moving(self) -> tuple[Blocks, Array]:
        """The nominal columns on the axes' rows, and their products (m, m) with their prior precision."""
        columns = Blocks(self._nominal.parts[: len(self.rows.axes)], self._nominal.width)
        products = columns.products(np.zeros(columns.places[-1].stop, dtype=np.intp))[0]
        return columns, products + np.diag(self.rows.nominal_precision)

    @cached_property
    def _found(self) -> dict[tuple[Key, ...], Fitted]:
        """Fits by their initial causes, without rows to save memory."""
        return {}

    @cached_property
    def _besides(self) -> dict[tuple[int, tuple[Key, ...]], CandidateEquations]:
        return {}

    def fitted(self, causes: Sequence[Cause]) -> Fitted:
        """The causes at their best values with the best nominal model; kept, because a search asks repeatedly."""
        key = tuple(key_of(cause) for cause in causes)
        if key not in self._found:
            fit = self._fitted(causes)
            self._found[key] = replace(fit, value=np.zeros(0), slopes=np.zeros((0, len(fit.at))))
            return fit
        known = self._found[key]
        rows, _ = self._weighed(known.causes)
        return replace(known, value=rows.value, slopes=rows.slopes)

    def _fitted(self, causes: Sequence[Cause]) -> Fitted:
        """Fit by Gauss-Newton; a step that raises the residual is shortened."""
        best, step = self._weighed(tuple(cause for cause in causes if cause.present.any()))
        for _ in range(MOST_STEPS if best.at else 0):
            tried, further = self._moved(best, step)
            if tried.residual_squares >= best.residual_squares:
                tried, further = self._moved(best, SHORTER * step)
            if tried.residual_squares >= best.residual_squares:
                break
            small = bool(np.all(np.abs(step) < SETTLED * np.sqrt(np.diag(best.covariance))))
            best, step = tried, further
            if small or not best.at or all(cause.effect.linear for cause in best.causes):
                break
        gain, std, motion_nats = self._held(best)
        return replace(best, gain=gain, std=std, motion_nats=motion_nats)

    def _moved(self, fit: Fitted, step: Array) -> tuple[Fitted, Array]:
        moved = list(fit.causes)
        for (k, p), by in zip(fit.at, step.tolist(), strict=True):
            moved[k] = moved[k].moved(p, by)
        return self._weighed(tuple(cause for cause in moved if cause.present.any()))

    def candidates_beside(self, fit: Fitted) -> CandidateEquations:
        """All candidates, with a fit's slopes projected out."""
        return self._weighed_beside(fit, fit.slopes)

    def candidates_beyond_forms(self, fit: Fitted) -> CandidateEquations:
        """All candidates, with the slopes and the other forms of the fit's causes projected out."""
        return self._weighed_beside(fit, self.nuisance(fit))

    def candidates_beyond_acts(self, fit: Fitted, acts: list[Act]) -> CandidateEquations:
        """All candidates, with the slopes, the other forms and further acts projected out."""
        return self._weighed_beside(fit, self.nuisance(fit), acts)

    def nuisance(self, fit: Fitted) -> Array:
        """Slopes and other forms of a fit's causes (rows, k)."""
        others = [self._columns.forms_of(cause) for cause in fit.causes]
        return np.vstack([fit.slopes.T, *others]).T

    def _weighed_beside(self, fit: Fitted, known: Array, acts: Sequence[Act] = ()) -> CandidateEquations:
        key = known.shape[1] + len(acts), tuple(key_of(cause) for cause in fit.causes)
        if key not in self._besides:
            blocks = self._candidates.blocks_of(np.vstack([fit.value, known.T]).T)
            if acts:
                blocks = blocks.beside(self.rows.blocks(acts, self.now.course))
            self._besides[key] = self._beside(blocks)
        return self._besides[key]

    def _beside(self, new: Blocks) -> CandidateEquations:
        """Normal equations of all candidates, with the columns in `new` projected out.

        Products of nominal and candidate columns are made once and reused. `new` holds the residual value first, then
        the known columns.
        """
        m, n = self.rows.nominal.shape[1], new.width - 1
        with_new, among = (
            self._candidates.products_between(new, self.rows.piece),
            new.products(self.rows.piece),
        )
        cross, among_new = with_new[:, :, 1:], among[:, 1:, 1:]
        square = np.block(
            [
                [self._products[:, :m, :m], cross[:, :m], self._products[:, :m, m:]],
                [cross[:, :m].mT, among_new, cross[:, m:].mT],
                [self._products[:, m:, :m], cross[:, m:], self._products[:, m:, m:]],
            ]
        )
        right = np.concatenate([with_new[:, :m, 0], among[:, 1:, 0], with_new[:, m:, 0]], axis=1)
        precision = np.concatenate([self.rows.nominal_precision, np.zeros(n)])
        return CandidateEquations(equations_from_products(square, right, precision), self._columns.settings)

    @cached_property
    def _pieces(self) -> Pieces:
        return pieces_of(self.rows.piece)

    @cached_property
    def _products(self) -> Array:
        """Products (P, m + c, m + c) of the nominal and candidate columns within each piece."""
        return self._candidates.products(self.rows.piece)

    def _weighed(self, causes: tuple[Cause, ...]) -> tuple[Fitted, Array]:
        """The causes at their present values, and the Gauss-Newton step (k,) of their parameters."""
        at = tuple((k, p) for k, cause in enumerate(causes) for p in np.flatnonzero(cause.present).tolist())
        columns = [self._columns.of(cause) for cause in causes]
        value = self.rows.value.copy()
        for of_cause in columns:
            value -= of_cause[0]
        new = np.vstack([*(of_cause[1:] for of_cause in columns), value])
        cross, products = self._nominal.crossed(new.T), new @ new.T
        square = np.block([[self._square, cross[:, :-1]], [cross[:, :-1].T, products[:-1, :-1]]])
        m, free = len(self._square), inverse(square)
        step = free[m:] @ np.concatenate([cross[:, -1], products[:-1, -1]])
        left = float(products[-1, -1] - cross[:, -1] @ self._inverse_square @ cross[:, -1])
        return Fitted(causes, at, new[-1], new[:-1].T, free[m:, m:], left, 0.0, 0.0, 0.0), step

    def _held(self, fit: Fitted) -> tuple[float, float, float]:
        """Evaluate a fit on held-out pieces and in the motion.

        Returns the nats saved on held-out pieces over the nominal model alone, their standard error, and the nats
        saved in sample by the vehicle's motion.
        """
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
        nominal, in_motion = self.moving
        moved, lean = columns[: nominal.places[-1].stop, -2:], taken[:, -2:]
        left = (moved**2).sum(axis=0) - 2.0 * (lean * nominal.crossed(moved)).sum(axis=0)
        left += (lean * (in_motion @ lean)).sum(axis=0)
        return float(gains.sum()), float(np.std(gains) * np.sqrt(len(gains))), 0.5 * float(left[0] - left[1])


def weighing_of(now: Nominal, library: tuple[Effect, ...]) -> Weighing:
    """The weighing by the filters of `now`."""
    rows = regression_of(now.joint, now.theta, now.unheard).with_thrust_scale()
    if now.filtered:
        rows = rows.with_drift_moments(now.course)
    rows = rows.with_witnesses(now.witnesses, now.acts, now.course)
    back = rows.columns(now.acts, now.course).sum(axis=1)
    return Weighing(now, replace(rows, value=rows.value + back), library)


@dataclass(frozen=True)
class FormRemainder:
    """Bound on the nats that a further cause may save by the remainder of a fit's forms."""

    weighing: Weighing
    fit: Fitted

    def overlap(self, cause: Cause) -> float:
        """Nats of the fit's causes that a further cause could share, in the same axes and pieces."""
        course = self.weighing.now.course
        acts = [cause.act(course), *(other.act(course) for other in self.fit.causes)]
        columns = self.weighing.rows.columns(acts, course)[: self._count]
        column, *before = self._taken_out(self._nominal, columns).T
        return self._shared(column, *before)

    def saved_overlap(self, cause: Cause) -> float:
        """Nats saved by other forms of the causes that a further cause could share, with its own share of these forms
        projected out."""
        course = self.weighing.now.course
        column = self.weighing.rows.columns([cause.act(course)], course)[: self._count]
        return self._shared(self._taken_out(self._all, column)[:, 0], self._saved)

    @property
    def _count(self) -> int:
        """Number of the axes' rows, which come before those of the witnesses."""
        return len(self.weighing.rows.dof) - int(np.count_nonzero(self.weighing.rows.dof < 0))

    @cached_property
    def _known(self) -> Array:
        return self.weighing.nuisance(self.fit)[: self._count]

    @cached_property
    def _nominal(self) -> tuple[Array, Array]:
        return self._regressors(0)

    @cached_property
    def _all(self) -> tuple[Array, Array]:
        return self._regressors(self._known.shape[1])

    @cached_property
    def _saved(self) -> Array:
        """The part (rows,) of the residual that other forms absorb."""
        value = self.fit.value[: self._count, None]
        slopes_only = self._regressors(self.fit.slopes.shape[1])
        return (self._taken_out(slopes_only, value) - self._taken_out(self._all, value))[:, 0]

    def _regressors(self, known: int) -> tuple[Array, Array]:
        """The first `known` nuisance columns on the axes' rows, and the inverse square of the nominal columns and
        these."""
        nominal, nominal_square = self.weighing.moving
        more = self._known[:, :known]
        cross = nominal.crossed(more)
        square = np.block([[nominal_square, cross], [cross.T, more.T @ more]])
        return more, inverse(square)

    def _taken_out(self, regressors: tuple[Array, Array], columns: Array) -> Array:
        more, square = regressors
        nominal, m = self.weighing.rows.nominal[: self._count], self.weighing.rows.nominal.shape[1]
        size = square @ np.vstack([self.weighing.moving[0].crossed(columns), more.T @ columns])
        return np.asarray(columns - nominal @ size[:m] - more @ size[m:])

    def _shared(self, own: Array, *before: Array) -> float:
        """Cauchy-Schwarz bound, in nats, of a column's overlap with others, cell by cell."""
        rows = self.weighing.rows
        cell = (rows.piece * len(DOFS) + rows.dof)[: self._count]
        own_power, *others = (np.bincount(cell, column**2) for column in (own, *before))
        both = np.sqrt(own_power * np.sum(others, axis=0)).sum()
        return 0.5 * float(both**2 / max(own_power.sum(), 1e-300))
