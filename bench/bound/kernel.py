"""The joint Kalman filter of all six degrees of freedom at the true parameters, with its sensitivities, compiled.

State (17): nu (6), disturbance as an acceleration (6), roll, pitch, yaw, depth, turned (the integral of yaw rate
since the last mean of the fibre-optic gyro). Parameters (48): log total masses (6), log dampings (6), trim forces
(6), log spread of the disturbance as an acceleration (6), log of its time constant (6), log noise by axis and channel
(6 x 3: velocity or rate; depth or angle; fibre-optic gyro).

The equations are Fossen's (2011, eqs 2.28, 6.1 to 6.3), linearised about the filter's own estimate. The gains'
derivatives by the parameters come from a small Riccati recursion of each axis next to the joint one (`shadow`).
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.arrays import Array

NU, PUSH, ROLL, PITCH, YAW, DEPTH, TURNED, STATES = 0, 6, 12, 13, 14, 15, 16, 17
LOG_MASS, LOG_DAMPING, TRIM, LOG_SPREAD, LOG_TIME, LOG_NOISE, PARAMETERS = 0, 6, 12, 18, 24, 30, 48
SIZE, LOCALS, NOISES = 4, 6, 3
"""Of an axis's shadow: number of states, number of parameters, and place of the first noise among the parameters."""

ORDER = (1, 0, 2, 2)
"""Number of times that each state of a shadow integrates the push."""

HEAVE, YAW_RATE = np.int64(2), np.int64(5)
AT_SPEED, AT_POSITION, AT_TURNED = np.int64(0), np.int64(2), np.int64(3)
OF_RATE, OF_POSITION, OF_FOG = np.int64(0), np.int64(1), np.int64(2)
"""Axes, places in a shadow, and channels of noise. Plain numbers would compile `_read` anew for each of them."""

SMALL = 1e-4
BLOCK = 256
"""Number of sensitivities that are gathered before they are added to the information."""


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
    """Mean wrench (n, 6), N and N m, over each step of `step_s`, and the recorded readings in time order.

    dvl (a, 3) at `arm` (3,); gyro (b, 3); fog (c, 1); angles (e, 3) roll pitch yaw; depth (f, 1). `every` (5,): their
    periods in steps, 0 for a missing sensor; `dvl_first`: step of the first DVL reading; `variance` (6,): of one
    reading of dvl, gyro, fog, tilt, heading, depth.
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


class Shadow(NamedTuple):
    """Derivatives of the covariance, and so of the gains, by the parameters.

    by_mass (6, STATES, STATES): derivative of the joint covariance by each log mass, exact. All other derivatives
    come from a small filter of each axis: p (6, SIZE, SIZE): covariance of speed, push, position (angle or depth),
    turned; dp (6, LOCALS, SIZE, SIZE): its derivatives by log damping, spread, time constant and the three noises;
    phi, q (6, SIZE, SIZE) and dphi, dq (6, LOCALS, SIZE, SIZE): transition and noise of a step, and their
    derivatives; state (6, SIZE): places in the joint state, -1 if absent; column (6, LOCALS): places among the
    parameters.
    """

    by_mass: Array
    p: Array
    dp: Array
    phi: Array
    dphi: Array
    q: Array
    dq: Array
    state: NDArray[np.int64]
    column: NDArray[np.int64]


class Score(NamedTuple):
    """Sums over the readings: log likelihood (1,), gradient (PARAMETERS,), information (PARAMETERS, PARAMETERS).

    `rows` (BLOCK, PARAMETERS) gathers sensitivities over their spread; `used` (1,) is the number gathered so far.
    """

    likelihood: Array
    gradient: Array
    information: Array
    rows: Array
    used: NDArray[np.int64]


def new_score() -> Score:
    information = np.zeros((PARAMETERS, PARAMETERS))
    rows = np.zeros((BLOCK, PARAMETERS))
    return Score(np.zeros(1), np.zeros(PARAMETERS), information, rows, np.zeros(1, np.int64))


def shared_noise(m: int, n: int, h: float) -> float:
    """Covariance of the m-fold and n-fold integrals of white noise over h, relative to the noise's own."""
    return h ** (m + n) / ((m + n + 1) * math.factorial(m) * math.factorial(n))


def new_shadow(model: Model, covariance: Array, h: float) -> Shadow:
    """The shadow of a joint covariance (STATES, STATES) that depends on the spread of the disturbance alone."""
    state = np.full((6, SIZE), -1, np.int64)
    state[:, 0], state[:, 1] = np.arange(6), PUSH + np.arange(6)
    state[2, 2], state[3:, 2], state[5, 3] = DEPTH, [ROLL, PITCH, YAW], TURNED
    column = np.empty((6, LOCALS), np.int64)
    p, q, phi = (np.zeros((6, SIZE, SIZE)) for _ in range(3))
    dp, dq, dphi = (np.zeros((6, LOCALS, SIZE, SIZE)) for _ in range(3))
    half = 0.5 * h * h
    for axis in range(6):
        noises = [LOG_NOISE + 3 * axis + channel for channel in range(3)]
        column[axis] = [LOG_DAMPING + axis, LOG_SPREAD + axis, LOG_TIME + axis, *noises]
        known = np.flatnonzero(state[axis] >= 0)
        p[axis][np.ix_(known, known)] = covariance[np.ix_(state[axis][known], state[axis][known])]
        drag, time_s = model.damping[axis] / model.mass[axis], model.disturbance_time_s[axis]
        stiff = model.righting_nm / model.mass[axis] if axis in (3, 4) else 0.0
        keep = np.exp(-h / time_s)
        phi[axis] = np.eye(SIZE)
        phi[axis, 0, :3] = 1.0 - h * drag + half * (drag * drag - stiff), h - half * drag, -h * stiff
        phi[axis, 1, 1] = keep
        if axis > 1:
            phi[axis, 2, :3] = h - half * drag, half, 1.0 - half * stiff
        if axis == 5:
            phi[axis, 3, :2] = h - half * drag, half
        white = (model.disturbance_std[axis] / model.mass[axis]) ** 2 * (1.0 - keep**2)
        for a in range(SIZE):
            for b in range(SIZE):
                if state[axis, a] >= 0 and state[axis, b] >= 0:
                    q[axis, a, b] = white * shared_noise(ORDER[a], ORDER[b], h)
        dphi[axis, 0, 0, :2] = -h * drag, -half * drag
        dphi[axis, 2, 1, 1] = keep * h / time_s
        dq[axis, 1] = 2.0 * q[axis]
        dq[axis, 2] = -2.0 * h / time_s * keep**2 / (1.0 - keep**2) * q[axis]
        dp[axis, 1, 1, 1] = 2.0 * p[axis, 1, 1]
    return Shadow(np.zeros((6, STATES, STATES)), p, dp, phi, dphi, q, dq, state, column)


@njit(cache=True, error_model="numpy")
def _motion(x: Array, tau: Array, model: Model, out: Array) -> None:
    """Time derivative of the state; the decay of the disturbance is applied exactly elsewhere."""
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
def _jacobian(x: Array, m: Array, model: Model, a: Array) -> None:
    """Derivative of `_motion` by the state at total masses m (6,), and the disturbance's decay."""
    d = model.damping
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
    """Derivative of nu_dot (6) by masses, dampings and trims, into (STATES, PARAMETERS).

    A mass divides the force on its own axis (the disturbance is held as an acceleration, which its mass leaves
    unchanged) and causes Coriolis forces in the others.
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
def _shadow_read(shadow: Shadow, axis: int, place: int, channel: int, variance: float, gain: Array) -> Array:
    """Update an axis's covariance and its derivatives by a reading of the state at `place`.

    Fills `gain` (LOCALS, SIZE), the derivatives of the gain, and returns the derivatives (LOCALS,) of the log of the
    innovation's variance. With L = 1 - K H and P+ = L P L' + K R K', dP+ = L dP L' + K dR K' at the optimal gain.
    """
    p, dp = shadow.p[axis], shadow.dp[axis]
    total = p[place, place] + variance
    k = p[:, place] / total
    relative = np.empty(LOCALS)
    for j in range(LOCALS):
        change = dp[j, place, place]
        if j == NOISES + channel:
            change += 2.0 * variance
        relative[j] = change / total
        column = dp[j, :, place].copy()
        for a in range(SIZE):
            gain[j, a] = (column[a] - k[a] * change) / total
            for b in range(SIZE):
                dp[j, a, b] += k[a] * k[b] * change - k[a] * column[b] - column[a] * k[b]
    row = p[place].copy()
    for a in range(SIZE):
        for b in range(SIZE):
            p[a, b] -= k[a] * row[b]
    return relative


@njit(cache=True, error_model="numpy")
def _sandwich(left: Array, middle: Array, right: Array, out: Array) -> None:
    """Add left middle right' to `out`, (SIZE, SIZE) each."""
    for a in range(SIZE):
        for c in range(SIZE):
            if left[a, c] != 0.0:
                for b in range(SIZE):
                    total = 0.0
                    for d in range(SIZE):
                        total += middle[c, d] * right[b, d]
                    out[a, b] += left[a, c] * total


@njit(cache=True, error_model="numpy")
def _shadow_predict(shadow: Shadow) -> None:
    """Propagate every axis's covariance and its derivatives over a step."""
    for axis in range(6):
        phi, dphi, p = shadow.phi[axis], shadow.dphi[axis], shadow.p[axis]
        for j in range(LOCALS):
            moved = shadow.dq[axis, j].copy()
            _sandwich(phi, shadow.dp[axis, j], phi, moved)
            if j == 0 or j == 2:
                cross = np.zeros((SIZE, SIZE))
                _sandwich(dphi[j], p, phi, cross)
                moved += cross + cross.T
            shadow.dp[axis, j] = moved
        carried = shadow.q[axis].copy()
        _sandwich(phi, p, phi, carried)
        shadow.p[axis] = carried


@njit(cache=True, error_model="numpy")
def _times_row(p: Array, row: Array, out: Array) -> None:
    """out = p row, for a row with few nonzero entries and a symmetric p."""
    out[:] = 0.0
    for i in range(STATES):
        if row[i] != 0.0:
            for k in range(STATES):
                out[k] += p[i, k] * row[i]


@njit(cache=True, error_model="numpy")
def _read(
    row: Array,
    reading: float,
    variance: float,
    axis: int,
    place: int,
    channel: int,
    shadow: Shadow,
    x: Array,
    p: Array,
    s: Array,
    score: Score,
) -> None:
    """Score one scalar reading, then update the filter; `row` (STATES,) is its row of the state.

    `place` is its place in the shadow of `axis`.
    """
    if np.isnan(reading):
        return
    ph, column, slope = np.empty(STATES), np.empty(STATES), np.zeros(PARAMETERS)
    error = reading
    for i in range(STATES):
        if row[i] != 0.0:
            error -= row[i] * x[i]
            slope += row[i] * s[i]
    _times_row(p, row, ph)
    spread = row @ ph + variance
    gain = ph / spread
    by_gain = np.empty((LOCALS, SIZE))
    relative = _shadow_read(shadow, axis, place, channel, variance, by_gain)
    used = score.used[0]
    if used + 2 > BLOCK:
        score.information[:] += score.rows[:used].T @ score.rows[:used]
        used = 0
    score.rows[used] = slope / np.sqrt(spread)
    score.rows[used + 1] = 0.0
    score.gradient[:] += slope * (error / spread)
    score.likelihood[0] -= 0.5 * (np.log(spread) + error * error / spread)
    surprise = 0.5 * (error * error / spread - 1.0)
    for j in range(LOCALS):
        score.rows[used + 1, shadow.column[axis, j]] = relative[j] * np.sqrt(0.5)
        score.gradient[shadow.column[axis, j]] += surprise * relative[j]
    for i in range(STATES):
        x[i] += gain[i] * error
        for k in range(STATES):
            p[i, k] -= gain[i] * ph[k]
        for k in range(PARAMETERS):
            s[i, k] -= gain[i] * slope[k]
    for j in range(6):
        dp = shadow.by_mass[j]
        _times_row(dp, row, column)
        change = row @ column
        score.rows[used + 1, LOG_MASS + j] = change / spread * np.sqrt(0.5)
        score.gradient[LOG_MASS + j] += surprise * change / spread
        for i in range(STATES):
            s[i, LOG_MASS + j] += (column[i] - gain[i] * change) * (error / spread)
            mine, its = gain[i] * change - column[i], gain[i]
            for k in range(STATES):
                dp[i, k] += mine * gain[k] - its * column[k]
    for j in range(LOCALS):
        for a in range(SIZE):
            if shadow.state[axis, a] >= 0:
                s[shadow.state[axis, a], shadow.column[axis, j]] += by_gain[j, a] * error
    score.used[0] = used + 2


@njit(cache=True, error_model="numpy")
def _forget(place: int, x: Array, p: Array, s: Array) -> None:
    """Reset a state to a known zero."""
    x[place] = 0.0
    p[place, :] = 0.0
    p[:, place] = 0.0
    s[place, :] = 0.0


@njit(cache=True, error_model="numpy", nogil=True)
def scored(model: Model, recorded: Recorded, x: Array, p: Array, shadow: Shadow, score: Score) -> None:
    """Fill `score` with the log likelihood at the truth, its gradient and its Fisher information.

    x (STATES,) and p (STATES, STATES) are the estimate and covariance at the start; both are advanced in place.
    """
    h = recorded.step_s
    s = np.zeros((STATES, PARAMETERS))
    a, drive = np.zeros((STATES, STATES)), np.zeros((STATES, PARAMETERS))
    heavier, lighter = np.zeros((STATES, STATES)), np.zeros((STATES, STATES))
    phi, first, second = np.empty((STATES, STATES)), np.empty(STATES), np.empty(STATES)
    eye = np.eye(STATES)
    keep = np.exp(-h / model.disturbance_time_s)
    row, unused = np.zeros(STATES), np.zeros(STATES)
    dvl_every, gyro_every, fog_every = recorded.every[0], recorded.every[1], recorded.every[2]
    angle_every, depth_every = recorded.every[3], recorded.every[4]
    arm, variance = recorded.arm, recorded.variance
    for step in range(len(recorded.wrench)):
        if step >= recorded.dvl_first and (step - recorded.dvl_first) % dvl_every == 0:
            said = recorded.dvl[(step - recorded.dvl_first) // dvl_every]
            for i in range(3):
                row[:] = 0.0
                row[i] = 1.0
                row[3 + (i + 1) % 3], row[3 + (i + 2) % 3] = arm[(i + 2) % 3], -arm[(i + 1) % 3]
                _read(row, said[i], variance[0], i, AT_SPEED, OF_RATE, shadow, x, p, s, score)
        if step % gyro_every == 0:
            for i in range(3):
                row[:] = 0.0
                row[3 + i] = 1.0
                said_rad_s = recorded.gyro[step // gyro_every, i]
                _read(row, said_rad_s, variance[1], 3 + i, AT_SPEED, OF_RATE, shadow, x, p, s, score)
        if fog_every > 0 and step > 0 and step % fog_every == 0:
            span = fog_every * h
            row[:] = 0.0
            row[TURNED] = 1.0
            turned = recorded.fog[step // fog_every - 1, 0] * span
            spread = variance[2] * span**2
            _read(row, turned, spread, YAW_RATE, AT_TURNED, OF_FOG, shadow, x, p, s, score)
            _forget(TURNED, x, p, s)
            for j in range(6):
                _forget(TURNED, unused, shadow.by_mass[j], s)
            shadow.p[5, 3, :] = 0.0
            shadow.p[5, :, 3] = 0.0
            shadow.dp[5, :, 3, :] = 0.0
            shadow.dp[5, :, :, 3] = 0.0
        if step % angle_every == 0:
            for i in range(3):
                row[:] = 0.0
                row[ROLL + i] = 1.0
                said_rad = recorded.angles[step // angle_every, i]
                said_rad -= 2 * np.pi * np.round((said_rad - x[ROLL + i]) / (2 * np.pi))
                spread = variance[3] if i < 2 else variance[4]
                _read(row, said_rad, spread, 3 + i, AT_POSITION, OF_POSITION, shadow, x, p, s, score)
        if step % depth_every == 0:
            row[:] = 0.0
            row[DEPTH] = 1.0
            said_m = recorded.depth[step // depth_every, 0]
            _read(row, said_m, variance[5], HEAVE, AT_POSITION, OF_POSITION, shadow, x, p, s, score)
        tau = recorded.wrench[step] + model.trim
        _motion(x, tau, model, first)
        middle = x + 0.5 * h * first
        middle[6:12] *= np.sqrt(keep)
        _jacobian(middle, model.mass, model, a)
        _motion(middle, tau, model, second)
        _by_parameter(middle, second, model, drive)
        ah = h * a
        change = h * (drive + 0.5 * (ah @ drive))
        for i in range(6):
            change[PUSH + i, LOG_TIME + i] = keep[i] * h / model.disturbance_time_s[i] * x[PUSH + i]
        x += h * second
        x[6:12] *= keep
        phi[:] = eye + ah + 0.5 * (ah @ ah)
        for i in range(6):
            phi[6 + i, 6 + i] = keep[i]
        s = phi @ s + change
        turned_p = p @ phi.T
        for j in range(6):
            mass = model.mass.copy()
            mass[j] = model.mass[j] * (1.0 + SMALL)
            _jacobian(middle, mass, model, heavier)
            mass[j] = model.mass[j] * (1.0 - SMALL)
            _jacobian(middle, mass, model, lighter)
            cross = ((heavier[:6] - lighter[:6]) * (0.5 * h / SMALL)) @ turned_p
            moved = phi @ shadow.by_mass[j] @ phi.T
            moved[:6] += cross
            moved[:, :6] += cross.T
            shadow.by_mass[j] = moved
        moved = phi @ turned_p
        for i in range(6):
            for b in range(SIZE):
                for c in range(SIZE):
                    if shadow.state[i, b] >= 0 and shadow.state[i, c] >= 0:
                        moved[shadow.state[i, b], shadow.state[i, c]] += shadow.q[i, b, c]
        _shadow_predict(shadow)
        p[:] = 0.5 * (moved + moved.T)
    used = score.used[0]
    score.information[:] += score.rows[:used].T @ score.rows[:used]
    score.used[0] = 0
