"""Gradient and information of one degree of freedom's likelihood, in one pass over its events.

The filter runs for all parameters at once: a run at theta, and a run for each parameter that affects the gains, with
that parameter slightly larger, which gives the derivatives by forward differences. A parameter that acts only as a
force uses the gains of the first run (Gupta and Mehra 1974, eqs 33 to 35). No event is stored.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from identify.estimators.innovations import (
    INCREMENT,
    VELOCITY,
    gains,
    moved_covariance,
    moved_mean,
    told_covariance,
)

Array = NDArray[np.float64]
Indices = NDArray[np.int64]

STEP = 1e-6
"""Step of a logarithm: the relative error of the forward difference is about as large, and rounding adds about
1e-10."""


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc", "arcp", "nsz"})
def gradient_and_information(
    tables: Array,
    step: Indices,
    force: Array,
    columns: Array,
    reading: Array,
    state_read: Indices,
    variances: Array,
    channel: Indices,
    scale: Array,
    sigma_d: Array,
    sigma_c: Array,
    initial: Array,
) -> tuple[Array, Array]:
    """Return the gradient (p,) of the log likelihood and the information (p, p), p = c - 1 + k: first the curved,
    then the linear parameters.

    There are c runs, the first at theta and each other with one parameter STEP larger. For each run: tables (c,
    steps, COLUMNS) of `transitions`, variances (c, channels) of the readings' noise, sigma_d (c,) and sigma_c (c,).
    columns (n, k): the force of a unit of each linear parameter. channel (n,) of each reading, and scale (n,), the
    factor on its noise. The other arguments are those of `innovations`, without a gate.
    """
    runs, linear = tables.shape[0], columns.shape[1]
    curved = runs - 1
    size = curved + linear
    gradient, information = np.zeros(size), np.zeros((size, size))
    mean, cov = np.zeros((runs, 4)), np.zeros((runs, 10))
    response = np.zeros((linear, 4))
    slope, widening = np.zeros(size), np.zeros(curved)
    for r in range(runs):
        mean[r, 0], mean[r, 1] = initial[0], initial[1]
        cov[r, 0], cov[r, 3] = initial[2], initial[3]
        cov[r, 5], cov[r, 9] = sigma_d[r] ** 2, sigma_c[r] ** 2
    for i in range(step.shape[0]):
        velocity = state_read[i] == VELOCITY
        read = np.isfinite(reading[i])
        error, spread = 0.0, 1.0
        k = (0.0, 0.0, 0.0, 0.0)
        for r in range(runs):
            m = (mean[r, 0], mean[r, 1], mean[r, 2], mean[r, 3])
            p = (
                cov[r, 0], cov[r, 1], cov[r, 2], cov[r, 3], cov[r, 4],
                cov[r, 5], cov[r, 6], cov[r, 7], cov[r, 8], cov[r, 9],
            )  # fmt: skip
            if step[i] >= 0:
                row = tables[r, step[i]]
                m = moved_mean(row, m, force[i, 0], force[i, 1])
                p = moved_covariance(row, p)
            if read:
                e = reading[i] - (m[0] + m[3] if velocity else m[1])
                total, gain = gains(p, velocity, variances[r, channel[i]] * scale[i] * scale[i])
                m = (m[0] + gain[0] * e, m[1] + gain[1] * e, m[2] + gain[2] * e, m[3] + gain[3] * e)
                p = told_covariance(p, velocity, gain)
                if r == 0:
                    error, spread, k = e, total, gain
                else:
                    slope[r - 1] = (e - error) / STEP
                    widening[r - 1] = (total - spread) / STEP
            if state_read[i] == INCREMENT:
                m = (m[0], 0.0, m[2], m[3])
                p = (p[0], 0.0, p[2], 0.0, 0.0, p[5], p[6], 0.0, p[8], p[9])
            mean[r, 0], mean[r, 1], mean[r, 2], mean[r, 3] = m
            (
                cov[r, 0], cov[r, 1], cov[r, 2], cov[r, 3], cov[r, 4],
                cov[r, 5], cov[r, 6], cov[r, 7], cov[r, 8], cov[r, 9],
            ) = p  # fmt: skip
        for c in range(linear):
            x = (response[c, 0], response[c, 1], response[c, 2], response[c, 3])
            if step[i] >= 0:
                x = moved_mean(tables[0, step[i]], x, columns[i, c], columns[i, c])
            if read:
                e = -(x[0] + x[3]) if velocity else -x[1]
                slope[curved + c] = e
                x = (x[0] + k[0] * e, x[1] + k[1] * e, x[2] + k[2] * e, x[3] + k[3] * e)
            if state_read[i] == INCREMENT:
                x = (x[0], 0.0, x[2], x[3])
            response[c, 0], response[c, 1], response[c, 2], response[c, 3] = x
        if read:
            over = 1.0 / spread
            surprise = 0.5 * over * (1.0 - error * error * over)
            for a in range(size):
                gradient[a] -= slope[a] * error * over
                own_slope = slope[a] * over
                for b in range(a + 1):
                    information[a, b] += own_slope * slope[b]
            for a in range(curved):
                gradient[a] -= widening[a] * surprise
                own_slope = 0.5 * widening[a] * over * over
                for b in range(a + 1):
                    information[a, b] += own_slope * widening[b]
    for a in range(size):
        for b in range(a):
            information[b, a] = information[a, b]
    return gradient, information
