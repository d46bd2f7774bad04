"""The difference of a model from a recorded motion, integrated from many starts: the compiled loop of `flown`."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

RUN_AWAY = np.array([10.0, 10.0, 10.0, 20.0, 20.0, 20.0])
"""Off by so much, m/s and rad/s, a simulation tells nothing any more: no vehicle with thrusters moves so fast under
water. Its flight ends there, or squares of its drift would be beyond what numbers hold."""


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
) -> Array:
    """The compiled loop of `Flown.off`, by Heun's rule, from each start in turn. A flight that runs away stays at the
    RUN_AWAY of the axis that it ran away in."""
    n, last = nu.shape[0], steps[-1]
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
            if at + k >= n:
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
                    if at + steps[h] < n:
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
    """How fast the difference d (6,) changes; a (6,) is its integral. ease (6,): one over the mass, 0 where an axis is
    not fitted; bent: whether any slope is not zero.

    What C(nu) nu of `bridge.vehicle.dynamics.coriolis` changes by: of a product u v it is du (v + dv) + u dv.
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
