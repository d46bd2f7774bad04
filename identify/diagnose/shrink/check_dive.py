"""A further dive, predicted by the models of a dive before and after its causes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bridge.arrays import Array
from bridge.errors import LogError
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.causes.search import Explanation
from identify.diagnose.filters.nominal import Nominal, coefficients, quadratic_of, refitted
from identify.diagnose.filters.regression import mean_indices, regression_of
from identify.diagnose.gap.drift import baseline_of, floors_of
from identify.diagnose.gap.simulation import (
    Simulation,
    beyond_motion_of,
    logarithms,
    simulation_of,
    slope_of,
)
from identify.diagnose.result import Prediction
from identify.diagnose.shrink.held_out import differences, prediction_of, without_seas
from identify.diagnose.shrink.shrink import HORIZON_S, Windows, by_axis
from identify.diagnose.shrink.shrunk import Shrink
from identify.effects.course import Course
from identify.estimators.likelihood.axis import DAMPING, MASS

PASSES = 3
"""Fits of a further dive less the causes: each goes by the speeds of the one before."""


def windows_of(prediction: Prediction) -> Windows:
    """Squared drifts at the ends of the windows, each window a piece of its own."""
    ends = np.flatnonzero(np.diff(prediction.window, append=prediction.window[-1] + 1))
    before, after = (
        ((simulated[ends] - prediction.measured[ends]) / prediction.floor) ** 2
        for simulated in (prediction.before, prediction.after)
    )
    return Windows(before, after, prediction.window[ends])


def with_coefficients(model: Nominal, of: Nominal) -> Array:
    """A fit's theta with the masses and drags of another fit, and the best trims for these."""
    joint, theta = model.joint, model.theta.copy()
    mass, damping = coefficients(of.joint, of.theta)
    quadratic = quadratic_of(of.joint, of.theta)
    for problem, of_axis, at in zip(joint.problems, joint.slices, joint.mass_indices, strict=True):
        dof, of_dof = problem.axis.dof, theta[of_axis]
        if damping[dof] > 0:
            of_dof[MASS] = theta[at] = np.log(mass[dof])
            of_dof[DAMPING] = np.log(damping[dof])
        if problem.damped != "linear" and quadratic[dof] > 0:
            of_dof[problem.quadratic_index] = np.log(quadratic[dof])
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


def _with_hull(course: Course, of: Nominal) -> Course:
    """A course of the hull of another fit."""
    return replace(course, mass=of.course.mass, damping=of.course.damping, quadratic=of.course.quadratic)


def flight_of(now: Nominal, causes: Sequence[Cause], nominal: Nominal, check: Nominal) -> Flight:
    """Simulate the models of a dive on a further dive with filters `check`.

    `nominal` is the model before, `now` with its causes the model after. Masses, drags and causes come from the
    dive, trims and noise levels from the further dive.
    """
    fit = check
    for _ in range(PASSES if causes else 1):
        fit = refitted(check, [cause.act(_with_hull(fit.course, now)) for cause in causes], fit)
    course = _with_hull(fit.course, now)
    nu, wrong = fit.motion.nu, beyond_motion_of(causes, course)
    after = simulation_of(fit, with_coefficients(fit, now), nu, slope=slope_of(causes, course))
    before = simulation_of(check, with_coefficients(check, nominal), nu + wrong)
    return Flight(fit, course, before, after)


def predict(
    explanation: Explanation,
    nominal: Nominal,
    check: Nominal,
    name: str,
    rng: np.random.Generator,
    *,
    is_earlier: bool = False,
) -> Prediction:
    """Predict a further dive with filters `check` by the models of a dive, `nominal` before and `explanation` after.

    Masses, drags and causes come from the dive; trims, noise levels and seas, which change between dives, from the
    further dive. A cause that began within the dive acts in all of a later one, and not in one that `is_earlier`.
    Raises LogError if the further dive is too short.
    """
    flight = flight_of(explanation.now, recurring(explanation.causes, is_earlier), nominal, check)
    before, after = flight.before, flight.after
    floor = floors_of(flight.fit, after, rng)[1]
    length = round(HORIZON_S / after.step_s)
    starts = np.concatenate([np.arange(run.start, run.stop - length - 1, length) for run in after.runs])
    if len(starts) < 2:
        raise LogError(f"{name}: is too short to check a diagnosis on; give a dive of a minute or more")
    gone = [differences(model, starts) for model in (before, after)]
    plainest = baseline_of(nominal.course, nominal.motion.nu)
    return prediction_of(name, (before.time_s, before.nu), starts, gone, plainest, flight.course, floor)


def recurring(causes: Sequence[Cause], is_earlier: bool) -> list[Cause]:
    """The causes that act in all of a further dive."""
    lasting = [cause for cause in without_seas(causes) if not cause.effect.has_ended]
    return [cause.throughout for cause in lasting if not (is_earlier and cause.effect.since_s)]


def checked(prediction: Prediction, rng: np.random.Generator) -> Shrink:
    """The shrink on a check dive."""
    drift = windows_of(prediction)
    return replace(drift.shrink(rng), by_axis=by_axis(drift, prediction))
