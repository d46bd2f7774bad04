"""How far the gap shrinks: on held-out pieces, on a check dive, and whether the check dive contradicts the causes.

Every 5 s the simulation restarts from the measured velocity and then uses only recorded thrust and attitude, so the
shrink can be recomputed from these velocities alone.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.errors import LogError
from bridge.vehicle.coefficients import DOFS
from identify.diagnose.candidates import Cause
from identify.diagnose.drift import Baseline, baseline_of, floors_of
from identify.diagnose.evidence import SCARCE, inverse
from identify.diagnose.nominal import Nominal, coefficients, refitted
from identify.diagnose.regression import Regression, mean_indices, pieces_of, regression_of
from identify.diagnose.result import Prediction
from identify.diagnose.search import Explanation
from identify.diagnose.shrunk import AxisShrink, Shrink
from identify.diagnose.simulation import (
    EACH,
    Simulation,
    beyond_motion_of,
    logarithms,
    simulation_of,
    slope_of,
    wrench_of,
)
from identify.effects.course import Course
from identify.estimators.likelihood_axis import DAMPING, MASS
from identify.estimators.likelihood_joint import JointLikelihood
from identify.threads import side_by_side
from identify.words import fixed, significant

HORIZON_S = 5.0
FOLDS = 12
"""Distance of held-out pieces of 20 s, in pieces: with more held out at once, whole legs would be gone with all their
information."""

PASSES = 3
"""Fits of a further dive less the causes: each goes by the speeds of the one before."""

LEAST_LEFT = 0.2
"""Least factor by which a step may change a mass or a damping."""

RESAMPLED, CONFIDENCE = 400, 0.9
LEAST_GAP = 0.1
"""Drift above the floor that leaves a gap to shrink; and the least change of drift in a degree of freedom that counts
as closing one."""

CHANCE = 0.2
"""Chance deviation of a five-minute dive's drift from its floor: two standard errors of an rms over some sixty windows,
and the floor's own uncertainty."""

SYMBOLS = "uvwpqr"
UNITS = ("m/s",) * 3 + ("rad/s",) * 3

LEAST_PART = 0.5
"""Share of the predicted shrink that a check dive must show. An inexact form closes less in other flight; less than
half leaves more than it closes."""

LEAST_SAID = 0.005
"""Least share that counts as more than none."""


@dataclass(frozen=True)
class Windows:
    """Squares of the 5 s drift before and after (w, 6), in floors, and the piece (w,) of each window."""

    before: Array
    after: Array
    piece: NDArray[np.intp]

    def shrink(self, rng: np.random.Generator) -> Shrink:
        """Compute the shrink, with a 95 % interval by a bootstrap over pieces (Efron and Tibshirani 1993, section
        8.5)."""
        pieces = np.unique(self.piece)
        sums = np.stack(
            [
                np.stack([drift[self.piece == piece].sum(axis=0) for piece in pieces])
                for drift in (self.before, self.after)
            ]
        )
        counts = np.array([np.count_nonzero(self.piece == piece) for piece in pieces])
        all_axes = _by_axis(sums, counts, np.arange(len(pieces)))
        closes = np.abs(all_axes[0] - all_axes[1]) > LEAST_GAP
        again = (
            _by_axis(sums, counts, rng.integers(len(pieces), size=len(pieces))) for _ in range(RESAMPLED)
        )
        drawn = np.array([value for axes in again if np.isfinite(value := closed(*_totals(axes, closes)))])
        before, after, floor = _totals(all_axes, closes)
        value = closed(before, after, floor)
        if np.isnan(value) or len(drawn) < CONFIDENCE * RESAMPLED:
            return Shrink(before, after, np.nan, np.nan, np.nan, floor)
        if _overstated(after, floor):
            return Shrink(before, after, value, np.nan, np.nan, floor)
        low, high = np.quantile(drawn, [0.025, 0.975]).tolist()
        return Shrink(before, after, value, low, high, floor)


def overstated_note(shrink: Shrink) -> tuple[str, ...]:
    """A sentence on drift significantly below its floor; empty otherwise."""
    if not _overstated(shrink.after, shrink.floor):
        return ()
    return (
        f"With the causes in, the model drifts {shrink.after:.2f} times as far as noise makes it on pieces held out: "
        "what this dive's filters take for noise, as of velocities that were smoothed on board, is overstated, and "
        "what the causes close counts as 100 % at most, with no interval.",
    )


def _overstated(after: float, floor: float) -> bool:
    """Whether the floor is too high for an interval of a shrink near 100 %."""
    return after < floor - CHANCE


def floor_of(after: Array, closes: NDArray[np.bool_]) -> Array:
    """This dive's floor (6,) by degree of freedom.

    It is 1 in degrees of freedom that the causes close. In others the drift itself, within chance, is this dive's
    floor: before and after deviate from 1 alike there, and only noise explains it.
    """
    return np.asarray(np.where(closes, 1.0, np.clip(after, 1.0 - CHANCE, 1.0 + CHANCE)))


def _by_axis(sums: Array, counts: NDArray[np.intp], drawn: NDArray[np.intp]) -> Array:
    """Rms drifts (2, 6) before and after."""
    return np.asarray(np.sqrt(sums[:, drawn].sum(axis=1) / counts[drawn].sum()))


def _totals(axes: Array, closes: NDArray[np.bool_]) -> tuple[float, float, float]:
    """Rms over degrees of freedom of the drifts before and after (2, 6), and of the floor."""
    fitted = np.isfinite(axes[1])
    three = np.stack([*axes, floor_of(axes[1], closes)])[:, fitted]
    before, after, floor = np.sqrt(np.mean(three**2, axis=1)).tolist()
    return before, after, floor


def by_axis(drift: Windows, flown: Prediction) -> tuple[AxisShrink, ...]:
    """The shrink of each fitted degree of freedom, with the errors of the simulated velocities."""
    rms = np.sqrt(np.stack([np.mean(squares, axis=0) for squares in (drift.before, drift.after)]))
    spread = np.std(flown.measured, axis=0)
    errors = [
        np.sqrt(np.mean((simulated - flown.measured) ** 2, axis=0)) / np.where(spread > 0, spread, np.nan)
        for simulated in (flown.before, flown.after, flown.baseline)
    ]
    noise = floor_of(rms[1], np.abs(rms[0] - rms[1]) > LEAST_GAP)
    out = []
    for dof in np.flatnonzero(np.isfinite(flown.floor)).tolist():
        before, after = rms[:, dof].tolist()
        floor, value = float(flown.floor[dof]), closed(before, after, float(noise[dof]))
        nrmse = [float(squares[dof]) for squares in errors]
        out.append(AxisShrink(DOFS[dof], before * floor, after * floor, floor, value, *nrmse))
    return tuple(out)


def closed(before: float, after: float, floor: float = 1.0) -> float:
    """Share of the closable gap that closes; NaN without a gap.

    No model drifts by less than noise, so a drift below the floor is chance, or an overstated floor.
    """
    if before - floor <= LEAST_GAP:
        return float("nan")
    return (before - max(after, floor)) / (before - floor)


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
    prediction = _flown(
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


def _flown(
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

    Forces are linear in masses and dampings, not in their logarithms, so the step is linear in these.
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


def windows_of(prediction: Prediction) -> Windows:
    """Squared drifts at the ends of the windows, each window a piece of its own."""
    ends = np.flatnonzero(np.diff(prediction.window, append=prediction.window[-1] + 1))
    before, after = (
        ((simulated[ends] - prediction.measured[ends]) / prediction.floor) ** 2
        for simulated in (prediction.before, prediction.after)
    )
    return Windows(before, after, prediction.window[ends])


def csv_of(prediction: Prediction) -> str:
    """The prediction as CSV: header lines that begin with #, then a line per instant."""
    fitted = [dof for dof in range(6) if np.isfinite(prediction.floor[dof])]
    floors = ", ".join(f"{DOFS[dof]} {prediction.floor[dof]:.6g} {UNITS[dof]}" for dof in fitted)
    lines = [
        f"# {prediction.dive}: velocities in body axes (x forward, y right, z down), m/s and rad/s, open loop from the "
        f"measured velocity, started anew every {HORIZON_S:g} s (window).",
        "# measured: smoothed; before: the nominal model; after: with the causes in; baseline: least squares with "
        "linear and quadratic drag and a delay.",
        f"# floor, rms after {HORIZON_S:g} s by noise alone: {floors}.",
        "# drift: before, or after, less measured in the last line of each window, rms over windows, over the floor, "
        f"and the rms of that over {len(fitted)} degrees of freedom; shrink = (before - after) / (before - floor), "
        f"after no less than floor, and no number where before is no more than {LEAST_GAP:g} over floor: there is too "
        "little to shrink.",
        f"# floor of this dive: the rms over degrees of freedom of 1 where before and after differ by more than "
        f"{LEAST_GAP:g}, and else, for there no cause closes anything and noise is all that there is, of after within "
        f"{1 - CHANCE:g} and {1 + CHANCE:g}.",
    ]
    ways = {
        "measured": prediction.measured,
        "before": prediction.before,
        "after": prediction.after,
        "baseline": prediction.baseline,
    }
    names = [f"{what}_{SYMBOLS[dof]}" for what in ways for dof in fitted]
    lines.append(",".join(["time_s", "window", *names]))
    values = np.column_stack([way[:, fitted] for way in ways.values()])
    for at_s, window, row in zip(prediction.time_s, prediction.window, values, strict=True):
        lines.append(f"{at_s:.3f},{window}," + ",".join(f"{value:.6f}" for value in row))
    return "\n".join(lines) + "\n"


def with_coefficients(model: Nominal, of: Nominal) -> Array:
    """A fit's theta with the masses and dampings of another fit, and the best trims for these."""
    joint, theta = model.joint, model.theta.copy()
    mass, damping = coefficients(of.joint, of.theta)
    for problem, of_axis, at in zip(joint.problems, joint.slices, joint.mass_indices, strict=True):
        dof = problem.axis.dof
        if damping[dof] > 0:
            theta[[of_axis.start + MASS, at]] = np.log(mass[dof])
            theta[of_axis.start + DAMPING] = np.log(damping[dof])
    rows = regression_of(joint, theta, model.feedback_maybe_unrecorded)
    kept = sorted({*joint.mass_indices, *mean_indices(joint)})
    trims = [at for at in kept if at not in logarithms(joint)]
    columns = -rows.nuisance.some([kept.index(at) for at in trims])
    known = joint.prior_precision[trims]
    right = columns.T @ rows.value + known * (joint.prior_mean - theta)[trims]
    theta[trims] += np.linalg.solve(columns.T @ columns + np.diag(known), right)
    return theta


@dataclass(frozen=True)
class Flight:
    """Models of a dive, simulated along a further dive.

    before: over ground; after: through the water, by `fit`, that of the further dive less the causes.
    """

    fit: Nominal
    course: Course
    before: Simulation
    after: Simulation


def flight_of(now: Nominal, causes: Sequence[Cause], nominal: Nominal, check: Nominal) -> Flight:
    """Simulate the models of a dive on a further dive with filters `check`.

    `nominal` is the model before, `now` with its causes the model after. Masses, dampings and causes come from the
    dive, trims and noise levels from the further dive.
    """
    mass, damping, fit = now.course.mass, now.course.damping, check
    for _ in range(PASSES if causes else 1):
        course = replace(fit.course, mass=mass, damping=damping)
        fit = refitted(check, [cause.act(course) for cause in causes], fit)
    course = replace(fit.course, mass=mass, damping=damping)
    nu, wrong = fit.motion.nu, beyond_motion_of(causes, course)
    after = simulation_of(fit, with_coefficients(fit, now), nu, slope=slope_of(causes, course))
    before = simulation_of(check, with_coefficients(check, nominal), nu + wrong)
    return Flight(fit, course, before, after)


def predict(
    explanation: Explanation, nominal: Nominal, check: Nominal, name: str, rng: np.random.Generator
) -> Prediction:
    """Predict a further dive with filters `check` by the models of a dive, `nominal` before and `explanation` after.

    Masses, dampings and causes come from the dive; trims, noise levels and seas, which change between dives, from the
    further dive. Raises LogError if the further dive is too short.
    """
    flight = flight_of(explanation.now, without_seas(explanation.causes), nominal, check)
    before, after = flight.before, flight.after
    floor = floors_of(flight.fit, after, rng)[1]
    length = round(HORIZON_S / after.step_s)
    starts = np.concatenate([np.arange(run.start, run.stop - length - 1, length) for run in after.runs])
    if len(starts) < 2:
        raise LogError(f"{name}: is too short to check a diagnosis on; give a dive of a minute or more")
    gone = [differences(model, starts) for model in (before, after)]
    plainest = baseline_of(nominal.course, nominal.motion.nu)
    return _flown(name, (before.time_s, before.nu), starts, gone, plainest, flight.course, floor)


def checked(prediction: Prediction, rng: np.random.Generator) -> Shrink:
    """The shrink on a check dive."""
    drift = windows_of(prediction)
    return replace(drift.shrink(rng), by_axis=by_axis(drift, prediction))


def contradicted(foretold: Shrink | None, measured: Shrink | None) -> bool:
    """Whether a check dive contradicts the causes.

    It does if the 95 % intervals of the two shrinks are disjoint and it closes less than `LEAST_PART` of the
    prediction; or if there is no gap to close, but the model with the causes drifts further than without, and than
    noise.
    """
    if foretold is None or measured is None:
        return False
    if not math.isfinite(measured.value):
        return measured.after > max(measured.floor + CHANCE, measured.before + LEAST_GAP)
    apart = measured.high95 < foretold.low95
    return bool(apart and measured.value < LEAST_PART * foretold.value)


def shown(foretold: Shrink | None, measured: Shrink | None) -> bool:
    """Whether a check dive shows the causes at all: it does not where it contradicts them, and the model drifts further
    with them than without. So it is on a dive from before they set in."""
    return measured is None or not (contradicted(foretold, measured) and measured.after > measured.before)


def contradiction_clause(foretold: Shrink | None, measured: Shrink | None, conjunction: str = "but") -> str:
    """Clause for a verdict that a check dive contradicts, begun by a conjunction; "" otherwise."""
    if foretold is None or measured is None or not contradicted(foretold, measured):
        return ""
    if not shown(foretold, measured):
        return f", {conjunction} the check dive shows no such effect ({_both_drifts(measured)})"
    return f", {conjunction} the check dive does not bear that out ({_both_shrinks(foretold, measured)})"


def contradiction_note(foretold: Shrink | None, measured: Shrink | None) -> tuple[str, ...]:
    """The contradiction as a sentence, with advice; empty otherwise."""
    if foretold is None or measured is None or not contradicted(foretold, measured):
        return ()
    if not shown(foretold, measured):
        return (
            f"The check dive shows no such effect: {_both_drifts(measured)}. Either it was dived before the causes set "
            "in, or they are no more than a guess. Dive again as the diagnosed dive was flown, check on that, and "
            "send nothing of them to the vehicle before.",
        )
    return (
        f"The check dive does not bear the causes out: {_both_shrinks(foretold, measured)}. "
        "Look whether it was dived with the same vehicle and configuration and nothing was changed in between; if so, "
        "take the causes for no more than a guess, send nothing of them to the vehicle, and dive again.",
    )


def _both_drifts(measured: Shrink) -> str:
    """The drift of a check dive that does not show the causes."""
    without, with_them = (
        significant(drift / measured.floor, 2) for drift in (measured.before, measured.after)
    )
    return f"its 5 s drift is {without} times what noise makes it without the causes, and {with_them} times with them"


def _both_shrinks(foretold: Shrink, measured: Shrink) -> str:
    """How much of a drift was foretold to close, and how much of it does."""
    share = fixed(100 * measured.value, 0)
    closes = f"{share} % does" if measured.value >= LEAST_SAID else "none does"
    return f"{fixed(100 * foretold.value, 0)} % of the drift beyond noise was foretold to close there, and {closes}"
