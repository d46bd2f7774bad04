"""Drift of a simulated velocity from the recorded velocity over 1, 5 and 20 s, its floor by noise, a plain baseline.

A simulation starts from the recorded velocity at each second of a dive, and then uses only recorded thrust and
attitude. Its error at the horizon is the drift. The floor is the drift of dives without any gap, drawn from the
fitted disturbance and sensor noise, smoothed and simulated alike (a parametric bootstrap, Efron and Tibshirani 1993,
section 6.5), so that errors at a window's ends count equally.

The baseline is equation error (Ljung 1999, section 10.1), one degree of freedom at a time: nu' = a tau(t - delay) -
b nu - c |nu| nu - e sin(angle) + trim, with the delay from a grid. A diagnosis has to beat it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.diagnose.filters.nominal import Nominal
from identify.diagnose.gap.simulation import EACH, RUN_AWAY, Simulation, smoothed_angle
from identify.effects.course import Course, delayed
from identify.estimators.filter.innovations import smoothed_velocity
from identify.estimators.filter.state import INCREMENT, NO_STEP, POSITION, VELOCITY, moved_mean, read_of

HORIZONS_S = (1.0, 5.0, 20.0)
EVERY_S = 1.0

DRAWN_S = 2400.0
"""Total length of the drawn dives, s, for floors known to about 3 %."""

DELAYS_S = np.arange(51) * 0.02
"""Delays of the asked thrust that are tried, s."""

TERMS = 5
THRUST, LINEAR, QUADRATIC, RIGHTING, TRIM = range(TERMS)

RIGHTED = (3, 4)
"""Roll and pitch."""


@dataclass(frozen=True)
class Drift:
    """The drift at one horizon.

    starts_s (w,): of the windows; off (w, 6): errors, m/s and rad/s; floor (6,): rms by noise alone, NaN in axes that
    are not fitted.
    """

    horizon_s: float
    starts_s: Array
    off: Array
    floor: Array

    @property
    def rms(self) -> Array:
        """Rms (6,) over windows, m/s and rad/s."""
        return np.asarray(np.sqrt(np.mean(self.off**2, axis=0)))

    @property
    def by_axis(self) -> Array:
        """Rms (6,) over windows, in floors."""
        return self.rms / self.floor

    @property
    def total(self) -> float:
        """Rms over the axes that are fitted, in floors."""
        return float(np.sqrt(np.nanmean(self.by_axis**2)))

    @property
    def ran_away(self) -> float:
        """Share of runs that diverged."""
        return float(np.mean(np.any(np.abs(self.off) >= RUN_AWAY, axis=1)))


def drifts(model: Simulation, floors: Array) -> tuple[Drift, ...]:
    """The drifts of a model, with the floors (h, 6) of each horizon; without the horizons that no run lasts for."""
    starts = _starts(model)
    off = model.off(starts, _steps(model), np.zeros_like(model.nu))
    out = []
    for k, horizon_s in enumerate(HORIZONS_S):
        complete = np.isfinite(off[:, k, model.dofs[0]])
        if complete.any():
            out.append(Drift(horizon_s, model.time_s[starts[complete]], off[complete, k], floors[k]))
    return tuple(out)


def ran_away(before: Sequence[Drift], after: Sequence[Drift]) -> tuple[str, ...]:
    """Sentences on runs that diverged, at the shortest horizon with any."""
    out = []
    for model, drifts_of in (("the nominal model", before), ("the model with the causes in", after)):
        diverged = next((drift for drift in drifts_of if drift.ran_away > 0), None)
        if diverged is not None:
            out.append(
                f"Flown for {diverged.horizon_s:g} s, {model} runs away from the recording in "
                f"{100 * diverged.ran_away:.1f} % of the flights, which end there: how large its drift is says little."
            )
    return tuple(out)


def floors_of(noise: Nominal, model: Simulation, rng: np.random.Generator) -> Array:
    """Rms drift (h, 6) at each horizon under a fit's noise alone."""
    square = np.zeros((len(HORIZONS_S), 6))
    starts, steps = _starts(model), _steps(model)
    draws = max(round(DRAWN_S / float(model.time_s[-1] - model.time_s[0])), 4)
    for _ in range(draws):
        disturbance, errors = drawn(noise, rng)
        off = replace(model, lacking=disturbance).off(starts, steps, errors)
        finite = np.isfinite(off)
        square += (np.where(finite, off, 0.0) ** 2).sum(axis=0) / np.maximum(finite.sum(axis=0), 1)
    return np.asarray(np.where(square > 0, np.sqrt(square / draws), np.nan))


def drawn(noise: Nominal, rng: np.random.Generator) -> tuple[Array, Array]:
    """A disturbance and the error of the smoothed velocity, (n, 6) each, drawn from a fit's noise levels.

    For a body that rights itself, the error of its angle adds a righting moment.
    """
    time_s = noise.course.time_s[::EACH]
    force, errors = np.zeros((len(time_s), 6)), np.zeros((len(time_s), 6))
    for problem, of_axis in zip(noise.joint.at(noise.theta), noise.joint.slices, strict=True):
        theta_axis, axis = noise.theta[of_axis], problem.axis
        table, variance = problem.transition_table(theta_axis), problem.noise_variance(theta_axis)
        levels = problem.hidden_levels(theta_axis)
        normal = rng.normal(size=(len(axis.time_s), 5))
        true, angle, pushed, reading = _coloured_motion(
            table,
            problem.step,
            problem.reading,
            axis.state_read,
            np.sqrt(variance),
            *levels,
            normal,
        )
        still = axis.initial * np.array([0.0, 0.0, 1.0, 1.0])
        no_force = np.zeros((len(true), 2))
        smoothed = smoothed_velocity(
            table, problem.step, no_force, reading, axis.state_read, variance, *levels, still
        )
        errors[:, axis.dof] = np.interp(time_s, axis.time_s, smoothed - true)
        force[:, axis.dof] = np.interp(time_s, axis.time_s, pushed)
        white = problem.white_force(theta_axis)
        if white > 0:
            # Held over a step of the simulation; the drawn readings have a similar noise.
            force[:, axis.dof] += white * rng.normal(size=len(time_s)) / np.sqrt(time_s[1] - time_s[0])
        placed = (axis.state_read == POSITION) & np.isfinite(reading)
        if axis.stiffness > 0 and placed.any():
            rate = np.interp(time_s, axis.time_s, smoothed)
            estimated_angle = smoothed_angle(
                time_s, axis.time_s[placed], reading[placed], rate, noise.course.runs_s
            )
            force[:, axis.dof] += axis.stiffness * (estimated_angle - np.interp(time_s, axis.time_s, angle))
    return force, errors


def _starts(model: Simulation) -> NDArray[np.int64]:
    every = max(round(EVERY_S / model.step_s), 1)
    return np.arange(0, max(len(model.time_s) - round(HORIZONS_S[0] / model.step_s), 0), every)


def _steps(model: Simulation) -> list[int]:
    return [round(horizon_s / model.step_s) for horizon_s in HORIZONS_S]


@njit(cache=True, nogil=True, error_model="numpy")
def _coloured_motion(
    table: Array,
    step: NDArray[np.int64],
    reading: Array,
    state_read: NDArray[np.int64],
    noise: Array,
    sigma_d: float,
    sigma_s: float,
    coloured: bool,
    normal: Array,
) -> tuple[Array, Array, Array, Array]:
    """Velocity, its integral, disturbance and readings (n,) of a body under a coloured force alone, from rest."""
    n = step.shape[0]
    true, position, pushed, read = np.empty(n), np.empty(n), np.empty(n), np.full(n, np.nan)
    state = (0.0, 0.0, sigma_d * normal[0, 2], sigma_s * normal[0, 3])
    for i in range(n):
        if step[i] >= 0:
            t = table[step[i]]
            nu, x, d, s = moved_mean(t, state, 0.0, 0.0)
            # The lower Cholesky root of the step's noise, of which the table holds ten numbers.
            a = np.sqrt(max(t[11], 0.0))
            b, c, e = (t[12] / a, t[13] / a, t[23] / a) if a > 0 else (0.0, 0.0, 0.0)
            f = np.sqrt(max(t[14] - b * b, 0.0))
            g, h = ((t[15] - b * c) / f, (t[24] - b * e) / f) if f > 0 else (0.0, 0.0)
            k = np.sqrt(max(t[16] - c * c - g * g, 0.0))
            m = (t[25] - c * e - g * h) / k if k > 0 else 0.0
            o = np.sqrt(max(t[18] - e * e - h * h - m * m, 0.0))
            state = (
                nu + a * normal[i, 0],
                x + b * normal[i, 0] + f * normal[i, 1],
                d + c * normal[i, 0] + g * normal[i, 1] + k * normal[i, 2],
                s + e * normal[i, 0] + h * normal[i, 1] + m * normal[i, 2] + o * normal[i, 3],
            )
        elif step[i] < NO_STEP:
            state = (0.0, 0.0, sigma_d * normal[i, 2], sigma_s * normal[i, 3])
        true[i], position[i], pushed[i] = state[0], state[1], state[2]
        if np.isfinite(reading[i]):
            velocity = state_read[i] == VELOCITY
            read[i] = read_of(state, velocity, coloured) + noise[i] * normal[i, 4]
        if state_read[i] == INCREMENT:
            state = (state[0], 0.0, state[2], state[3])
    return true, position, pushed, read


@dataclass(frozen=True)
class Baseline:
    """The plain model that a diagnosis has to beat: each axis alone, its terms fitted by least squares.

    terms (6, TERMS): acceleration by asked force (1/kg, 1/(kg m2)), speed, speed times its magnitude, sine of the
    angle and trim. delay_s (6,): delay of the asked thrust.
    """

    terms: Array
    delay_s: Array

    def flown(self, course: Course, measured: Array, starts: NDArray[np.int64], length: int) -> Array:
        """Velocities (w, length, 6) at the steps after each start, from the measured velocity (n, 6) there, by Heun's
        rule.

        n: every EACH-th instant of the course. The trims are refitted to `measured`, as those of any model are.
        """
        step_s = course.step_s * EACH
        pushed = self._pushed(course)
        beyond = np.gradient(measured, step_s, axis=0) - pushed + self._drag(measured)
        trim = np.mean(beyond[course.recorded[::EACH]], axis=0)
        pushed = pushed + trim
        nu, out = measured[starts], np.empty((len(starts), length, 6))
        for k in range(length):
            first = pushed[starts + k] - self._drag(nu)
            second = pushed[starts + k + 1] - self._drag(nu + step_s * first)
            nu = np.clip(nu + 0.5 * step_s * (first + second), -RUN_AWAY, RUN_AWAY)
            out[:, k] = nu
        return out

    def _pushed(self, course: Course) -> Array:
        """Acceleration (n, 6) by thrust and righting moment."""
        force, sines = course.wrench_of(course.asked_n), _sines(course)
        late = [delayed(force[:, [dof]], course.step_s, self.delay_s[dof])[::EACH, 0] for dof in range(6)]
        return np.asarray(self.terms[:, THRUST] * np.stack(late, axis=1) + self.terms[:, RIGHTING] * sines)

    def _drag(self, nu: Array) -> Array:
        return np.asarray(-(self.terms[:, LINEAR] + self.terms[:, QUADRATIC] * np.abs(nu)) * nu)


def baseline_of(course: Course, nu: Array) -> Baseline:
    """Fit the baseline to velocities nu (n, 6) at the times of a dive's course; of all delays, the best is kept."""
    moved, kept = nu[::EACH], course.recorded[::EACH]
    rate = np.gradient(moved, course.step_s * EACH, axis=0)
    force, sines = course.wrench_of(course.asked_n), _sines(course)
    late_forces = [delayed(force, course.step_s, float(by_s))[::EACH] for by_s in DELAYS_S]
    terms, delay_s = np.zeros((6, TERMS)), np.zeros(6)
    for dof in range(6):
        columns = np.stack(
            [moved[:, dof], np.abs(moved[:, dof]) * moved[:, dof], sines[:, dof], np.ones(len(moved))]
        )
        late = np.stack([late_force[:, dof] for late_force in late_forces])
        sizes, left = _least_squares(late[:, kept], columns[:, kept], rate[kept, dof])
        best = int(np.argmin(left))
        terms[dof], delay_s[dof] = sizes[best], DELAYS_S[best]
    return Baseline(terms, delay_s)


def _sines(course: Course) -> Array:
    """Sines (n, 6) of roll and pitch, 0 elsewhere."""
    out = np.zeros((len(course.euler[::EACH]), 6))
    out[:, RIGHTED] = np.sin(course.euler[::EACH, :2])
    return out


def _least_squares(separate: Array, shared: Array, value: Array) -> tuple[Array, Array]:
    """Fits of each row of `separate` (d, n) together with the rows `shared` (k, n).

    Returns the sizes (d, 1 + k), 0 if undetermined, and the mean squares of the residuals (d,).
    """
    rows = np.vstack([separate, shared])
    length = np.sqrt(np.mean(rows**2, axis=1))
    unit = rows / np.where(length > 0, length, 1.0)[:, None]
    square, right, count = unit @ unit.T, unit @ value, len(separate)
    sizes, left = np.zeros((count, 1 + len(shared))), np.zeros(count)
    for k in range(count):
        of = np.r_[k, count : len(rows)]
        of_square = square[np.ix_(of, of)]
        fitted, *_ = np.linalg.lstsq(of_square, right[of], rcond=1e-9)
        sizes[k] = fitted / np.where(length[of] > 0, length[of], 1.0)
        left[k] = (value @ value - fitted @ (2.0 * right[of] - of_square @ fitted)) / len(value)
    return sizes, left
