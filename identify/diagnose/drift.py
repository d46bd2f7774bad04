"""Drift of a simulated velocity from the recorded velocity over 1, 5 and 20 s, with its floor by noise alone.

A simulation starts from the recorded velocity at each second of a dive, and then uses only recorded thrust and
attitude. Its error at the horizon is the drift. The floor is the drift of dives without any gap, drawn from the
fitted disturbance and sensor noise, smoothed and simulated alike (a parametric bootstrap, Efron and Tibshirani 1993,
section 6.5), so that errors at a window's ends count equally.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numba import njit
from numpy.typing import NDArray

from identify.diagnose.nominal import Nominal
from identify.diagnose.simulation import EACH, RUN_AWAY, Simulation, smoothed_angle
from identify.estimators.innovations import INCREMENT, POSITION, smoothed_velocity
from identify.estimators.likelihood_axis import DISTURBANCE

Array = NDArray[np.float64]

HORIZONS_S = (1.0, 5.0, 20.0)
EVERY_S = 1.0

DRAWN_S = 2400.0
"""Total length of the drawn dives, s, for floors known to about 3 %."""


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
    def by_axis(self) -> Array:
        """Rms (6,) over windows, in floors."""
        return np.asarray(np.sqrt(np.mean(self.off**2, axis=0)) / self.floor)

    @property
    def total(self) -> float:
        """Rms over the axes that are fitted, in floors."""
        return float(np.sqrt(np.nanmean(self.by_axis**2)))

    @property
    def ran_away(self) -> float:
        """Share of runs that diverged."""
        return float(np.mean(np.any(np.abs(self.off) >= RUN_AWAY, axis=1)))


def drifts(model: Simulation, floors: Array) -> tuple[Drift, ...]:
    """The drifts of a model, with the floors (h, 6) of each horizon."""
    starts = _starts(model)
    off = model.off(starts, _steps(model), np.zeros_like(model.nu))
    out = []
    for k, horizon_s in enumerate(HORIZONS_S):
        complete = np.isfinite(off[:, k, model.dofs[0]])
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
    for problem, place in zip(noise.joint.at(noise.theta), noise.joint.places, strict=True):
        theta_axis, axis = noise.theta[place], problem.axis
        table, variance = problem.transition_table(theta_axis), problem.noise_variance(theta_axis)
        sigma = float(np.exp(theta_axis[DISTURBANCE]))
        normal = rng.normal(size=(len(axis.time_s), 4))
        slow, _ = problem.coloured(theta_axis)
        coloured = rng.normal(size=len(axis.time_s)) if axis.is_coloured else np.zeros(len(axis.time_s))
        true, angle, pushed, reading = _coloured_motion(
            table,
            problem.step,
            problem.reading,
            axis.state_read,
            np.sqrt(variance),
            sigma,
            slow,
            normal,
            coloured,
        )
        still = np.concatenate([np.zeros(2), axis.initial[2:]])
        no_force = np.zeros((len(true), 2))
        smoothed = smoothed_velocity(
            table, problem.step, no_force, reading, axis.state_read, variance, sigma, slow, still
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
            estimated_angle = smoothed_angle(time_s, axis.time_s[placed], reading[placed], rate)
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
    sigma_c: float,
    normal: Array,
    coloured: Array,
) -> tuple[Array, Array, Array, Array]:
    """Velocity, its integral, disturbance and readings (n,) of a body under a coloured force alone, from rest."""
    n = step.shape[0]
    true, place, pushed, read = np.empty(n), np.empty(n), np.empty(n), np.full(n, np.nan)
    nu, x, d, slow = 0.0, 0.0, sigma_d * normal[0, 2], sigma_c * coloured[0]
    for i in range(n):
        if step[i] >= 0:
            t = table[step[i]]
            # The lower Cholesky root of the step's noise, with six numbers in the table, by rows.
            a = np.sqrt(max(t[11], 0.0))
            b, c = (t[12] / a, t[13] / a) if a > 0 else (0.0, 0.0)
            e = np.sqrt(max(t[14] - b * b, 0.0))
            f = (t[15] - b * c) / e if e > 0 else 0.0
            g = np.sqrt(max(t[16] - c * c - f * f, 0.0))
            nu, x, d = (
                t[0] * nu + t[1] * x + t[2] * d + a * normal[i, 0],
                t[3] * nu + t[4] * x + t[5] * d + b * normal[i, 0] + e * normal[i, 1],
                t[6] * d + c * normal[i, 0] + f * normal[i, 1] + g * normal[i, 2],
            )
            slow = t[17] * slow + np.sqrt(t[18]) * coloured[i]
        true[i], place[i], pushed[i] = nu, x, d
        if np.isfinite(reading[i]):
            placed = state_read[i] == INCREMENT or state_read[i] == POSITION
            read[i] = (x if placed else nu + slow) + noise[i] * normal[i, 3]
        if state_read[i] == INCREMENT:
            x = 0.0
    return true, place, pushed, read
