"""The bias of fitting a disturbance, exactly: one axis alone, everything else at the truth, at the least loss.

The axis is then linear, M nu_dot + D nu = F + M a with a first-order Gauss-Markov acceleration a, so a Kalman filter
gives both parts of the negative log likelihood: the squares, which are the cost of the best path together with its
disturbance, and the log determinant, which appears only if the paths are integrated out (Ljung 1999, section 13.4).
"""

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy.optimize import minimize

from bench.forms.task import lever_of
from bench.missions import Mission
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.dynamics import coriolis, restoring
from identify.forces import wrench

Array = NDArray[np.float64]

AXES = (0, 1, 5)
YAW = 5
LEAST_START_S, LAGS_OF_START = 0.5, 10.0
WIDE = 1.0
"""Variance of the initial velocity."""


@dataclass(frozen=True)
class AxisAlone:
    """Readings (n,) of one velocity, each `step_s` after the last; `force`: mean force between readings; SI units."""

    step_s: Array
    force: Array
    reading: Array
    variance: float
    disturbance_std: float
    disturbance_time_s: float


@njit(cache=True, error_model="numpy")
def scored(
    step_s: Array,
    force: Array,
    reading: Array,
    variance: float,
    std: float,
    time_s: float,
    mass: float,
    damping: float,
) -> tuple[float, float]:
    """Half the sum of squared innovations over their variances, and half the sum of the variances' logarithms."""
    rate, keep_rate = damping / mass, 1.0 / time_s
    # Of the stationary pair of velocity and acceleration.
    covariance_xa = std**2 / (rate + keep_rate)
    variance_x = covariance_xa / rate
    x, a = 0.0, 0.0
    p, c, q = WIDE, 0.0, std**2
    squares, spread = 0.0, 0.0
    for i in range(len(reading)):
        h = step_s[i]
        if h > 0.0:
            phi, keep = np.exp(-rate * h), np.exp(-keep_rate * h)
            off = rate - keep_rate
            mixed = (keep - phi) / off if abs(off) * h > 1e-6 else h * phi
            x = phi * x + mixed * a + (1.0 - phi) / damping * force[i]
            a = keep * a
            dp, dc, dq = p - variance_x, c - covariance_xa, q - std**2
            p = variance_x + phi * phi * dp + 2.0 * phi * mixed * dc + mixed * mixed * dq
            c = covariance_xa + keep * (phi * dc + mixed * dq)
            q = std**2 + keep * keep * dq
        s = p + variance
        e = reading[i] - x
        squares += 0.5 * e * e / s
        spread += 0.5 * np.log(s)
        x += p / s * e
        a += c / s * e
        q -= c * c / s
        c -= p * c / s
        p -= p * p / s
    return squares, spread


def best_masses(alone: AxisAlone, mass: float, damping: float) -> tuple[float, float]:
    """Mass over the true mass at the least loss: with the disturbance fitted, and with it integrated out."""

    def ratio(weight: float) -> float:
        def loss(logs: Array) -> float:
            squares, spread = scored(
                alone.step_s, alone.force, alone.reading, alone.variance, alone.disturbance_std,
                alone.disturbance_time_s, mass * math.exp(logs[0]), damping * math.exp(logs[1]),
            )  # fmt: skip
            return float(squares + weight * spread)

        start = np.array([[0.0, 0.0], [0.1, 0.0], [0.0, 0.1]])
        best_fit = minimize(
            loss, start[0], method="Nelder-Mead", options={"initial_simplex": start, "xatol": 1e-3}
        )
        return math.exp(float(best_fit.x[0]))

    return ratio(0.0), ratio(1.0)


def of_mission(mission: Mission) -> dict[str, tuple[float, float]]:
    """`best_masses` of surge, sway and yaw by axis, as far as driven."""
    driven = [dof for dof in AXES if dof in mission.drawn.driven]
    return {
        DOFS[dof]: best_masses(
            axis_alone(mission, dof), float(mission.drawn.mass[dof]), float(mission.drawn.damping[dof])
        )
        for dof in driven
    }


def axis_alone(mission: Mission, dof: int) -> AxisAlone:
    """Prepare one axis for the filter: surge and sway from the DVL, yaw from the gyro."""
    dive, drawn = mission.dive, mission.drawn
    signal = dive.gyro if dof == YAW else dive.velocity
    assert signal is not None
    forces = wrench(dive, mission.file, mission.configuration)
    start_s = max(LAGS_OF_START * forces.lag_s, LEAST_START_S)
    nu = np.column_stack([np.interp(signal.time_s, mission.time_s, mission.nu[:, i]) for i in range(6)])
    value = signal.value[:, dof - 3] if dof == YAW else signal.value[:, dof]
    if dof != YAW:
        value = value - np.cross(nu[:, 3:], lever_of(mission))[:, dof]
    good = np.isfinite(value) & (signal.time_s >= start_s) & (signal.time_s <= mission.time_s[-1])
    at = signal.time_s[good]
    before = np.concatenate([at[:1], at[:-1]])
    g = restoring(drawn.configuration, tuple(mission.attitude.T))[dof]
    turning = coriolis(drawn.mass.tolist(), tuple(mission.nu.T))[dof]
    held = np.asarray(g + turning) - drawn.trim[dof]
    total = np.concatenate([[0.0], np.cumsum(0.5 * (held[1:] + held[:-1]) * np.diff(mission.time_s))])
    step_s = at - before
    area = np.interp(at, mission.time_s, total) - np.interp(before, mission.time_s, total)
    force = forces.mean_between(before, at)[:, dof] - area / np.where(step_s > 0, step_s, 1.0)
    std = mission.sensors.gyro_rad_s if dof == YAW else mission.sensors.dvl_m_s
    spread = drawn.disturbance_std[dof] / drawn.mass[dof]
    return AxisAlone(step_s, force, value[good], std**2, float(spread), float(drawn.disturbance_time_s[dof]))
