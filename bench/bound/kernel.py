"""The joint Kalman filter of all six degrees of freedom at the true parameters, with its sensitivities, compiled.

State (17): nu (6), disturbance as an acceleration (6), roll, pitch, yaw, depth, turned (the integral of yaw rate
since the last mean of the fibre-optic gyro). Parameters (18): log total masses (6), log dampings (6), trim forces (6).
The equations are Fossen's (2011, eqs 2.28, 6.1 to 6.3), linearised about the filter's own estimate.
"""

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

NU, PUSH, ROLL, PITCH, YAW, DEPTH, TURNED, STATES = 0, 6, 12, 13, 14, 15, 16, 17
LOG_MASS, LOG_DAMPING, TRIM, PARAMETERS = 0, 6, 12, 18


class Model(NamedTuple):
    """The truth in SI units: (6,) each for mass, damping, trim and the disturbance's std (N, N m) and time constant."""

    mass: Array
    damping: Array
    trim: Array
    righting_nm: float
    net_up_n: float
    disturbance_std: Array
    disturbance_time_s: Array


class Recorded(NamedTuple):
    """Wrench (n, 6) N and N m, its mean over each step of `step_s`; readings in time order, as they were recorded.

    dvl (a, 3) at `arm` (3,); gyro (b, 3); fog (c, 1); angles (e, 3) roll pitch yaw; depth (f, 1). `every` (5,) their
    periods in steps, 0 for a sensor that is not there; `dvl_first` the step of the first of the DVL; `variance` (6,)
    of one reading of dvl, gyro, fog, tilt, heading, depth.
    """

    step_s: float
    wrench: Array
    arm: Array
    dvl: Array
    gyro: Array
    fog: Array
    angles: Array
    depth: Array
    every: NDArray[np.int64]
    dvl_first: int
    variance: Array


@njit(cache=True, error_model="numpy")
def _motion(x: Array, tau: Array, model: Model, out: Array) -> None:
    """The time derivative of the state; the disturbance's own decay is left to the exact answer."""
    m, d = model.mass, model.damping
    u, v, w, p, q, r = x[0], x[1], x[2], x[3], x[4], x[5]
    sr, cr, sp, cp = np.sin(x[ROLL]), np.cos(x[ROLL]), np.sin(x[PITCH]), np.cos(x[PITCH])
    up, arm = model.net_up_n, model.righting_nm
    out[0] = (tau[0] - m[2] * w * q + m[1] * v * r - d[0] * u + up * sp) / m[0] + x[6]
    out[1] = (tau[1] - m[0] * u * r + m[2] * w * p - d[1] * v - up * cp * sr) / m[1] + x[7]
    out[2] = (tau[2] - m[1] * v * p + m[0] * u * q - d[2] * w - up * cp * cr) / m[2] + x[8]
    out[3] = (tau[3] - (m[2] - m[1]) * v * w - (m[5] - m[4]) * q * r - d[3] * p - arm * cp * sr) / m[3] + x[9]
    out[4] = (tau[4] - (m[0] - m[2]) * u * w - (m[3] - m[5]) * p * r - d[4] * q - arm * sp) / m[4] + x[10]
    out[5] = (tau[5] - (m[1] - m[0]) * u * v - (m[4] - m[3]) * p * q - d[5] * r) / m[5] + x[11]
    out[6:12] = 0.0
    out[ROLL] = p + sp / cp * (q * sr + r * cr)
    out[PITCH] = q * cr - r * sr
    out[YAW] = (q * sr + r * cr) / cp
    out[DEPTH] = -sp * u + cp * sr * v + cp * cr * w
    out[TURNED] = r


@njit(cache=True, error_model="numpy")
def _jacobian(x: Array, model: Model, a: Array) -> None:
    """The derivative of `_motion` by the state, and the disturbance's decay."""
    m, d = model.mass, model.damping
    u, v, w, p, q, r = x[0], x[1], x[2], x[3], x[4], x[5]
    sr, cr, sp, cp = np.sin(x[ROLL]), np.cos(x[ROLL]), np.sin(x[PITCH]), np.cos(x[PITCH])
    up, arm = model.net_up_n, model.righting_nm
    for i in range(6):
        a[i, i] = -d[i] / m[i]
        a[i, 6 + i] = 1.0
        a[6 + i, 6 + i] = -1.0 / model.disturbance_time_s[i]
    a[0, 1], a[0, 2], a[0, 4], a[0, 5] = m[1] * r / m[0], -m[2] * q / m[0], -m[2] * w / m[0], m[1] * v / m[0]
    a[1, 0], a[1, 2], a[1, 3], a[1, 5] = -m[0] * r / m[1], m[2] * p / m[1], m[2] * w / m[1], -m[0] * u / m[1]
    a[2, 0], a[2, 1], a[2, 3], a[2, 4] = m[0] * q / m[2], -m[1] * p / m[2], -m[1] * v / m[2], m[0] * u / m[2]
    k, h, n = (m[2] - m[1]) / m[3], (m[0] - m[2]) / m[4], (m[1] - m[0]) / m[5]
    a[3, 1], a[3, 2], a[4, 0], a[4, 2], a[5, 0], a[5, 1] = -k * w, -k * v, -h * w, -h * u, -n * v, -n * u
    k, h, n = (m[5] - m[4]) / m[3], (m[3] - m[5]) / m[4], (m[4] - m[3]) / m[5]
    a[3, 4], a[3, 5], a[4, 3], a[4, 5], a[5, 3], a[5, 4] = -k * r, -k * q, -h * r, -h * p, -n * q, -n * p
    a[0, PITCH] = up * cp / m[0]
    a[1, ROLL], a[1, PITCH] = -up * cp * cr / m[1], up * sp * sr / m[1]
    a[2, ROLL], a[2, PITCH] = up * cp * sr / m[2], up * sp * cr / m[2]
    a[3, ROLL], a[3, PITCH] = -arm * cp * cr / m[3], arm * sp * sr / m[3]
    a[4, PITCH] = -arm * cp / m[4]
    tan = sp / cp
    a[ROLL, 3], a[ROLL, 4], a[ROLL, 5] = 1.0, tan * sr, tan * cr
    a[ROLL, ROLL], a[ROLL, PITCH] = tan * (q * cr - r * sr), (q * sr + r * cr) / cp**2
    a[PITCH, 4], a[PITCH, 5], a[PITCH, ROLL] = cr, -sr, -q * sr - r * cr
    a[YAW, 4], a[YAW, 5] = sr / cp, cr / cp
    a[YAW, ROLL], a[YAW, PITCH] = (q * cr - r * sr) / cp, (q * sr + r * cr) * sp / cp**2
    a[DEPTH, 0], a[DEPTH, 1], a[DEPTH, 2] = -sp, cp * sr, cp * cr
    a[DEPTH, ROLL] = cp * (cr * v - sr * w)
    a[DEPTH, PITCH] = -cp * u - sp * (sr * v + cr * w)
    a[TURNED, 5] = 1.0


@njit(cache=True, error_model="numpy")
def _by_parameter(x: Array, motion: Array, model: Model, out: Array) -> None:
    """The derivative of nu_dot (6) by the parameters (6, PARAMETERS).

    A mass divides what pushes its own axis (the disturbance is held as an acceleration, which its mass leaves
    alone) and makes Coriolis forces in the others.
    """
    m, d = model.mass, model.damping
    u, v, w, p, q, r = x[0], x[1], x[2], x[3], x[4], x[5]
    for i in range(6):
        out[i, LOG_MASS + i] = -(motion[i] - x[6 + i])
        out[i, LOG_DAMPING + i] = -d[i] * x[i] / m[i]
        out[i, TRIM + i] = 1.0 / m[i]
    out[0, 1], out[0, 2] = m[1] * v * r / m[0], -m[2] * w * q / m[0]
    out[1, 0], out[1, 2] = -m[0] * u * r / m[1], m[2] * w * p / m[1]
    out[2, 0], out[2, 1] = m[0] * u * q / m[2], -m[1] * v * p / m[2]
    out[3, 1], out[3, 2], out[3, 4], out[3, 5] = (
        m[1] * v * w / m[3], -m[2] * v * w / m[3], m[4] * q * r / m[3], -m[5] * q * r / m[3],
    )  # fmt: skip
    out[4, 0], out[4, 2], out[4, 3], out[4, 5] = (
        -m[0] * u * w / m[4], m[2] * u * w / m[4], -m[3] * p * r / m[4], m[5] * p * r / m[4],
    )  # fmt: skip
    out[5, 0], out[5, 1], out[5, 3], out[5, 4] = (
        m[0] * u * v / m[5], -m[1] * u * v / m[5], m[3] * p * q / m[5], -m[4] * p * q / m[5],
    )  # fmt: skip


@njit(cache=True, error_model="numpy")
def _read(
    row: Array, reading: float, variance: float, x: Array, p: Array, s: Array, gradient: Array, total: Array
) -> None:
    """One scalar reading: its share of gradient and information, then the update of estimate and sensitivities."""
    if np.isnan(reading):
        return
    error = reading - row @ x
    ph = p @ row
    spread = row @ ph + variance
    slope = row @ s
    for i in range(PARAMETERS):
        gradient[i] += slope[i] * error / spread
        for k in range(PARAMETERS):
            total[i, k] += slope[i] * slope[k] / spread
    for i in range(STATES):
        gain = ph[i] / spread
        x[i] += gain * error
        for k in range(STATES):
            p[i, k] -= gain * ph[k]
        for k in range(PARAMETERS):
            s[i, k] -= gain * slope[k]


@njit(cache=True, error_model="numpy", nogil=True)
def scored(model: Model, recorded: Recorded, x: Array, p: Array) -> tuple[Array, Array]:
    """Gradient (PARAMETERS,) of the log likelihood at the truth, and the Fisher information.

    x (STATES,) and p (STATES, STATES) are the estimate and covariance at the start; both are moved on in place.
    """
    h = recorded.step_s
    gradient, total = np.zeros(PARAMETERS), np.zeros((PARAMETERS, PARAMETERS))
    s = np.zeros((STATES, PARAMETERS))
    a, phi, drive = np.zeros((STATES, STATES)), np.empty((STATES, STATES)), np.zeros((STATES, PARAMETERS))
    first, second, pushed = np.empty(STATES), np.empty(STATES), np.zeros((6, PARAMETERS))
    eye = np.eye(STATES)
    keep = np.exp(-h / model.disturbance_time_s)
    stationary = (model.disturbance_std / model.mass) ** 2
    white = stationary * (1.0 - keep**2)
    row = np.zeros(STATES)
    dvl_every, gyro_every, fog_every = recorded.every[0], recorded.every[1], recorded.every[2]
    angle_every, depth_every = recorded.every[3], recorded.every[4]
    arm = recorded.arm
    for step in range(len(recorded.wrench)):
        if step >= recorded.dvl_first and (step - recorded.dvl_first) % dvl_every == 0:
            said = recorded.dvl[(step - recorded.dvl_first) // dvl_every]
            for i in range(3):
                row[:] = 0.0
                row[i] = 1.0
                row[3 + (i + 1) % 3], row[3 + (i + 2) % 3] = arm[(i + 2) % 3], -arm[(i + 1) % 3]
                _read(row, said[i], recorded.variance[0], x, p, s, gradient, total)
        if step % gyro_every == 0:
            for i in range(3):
                row[:] = 0.0
                row[3 + i] = 1.0
                _read(
                    row, recorded.gyro[step // gyro_every, i], recorded.variance[1], x, p, s, gradient, total
                )
        if fog_every > 0 and step > 0 and step % fog_every == 0:
            span = fog_every * h
            row[:] = 0.0
            row[TURNED] = 1.0
            turned = recorded.fog[step // fog_every - 1, 0] * span
            _read(row, turned, recorded.variance[2] * span**2, x, p, s, gradient, total)
            x[TURNED] = 0.0
            p[TURNED, :] = 0.0
            p[:, TURNED] = 0.0
            s[TURNED, :] = 0.0
        if step % angle_every == 0:
            for i in range(3):
                row[:] = 0.0
                row[ROLL + i] = 1.0
                said_rad = recorded.angles[step // angle_every, i]
                said_rad -= 2 * np.pi * np.round((said_rad - x[ROLL + i]) / (2 * np.pi))
                spread = recorded.variance[3] if i < 2 else recorded.variance[4]
                _read(row, said_rad, spread, x, p, s, gradient, total)
        if step % depth_every == 0:
            row[:] = 0.0
            row[DEPTH] = 1.0
            _read(row, recorded.depth[step // depth_every, 0], recorded.variance[5], x, p, s, gradient, total)
        tau = recorded.wrench[step] + model.trim
        _motion(x, tau, model, first)
        middle = x + 0.5 * h * first
        middle[6:12] *= np.sqrt(keep)
        _jacobian(middle, model, a)
        _motion(middle, tau, model, second)
        _by_parameter(middle, second, model, pushed)
        drive[:6] = pushed
        x += h * second
        x[6:12] *= keep
        ah = h * a
        phi[:] = eye + ah + 0.5 * (ah @ ah)
        for i in range(6):
            phi[6 + i, 6 + i] = keep[i]
        s = phi @ s + h * (drive + 0.5 * (ah @ drive))
        moved = phi @ p @ phi.T
        for i in range(6):
            moved[6 + i, 6 + i] += white[i]
            moved[i, 6 + i] += 0.5 * h * white[i]
            moved[6 + i, i] += 0.5 * h * white[i]
            moved[i, i] += h * h / 3.0 * white[i]
        p[:] = 0.5 * (moved + moved.T)
    return gradient, total
