"""State transition and process noise of the Kalman filter, once for each of the few step lengths of a recording."""

import numpy as np
from numba import njit

from bridge.arrays import Array

COLUMNS = 26


@njit(cache=True, nogil=True, error_model="numpy")
def transitions(
    different_s: Array,
    mass: float,
    dampings: Array,
    stiffness: float,
    sigmas_d: Array,
    time_constant_s: float,
    rise_s: float,
    white_forces: Array,
    sigma_c: float,
    coloured_s: float,
    smoothing_s: float,
) -> Array:
    """Return a row of COLUMNS numbers for each of the steps (k,) s with each of the dampings (b,), (k b, COLUMNS).

    The state is the velocity nu, the position or angle x, the disturbance d and a fourth. A row holds, by column:

    - 0 to 6: elements 00 01 02 10 11 12 22 of the transition;
    - 7 to 10: nu and x after a unit force held over the first half of the step, then over the second;
    - 11 to 16: elements 00 01 02 11 12 22 of the process noise;
    - 17 to 25, of the fourth state: transition 33, noise 33, transitions 03 13 23 32, noise 03 13 23.

    sigmas_d (k,): standard deviation of the disturbance as each step drives it, N (N m in rotation). rise_s: r of the
    disturbance, 0 for one of first order, whose fourth state is the readings' error: sigma_c its standard deviation, in
    the reading's unit, coloured_s its time constant. white_forces (k,): N per root of 1/s (N m in rotation).
    smoothing_s: time constant of the filter that nu comes out of, 0 for no filter; x is the vehicle's own position or
    angle.
    """
    brackets = dampings.shape[0]
    out = np.empty((different_s.shape[0] * brackets, COLUMNS))
    rate = np.zeros((4, 4))
    rate[0, 1] = -stiffness / mass
    rate[0, 2] = 1.0 / mass
    # The input of a first-order filter is its output plus smoothing_s times the output's rate.
    rate[1, 1] = smoothing_s * rate[0, 1]
    rate[1, 2] = smoothing_s * rate[0, 2]
    if rise_s > 0.0:
        rate[2, 3] = 1.0
        rate[3, 2] = -1.0 / (rise_s * time_constant_s)
        rate[3, 3] = -1.0 / rise_s
        of_square_d, of_square_s = 0.0, 2.0 / (rise_s * rise_s * time_constant_s)
    else:
        rate[2, 2] = -1.0 / time_constant_s
        rate[3, 3] = -1.0 / coloured_s
        of_square_d, of_square_s = 2.0 / time_constant_s, 0.0
    noise_of_readings = 0.0 if rise_s > 0.0 else 2.0 * sigma_c * sigma_c / coloured_s
    for i in range(out.shape[0]):
        noise_nu = (white_forces[i // brackets] / mass) ** 2
        noise_d = of_square_d * sigmas_d[i // brackets] ** 2
        noise_fourth = of_square_s * sigmas_d[i // brackets] ** 2 + noise_of_readings
        h = different_s[i // brackets]
        rate[0, 0] = -dampings[i % brackets] / mass
        rate[1, 0] = 1.0 + smoothing_s * rate[0, 0]
        eighth = _exponential(rate, 0.125 * h)
        quarter = _product(eighth, eighth)
        half = _product(quarter, quarter)
        full = _product(half, half)
        # Numbers, because a slice's assignment takes 2 s longer to compile.
        out[i, 0], out[i, 1], out[i, 2] = full[0, 0], full[0, 1], full[0, 2]
        out[i, 3], out[i, 4], out[i, 5], out[i, 6] = full[1, 0], full[1, 1], full[1, 2], full[2, 2]
        # Simpson's rule for the response to a force.
        nu_after_quarter, x_after_quarter = _after_impulse(quarter, smoothing_s)
        nu_after_half, x_after_half = _after_impulse(half, smoothing_s)
        late_nu = h / 12.0 / mass * (1.0 + 4.0 * nu_after_quarter + nu_after_half)
        late_x = h / 12.0 / mass * (smoothing_s + 4.0 * x_after_quarter + x_after_half)
        out[i, 7] = half[0, 0] * late_nu + half[0, 1] * late_x
        out[i, 8] = half[1, 0] * late_nu + half[1, 1] * late_x
        out[i, 9], out[i, 10] = late_nu, late_x
        # And for the noise of a quarter of the step, of which the whole is made.
        noise = _noise_of_step(eighth, quarter, 0.25 * h, noise_d, noise_fourth, noise_nu, smoothing_s)
        noise = _noise_of_two(noise, quarter)
        noise = _noise_of_two(noise, half)
        out[i, 11], out[i, 12], out[i, 13] = noise[0, 0], noise[0, 1], noise[0, 2]
        out[i, 14], out[i, 15], out[i, 16] = noise[1, 1], noise[1, 2], noise[2, 2]
        out[i, 17], out[i, 18] = full[3, 3], noise[3, 3]
        out[i, 19], out[i, 20], out[i, 21], out[i, 22] = full[0, 3], full[1, 3], full[2, 3], full[3, 2]
        out[i, 23], out[i, 24], out[i, 25] = noise[0, 3], noise[1, 3], noise[2, 3]
    return out


@njit(cache=True, inline="always")
def _after_impulse(transition: Array, smoothing_s: float) -> tuple[float, float]:
    """nu and x after an impulse that adds 1 to nu and smoothing_s to x."""
    return (
        transition[0, 0] + smoothing_s * transition[0, 1],
        transition[1, 0] + smoothing_s * transition[1, 1],
    )


@njit(cache=True, nogil=True)
def _noise_of_step(
    half: Array,
    full: Array,
    h: float,
    noise_d: float,
    noise_fourth: float,
    noise_nu: float,
    smoothing_s: float,
) -> Array:
    """Covariance (4, 4) that white noise adds over a step, by Simpson's rule: of the intensities `noise_d` in d,
    `noise_fourth` in the fourth state, and `noise_nu` in nu, with smoothing_s of it in x."""
    out = np.zeros((4, 4))
    for transition, weight in ((np.eye(4), 1.0), (half, 4.0), (full, 1.0)):
        for r in range(4):
            to_r = transition[r, 0] + smoothing_s * transition[r, 1]
            for c in range(r, 4):
                to_c = transition[c, 0] + smoothing_s * transition[c, 1]
                out[r, c] += (h / 6.0 * weight) * (
                    noise_d * transition[r, 2] * transition[c, 2]
                    + noise_fourth * transition[r, 3] * transition[c, 3]
                    + noise_nu * to_r * to_c
                )
    for r in range(4):
        for c in range(r):
            out[r, c] = out[c, r]
    return out


@njit(cache=True, nogil=True)
def _noise_of_two(noise: Array, transition: Array) -> Array:
    """Covariance (4, 4) that the noise adds over two steps."""
    out = noise.copy()
    moved = _product(transition, noise)
    for r in range(4):
        for c in range(4):
            for k in range(4):
                out[r, c] += moved[r, k] * transition[c, k]
    return out


@njit(cache=True, nogil=True)
def _exponential(rate: Array, h: float) -> Array:
    """exp(rate h) to the sixth order."""
    out = np.eye(4)
    term = np.eye(4)
    for k in range(1, 7):
        term = _product(term, rate) * (h / k)
        out += term
    return out


@njit(cache=True, inline="always")
def _product(a: Array, b: Array) -> Array:
    """Product of 4 by 4 matrices, for which a call of BLAS takes longer."""
    out = np.empty((4, 4))
    for r in range(4):
        for c in range(4):
            out[r, c] = a[r, 0] * b[0, c] + a[r, 1] * b[1, c] + a[r, 2] * b[2, c] + a[r, 3] * b[3, c]
    return out
