"""Gradient and information of one degree of freedom's likelihood, in one pass over its events.

The filter runs for all parameters at once: a run at theta, and a run for each parameter that affects the gains, with
that parameter slightly larger, which gives the derivatives by forward differences. A parameter that acts only as a
force uses the gains of the first run (Gupta and Mehra 1974, eqs 33 to 35). Only a block of events is stored.

For vectorisation, each number of the state is an array over the runs, and loops over the runs are innermost.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.estimators.filter.state import (
    INCREMENT,
    VELOCITY,
    Covariance,
    Gain,
    gains,
    moved_covariance,
    moved_mean,
    read_of,
    updated_covariance,
)
from identify.estimators.filter.transitions import COLUMNS

Indices = NDArray[np.int64]

STEP = 1e-6
"""Step of a logarithm: the relative error of the forward difference is about as large, and rounding adds about
1e-10."""

LANES = 16
"""Length of arrays over runs or linear parameters, the most of either. The compiler has to know it to vectorise.

An axis has at most 11 runs and 13 linear parameters: no more than four masses act in it by Coriolis forces.
"""

TOGETHER = 8
"""Runs are computed in multiples of this; those beyond the last repeat it, and linear parameters beyond
the last are zero."""

BLOCK = 256
"""Readings whose derivatives are stored before they are added to the information: enough for a fast product, and few
enough for the cache."""

HALF_ROOT = np.sqrt(0.5)


@njit(cache=True, nogil=True, error_model="numpy", fastmath={"contract", "reassoc", "arcp", "nsz"})
def gradient_and_information(
    tables: Array,
    step: Indices,
    force: Array,
    shapes: Array,
    shapes_used: Indices,
    coriolis: Array,
    dofs: Indices,
    masses: Array,
    reading: Array,
    state_read: Indices,
    variances: Array,
    channel: Indices,
    scale: Array,
    sigma_d: Array,
    sigma_s: Array,
    coloured: bool,
    initial: Array,
) -> tuple[Array, Array]:
    """Return the gradient (p,) of the log likelihood and the information (p, p), p = c - 1 + k: first the curved,
    then the linear parameters.

    There are c runs, the first at theta and each other with one parameter STEP larger. For each run: tables (c,
    steps, COLUMNS) of `transitions`, variances (c, channels) of the readings' noise, sigma_d (c,) and sigma_s (c,).
    The k linear parameters are factors on the shapes (n, j) of force with the numbers `shapes_used`, then logarithms of
    masses (m,), which act by the columns `dofs` (m,) of coriolis (n, 6). channel (n,) of each reading, and scale (n,),
    the factor on its noise. The other arguments are those of `innovations`, without a gate, and of a single run:
    initial (4,). c and k are at most LANES.
    """
    runs, shaped, linear = tables.shape[0], len(shapes_used), len(shapes_used) + len(dofs)
    if max(runs, linear) > LANES:
        raise ValueError("more runs or linear parameters than LANES")
    run_lanes, linear_lanes = _padded(runs), _padded(linear)
    table, noise = np.zeros((tables.shape[1], COLUMNS, LANES)), np.zeros((variances.shape[1], LANES))
    mean, cov = np.zeros((4, LANES)), np.zeros((10, LANES))
    for lane in range(run_lanes):
        r = min(lane, runs - 1)
        # Loops, because a slice's assignment takes 2 s longer to compile.
        for column in range(COLUMNS):
            for k in range(tables.shape[1]):
                table[k, column, lane] = tables[r, k, column]
        for c in range(variances.shape[1]):
            noise[c, lane] = variances[r, c]
        mean[0, lane], mean[1, lane] = initial[0], initial[1]
        cov[0, lane], cov[3, lane] = initial[2], initial[3]
        cov[5, lane], cov[9, lane] = sigma_d[r] ** 2, sigma_s[r] ** 2
    push, response = np.zeros(LANES), np.zeros((4, LANES))
    error, spread, answer = np.zeros((BLOCK, LANES)), np.zeros((BLOCK, LANES)), np.zeros((BLOCK, LANES))
    rows = np.zeros((2 * BLOCK, runs + linear))
    product = np.zeros((runs + linear, runs + linear))
    count = 0
    for i in range(step.shape[0]):
        if step[i] >= 0:
            _move(table[step[i]], mean, cov, force[i, 0], force[i, 1], run_lanes)
            for c in range(shaped):
                push[c] = shapes[i, shapes_used[c]]
            for c in range(len(dofs)):
                push[shaped + c] = coriolis[i, dofs[c]] * masses[c]
            _move_response(tables[0, step[i]], response, push, linear_lanes)
        if np.isfinite(reading[i]):
            read, variance, share = reading[i], noise[channel[i]], scale[i] * scale[i]
            e, total = error[count], spread[count]
            # The compiler vectorises only loops without a choice of the state that is read.
            if state_read[i] != VELOCITY:
                _, k = gains(_covariance(cov, 0), False, False, variance[0] * share)
                _tell(mean, cov, read, variance, share, e, total, False, False, run_lanes)
                _tell_response(response, k, answer[count], False, False, linear_lanes)
            elif coloured:
                _, k = gains(_covariance(cov, 0), True, True, variance[0] * share)
                _tell(mean, cov, read, variance, share, e, total, True, True, run_lanes)
                _tell_response(response, k, answer[count], True, True, linear_lanes)
            else:
                _, k = gains(_covariance(cov, 0), True, False, variance[0] * share)
                _tell(mean, cov, read, variance, share, e, total, True, False, run_lanes)
                _tell_response(response, k, answer[count], True, False, linear_lanes)
            count += 1
        if state_read[i] == INCREMENT:
            for lane in range(run_lanes):
                mean[1, lane] = 0.0
                cov[1, lane] = cov[3, lane] = cov[4, lane] = cov[7, lane] = 0.0
            for lane in range(linear_lanes):
                response[1, lane] = 0.0
        if count == BLOCK:
            _normalise(error, spread, answer, runs, linear, rows)
            product += rows.T @ rows
            count = 0
    _normalise(error[:count], spread[:count], answer[:count], runs, linear, rows)
    product += rows[: 2 * count].T @ rows[: 2 * count]
    return -product[0, 1:], product[1:, 1:].copy()


@njit(cache=True, inline="always")
def _padded(count: int) -> int:
    return (count + TOGETHER - 1) // TOGETHER * TOGETHER


@njit(cache=True, inline="always")
def _covariance(cov: Array, lane: int) -> Covariance:
    return (
        cov[0, lane], cov[1, lane], cov[2, lane], cov[3, lane], cov[4, lane],
        cov[5, lane], cov[6, lane], cov[7, lane], cov[8, lane], cov[9, lane],
    )  # fmt: skip


@njit(cache=True, inline="always")
def _keep(cov: Array, lane: int, p: Covariance) -> None:
    (
        cov[0, lane], cov[1, lane], cov[2, lane], cov[3, lane], cov[4, lane],
        cov[5, lane], cov[6, lane], cov[7, lane], cov[8, lane], cov[9, lane],
    ) = p  # fmt: skip


@njit(cache=True, inline="always")
def _move(table: Array, mean: Array, cov: Array, early: float, late: float, lanes: int) -> None:
    """Move means (4, LANES) and covariances (10, LANES) one step, by a row of the table (COLUMNS, LANES)."""
    for lane in range(lanes):
        row = table[:, lane]
        m = moved_mean(row, (mean[0, lane], mean[1, lane], mean[2, lane], mean[3, lane]), early, late)
        p = moved_covariance(row, _covariance(cov, lane))
        mean[0, lane], mean[1, lane], mean[2, lane], mean[3, lane] = m
        _keep(cov, lane, p)


@njit(cache=True, inline="always")
def _tell(
    mean: Array,
    cov: Array,
    reading: float,
    noise: Array,
    share: float,
    error: Array,
    spread: Array,
    velocity: bool,
    coloured: bool,
    lanes: int,
) -> None:
    """Update means and covariances by a reading of variance `share` times noise (LANES,); fill in the innovations and
    their variances, (LANES,)."""
    for lane in range(lanes):
        e = reading - read_of(
            (mean[0, lane], mean[1, lane], mean[2, lane], mean[3, lane]), velocity, coloured
        )
        p = _covariance(cov, lane)
        total, k = gains(p, velocity, coloured, noise[lane] * share)
        error[lane], spread[lane] = e, total
        mean[0, lane] += k[0] * e
        mean[1, lane] += k[1] * e
        mean[2, lane] += k[2] * e
        mean[3, lane] += k[3] * e
        _keep(cov, lane, updated_covariance(p, velocity, coloured, k))


@njit(cache=True, inline="always")
def _move_response(row: Array, response: Array, push: Array, lanes: int) -> None:
    """Move the responses (4, LANES) to the forces of the linear parameters one step; push (LANES,): those forces."""
    for lane in range(lanes):
        x = (response[0, lane], response[1, lane], response[2, lane], response[3, lane])
        x = moved_mean(row, x, push[lane], push[lane])
        response[0, lane], response[1, lane], response[2, lane], response[3, lane] = x


@njit(cache=True, inline="always")
def _tell_response(
    response: Array, k: Gain, answer: Array, velocity: bool, coloured: bool, lanes: int
) -> None:
    """Update the responses by a reading; fill in those of the innovation, (LANES,)."""
    for lane in range(lanes):
        x = (response[0, lane], response[1, lane], response[2, lane], response[3, lane])
        e = -read_of(x, velocity, coloured)
        answer[lane] = e
        response[0, lane] += k[0] * e
        response[1, lane] += k[1] * e
        response[2, lane] += k[2] * e
        response[3, lane] += k[3] * e


@njit(cache=True, inline="always")
def _normalise(error: Array, spread: Array, answer: Array, runs: int, linear: int, rows: Array) -> None:
    """Fill in two rows for each reading, whose product with their transpose is the information; the product with the
    first column is minus the gradient.

    The first row has the innovation e and its derivatives, over the root of its variance S. The second has 1 - e^2/S
    and the derivatives of S over S, both over the root of 2.
    """
    for j in range(len(error)):
        e, total = error[j, 0], spread[j, 0]
        over = 1.0 / total
        root = np.sqrt(over)
        per_e, per_total = root / STEP, HALF_ROOT * over / STEP
        rows[2 * j, 0], rows[2 * j + 1, 0] = e * root, HALF_ROOT * (1.0 - e * e * over)
        for r in range(1, runs):
            rows[2 * j, r] = (error[j, r] - e) * per_e
            rows[2 * j + 1, r] = (spread[j, r] - total) * per_total
        for c in range(linear):
            rows[2 * j, runs + c] = answer[j, c] * root
