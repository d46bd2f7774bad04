"""How far a simulated velocity drifts from the recorded one: over 1, 5 and 20 s, beside what noise alone makes of it.

From each second of a dive on the model is given the recorded velocity, the recorded thrust and attitude, and nothing
more. What it is off by after so many seconds is the gap; the floor is what a stationary disturbance of the fitted
strength and memory alone would drive it to. Sensors' noise is in no floor: in
roll and pitch, where it is larger than what disturbs, a model without a gap drifts by more than that.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.effects.effect import Act
from bridge.vehicle.dynamics import coriolis
from identify.diagnose.nominal import Nominal
from identify.estimators.innovations import POSITION
from identify.estimators.likelihood_axis import DISTURBANCE, FORCES, TIME_CONSTANT
from identify.estimators.motion import Motion

Array = NDArray[np.float64]

HORIZONS_S = (1.0, 5.0, 20.0)
EVERY_S = 1.0
EACH = 2
"""A step of the simulation is so many of the course's: 40 ms."""


@dataclass(frozen=True)
class Drift:
    """After one horizon: starts_s (w,) of the windows, off (w, 6) what the simulation is off by, m/s and rad/s; floor
    (6,) the standard deviation that noise alone would give, NaN in axes that are not fitted."""

    horizon_s: float
    starts_s: Array
    off: Array
    floor: Array

    @property
    def by_axis(self) -> Array:
        """(6,) rms over windows, in floors."""
        return np.asarray(np.sqrt(np.mean(self.off**2, axis=0)) / self.floor)

    @property
    def total(self) -> float:
        """Rms over the axes that are fitted, in floors."""
        return float(np.sqrt(np.nanmean(self.by_axis**2)))


def drifts(model: Nominal, acts: Sequence[Act], noise: Nominal) -> tuple[Drift, ...]:
    """The drifts of a model with what the acts add to its forces; the floors are by the noise levels of `noise`."""
    course, dofs = model.course, [problem.axis.dof for problem in model.joint.problems]
    force = _force(model, acts)
    true = _true(model.motion, acts)
    step_s = EACH * course.step_s
    grid = slice(None, None, EACH)
    force, true = force[grid], true[grid]
    every = max(round(EVERY_S / step_s), 1)
    out = []
    for horizon_s in HORIZONS_S:
        steps = round(horizon_s / step_s)
        starts = np.arange(0, len(true) - steps - 1, every)
        nu = true[starts].copy()
        for k in range(steps):
            at = starts + k
            nu = _stepped(nu, true[at], force[at], course, dofs, step_s)
        off = np.full((len(starts), 6), np.nan)
        off[:, dofs] = (nu - true[starts + steps])[:, dofs]
        out.append(Drift(horizon_s, course.time_s[grid][starts], off, _floor(noise, horizon_s)))
    return tuple(out)


def _force(model: Nominal, acts: Sequence[Act]) -> Array:
    """What pushes at each instant of the course, (n, 6), but for Coriolis forces and damping."""
    course = model.course
    force = np.zeros_like(course.nu)
    for problem, place in zip(model.joint.problems, model.joint.places, strict=True):
        axis = problem.axis
        shapes = problem.shapes @ model.theta[place][FORCES : problem.noise_place]
        force[:, axis.dof] = np.interp(course.time_s, axis.time_s, axis.force.mean(axis=1) + shapes)
        placed = (axis.state_read == POSITION) & np.isfinite(problem.reading)
        if axis.stiffness > 0 and placed.any():
            angle = np.interp(course.time_s, axis.time_s[placed], problem.reading[placed])
            force[:, axis.dof] -= axis.stiffness * angle
    for act in acts:
        if act.wrench is not None:
            force += act.wrench
    return force


def _true(motion: Motion, acts: Sequence[Act]) -> Array:
    """The recorded velocity (n, 6), smoothed, less what the acts add to its readings."""
    nu = motion.nu.copy()
    for act in acts:
        if act.velocity is not None:
            nu[:, :3] -= act.velocity
        if act.gyro is not None:
            nu[:, 3:] -= act.gyro
    return nu


def _stepped(nu: Array, read: Array, force: Array, course: Course, dofs: list[int], step_s: float) -> Array:
    """One step (Heun) of the fitted axes; the others follow what was read."""

    def rate(at: Array) -> Array:
        c = np.stack(
            [np.broadcast_to(f, len(at)) for f in coriolis(course.mass.tolist(), tuple(at.T))], axis=1
        )
        return np.asarray((force - c - course.damping * at) / course.mass)

    first = rate(nu)
    guess = nu + step_s * first
    moved = nu + 0.5 * step_s * (first + rate(guess))
    out = read.copy()
    out[:, dofs] = moved[:, dofs]
    return out


def _floor(noise: Nominal, horizon_s: float) -> Array:
    """(6,): what the disturbance alone drives a velocity to within a horizon, from its stationary spread."""
    out = np.full(6, np.nan)
    for problem, place in zip(noise.joint.problems, noise.joint.places, strict=True):
        own, dof = noise.theta[place], problem.axis.dof
        mass, damping = noise.course.mass[dof], noise.course.damping[dof]
        sigma, memory_s = np.exp(own[DISTURBANCE]), np.exp(own[TIME_CONSTANT])
        out[dof] = np.sqrt(_spread(mass, damping, sigma, memory_s, horizon_s))
    return out


def _spread(mass: float, damping: float, sigma: float, memory_s: float, horizon_s: float) -> float:
    """Variance of m nu' = -D nu + d after a horizon from rest, d stationary (Jazwinski 1970, section 4.6)."""
    a, b = damping / mass, 1.0 / memory_s
    t = np.linspace(0.0, horizon_s, 2001)
    # nu(H) = int g(H - s) d(s) ds / m with g = exp(-a s): a double integral over the disturbance's covariance.
    g = np.exp(-a * t)
    cumulated = np.zeros_like(t)
    h = t[1] - t[0]
    keep = np.exp(-b * h)
    for i in range(1, len(t)):
        cumulated[i] = keep * cumulated[i - 1] + 0.5 * h * (keep * g[i - 1] + g[i])
    integrand = g * cumulated
    return float(2.0 * (sigma / mass) ** 2 * h * (integrand.sum() - 0.5 * (integrand[0] + integrand[-1])))
