"""The shrink on held-out pieces: each piece is simulated by a model that was fitted without it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.causes.evidence import SCARCE, inverse
from identify.diagnose.causes.search import Explanation
from identify.diagnose.filters.nominal import Nominal
from identify.diagnose.filters.regression import Regression, mean_indices, pieces_of, regression_of
from identify.diagnose.gap.drift import Baseline, baseline_of
from identify.diagnose.gap.simulation import (
    EACH,
    Simulation,
    beyond_motion_of,
    logarithms,
    simulation_of,
    slope_of,
    wrench_of,
)
from identify.diagnose.result import Prediction
from identify.diagnose.shrink.shrink import HORIZON_S, Windows, by_axis
from identify.diagnose.shrink.shrunk import Shrink
from identify.effects.course import Course
from identify.estimators.likelihood.joint import JointLikelihood
from identify.threads import side_by_side

FOLDS = 12
"""Distance of held-out pieces of 20 s, in pieces: with more held out at once, whole legs would be gone with all their
information."""

LEAST_LEFT = 0.2
"""Least factor by which a step may change a mass or a drag."""


def held_out_shrink(
    explanation: Explanation, nominal: Nominal, floor: Array, rng: np.random.Generator
) -> tuple[Shrink, Prediction]:
    """Cross-validated shrink, and the velocities: each fold by models fitted on the others.

    Their parameters are one Gauss-Newton step from the whole dive's. floor (6,): of the 5 s drift. Both models know the
    seas of this dive; to a further dive these are noise. The plain baseline is fitted to the whole dive.
    """
    weighing, fit = explanation.weighing, explanation.fit
    course, nu, causes = explanation.now.course, explanation.now.motion.nu, explanation.causes
    fitted_after = HeldOutFit(weighing.rows, explanation.now, fit.slopes, fit.value)
    plain_rows = regression_of(nominal.joint, nominal.theta, nominal.feedback_maybe_unrecorded)
    fitted_before = HeldOutFit(plain_rows, nominal, np.zeros((len(plain_rows.value), 0)), plain_rows.value)
    slope, wrench_before, wrong = (
        slope_of(causes, course),
        wrench_of(causes, course),
        beyond_motion_of(causes, course),
    )
    lasting = without_seas(causes)
    seas, beyond_lasting = wrench_before - wrench_of(lasting, course), beyond_motion_of(lasting, course)
    plainest = baseline_of(course, nu + wrong)

    def held_out(fold: int) -> tuple[tuple[NDArray[Any], ...], tuple[NDArray[Any], ...]]:
        theta, step = fitted_after.without(fold)
        moved = list(causes)
        for (k, p), by in zip(fit.at, step.tolist(), strict=True):
            moved[k] = moved[k].moved(p, by)
        more = wrench_of(moved, course) - wrench_before
        through = nu + wrong - beyond_motion_of(moved, course)
        after = simulation_of(explanation.now, theta, through, more, slope)
        before = simulation_of(nominal, fitted_before.without(fold)[0], nu + beyond_lasting, seas)
        starts, piece = held_windows(after, fold)
        apart = stitched_windows(after, fold)
        return (
            (squared(before, starts, floor), squared(after, starts, floor), piece),
            (apart, differences(before, apart), differences(after, apart)),
        )

    squares, flown = zip(*side_by_side(held_out, range(FOLDS)), strict=True)
    drift = Windows(*(np.concatenate(parts) for parts in zip(*squares, strict=True)))
    starts, *gone = (np.concatenate(parts) for parts in zip(*flown, strict=True))
    order = np.argsort(starts)
    along = course.time_s[::EACH], (nu + beyond_lasting)[::EACH]
    prediction = prediction_of(
        "pieces held out", along, starts[order], [parts[order] for parts in gone], plainest, course, floor
    )
    return replace(drift.shrink(rng), by_axis=by_axis(drift, prediction)), prediction


def stitched_windows(model: Simulation, fold: int) -> NDArray[np.int64]:
    """Starts (w,) of the windows of a fold's pieces, one directly after another."""
    length = round(HORIZON_S / model.step_s)
    starts = np.concatenate([np.arange(run.start, run.stop - length, length) for run in model.runs])
    piece = pieces_of(model.time_s[starts] + 0.5 * HORIZON_S, _runs_s(model))
    return np.asarray(starts[piece % FOLDS == fold])


def _runs_s(model: Simulation) -> Sequence[tuple[float, float]]:
    return model.runs_s or ((float(model.time_s[0]), float(model.time_s[-1])),)


def differences(model: Simulation, starts: NDArray[np.int64]) -> Array:
    """Errors (w, length, 6) of a model at every step of its windows; 0 in axes that are not fitted."""
    every = range(1, round(HORIZON_S / model.step_s) + 1)
    return np.asarray(np.nan_to_num(model.off(starts, every, np.zeros_like(model.nu))))


def prediction_of(
    name: str,
    along: tuple[Array, Array],
    starts: NDArray[np.int64],
    gone: Sequence[Array],
    plainest: Baseline,
    course: Course,
    floor: Array,
) -> Prediction:
    """The velocities of windows from `starts` (w,): measured, and predicted.

    along: times (n,) and measured velocities (n, 6). gone (w, length, 6): errors of the models before and after.
    """
    length = gone[0].shape[1]
    at = (starts[:, None] + np.arange(1, length + 1)).ravel()
    time_s, nu = along
    measured = nu[at]
    before, after = (measured + part.reshape(-1, 6) for part in gone)
    baseline = plainest.flown(course, nu, starts, length).reshape(-1, 6)
    window = np.repeat(np.arange(len(starts)), length)
    return Prediction(name, time_s[at], measured, before, after, baseline, window, floor)


def without_seas(causes: Sequence[Cause]) -> list[Cause]:
    """The causes whose forces recur on a further dive; a sea's phase is unpredictable."""
    return [cause for cause in causes if not cause.effect.sea]


@dataclass(frozen=True)
class HeldOutFit:
    """A regression's normal equations by piece, at a fit, for refits without some of them."""

    rows: Regression
    model: Nominal
    slopes: Array
    value: Array

    @cached_property
    def _products(self) -> Array:
        """Products (F, k + 1, k + 1) of the columns within each fold, the value last.

        A rise of a nominal parameter adds its column to the innovations; a missing force subtracts its own.
        """
        nominal = self.rows.nuisance
        columns = nominal.with_columns(nominal.blocks_of(np.column_stack([self.slopes, self.value])))
        products = columns.products(self.rows.piece)
        sign = np.where(np.arange(columns.width) < nominal.width, -1.0, 1.0)
        by_fold = np.array([products[k::FOLDS].sum(axis=0) for k in range(FOLDS)])
        return np.asarray(by_fold * np.outer(sign, sign))

    def without(self, fold: int) -> tuple[Array, Array]:
        """The fit's theta and the step of the slopes' parameters, with a fold left out.

        The step is from the regression's own optimum for the whole dive, which is the fit's but for what the filters
        weigh otherwise, as noise of the commands. If the fold holds nearly all information on a parameter, as the only
        leg that dives would, noise would move the parameter; SCARCE holds it in place.
        """
        joint, theta = self.model.joint, self.model.theta
        kept = sorted({*joint.mass_indices, *mean_indices(joint)})
        whole = self._products.sum(axis=0)
        left = whole - self._products[fold]
        known = np.diag(np.concatenate([self.rows.nominal_precision, np.zeros(self.slopes.shape[1])]))
        pull = np.zeros(len(known))
        pull[: len(kept)] = (joint.prior_precision * (joint.prior_mean - theta))[kept]
        optimum = inverse(whole[:-1, :-1] + known) @ (whole[:-1, -1] + pull)
        beyond = left[:-1, -1] + pull - (left[:-1, :-1] + known) @ optimum
        scarce = SCARCE * np.diag(np.diag(whole)[:-1])
        step = inverse(left[:-1, :-1] + known + scarce) @ beyond
        theta = _moved(theta, joint, kept, step[: len(kept)])
        return theta, step[self.rows.nuisance.width :]


def _moved(theta: Array, joint: JointLikelihood, indices: Sequence[int], step: Array) -> Array:
    """Move theta by a step.

    Forces are linear in masses and drags, not in their logarithms, so the step is linear in these.
    """
    out = theta.copy()
    for at, by in zip(indices, step.tolist(), strict=True):
        out[at] += np.log(max(1.0 + by, LEAST_LEFT)) if at in logarithms(joint) else by
    return out


def held_windows(model: Simulation, fold: int) -> tuple[NDArray[np.int64], NDArray[np.intp]]:
    """Starts (w,) of the windows within the pieces of a fold, a second apart, and their pieces."""
    length = round(HORIZON_S / model.step_s)
    every = max(round(1.0 / model.step_s), 1)
    starts = np.concatenate([np.arange(run.start, run.stop - length - 1, every) for run in model.runs])
    piece = pieces_of(model.time_s, _runs_s(model))
    inside = (piece[starts] == piece[starts + length]) & (piece[starts] % FOLDS == fold)
    return starts[inside], piece[starts[inside]]


def squared(model: Simulation, starts: NDArray[np.int64], floor: Array) -> Array:
    """Squares (w, 6) of the 5 s drift, in floors; NaN in axes that are not fitted."""
    off = model.off(starts, [round(HORIZON_S / model.step_s)], np.zeros_like(model.nu))[:, 0]
    return np.asarray((off / floor) ** 2)
