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
from functools import cached_property, lru_cache, partial, reduce

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import DOFS
from identify.diagnose.causes.candidates import Cause, Setting, other_forms, other_variants, settings_of
from identify.diagnose.causes.evidence import (
    FOLDS,
    SCARCE,
    Blocks,
    NormalEquations,
    Pieces,
    equations_beyond,
    inverse,
    pieces_of,
    products_of,
    projected_out,
)
from identify.diagnose.filters.nominal import Nominal, quadratic_of
from identify.diagnose.filters.regression import Regression, regression_of
from identify.effects.course import Course
from identify.effects.effect import Act, Effect
from identify.effects.hydrodynamics import QUADRATIC_DRAG
from identify.threads import side_by_side

Key = tuple[Effect, bytes]

TOGETHER = 8
"""Candidates whose acts are held at a time: an act of a long dive takes a megabyte, and those of all a processor's
cache many times over."""

KEPT = 32
"""Number of causes whose columns are kept: those of a long dive take a megabyte per cause."""

MOST_STEPS = 8

SETTLED = 0.1

SHORTER = 0.3

SEARCHED = (0.04, 0.02, 0.01, 0.005)
"""Shares of a parameter by which it is moved where no slope leads to a better value."""


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
        every = self._tried[1]
        some = [every[first : first + TOGETHER] for first in range(0, max(len(every), 1), TOGETHER)]
        return Blocks.joined(side_by_side(self._blocks, some))

    @cached_property
    def _tried(self) -> tuple[tuple[Setting, ...], list[Cause]]:
        return settings_of(self.library, self.course)

    def _blocks(self, causes: Sequence[Cause]) -> Blocks:
        return self.rows.blocks([cause.act(self.course) for cause in causes], self.course)

    def of(self, cause: Cause) -> Array:
        """Columns (1 + k, rows): a cause's column, and its slopes by each parameter present."""
        if cause.effect.linear:
            return self._of_linear(cause)
        return self._last(*key_of(cause))

    def column(self, cause: Cause) -> Array:
        """Column (rows,) of a cause; without slopes for an effect that is searched where no slope leads."""
        if cause.effect.steep:
            return self.rows.columns([cause.act(self.course)], self.course)[:, 0]
        return np.asarray(self.of(cause)[0])

    def forms_of(self, cause: Cause) -> Blocks:
        """Columns of a cause's other forms."""
        key = key_of(cause)
        if key not in self._other:
            forms = [*other_forms(self.course, cause), *other_variants(self.course, cause, self.library)]
            self._other[key] = self.rows.blocks(forms, self.course)
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
            (setting,), causes = settings_of((effect,), self.course)
            tried = self._blocks(causes).dense()
        return tried.T / np.diag(setting.steps)[:, None]

    @cached_property
    def _other(self) -> dict[Key, Blocks]:
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
    the vehicle's motion alone; unsteady_nats: those that steady pushes in each degree of freedom do not save.
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
    unsteady_nats: float


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
    def hull_drags(self) -> tuple[Cause, ...]:
        """The quadratic drag of the hull's own model, by degree of freedom: no exacter in its form than a cause."""
        quadratic = quadratic_of(self.now.joint, self.now.theta)
        return tuple(Cause(QUADRATIC_DRAG, values) for values in np.diag(quadratic) if values.any())

    @cached_property
    def _columns(self) -> CandidateColumns:
        """Candidate columns."""
        return CandidateColumns(self.rows, self.now.course, self.library)

    @cached_property
    def _by_piece(self) -> Array:
        """Products (P, m, m) of the nominal columns within each piece, each with a part of their prior precision."""
        products = self.rows.nuisance.products(self.rows.piece)
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
        columns = self.rows.nuisance.first(len(self.rows.axes))
        return columns, columns.square() + np.diag(self.rows.nominal_precision)

    @cached_property
    def _fits(self) -> dict[tuple[Key, ...], Fitted]:
        """Fits by their initial causes, without rows to save memory."""
        return {}

    @cached_property
    def _equations(self) -> dict[tuple[int, tuple[Key, ...]], CandidateEquations]:
        return {}

    def fitted(self, causes: Sequence[Cause]) -> Fitted:
        """The causes at their best values with the best nominal model; kept, because a search asks repeatedly."""
        key = tuple(key_of(cause) for cause in causes)
        if key not in self._fits:
            fit = self._fitted(causes)
            self._fits[key] = replace(fit, value=np.zeros(0), slopes=np.zeros((0, len(fit.at))))
            return fit
        known = self._fits[key]
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
        best = self._searched(best)
        gain, std, lean = self._held(best)
        motion_nats, unsteady_nats = self._in_motion(best, lean)
        return replace(best, gain=gain, std=std, motion_nats=motion_nats, unsteady_nats=unsteady_nats)

    def _searched(self, fit: Fitted) -> Fitted:
        """The fit with each parameter on which the motion depends in steps, where no slope leads, at the best value
        nearby."""
        for k, p in fit.at:
            if fit.causes[k].effect.steep:
                for share in (side * share for share in SEARCHED for side in (-1.0, 1.0)):
                    by = share * float(fit.causes[k].values[p])
                    moved = (*fit.causes[:k], fit.causes[k].moved(p, by), *fit.causes[k + 1 :])
                    if self.residual_squares(moved) < fit.residual_squares:
                        fit, _ = self._weighed(moved)
        return fit

    def _moved(self, fit: Fitted, step: Array) -> tuple[Fitted, Array]:
        moved = list(fit.causes)
        for (k, p), by in zip(fit.at, step.tolist(), strict=True):
            moved[k] = moved[k].moved(p, by)
        return self._weighed(tuple(cause for cause in moved if cause.present.any()))

    def candidates_with_fit(self, fit: Fitted) -> CandidateEquations:
        """All candidates, with a fit's slopes projected out."""
        return self._kept_equations(fit, Blocks.nothing(self.rows.nuisance))

    def candidates_beyond_forms(self, fit: Fitted, acts: Sequence[Act] = ()) -> CandidateEquations:
        """All candidates, with the slopes and the other forms of the fit's causes, and further acts, projected
        out."""
        forms = self.forms_of(fit)
        return self._kept_equations(
            fit, forms.with_columns(self.rows.blocks(acts, self.now.course)) if acts else forms
        )

    def forms_of(self, fit: Fitted) -> Blocks:
        """Other forms of a fit's causes and of the hull's own drag."""
        forms = [self._columns.forms_of(cause) for cause in (*self.hull_drags, *fit.causes)]
        return reduce(Blocks.with_columns, forms, Blocks.nothing(self.rows.nuisance))

    def _kept_equations(self, fit: Fitted, more: Blocks) -> CandidateEquations:
        key = more.width, tuple(key_of(cause) for cause in fit.causes)
        if key not in self._equations:
            nuisance = self.rows.nuisance.blocks_of(np.column_stack([fit.value, fit.slopes]))
            self._equations[key] = self._equations_beyond(nuisance.with_columns(more))
        return self._equations[key]

    def _equations_beyond(self, new: Blocks) -> CandidateEquations:
        """Normal equations of all candidates, with the columns in `new` projected out beyond the nominal ones.

        `new` holds the residual value first, then the known columns. Of nominal and candidate columns, products are
        made once.
        """
        piece, candidates = self.rows.piece, self._columns.candidates
        by_new = self.rows.nuisance.products_between(new, piece)
        with_new = by_new, self._inverse_square @ by_new.sum(axis=0)
        full = new.products(piece)
        among = projected_out(full, self._by_piece, with_new, with_new)
        cross = projected_out(
            new.products_between(candidates, piece), self._by_piece, with_new, self._with_candidates
        )
        known, value = among[:, 1:, 1:], among[:, 1:, :1]
        free = inverse(known.sum(axis=0), np.einsum("pii->i", full)[1:])
        by_known = cross[:, 1:], free @ cross[:, 1:].sum(axis=0)
        by_value = value, free @ value.sum(axis=0)
        squares, beyond_nominal = self._candidate_products
        equations = equations_beyond(
            squares,
            projected_out(beyond_nominal, known, by_known, by_known),
            projected_out(cross[:, :1].mT, known, by_known, by_value)[:, :, 0],
        )
        return CandidateEquations(equations, self._columns.settings)

    @cached_property
    def _with_candidates(self) -> tuple[Array, Array]:
        """Products (P, m, c) of the nominal with the candidate columns within each piece, and their sizes (m, c)."""
        products = self.rows.nuisance.products_between(self._columns.candidates, self.rows.piece)
        return products, self._inverse_square @ products.sum(axis=0)

    @cached_property
    def _candidate_products(self) -> tuple[Array, Array]:
        """Squares (c,) of the candidate columns, and their products (P, c, c) within each piece, with the nominal
        columns projected out."""
        full = self._columns.candidates.products(self.rows.piece)
        beyond = projected_out(full, self._by_piece, self._with_candidates, self._with_candidates)
        return np.einsum("pii->i", full), beyond

    @cached_property
    def _pieces(self) -> Pieces:
        return pieces_of(self.rows.piece)

    def residual_squares(self, causes: Sequence[Cause]) -> float:
        """The sum of squares left with the causes at their present values and the best nominal model."""
        value = self.rows.value - sum(self._columns.column(cause) for cause in causes)
        cross = self.rows.nuisance.crossed(value[:, None])[:, 0]
        return float(value @ value - cross @ self._inverse_square @ cross)

    def _weighed(self, causes: tuple[Cause, ...]) -> tuple[Fitted, Array]:
        """The causes at their present values, and the Gauss-Newton step (k,) of their parameters."""
        at = tuple((k, p) for k, cause in enumerate(causes) for p in np.flatnonzero(cause.present).tolist())
        columns = [self._columns.of(cause) for cause in causes]
        value = self.rows.value.copy()
        for of_cause in columns:
            value -= of_cause[0]
        new = np.vstack([*(of_cause[1:] for of_cause in columns), value])
        cross, products = self.rows.nuisance.crossed(new.T), new @ new.T
        square = np.block([[self._square, cross[:, :-1]], [cross[:, :-1].T, products[:-1, :-1]]])
        m, free = len(self._square), inverse(square)
        step = free[m:] @ np.concatenate([cross[:, -1], products[:-1, -1]])
        left = float(products[-1, -1] - cross[:, -1] @ self._inverse_square @ cross[:, -1])
        return Fitted(causes, at, new[-1], new[:-1].T, free[m:, m:], left, 0.0, 0.0, 0.0, 0.0), step

    def _held(self, fit: Fitted) -> tuple[float, float, Array]:
        """Nats saved by a fit on held-out pieces over the nominal model alone, their standard error, and the sizes
        (m, 2) of the nominal columns without and with the fit."""
        columns = np.vstack([fit.slopes.T, self.rows.value, fit.value]).T
        cross = self.rows.nuisance.products_with(columns, self.rows.piece)
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
        return float(gains.sum()), float(np.std(gains) * np.sqrt(len(gains))), taken[:, -2:]

    def _in_motion(self, fit: Fitted, lean: Array) -> tuple[float, float]:
        """Nats saved in sample by the vehicle's motion, and those of them that steady pushes do not save; lean (m, 2):
        sizes of the nominal columns without and with the fit."""
        nominal, square = self.moving
        steady, by_nominal, free = self._steady
        end = nominal.slices[-1].stop
        moved = np.column_stack([self.rows.value[:end], fit.value[:end]])
        left = (moved**2).sum(axis=0) - 2.0 * (lean * nominal.crossed(moved)).sum(axis=0)
        left += (lean * (square @ lean)).sum(axis=0)
        pushed = steady.crossed(moved) - by_nominal @ lean
        unsteady = left - (pushed * (free @ pushed)).sum(axis=0)
        return 0.5 * float(left[0] - left[1]), 0.5 * float(unsteady[0] - unsteady[1])

    @cached_property
    def _steady(self) -> tuple[Blocks, Array, Array]:
        """Columns of a steady push in each degree of freedom on the axes' rows, their products (s, m) with the nominal
        columns, and the inverse (s, s) of their square."""
        count = len(self.now.course.time_s)
        pushes = [Act(wrench=np.tile(unit, (count, 1))) for unit in np.eye(len(DOFS))]
        columns = self.rows.blocks(pushes, self.now.course).first(len(self.rows.axes))
        return columns, columns.crossed(self.moving[0].dense()), np.asarray(np.linalg.pinv(columns.square()))


def weighing_of(now: Nominal, library: tuple[Effect, ...]) -> Weighing:
    """The weighing by the filters of `now`."""
    return Weighing(now, rows_of(now), library)


def rows_of(now: Nominal) -> Regression:
    """The regression of the filters of `now`, before any effect was removed."""
    rows = regression_of(now.joint, now.theta, now.feedback_maybe_unrecorded).with_thrust_scale()
    if now.filtered:
        rows = rows.with_drift_moments(now.course)
    rows = rows.with_deviation(now.course)
    rows = rows.with_witnesses(now.witnesses, now.acts, now.course)
    removed = rows.blocks(now.acts, now.course).times(np.ones((len(now.acts), 1)))
    return replace(rows, value=rows.value + removed[:, 0])
