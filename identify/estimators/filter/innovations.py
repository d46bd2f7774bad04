"""Kalman innovations of one degree of freedom: the compiled inner loop over its events.

Events are measurements in time order, and their steps are indices into the table of `transitions`, so that all here is
scalar arithmetic on the ten numbers of the covariance (`state`).
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.estimators.filter.state import (
    INCREMENT,
    NO_STEP,
    VELOCITY,
    Indices,
    begun,
    gains,
    moved_covariance,
    moved_mean,
    read_of,
    updated_covariance,
)


@njit(cache=True, nogil=True, error_model="numpy")
def innovations(
    table: Array,
    step: Indices,
    force: Array,
    reading: Array,
    state_read: Indices,
    variance: Array,
    sigma_d: float,
    sigma_s: float,
    coloured: bool,
    initial: Array,
    gate_sigma: float,
) -> tuple[Array, Array, Array]:
    """Return innovations and their variances, (n,), NaN where a reading is NaN, and the gains (n, 4).

    table (k, COLUMNS) of `transitions`; step (n,) its row for the time since the event before, or NO_STEP; force
    (n, 2) N, held over the first and the second half of that step; reading (n,) in SI units; state_read (n,)
    VELOCITY, POSITION or INCREMENT; variance (n,) of each reading; sigma_s: standard deviation of the fourth state;
    coloured: whether that is an error of the velocity readings; initial (r, 4), by run: nu, x, their variances. A
    reading beyond `gate_sigma` standard deviations has its innovation clipped to that limit and does not update the
    state. An INCREMENT restarts x from zero, even if its reading is NaN.
    """
    n = step.shape[0]
    error, spread, gain = np.full(n, np.nan), np.full(n, np.nan), np.zeros((n, 4))
    mean, p = begun(initial[0], sigma_d, sigma_s)
    for i in range(n):
        if step[i] >= 0:
            row = table[step[i]]
            mean = moved_mean(row, mean, force[i, 0], force[i, 1])
            p = moved_covariance(row, p)
        elif step[i] < NO_STEP:
            mean, p = begun(initial[NO_STEP - step[i]], sigma_d, sigma_s)
        if np.isfinite(reading[i]):
            velocity = state_read[i] == VELOCITY
            e = reading[i] - read_of(mean, velocity, coloured)
            total, k = gains(p, velocity, coloured, variance[i])
            limit = gate_sigma * np.sqrt(total)
            spread[i] = total
            error[i] = min(max(e, -limit), limit)
            if abs(e) <= limit:
                gain[i, 0], gain[i, 1], gain[i, 2], gain[i, 3] = k
                mean = (mean[0] + k[0] * e, mean[1] + k[1] * e, mean[2] + k[2] * e, mean[3] + k[3] * e)
                p = updated_covariance(p, velocity, coloured, k)
        if state_read[i] == INCREMENT:
            mean = (mean[0], 0.0, mean[2], mean[3])
            p = (p[0], 0.0, p[2], 0.0, 0.0, p[5], p[6], 0.0, p[8], p[9])
    return error, spread, gain


@njit(cache=True, nogil=True, error_model="numpy")
def log_likelihood(
    table: Array,
    step: Indices,
    force: Array,
    reading: Array,
    state_read: Indices,
    variance: Array,
    sigma_d: float,
    sigma_s: float,
    coloured: bool,
    initial: Array,
) -> float:
    """Return the log likelihood of the readings, without constants; -inf where a variance or the state has run away.

    The arguments are those of `innovations`, without a gate.
    """
    out = 0.0
    mean, p = begun(initial[0], sigma_d, sigma_s)
    for i in range(step.shape[0]):
        if step[i] >= 0:
            row = table[step[i]]
            mean = moved_mean(row, mean, force[i, 0], force[i, 1])
            p = moved_covariance(row, p)
        elif step[i] < NO_STEP:
            mean, p = begun(initial[NO_STEP - step[i]], sigma_d, sigma_s)
        if np.isfinite(reading[i]):
            velocity = state_read[i] == VELOCITY
            e = reading[i] - read_of(mean, velocity, coloured)
            total, k = gains(p, velocity, coloured, variance[i])
            if not total > 0.0:
                return -np.inf
            out -= 0.5 * (np.log(total) + e * e / total)
            mean = (mean[0] + k[0] * e, mean[1] + k[1] * e, mean[2] + k[2] * e, mean[3] + k[3] * e)
            p = updated_covariance(p, velocity, coloured, k)
        if state_read[i] == INCREMENT:
            mean = (mean[0], 0.0, mean[2], mean[3])
            p = (p[0], 0.0, p[2], 0.0, 0.0, p[5], p[6], 0.0, p[8], p[9])
    return out if np.isfinite(out) else -np.inf


@njit(cache=True, nogil=True)
def filtered_means(
    table: Array, step: Indices, force: Array, error: Array, gain: Array, state_read: Indices, initial: Array
) -> Array:
    """Means of nu, x and d after each event (n, 3), from the gains and innovations (n,) of an earlier filter run; an
    innovation is 0 without a reading."""
    out = np.empty((step.shape[0], 3))
    nu, x, d, s = initial[0, 0], initial[0, 1], 0.0, 0.0
    for i in range(step.shape[0]):
        if step[i] >= 0:
            nu, x, d, s = moved_mean(table[step[i]], (nu, x, d, s), force[i, 0], force[i, 1])
        elif step[i] < NO_STEP:
            nu, x, d, s = initial[NO_STEP - step[i], 0], initial[NO_STEP - step[i], 1], 0.0, 0.0
        nu, x = nu + gain[i, 0] * error[i], x + gain[i, 1] * error[i]
        d, s = d + gain[i, 2] * error[i], s + gain[i, 3] * error[i]
        out[i, 0], out[i, 1], out[i, 2] = nu, x, d
        if state_read[i] == INCREMENT:
            x = 0.0
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def smoothed_velocity(
    table: Array,
    step: Indices,
    force: Array,
    reading: Array,
    state_read: Indices,
    variance: Array,
    sigma_d: float,
    sigma_s: float,
    coloured: bool,
    initial: Array,
) -> Array:
    """Mean of nu (n,) at every event given all readings, earlier and later.

    The adjoint form of Bryson and Frazier (1963; Bierman 1977, eqs 10.2.1 to 10.2.4) inverts no matrix, so an
    INCREMENT, after which x is certain, does no harm.
    """
    n = step.shape[0]
    means, spreads = np.empty(n), np.empty((n, 4))
    surprise, gain = np.zeros(n), np.zeros((n, 4))
    mean, p = begun(initial[0], sigma_d, sigma_s)
    for i in range(n):
        if step[i] >= 0:
            row = table[step[i]]
            mean = moved_mean(row, mean, force[i, 0], force[i, 1])
            p = moved_covariance(row, p)
        elif step[i] < NO_STEP:
            mean, p = begun(initial[NO_STEP - step[i]], sigma_d, sigma_s)
        means[i] = mean[0]
        spreads[i, 0], spreads[i, 1], spreads[i, 2], spreads[i, 3] = p[0], p[1], p[2], p[6]
        if np.isfinite(reading[i]):
            velocity = state_read[i] == VELOCITY
            e = reading[i] - read_of(mean, velocity, coloured)
            total, k = gains(p, velocity, coloured, variance[i])
            gain[i, 0], gain[i, 1], gain[i, 2], gain[i, 3] = k
            surprise[i] = e / total
            mean = (mean[0] + k[0] * e, mean[1] + k[1] * e, mean[2] + k[2] * e, mean[3] + k[3] * e)
            p = updated_covariance(p, velocity, coloured, k)
        if state_read[i] == INCREMENT:
            mean = (mean[0], 0.0, mean[2], mean[3])
            p = (p[0], 0.0, p[2], 0.0, 0.0, p[5], p[6], 0.0, p[8], p[9])
    out = np.empty(n)
    a0, a1, a2, a3 = 0.0, 0.0, 0.0, 0.0
    for i in range(n - 1, -1, -1):
        if state_read[i] == INCREMENT:
            a1 = 0.0
        if np.isfinite(reading[i]):
            update = gain[i, 0] * a0 + gain[i, 1] * a1 + gain[i, 2] * a2 + gain[i, 3] * a3 + surprise[i]
            if state_read[i] == VELOCITY:
                a0 -= update
                if coloured:
                    a3 -= update
            else:
                a1 -= update
        out[i] = means[i] - (
            spreads[i, 0] * a0 + spreads[i, 1] * a1 + spreads[i, 2] * a2 + spreads[i, 3] * a3
        )
        if step[i] >= 0:
            t = table[step[i]]
            a0, a1, a2, a3 = (
                t[0] * a0 + t[3] * a1,
                t[1] * a0 + t[4] * a1,
                t[2] * a0 + t[5] * a1 + t[6] * a2 + t[22] * a3,
                t[19] * a0 + t[20] * a1 + t[21] * a2 + t[17] * a3,
            )
        elif step[i] < NO_STEP:
            a0, a1, a2, a3 = 0.0, 0.0, 0.0, 0.0
    return out


@njit(cache=True, nogil=True, error_model="numpy")
def responses(
    table: Array,
    step: NDArray[np.int64],
    force: Array,
    early: Array,
    off: Array,
    read: NDArray[np.bool_],
    state_read: NDArray[np.int64],
    gain: Array,
    std: Array,
    coloured: bool,
) -> Array:
    """Innovations (rows, k) over `std` (rows,) of a filter with given gains (n, 4), in response to unknown inputs.

    force, early, off: forces over each step and over its first half, and reading errors, (n, k) each, or (0, k) for
    none; coloured: as in `innovations`. x is the vehicle's state less the filter's. Columns are computed together for
    vectorisation.
    """
    count = force.shape[1]
    pushed, wrong = len(force) > 0, len(off) > 0
    out = np.zeros((std.shape[0], count))
    x = np.zeros((4, count))
    row = 0
    for i in range(step.shape[0]):
        if step[i] >= 0:
            move_response(x, table, step[i], count)
            if pushed:
                push_response(x, table, step[i], force, early, i, count)
        elif step[i] < NO_STEP:
            x[:] = 0.0
        if read[i]:
            if wrong:
                for c in range(count):
                    out[row, c] = off[i, c]
            tell_response(x, state_read[i] == VELOCITY, coloured, gain, i, 1.0 / std[row], out, row, count)
            row += 1
        if state_read[i] == INCREMENT:
            for c in range(count):
                x[1, c] = 0.0
    return out


# Each takes whole arrays and the number of a row: a view of a row for every event costs as much as the row's work.


@njit(cache=True, inline="always")
def move_response(x: Array, table: Array, at: int, count: int) -> None:
    """Move the responses (4, k) of `count` columns one step."""
    t = table[at]
    t0, t1, t2, t3, t4, t5, t6 = t[0], t[1], t[2], t[3], t[4], t[5], t[6]
    t33, t03, t13, t23, t32 = t[17], t[19], t[20], t[21], t[22]
    for c in range(count):
        a, b, d, s = x[0, c], x[1, c], x[2, c], x[3, c]
        x[0, c] = t0 * a + t1 * b + t2 * d + t03 * s
        x[1, c] = t3 * a + t4 * b + t5 * d + t13 * s
        x[2, c] = t6 * d + t23 * s
        x[3, c] = t32 * d + t33 * s


@njit(cache=True, inline="always")
def push_response(x: Array, table: Array, at: int, force: Array, early: Array, i: int, count: int) -> None:
    """Add the effect of forces in a step: by rows i of their means over it, and over its first half."""
    to_nu, to_x = 2.0 * table[at, 9], 2.0 * table[at, 10]
    first_nu, first_x = table[at, 7] - table[at, 9], table[at, 8] - table[at, 10]
    for c in range(count):
        x[0, c] += to_nu * force[i, c] + first_nu * early[i, c]
        x[1, c] += to_x * force[i, c] + first_x * early[i, c]


@njit(cache=True, inline="always")
def tell_response(
    x: Array,
    velocity: bool,
    coloured: bool,
    gain: Array,
    i: int,
    scale: float,
    out: Array,
    row: int,
    count: int,
) -> None:
    """Update the responses by a reading of gain i that is off by a row of `out`, and fill in the innovations there,
    times `scale`."""
    k0, k1, k2, k3 = gain[i, 0], gain[i, 1], gain[i, 2], gain[i, 3]
    if velocity:
        error = 1.0 if coloured else 0.0
        for c in range(count):
            e = x[0, c] + error * x[3, c] + out[row, c]
            out[row, c] = scale * e
            x[0, c] -= k0 * e
            x[1, c] -= k1 * e
            x[2, c] -= k2 * e
            x[3, c] -= k3 * e
    else:
        for c in range(count):
            e = x[1, c] + out[row, c]
            out[row, c] = scale * e
            x[0, c] -= k0 * e
            x[1, c] -= k1 * e
            x[2, c] -= k2 * e
            x[3, c] -= k3 * e
