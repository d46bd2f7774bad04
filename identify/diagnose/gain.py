"""What the feed-forward on board would gain by knowing of a cause."""

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from identify.diagnose.cause import Cause
from identify.diagnose.diagnosis import Gain
from identify.diagnose.flown import EACH
from identify.diagnose.missing import Missing
from identify.diagnose.nominal import Nominal
from identify.estimators.likelihood_axis import DISTURBANCE, TIME_CONSTANT

Array = NDArray[np.float64]

LEVEL = (0, 1)
"""Surge and sway: of the axes of the feed-forward those whose error is a speed."""


def gain_of(cause: Cause, missing: Missing, now: Nominal) -> Gain | None:
    """Of a cause, beyond what masses and dampings of their own make up for; None where the feed-forward can't."""
    wrench = cause.act(now.course).wrench
    if not cause.effect.feedforward or wrench is None:
        return None
    return gain_by(
        np.column_stack([_beyond(wrench[:, dof], now.course, dof) for dof in range(6)]), missing, now
    )


def gain_by(wrench: Array, missing: Missing, now: Nominal) -> Gain:
    """Velocity errors of the feed-forward alone, through m e' + D e = f: f is what the nominal model lacks and the
    disturbance, before; after, less a wrench (n, 6) along the course that the feed-forward makes up for."""
    before = after = 0.0
    for dof in LEVEL:
        noise = _driven(now, dof)
        mass, damping = float(now.course.mass[dof]), float(now.course.damping[dof])
        step_s = now.course.step_s * EACH
        lacking = missing.wrench[:, dof]
        before += float(np.mean(_error(lacking, mass, damping, step_s) ** 2)) + noise
        left = lacking - wrench[::EACH, dof]
        after += float(np.mean(_error(left, mass, damping, step_s) ** 2)) + noise
    return Gain(float(np.sqrt(before)), float(np.sqrt(after)))


def _beyond(force: Array, course: Course, dof: int) -> Array:
    columns = np.column_stack([course.nu[:, dof], course.nu_dot[:, dof]])
    fitted, *_ = np.linalg.lstsq(columns, force, rcond=None)
    return np.asarray(force - columns @ fitted)


def _error(force: Array, mass: float, damping: float, step_s: float) -> Array:
    """m e' + D e = f from rest, f held over each step."""
    keep = np.exp(-damping / mass * step_s)
    out, e = np.empty(len(force)), 0.0
    push = (1.0 - keep) / damping if damping > 0 else step_s / mass
    for i, one in enumerate(force.tolist()):
        e = keep * e + push * one
        out[i] = e
    return out


def _driven(now: Nominal, dof: int) -> float:
    """Variance of the velocity that the disturbance alone drives: s^2 / m^2 / (a (a + b))."""
    for problem, place in zip(now.joint.problems, now.joint.places, strict=True):
        if problem.axis.dof == dof:
            own = now.theta[place]
            a = float(now.course.damping[dof] / now.course.mass[dof])
            b = float(np.exp(-own[TIME_CONSTANT]))
            return float(np.exp(own[DISTURBANCE]) / now.course.mass[dof]) ** 2 / (a * (a + b))
    return 0.0
