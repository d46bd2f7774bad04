"""Kalman innovations of one degree of freedom with a first-order coloured force: the compiled inner loop.

State (nu, x, d) of   m nu_dot = F(t) - D nu - k x + d,   x_dot = nu,   d_dot = -d/T + white noise,
so that d is stationary with standard deviation `sigma_d` (Jazwinski 1970, theorem 7.1 for the recursion).
Events are measurements in time order: of nu, of x (an angle, or depth), or of how far x came since the last such
event (an INCREMENT: what a gyro that integrates between its messages tells).
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

VELOCITY, POSITION, INCREMENT = 0, 1, 2
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

    step_s (n,) s since the event before; force (n, 2) N, held over the first and the second half of that step;
    reading (n,) in SI units; state_read (n,) VELOCITY, POSITION or INCREMENT; variance (n,) of each reading;
    initial (4,): nu, x, their variances. An INCREMENT starts x anew from zero, also where its reading is NaN.
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
    half = np.eye(3)
    half_in = np.zeros(3)
    full = np.eye(3)
    q = np.zeros((3, 3))
    known_h = -1.0
    for i in range(n):
        if step_s[i] > 0.0:
            steps = 1 if step_s[i] <= LONGEST_STEP_S else 2 * int(np.ceil(0.5 * step_s[i] / LONGEST_STEP_S))
            h = step_s[i] / steps
            if abs(h - known_h) > 1e-9:
                _discretise(rate, white, 1.0 / mass, h, half, half_in, full, q)
                known_h = h
            for k in range(steps):
                early = force[i, (2 * k) // steps]
                late = force[i, (2 * k + 1) // steps]
                x = _apply(half, x)
                for r in range(3):
                    x[r] += half_in[r] * early
                x = _apply(half, x)
                for r in range(3):
                    x[r] += half_in[r] * late
                p = _propagate(full, p, q)
        if np.isfinite(reading[i]):
            s = 0 if state_read[i] == VELOCITY else 1
            e = reading[i] - x[s]
            total = p[s, s] + variance[i]
            limit = gate_sigma * np.sqrt(total)
            spread[i] = total
            error[i] = min(max(e, -limit), limit)
            if abs(e) <= limit:
                gain = p[:, s] / total
                row = p[s, :].copy()
                for r in range(3):
                    x[r] += gain[r] * e
                    for c in range(3):
                        p[r, c] -= gain[r] * row[c]
        if state_read[i] == INCREMENT:
            x[1] = 0.0
            p[1, :] = 0.0
            p[:, 1] = 0.0
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
    rate: Array, white: float, per_mass: float, h: float, half: Array, half_in: Array, full: Array, q: Array
) -> None:
    """Transitions over h / 2 and h, the response to a force held over h / 2, and the process noise over h.

    The integrals are Simpson's.
    """
    quarter = _series(rate, 0.25 * h)
    half[:] = _product(quarter, quarter)
    full[:] = _product(half, half)
    for r in range(3):
        start_u = per_mass if r == 0 else 0.0
        half_in[r] = h / 12.0 * (start_u + 4.0 * quarter[r, 0] * per_mass + half[r, 0] * per_mass)
        for c in range(3):
            start = white if r == 2 and c == 2 else 0.0
            middle = half[r, 2] * white * half[c, 2]
            end = full[r, 2] * white * full[c, 2]
            q[r, c] = h / 6.0 * (start + 4.0 * middle + end)
