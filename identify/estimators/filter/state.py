"""State of the Kalman filter of one degree of freedom with a coloured force: its step and its update, compiled.

State (nu, x, d, s), with

    m nu_dot = F(t) - D nu - k x + d,   x_dot = nu,   d_dot = s,   r T s_dot = -T s - d + white noise,

so that d is stationary with standard deviation `sigma_d` and integral time scale T (Jazwinski 1970, theorem 7.1 for
the recursion). With r = 0 the disturbance is of first order, d_dot = -d/T + white noise.

The velocity of a stock autopilot has a coloured error of its own. There the disturbance is of first order, and the
fourth state is that error: c_dot = -c/T_c + white noise, which no force moves (`coloured`). The model then also has a
white force (from pulses rounded to whole microseconds and unknown between messages); and, if nu and the forces come
out of the autopilot's filter of time constant T_s, x_dot = nu + T_s nu_dot. These are zero for other recordings.

Events are measurements in time order: of nu, of x (an angle, or depth), or of the change of x since the last such
event (an INCREMENT, from a gyro that integrates between its messages). A NaN reading is no measurement.

A row `t` of `transitions.transitions` holds one step, with A its transition and Q its noise, states counted from 0:

    t[0:7]    A00 A01 A02 A10 A11 A12 A22       t[7:11]   response of nu and x to a unit force over the step's first
    t[11:17]  Q00 Q01 Q02 Q11 Q12 Q22                     half, then to one over its second half
    t[17:19]  A33 Q33                           t[19:26]  A03 A13 A23 A32 Q03 Q13 Q23
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.arrays import Array

Indices = NDArray[np.int64]
Mean = tuple[float, float, float, float]
Covariance = tuple[float, float, float, float, float, float, float, float, float, float]
"""Upper triangle, row by row, 00 01 02 11 12 22, then the covariances of the fourth state: 03 13 23 33."""

Gain = tuple[float, float, float, float]

VELOCITY, POSITION, INCREMENT = 0, 1, 2
NO_STEP = -1
"""In place of a row's number: -1 for an event without a step before it; -1 - r begins run r > 0, and sets the state to
that of the run's first instant."""


@njit(cache=True, inline="always")
def begun(initial: Array, sigma_d: float, sigma_s: float) -> tuple[Mean, Covariance]:
    """Mean and covariance at the first instant of a run; initial (4,): the means of nu and x, then their variances."""
    return (initial[0], initial[1], 0.0, 0.0), (
        initial[2], 0.0, 0.0, initial[3], 0.0, sigma_d * sigma_d, 0.0, 0.0, 0.0, sigma_s * sigma_s,
    )  # fmt: skip


@njit(cache=True, inline="always")
def moved_mean(t: Array, x: Mean, early: float, late: float) -> Mean:
    """The mean one step later."""
    return (
        t[0] * x[0] + t[1] * x[1] + t[2] * x[2] + t[19] * x[3] + t[7] * early + t[9] * late,
        t[3] * x[0] + t[4] * x[1] + t[5] * x[2] + t[20] * x[3] + t[8] * early + t[10] * late,
        t[6] * x[2] + t[21] * x[3],
        t[22] * x[2] + t[17] * x[3],
    )


@njit(cache=True, inline="always")
def moved_covariance(t: Array, p: Covariance) -> Covariance:
    """The covariance one step later."""
    a0 = t[0] * p[0] + t[1] * p[1] + t[2] * p[2] + t[19] * p[6]
    a1 = t[0] * p[1] + t[1] * p[3] + t[2] * p[4] + t[19] * p[7]
    a2 = t[0] * p[2] + t[1] * p[4] + t[2] * p[5] + t[19] * p[8]
    a3 = t[0] * p[6] + t[1] * p[7] + t[2] * p[8] + t[19] * p[9]
    b1 = t[3] * p[1] + t[4] * p[3] + t[5] * p[4] + t[20] * p[7]
    b0 = t[3] * p[0] + t[4] * p[1] + t[5] * p[2] + t[20] * p[6]
    b2 = t[3] * p[2] + t[4] * p[4] + t[5] * p[5] + t[20] * p[8]
    b3 = t[3] * p[6] + t[4] * p[7] + t[5] * p[8] + t[20] * p[9]
    d2 = t[6] * p[5] + t[21] * p[8]
    d3 = t[6] * p[8] + t[21] * p[9]
    s2 = t[22] * p[5] + t[17] * p[8]
    s3 = t[22] * p[8] + t[17] * p[9]
    return (
        a0 * t[0] + a1 * t[1] + a2 * t[2] + a3 * t[19] + t[11],
        a0 * t[3] + a1 * t[4] + a2 * t[5] + a3 * t[20] + t[12],
        a2 * t[6] + a3 * t[21] + t[13],
        b0 * t[3] + b1 * t[4] + b2 * t[5] + b3 * t[20] + t[14],
        b2 * t[6] + b3 * t[21] + t[15],
        d2 * t[6] + d3 * t[21] + t[16],
        a2 * t[22] + a3 * t[17] + t[23],
        b2 * t[22] + b3 * t[17] + t[24],
        d2 * t[22] + d3 * t[17] + t[25],
        s2 * t[22] + s3 * t[17] + t[18],
    )


@njit(cache=True, inline="always")
def read_of(x: Mean, velocity: bool, coloured: bool) -> float:
    """Reading of a sensor without noise at this mean."""
    if not velocity:
        return x[1]
    return x[0] + x[3] if coloured else x[0]


@njit(cache=True, inline="always")
def _shown(p: Covariance, velocity: bool, coloured: bool) -> tuple[float, float, float, float, float]:
    """Covariances P H^T of a reading with nu, x, d and the fourth state, and its variance H P H^T, without noise."""
    if not velocity:
        return p[1], p[3], p[4], p[7], p[3]
    if not coloured:
        return p[0], p[1], p[2], p[6], p[0]
    return p[0] + p[6], p[1] + p[7], p[2] + p[8], p[6] + p[9], p[0] + p[6] + p[6] + p[9]


@njit(cache=True, inline="always")
def gains(p: Covariance, velocity: bool, coloured: bool, variance: float) -> tuple[float, Gain]:
    """The innovation's variance, and the gain of nu, x, d and the fourth state."""
    r0, r1, r2, r3, shown = _shown(p, velocity, coloured)
    total = shown + variance
    per = 1.0 / total
    return total, (r0 * per, r1 * per, r2 * per, r3 * per)


@njit(cache=True, inline="always")
def updated_covariance(p: Covariance, velocity: bool, coloured: bool, k: Gain) -> Covariance:
    """The covariance after a reading."""
    r0, r1, r2, r3, _ = _shown(p, velocity, coloured)
    return (
        p[0] - k[0] * r0,
        p[1] - k[0] * r1,
        p[2] - k[0] * r2,
        p[3] - k[1] * r1,
        p[4] - k[1] * r2,
        p[5] - k[2] * r2,
        p[6] - k[0] * r3,
        p[7] - k[1] * r3,
        p[8] - k[2] * r3,
        p[9] - k[3] * r3,
    )
