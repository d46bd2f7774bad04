"""A model simulated along a recorded motion: its missing force at every instant, and its drift.

The state is the difference d from the recorded velocity, so a model without a gap stays at zero: M d' = f - (C(nu + d)
- C(nu)) - D d + S d - K a, a' = d. f is the missing force along the recorded motion, S the slope of the causes' forces
by velocity (Fossen 2011, eq. 6.1, less itself along the recording).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.filters.nominal import Nominal, coefficients, quadratic_of
from identify.effects.course import Course, runs_at
from identify.effects.effect import Act
from identify.estimators.filter.state import POSITION
from identify.estimators.likelihood.axis import DAMPING, FORCES, MASS
from identify.estimators.likelihood.joint import JointLikelihood

RUN_AWAY = np.array([10.0, 10.0, 10.0, 20.0, 20.0, 20.0])
"""Difference, m/s and rad/s, that ends a simulation: no thruster-driven vehicle moves so fast under water, and
squares of a larger drift would overflow."""

EACH = 2
"""Steps of the course per step of the simulation: 40 ms."""

NUDGE = np.array([0.01, 0.01, 0.01, 0.02, 0.02, 0.02])
"""Velocity steps for the slope of the causes' forces, m/s and rad/s."""

MEANT_S = 2.0
"""Averaging time for the slow part of an angle."""


@njit(cache=True, nogil=True, error_model="numpy")
def off_by(
    starts: NDArray[np.int64],
    steps: NDArray[np.int64],
    lacking: Array,
    nu: Array,
    slope: Array,
    mass: Array,
    damping: Array,
    stiffness: Array,
    dofs: NDArray[np.int64],
    errors: Array,
    step_s: float,
    ends: NDArray[np.int64],
) -> Array:
    """The compiled loop of `Simulation.off`, by Heun's rule, from each start in turn. ends (n,): where the run of each
    instant ends.

    A run that ends early stays at the RUN_AWAY of its axis.
    """
    last = steps[-1]
    out = np.full((starts.shape[0], steps.shape[0], 6), np.nan)
    bent = bool(np.any(slope))
    ease = np.zeros(6)
    for j in dofs:
        ease[j] = 1.0 / mass[j]
    d, a, guess, tilted = np.zeros(6), np.zeros(6), np.zeros(6), np.zeros(6)
    first, second = np.zeros(6), np.zeros(6)
    for w in range(starts.shape[0]):
        at = starts[w]
        a[:] = 0.0
        for j in dofs:
            d[j] = errors[at, j]
        now = 0
        for k in range(1, last + 1):
            if at + k >= ends[at]:
                break
            i = at + k - 1
            _rate(first, d, a, lacking[i], nu[i], slope[i], bent, mass, damping, stiffness, ease)
            for j in range(6):
                guess[j] = d[j] + step_s * first[j]
                tilted[j] = a[j] + step_s * d[j]
            i += 1
            _rate(second, guess, tilted, lacking[i], nu[i], slope[i], bent, mass, damping, stiffness, ease)
            for j in range(6):
                a[j] += 0.5 * step_s * (d[j] + guess[j])
                d[j] += 0.5 * step_s * (first[j] + second[j])
            if _has_run_away(d):
                for h in range(now, steps.shape[0]):
                    if at + steps[h] < ends[at]:
                        for j in dofs:
                            out[w, h, j] = min(max(d[j], -RUN_AWAY[j]), RUN_AWAY[j])
                break
            if k == steps[now]:
                for j in dofs:
                    out[w, now, j] = d[j] - errors[at + k, j]
                now += 1
    return out


@njit(cache=True, inline="always")
def _has_run_away(d: Array) -> bool:
    far = False
    for j in range(6):
        far = far or abs(d[j]) > RUN_AWAY[j]
    return far


@njit(cache=True, inline="always")
def _rate(
    out: Array,
    d: Array,
    a: Array,
    lacking: Array,
    nu: Array,
    slope: Array,
    bent: bool,
    m: Array,
    damping: Array,
    stiffness: Array,
    ease: Array,
) -> None:
    """Rate of change of the difference d (6,), with integral a (6,).

    ease (6,): inverse mass, 0 for an axis that is not fitted; bent: whether any slope is nonzero. Change of C(nu) nu
    in `bridge.vehicle.dynamics.coriolis`: for a product u v it is du (v + dv) + u dv.
    """
    u, v, w, p, q, r = nu[0], nu[1], nu[2], nu[3], nu[4], nu[5]
    du, dv, dw, dp, dq, dr = d[0], d[1], d[2], d[3], d[4], d[5]
    wq, vr, ur = dw * (q + dq) + w * dq, dv * (r + dr) + v * dr, du * (r + dr) + u * dr
    wp, vp, uq = dw * (p + dp) + w * dp, dv * (p + dp) + v * dp, du * (q + dq) + u * dq
    vw, uw, uv = dv * (w + dw) + v * dw, du * (w + dw) + u * dw, du * (v + dv) + u * dv
    qr, pr, pq = dq * (r + dr) + q * dr, dp * (r + dr) + p * dr, dp * (q + dq) + p * dq
    out[0] = m[2] * wq - m[1] * vr
    out[1] = m[0] * ur - m[2] * wp
    out[2] = m[1] * vp - m[0] * uq
    out[3] = (m[2] - m[1]) * vw + (m[5] - m[4]) * qr
    out[4] = (m[0] - m[2]) * uw + (m[3] - m[5]) * pr
    out[5] = (m[1] - m[0]) * uv + (m[4] - m[3]) * pq
    for j in range(6):
        out[j] = -lacking[j] - out[j] - damping[j] * d[j] - stiffness[j] * a[j]
    if bent:
        for j in range(6):
            for i in range(6):
                out[j] += slope[j, i] * d[i]
    for j in range(6):
        out[j] *= ease[j]


@dataclass(frozen=True)
class Simulation:
    """A model along a recorded motion at uniform times (n,), body axes, SI units.

    dofs: fitted degrees of freedom; the others follow the recording. mass, damping, stiffness (6,). nu, nu_dot (n,
    6): recorded. lacking (n, 6): the missing force. slope (n, 6, 6): of the causes' forces by velocity. runs_s: first
    and last time of each run of a dive made of several; empty for a single one.
    """

    time_s: Array
    dofs: tuple[int, ...]
    mass: Array
    damping: Array
    stiffness: Array
    nu: Array
    nu_dot: Array
    lacking: Array
    slope: Array
    runs_s: tuple[tuple[float, float], ...] = ()

    @cached_property
    def runs(self) -> tuple[slice, ...]:
        """The instants of each run."""
        return runs_at(self.time_s, self.runs_s)

    @property
    def step_s(self) -> float:
        return float(self.time_s[1] - self.time_s[0])

    def less(self, wrench: Array) -> "Simulation":
        """The simulation with a force (n, 6) known."""
        return replace(self, lacking=self.lacking - wrench)

    def off(self, starts: NDArray[np.int64], steps: Sequence[int], errors: Array) -> Array:
        """Difference (w, h, 6) after some steps from each start; NaN beyond the end of its run and in axes that are not
        fitted. errors (n, 6): of the recorded velocity."""
        lacking, nu = np.ascontiguousarray(self.lacking), np.ascontiguousarray(self.nu)
        ends = np.arange(len(nu))
        for run in self.runs:
            ends[run] = run.stop
        out = off_by(
            starts, np.array(sorted(steps), dtype=np.int64), lacking, nu, self.slope, self.mass, self.damping,
            self.stiffness, np.array(self.dofs), errors, self.step_s, ends,
        )  # fmt: skip
        return np.asarray(out)


def simulation_of(
    model: Nominal,
    theta: Array,
    nu: Array,
    wrench: Array | None = None,
    slope: Array | None = None,
) -> Simulation:
    """A fit's equations at `theta` along a velocity nu (n, 6) at the times of its course.

    wrench (n, 6): of causes outside the fit's forces; slope (n, 6, 6): of all causes but those of `accepted`.
    """
    course = model.course
    mass, damping = coefficients(model.joint, theta)
    force, stiffness = _pushed(model, theta)
    if wrench is not None:
        force = force + wrench
    rate = np.zeros_like(nu)
    for run in runs_at(course.time_s, course.runs_s):
        rate[run] = np.gradient(nu[run], course.time_s[run], axis=0)
    grid = slice(None, None, EACH)
    nu, nu_dot = np.ascontiguousarray(nu[grid]), rate[grid]
    lacking = np.ascontiguousarray(mass * nu_dot + course.coriolis_of(mass, nu) + damping * nu - force[grid])
    dofs = tuple(problem.axis.dof for problem in model.joint.problems)
    lacking[:, [dof for dof in range(6) if dof not in dofs]] = 0.0
    total_slope = np.zeros((len(nu), 6, 6)) if slope is None else slope[grid].copy()
    if model.accepted:
        total_slope += slope_of(model.accepted, course)[grid]
    total_slope[:, range(6), range(6)] -= 2.0 * quadratic_of(model.joint, theta) * np.abs(nu)
    lacking[~course.recorded[grid]] = 0.0
    return Simulation(
        course.time_s[grid],
        dofs,
        mass,
        damping,
        stiffness,
        nu,
        nu_dot,
        lacking,
        total_slope,
        course.runs_s,
    )


def logarithms(joint: JointLikelihood) -> set[int]:
    """Places in theta of masses and drags."""
    indices = {of_axis.start + at for of_axis in joint.slices for at in (MASS, DAMPING)}
    indices |= {
        of_axis.start + problem.quadratic_index
        for problem, of_axis in zip(joint.problems, joint.slices, strict=True)
        if problem.damped != "linear"
    }
    return indices | set(joint.mass_indices)


def wrench_of(causes: Sequence[Cause], course: Course) -> Array:
    """Forces (n, 6) of causes along a course."""
    return summed([cause.act(course) for cause in causes], course)


def summed(acts: Sequence[Act], course: Course) -> Array:
    """Forces (n, 6) of acts together."""
    total = np.zeros_like(course.nu)
    for act in acts:
        if act.wrench is not None:
            total += act.wrench
    return total


def missing_wrench_of(causes: Sequence[Cause], course: Course) -> Array:
    """Force (n, 6) that a model of the velocity over ground lacks without the causes: their forces, and that of
    moving water."""
    total = wrench_of(causes, course)
    for cause in causes:
        act = cause.act(course)
        if act.water is not None:
            total += course.pushed_by(act.water)
    return total


def velocity_error_of(causes: Sequence[Cause], course: Course) -> Array:
    """Errors (n, 6) of the causes in readings of velocity and rate."""
    total = np.zeros_like(course.nu)
    for cause in causes:
        act = cause.act(course)
        if act.velocity is not None:
            total[:, :3] += act.velocity
        if act.gyro is not None:
            total[:, 3:] += act.gyro
    return total


def beyond_motion_of(causes: Sequence[Cause], course: Course) -> Array:
    """Readings of velocity and rate (n, 6) beyond the motion through the water: the causes' errors, and the water's
    own velocity."""
    total = velocity_error_of(causes, course)
    for cause in causes:
        act = cause.act(course)
        if act.water is not None:
            total[:, :3] += act.water
    return total


def specific_force_of(causes: Sequence[Cause], course: Course) -> Array:
    """Errors (n, 3) of the causes in the accelerometer's reading, m/s2."""
    total = np.zeros((len(course.time_s), 3))
    for cause in causes:
        error = cause.act(course).specific_force
        total += 0.0 if error is None else error
    return total


def slope_of(causes: Sequence[Cause], course: Course) -> Array:
    """Derivative (n, 6, 6) of the causes' forces (rows) by each velocity."""
    out = np.zeros((len(course.time_s), 6, 6))
    if any(cause.act(course).wrench is not None for cause in causes):
        for dof, h in enumerate(NUDGE):
            moved = np.zeros(6)
            moved[dof] = h
            up, down = (
                wrench_of(causes, replace(course, nu=course.nu + sign * moved, drift=None))
                for sign in (1, -1)
            )
            out[:, :, dof] = (up - down) / (2 * h)
    return out


def _pushed(model: Nominal, theta: Array) -> tuple[Array, Array]:
    """All forces (n, 6) on the vehicle but Coriolis and damping forces, and the stiffness (6,)."""
    time_s = model.course.time_s
    force, stiffness = np.zeros((len(time_s), 6)), np.zeros(6)
    for problem, of_axis in zip(model.joint.problems, model.joint.slices, strict=True):
        axis = problem.axis
        # Lateness and smoothing of readings exert no force on the vehicle.
        pushing = problem.noise_index - len(axis.timing)
        shapes = problem.shapes[:, : pushing - FORCES] @ problem.factors(theta[of_axis])[: pushing - FORCES]
        steps = 0.5 * (axis.force[:, 0] + axis.force[:, 1]) + shapes - axis.quadratic * axis.squared
        force[:, axis.dof] = between(time_s, axis.shown_s, axis.step_s, steps)
        placed = (axis.state_read == POSITION) & np.isfinite(problem.reading)
        if axis.stiffness > 0 and placed.any():
            angle = smoothed_angle(
                time_s,
                axis.time_s[placed],
                problem.reading[placed],
                model.motion.nu[:, axis.dof],
                model.course.runs_s,
            )
            force[:, axis.dof] -= axis.stiffness * angle
            stiffness[axis.dof] = axis.stiffness
    return force, stiffness


def between(time_s: Array, end_s: Array, step_s: Array, force: Array) -> Array:
    """Mean forces (n,) of steps (m,) that end at end_s, each at its middle.

    Two readings of one instant, as of a gyro and an attitude, have no step between them.
    """
    lasts = step_s > 0
    return np.asarray(np.interp(time_s, (end_s - 0.5 * step_s)[lasts], force[lasts]))


def smoothed_angle(
    time_s: Array, read_s: Array, angle: Array, rate: Array, runs_s: Sequence[tuple[float, float]] = ()
) -> Array:
    """An angle (n,) with its reading noise averaged out of the slow difference from its integrated rate, in each run by
    itself; 0 between runs."""
    step_s = float(time_s[1] - time_s[0])
    turned = np.cumsum(rate) * step_s
    difference, out = np.interp(time_s, read_s, angle) - turned, np.zeros(len(time_s))
    half = round(0.5 * MEANT_S / step_s)
    for run in runs_at(time_s, runs_s):
        out[run] = turned[run] + _averaged(difference[run], half)
    return out


def _averaged(difference: Array, half: int) -> Array:
    """Means (n,) of the values within `half` steps of each."""
    edges = np.clip(np.arange(len(difference))[:, None] + [-half, half + 1], 0, len(difference))
    total = np.concatenate([[0.0], np.cumsum(difference)])
    return np.asarray((total[edges[:, 1]] - total[edges[:, 0]]) / (edges[:, 1] - edges[:, 0]))
