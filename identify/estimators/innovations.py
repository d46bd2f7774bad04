"""Kalman innovations of one degree of freedom with a first-order coloured force: the compiled inner loop.

State (nu, x, d) of   m nu_dot = F(t) - D nu - k x + d,   x_dot = nu,   d_dot = -d/T + white noise,
so that d is stationary with standard deviation `sigma_d` (Jazwinski 1970, theorem 7.1 for the recursion).
Events are measurements in time order, each of nu or of x (an angle, or depth).
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

VELOCITY, POSITION = 0, 1
LONGEST_STEP_S = 0.1
"""Longer gaps are crossed in equal steps no longer than this, which keeps the series of the exponential exact."""


@njit(cache=True, error_model="numpy", fastmath=False)
def innovations(
    step_s: Array,
    force: Array,
    reading: Array,
    state_read: NDArray[np.int64],
    variance: Array,
    mass: float,
    damping: float,
    stiffness: float,
    sigma_d: float,
    time_constant_s: float,
    initial: Array,
    gate_sigma: float,
) -> tuple[Array, Array]:
    """Innovations and their variances, both (n,), NaN where a reading is NaN; a gated one comes back clipped.

    step_s (n,) s since the event before; force (n,) N, its mean over that step; reading (n,) in SI units;
    state_read (n,) VELOCITY or POSITION; variance (n,) of each reading; initial (4,): nu, x, their variances.
    """
    n = step_s.shape[0]
    error = np.full(n, np.nan)
    spread = np.full(n, np.nan)
    x = np.array([initial[0], initial[1], 0.0])
    p = np.zeros((3, 3))
    p[0, 0] = initial[2]
    p[1, 1] = initial[3]
    p[2, 2] = sigma_d * sigma_d
    rate = np.zeros((3, 3))
    rate[0, 0] = -damping / mass
    rate[0, 1] = -stiffness / mass
    rate[0, 2] = 1.0 / mass
    rate[1, 0] = 1.0
    rate[2, 2] = -1.0 / time_constant_s
    white = 2.0 * sigma_d * sigma_d / time_constant_s
    phi = np.eye(3)
    gain_in = np.zeros(3)
    q = np.zeros((3, 3))
    known_h = -1.0
    for i in range(n):
        if step_s[i] > 0.0:
            steps = int(np.ceil(step_s[i] / LONGEST_STEP_S - 1e-9))
            h = step_s[i] / steps
            if abs(h - known_h) > 1e-9:
                _discretise(rate, white, 1.0 / mass, h, phi, gain_in, q)
                known_h = h
            for _ in range(steps):
                x = _apply(phi, x)
                for r in range(3):
                    x[r] += gain_in[r] * force[i]
                p = _propagate(phi, p, q)
        if not np.isfinite(reading[i]):
            continue
        s = state_read[i]
        e = reading[i] - x[s]
        total = p[s, s] + variance[i]
        limit = gate_sigma * np.sqrt(total)
        spread[i] = total
        if abs(e) > limit:
            error[i] = limit if e > 0 else -limit
            continue
        error[i] = e
        gain = p[:, s] / total
        row = p[s, :].copy()
        for r in range(3):
            x[r] += gain[r] * e
            for c in range(3):
                p[r, c] -= gain[r] * row[c]
    return error, spread


@njit(cache=True)
def _apply(a: Array, x: Array) -> Array:
    out = np.zeros(3)
    for r in range(3):
        out[r] = a[r, 0] * x[0] + a[r, 1] * x[1] + a[r, 2] * x[2]
    return out


@njit(cache=True)
def _product(a: Array, b: Array) -> Array:
    out = np.zeros((3, 3))
    for r in range(3):
        for c in range(3):
            out[r, c] = a[r, 0] * b[0, c] + a[r, 1] * b[1, c] + a[r, 2] * b[2, c]
    return out


@njit(cache=True)
def _propagate(phi: Array, p: Array, q: Array) -> Array:
    out: Array = _product(_product(phi, p), phi.T)
    for r in range(3):
        for c in range(3):
            out[r, c] += q[r, c]
    return out


@njit(cache=True)
def _series(rate: Array, h: float) -> Array:
    """exp(rate h) to the sixth order."""
    out = np.eye(3)
    term = np.eye(3)
    for k in range(1, 7):
        term = _product(term, rate)
        for r in range(3):
            for c in range(3):
                term[r, c] *= h / k
                out[r, c] += term[r, c]
    return out


@njit(cache=True)
def _discretise(
    rate: Array, white: float, per_mass: float, h: float, phi: Array, gain_in: Array, q: Array
) -> None:
    """Transition, response to a force held over h, and process noise, the last two by Simpson's rule."""
    half = _series(rate, 0.5 * h)
    full = _product(half, half)
    for r in range(3):
        start_u = per_mass if r == 0 else 0.0
        gain_in[r] = h / 6.0 * (start_u + 4.0 * half[r, 0] * per_mass + full[r, 0] * per_mass)
        for c in range(3):
            phi[r, c] = full[r, c]
            start = white if r == 2 and c == 2 else 0.0
            middle = half[r, 2] * white * half[c, 2]
            end = full[r, 2] * white * full[c, 2]
            q[r, c] = h / 6.0 * (start + 4.0 * middle + end)
