"""Kalman innovations of one degree of freedom with a coloured force: the compiled inner loop.

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

Steps are indices into a table of the few different steps that a recording has. `transitions` computes each step once;
everything after is scalar arithmetic on the ten numbers of the covariance.
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
"""Instead of a row of the table, for an event without a step before it. NO_STEP - r begins run r > 0: the filter then
forgets all, and its state is that of the run's first instant."""

COLUMNS = 26


@njit(cache=True, nogil=True, error_model="numpy")
def transitions(
    different_s: Array,
    mass: float,
    dampings: Array,
    stiffness: float,
    sigma_d: float,
    time_constant_s: float,
    rise_s: float,
    white_forces: Array,
    sigma_c: float,
    coloured_s: float,
    smoothing_s: float,
) -> Array:
    """Return a row of COLUMNS numbers for each of the steps (k,) with each of the dampings (b,), (k b, COLUMNS).

    A row holds the transition (00 01 02 10 11 12 22), the response of nu and x to a unit force held over the first
    and over the second half of the step, and the process noise (00 01 02 11 12 22); then, of the fourth state, the
    transition 33 and the noise 33, the transitions 03 13 23 32 and the noise 03 13 23.

    rise_s: r of the disturbance, 0 for one of first order, whose fourth state is the readings' error: sigma_c its
    standard deviation, in the reading's unit, coloured_s its time constant. white_forces (k,): N per root of 1/s (N m
    in rotation). smoothing_s: time constant of the filter that nu comes out of, 0 for no filter; x is the vehicle's own
    position or angle.
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
        steady, moving = 0.0, 2.0 * sigma_d * sigma_d / (rise_s * rise_s * time_constant_s)
    else:
        rate[2, 2] = -1.0 / time_constant_s
        rate[3, 3] = -1.0 / coloured_s
        steady, moving = 2.0 * sigma_d * sigma_d / time_constant_s, 2.0 * sigma_c * sigma_c / coloured_s
    for i in range(out.shape[0]):
        direct = (white_forces[i // brackets] / mass) ** 2
        h = different_s[i // brackets]
        rate[0, 0] = -dampings[i % brackets] / mass
        rate[1, 0] = 1.0 + smoothing_s * rate[0, 0]
        eighth = _series(rate, 0.125 * h)
        quarter = _product(eighth, eighth)
        half = _product(quarter, quarter)
        full = _product(half, half)
        # Numbers, because a slice's assignment takes 2 s longer to compile.
        out[i, 0], out[i, 1], out[i, 2] = full[0, 0], full[0, 1], full[0, 2]
        out[i, 3], out[i, 4], out[i, 5], out[i, 6] = full[1, 0], full[1, 1], full[1, 2], full[2, 2]
        # Simpson's rule for the response to a force.
        to_nu_early, to_x_early = _pushed(quarter, smoothing_s)
        to_nu, to_x = _pushed(half, smoothing_s)
        late_nu = h / 12.0 / mass * (1.0 + 4.0 * to_nu_early + to_nu)
        late_x = h / 12.0 / mass * (smoothing_s + 4.0 * to_x_early + to_x)
        out[i, 7] = half[0, 0] * late_nu + half[0, 1] * late_x
        out[i, 8] = half[1, 0] * late_nu + half[1, 1] * late_x
        out[i, 9], out[i, 10] = late_nu, late_x
        # And for the noise of a quarter of the step, of which the whole is made.
        noise = _noise(eighth, quarter, 0.25 * h, steady, moving, direct, smoothing_s)
        noise = _twice(noise, quarter)
        noise = _twice(noise, half)
        out[i, 11], out[i, 12], out[i, 13] = noise[0, 0], noise[0, 1], noise[0, 2]
        out[i, 14], out[i, 15], out[i, 16] = noise[1, 1], noise[1, 2], noise[2, 2]
        out[i, 17], out[i, 18] = full[3, 3], noise[3, 3]
        out[i, 19], out[i, 20], out[i, 21], out[i, 22] = full[0, 3], full[1, 3], full[2, 3], full[3, 2]
        out[i, 23], out[i, 24], out[i, 25] = noise[0, 3], noise[1, 3], noise[2, 3]
    return out


@njit(cache=True, inline="always")
def _pushed(transition: Array, smoothing_s: float) -> tuple[float, float]:
    """nu and x after an impulse that adds 1 to nu and smoothing_s to x."""
    return (
        transition[0, 0] + smoothing_s * transition[0, 1],
        transition[1, 0] + smoothing_s * transition[1, 1],
    )


@njit(cache=True, nogil=True)
def _noise(
    half: Array, full: Array, h: float, steady: float, moving: float, direct: float, smoothing_s: float
) -> Array:
    """Covariance (4, 4) that white noise adds over a step, by Simpson's rule: noise of the intensities `steady` in d,
    `moving` in the fourth state, and `direct` in nu, with smoothing_s of it in x."""
    out = np.zeros((4, 4))
    for transition, weight in ((np.eye(4), 1.0), (half, 4.0), (full, 1.0)):
        for r in range(4):
            to_r = transition[r, 0] + smoothing_s * transition[r, 1]
            for c in range(r, 4):
                to_c = transition[c, 0] + smoothing_s * transition[c, 1]
                out[r, c] += (h / 6.0 * weight) * (
                    steady * transition[r, 2] * transition[c, 2]
                    + moving * transition[r, 3] * transition[c, 3]
                    + direct * to_r * to_c
                )
    for r in range(4):
        for c in range(r):
            out[r, c] = out[c, r]
    return out


@njit(cache=True, nogil=True)
def _twice(noise: Array, transition: Array) -> Array:
    """Covariance (4, 4) that the noise adds over two steps."""
    out = noise.copy()
    moved = _product(transition, noise)
    for r in range(4):
        for c in range(4):
            for k in range(4):
                out[r, c] += moved[r, k] * transition[c, k]
    return out


@njit(cache=True, nogil=True)
def _series(rate: Array, h: float) -> Array:
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


@njit(cache=True, inline="always")
def begun(initial: Array, sigma_d: float, sigma_s: float) -> tuple[Mean, Covariance]:
    """Mean and covariance at the first instant of a run; initial (4,)."""
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
    """Covariances of a reading with nu, x, d and the fourth state, and its variance but for noise."""
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


@njit(cache=True, nogil=True, error_model="numpy")
def responses(
    table: Array,
    step: NDArray[np.int64],
    force: Array,
    off: Array,
    read: NDArray[np.bool_],
    state_read: NDArray[np.int64],
    gain: Array,
    std: Array,
    coloured: bool,
) -> Array:
    """Innovations (rows, k) over `std` (rows,) of a filter with given gains (n, 4), in response to unknown inputs.

    force, off: forces and reading errors, (n, k) each, or (0, k) for none; coloured: as in `innovations`. x is the
    vehicle's state less the filter's. Columns are computed together for vectorisation.
    """
    count = force.shape[1]
    pushed, wrong = len(force) > 0, len(off) > 0
    out = np.empty((std.shape[0], count))
    x0, x1, x2, x3 = np.zeros(count), np.zeros(count), np.zeros(count), np.zeros(count)
    row = 0
    for i in range(step.shape[0]):
        if step[i] >= 0:
            t = table[step[i]]
            t0, t1, t2, t3, t4, t5, t6 = t[0], t[1], t[2], t[3], t[4], t[5], t[6]
            t33, t03, t13, t23, t32 = t[17], t[19], t[20], t[21], t[22]
            for c in range(count):
                a, b, d, s = x0[c], x1[c], x2[c], x3[c]
                x0[c] = t0 * a + t1 * b + t2 * d + t03 * s
                x1[c] = t3 * a + t4 * b + t5 * d + t13 * s
                x2[c] = t6 * d + t23 * s
                x3[c] = t32 * d + t33 * s
            if pushed:
                to_nu, to_x = t[7] + t[9], t[8] + t[10]
                for c in range(count):
                    x0[c] += to_nu * force[i, c]
                    x1[c] += to_x * force[i, c]
        elif step[i] < NO_STEP:
            x0[:], x1[:], x2[:], x3[:] = 0.0, 0.0, 0.0, 0.0
        if read[i]:
            k0, k1, k2, k3, scale = gain[i, 0], gain[i, 1], gain[i, 2], gain[i, 3], 1.0 / std[row]
            velocity = state_read[i] == VELOCITY
            error = 1.0 if velocity and coloured else 0.0
            for c in range(count):
                e = x0[c] + error * x3[c] if velocity else x1[c]
                if wrong:
                    e += off[i, c]
                out[row, c] = scale * e
                x0[c] -= k0 * e
                x1[c] -= k1 * e
                x2[c] -= k2 * e
                x3[c] -= k3 * e
            row += 1
        if state_read[i] == INCREMENT:
            x1[:] = 0.0
    return out
