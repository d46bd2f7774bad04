"""The feed-forward's gain by a cause: velocity errors before and after."""

from collections.abc import Sequence

import numpy as np

from bridge.arrays import Array
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.filters.nominal import Nominal, quadratic_of
from identify.diagnose.gap.missing import Missing
from identify.diagnose.gap.simulation import EACH, missing_wrench_of, slope_of
from identify.diagnose.result import Gain
from identify.effects.course import runs_at
from identify.estimators.likelihood.axis import DISTURBANCE, TIME_CONSTANT
from identify.statistics import left_of

LEVEL = (0, 1)
"""Surge and sway: the feed-forward axes whose error is a speed."""


def feedforward_gain(
    cause: Cause, others: Sequence[Cause], missing: Missing, now: Nominal, braking: Array
) -> Gain | None:
    """The feed-forward's gain by a cause, with the masses and dampings fitted together with all causes, as `--accept`
    sends them.

    None if the feed-forward can't compensate the cause. The other causes remain, less their part in masses and
    dampings.
    """
    if not cause.effect.feedforward or cause.act(now.course).wrench is None:
        return None
    wrench = missing_wrench_of(others, now.course)
    left = np.column_stack([_beyond_refit(wrench[:, dof], now, dof) for dof in range(6)])
    return feedforward_gain_by(left[::EACH], missing, now, braking)


def feedforward_gain_by(left: Array, missing: Missing, now: Nominal, braking: Array) -> Gain:
    """Velocity errors of the feed-forward alone, by m e' + B e = f.

    f is the disturbance with the missing force before, and with its remainder `left` (n, 6) after, at the times of
    `missing`; B as in `braking_of`.
    """
    before = after = 0.0
    runs = runs_at(missing.time_s, missing.runs_s)
    for dof in LEVEL:
        mass, braking_axis = float(now.course.mass[dof]), braking[:, dof]
        noise = _driven(now, dof, float(np.mean(braking_axis)))
        step_s = now.course.step_s * EACH
        before += _mean_square(missing.wrench[:, dof], mass, braking_axis, step_s, runs) + noise
        after += _mean_square(left[:, dof], mass, braking_axis, step_s, runs) + noise
    return Gain(float(np.sqrt(before)), float(np.sqrt(after)))


def braking_of(causes: Sequence[Cause], now: Nominal) -> Array:
    """Damping (n, 6) of a velocity error along the dive, N s/m and N m s/rad: that of the hull's own drag and the
    slope of causes such as quadratic drag."""
    course = now.course
    slope = slope_of([*now.accepted, *causes], course)[::EACH]
    of_hull = course.damping + 2.0 * quadratic_of(now.joint, now.theta) * np.abs(course.nu[::EACH])
    return np.asarray(np.maximum(of_hull - np.diagonal(slope, axis1=1, axis2=2), 0.0))


def _beyond_refit(force: Array, now: Nominal, dof: int) -> Array:
    course, known = now.course, now.course.recorded
    nu, nu_dot = course.nu[:, dof] * known, course.nu_dot[:, dof] * known
    squared = [np.abs(nu) * nu] if quadratic_of(now.joint, now.theta)[dof] else []
    return left_of(np.column_stack([nu, nu_dot, *squared]), force * known)


def _mean_square(force: Array, mass: float, braking: Array, step_s: float, runs: Sequence[slice]) -> float:
    """Mean square of the error over all runs: at the beginning of each nothing is known of it."""
    errors = [_error(force[run], mass, braking[run], step_s) for run in runs]
    return float(np.mean(np.concatenate(errors) ** 2))


def _error(force: Array, mass: float, braking: Array, step_s: float) -> Array:
    """Solve m e' + B e = f from rest, with f and B (n,) constant over each step."""
    keep = np.exp(-braking / mass * step_s)
    push = np.where(braking > 0, (1.0 - keep) / np.where(braking > 0, braking, 1.0), step_s / mass)
    out, e = np.empty(len(force)), 0.0
    for i, (decay, gained) in enumerate(zip(keep.tolist(), (push * force).tolist(), strict=True)):
        e = decay * e + gained
        out[i] = e
    return out


def _driven(now: Nominal, dof: int, braking: float) -> float:
    """Variance of the velocity under the disturbance alone.

    The integral of its spectrum for a braked body (a = braking over mass) and a disturbance of second order.
    """
    for problem, of_axis in zip(now.joint.problems, now.joint.slices, strict=True):
        if problem.axis.dof == dof and braking > 0:
            theta_axis = now.theta[of_axis]
            a = braking / float(now.course.mass[dof])
            memory_s, rise_s = float(np.exp(theta_axis[TIME_CONSTANT])), problem.rise_s(theta_axis)
            driven = (
                memory_s * (1.0 + a * rise_s) / (a * ((1.0 + a * rise_s) * (1.0 + a * memory_s) - a * rise_s))
            )
            return float(np.exp(theta_axis[DISTURBANCE]) / now.course.mass[dof]) ** 2 * driven
    return 0.0
