"""What the feed-forward on board would gain by knowing of a cause."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from identify.diagnose.cause import Cause
from identify.diagnose.diagnosis import Gain
from identify.diagnose.flown import EACH, slope_of, wrench_of
from identify.diagnose.missing import Missing
from identify.diagnose.nominal import Nominal
from identify.estimators.likelihood_axis import DISTURBANCE, TIME_CONSTANT

Array = NDArray[np.float64]

LEVEL = (0, 1)
"""Surge and sway: of the axes of the feed-forward those whose error is a speed."""


def gain_of(
    cause: Cause, others: Sequence[Cause], missing: Missing, now: Nominal, braking: Array
) -> Gain | None:
    """Of a cause beside others, with the masses and dampings that were fitted together with them, as `--accept` sends
    them; None where the feed-forward can't. What is left then is of the others, less what masses and dampings of their
    own take up of it."""
    if not cause.effect.feedforward or cause.act(now.course).wrench is None:
        return None
    wrench = wrench_of(others, now.course)
    left = np.column_stack([_beyond(wrench[:, dof], now.course, dof) for dof in range(6)])
    return gain_by(left[::EACH], missing, now, braking)


def gain_by(left: Array, missing: Missing, now: Nominal, braking: Array) -> Gain:
    """Velocity errors of the feed-forward alone, through m e' + B e = f: f is what the model before lacks and the
    disturbance, before; after, what is left (n, 6) of it, at the times of `missing`. braking B as `braking_of` has
    it."""
    before = after = 0.0
    for dof in LEVEL:
        mass, own = float(now.course.mass[dof]), braking[:, dof]
        noise = _driven(now, dof, float(np.mean(own)))
        step_s = now.course.step_s * EACH
        before += float(np.mean(_error(missing.wrench[:, dof], mass, own, step_s) ** 2)) + noise
        after += float(np.mean(_error(left[:, dof], mass, own, step_s) ** 2)) + noise
    return Gain(float(np.sqrt(before)), float(np.sqrt(after)))


def braking_of(causes: Sequence[Cause], now: Nominal) -> Array:
    """(n, 6): by how much a velocity that is off is braked along the dive, N s/m and N m s/rad. What errors die out by
    is the vehicle's own: the linear damping, and what causes such as a quadratic drag add to it at that speed."""
    slope = slope_of([*now.holds, *causes], now.course)[::EACH]
    return np.asarray(np.maximum(now.course.damping - np.diagonal(slope, axis1=1, axis2=2), 0.0))


def _beyond(force: Array, course: Course, dof: int) -> Array:
    columns = np.column_stack([course.nu[:, dof], course.nu_dot[:, dof]])
    fitted, *_ = np.linalg.lstsq(columns, force, rcond=None)
    return np.asarray(force - columns @ fitted)


def _error(force: Array, mass: float, braking: Array, step_s: float) -> Array:
    """m e' + B e = f from rest, f and B (n,) held over each step."""
    keep = np.exp(-braking / mass * step_s)
    push = np.where(braking > 0, (1.0 - keep) / np.where(braking > 0, braking, 1.0), step_s / mass)
    out, e = np.empty(len(force)), 0.0
    for i, (one, more) in enumerate(zip(keep.tolist(), (push * force).tolist(), strict=True)):
        e = one * e + more
        out[i] = e
    return out


def _driven(now: Nominal, dof: int, braking: float) -> float:
    """Variance of the velocity that the disturbance alone drives: s^2 / m^2 / (a (a + b))."""
    for problem, place in zip(now.joint.problems, now.joint.places, strict=True):
        if problem.axis.dof == dof and braking > 0:
            own = now.theta[place]
            a = braking / float(now.course.mass[dof])
            b = float(np.exp(-own[TIME_CONSTANT]))
            return float(np.exp(own[DISTURBANCE]) / now.course.mass[dof]) ** 2 / (a * (a + b))
    return 0.0
