"""How the velocity that the controller used (NU_FB) follows from the recorded readings, and how late it used them."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from bridge.vehicle.coefficients import DAMPINGS, DOFS, MASSES
from identify.dive import Array, Dive
from identify.identification import Doubt, Outcome
from identify.ingest.frozen import axis_key

TAPS = 8
MEMORIES_S = (0.3, 1.0, 3.0, 10.0)
LATEST_S, LATE_STEP_S = 0.3, 0.01
SINGULAR = 1e-12
"""Ratio of singular values of normal equations below which a direction counts as none."""

SAME = 1e-5
"""m/s: velocities closer than this are the same."""

EXPLAINED = 0.1
"""Share of the velocity sensor's noise. If the residual of NU_FB is no larger, its timing needs no other
explanation."""

EARLIER_SHARE = 0.5
"""Use of readings before their stamps is accepted only if it reduces the residual to less than this share."""


@dataclass(frozen=True)
class Fed:
    """How NU_FB came from the recorded velocity in one degree of freedom.

    left: residual of NU_FB after a causal linear filter of the readings, over their noise. late_s: time from a
    reading's stamp to its use; negative if it was used before its stamp.
    """

    left: float
    late_s: float


def fed_velocity(dive: Dive, dof: int) -> Fed | None:
    """Return how NU_FB came from the recorded velocity; None if there is too little data.

    Rates of turn are regressors together with the velocity: with a lever arm they carry it to the body's origin. A
    reading reaches the controller with a constant delay below LATEST_S; the delay that explains most is taken. Delays
    below zero, for readings whose stamps are late, are tried only if no other delay explains NU_FB. Spreads are
    medians, which dropouts and wild readings do not affect.
    """
    if dive.nu_fb is None or dive.velocity is None or dive.velocity_is_filtered:
        return None
    after = _best(dive, dof, np.arange(0.0, LATEST_S, LATE_STEP_S))
    if after is None or after.left <= EXPLAINED:
        return after
    before = _best(dive, dof, -np.arange(LATE_STEP_S, LATEST_S, LATE_STEP_S))
    return before if before is not None and before.left < EARLIER_SHARE * after.left else after


def stamp_doubts(dive: Dive) -> tuple[Doubt, ...]:
    """Return a doubt if the controller used velocities before their stamps in the recording."""
    by_dof = {dof: fed for dof in range(3) if (fed := fed_velocity(dive, dof)) is not None}
    early = {dof: -fed.late_s for dof, fed in by_dof.items() if fed.late_s < 0}
    if 2 * len(early) <= len(by_dof):
        return ()
    about = tuple(group[dof].name for group in (MASSES, DAMPINGS) for dof in range(3))
    late_ms = 1000 * float(np.median(list(early.values())))
    problem, remedy = (
        f"The controller used velocities (NU_FB) some {late_ms:.0f} ms before the recording says that they were read",
        ""
        "the DVL's stamps are late by that or more, and masses come out too large by it; mend the DVL's clock, or its "
        "latency in the vehicle file: seatrial doctor --wet tells how late each sensor is.",
    )
    return (Doubt(about, problem, remedy, Outcome.DISAGREES),)


def filtered_doubts(dive: Dive) -> tuple[Doubt, ...]:
    """Return a warning about the masses if velocity comes from an autopilot's filter. The filter's delay and
    smoothing are fitted, and their remaining error goes into the masses."""
    if not dive.velocity_is_filtered:
        return ()
    problem, remedy = (
        "Velocity comes from the autopilot's own filter, which smooths and delays it",
        "by how much is fitted, but "
        "masses in surge, sway and heave may be off by a few per cent more than their intervals; record the DVL's own "
        "readings.",
    )
    return (Doubt(tuple(mass.name for mass in MASSES[:3]), problem, remedy),)


def frozen_velocity(dive: Dive, dof: int) -> tuple[tuple[float, float], ...]:
    """Intervals in which the recorded velocity of an axis was frozen, alone or together with all others."""
    return dive.frozen.get("velocity", ()) + dive.frozen.get(axis_key("velocity", DOFS[dof]), ())


def _best(dive: Dive, dof: int, late_s: Array) -> Fed | None:
    """The best of the delays (n,) with which readings may be used; None if too little is known."""
    assert dive.nu_fb is not None
    assert dive.velocity is not None
    good = np.isfinite(dive.velocity.value[:, dof])
    time_s, read = dive.velocity.time_s[good], dive.velocity.value[good, dof]
    noise = white_noise(read)
    if not noise > 0:
        return None
    table = np.column_stack([_past(read), _memories(time_s, read)])
    fed = dive.nu_fb.value[:, dof]
    frozen = np.zeros(len(fed), dtype=np.bool_)  # `frozen_doubts` reports these
    for start_s, end_s in frozen_velocity(dive, dof):
        frozen |= (dive.nu_fb.time_s >= start_s) & (dive.nu_fb.time_s <= end_s + LATEST_S)
    best: Fed | None = None
    for by_s in late_s.tolist():
        latest = np.searchsorted(time_s, dive.nu_fb.time_s - by_s + 1e-6, side="right") - 1
        known = (latest >= TAPS) & np.isfinite(fed) & ~frozen
        if np.count_nonzero(known) < 10 * TAPS:
            return None
        columns = table
        if dive.gyro is not None and len(dive.gyro):
            columns = np.column_stack([table, np.nan_to_num(dive.gyro.held_at(time_s + by_s + 1e-6))])
        left = _left_by(columns[latest[known]], fed[known]) / noise
        if best is None or left < best.left:
            best = Fed(left, by_s)
        if left == 0.0:
            break
    return best


def _past(read: Array) -> Array:
    """Each reading (n,) and its predecessors, (n, TAPS); before the first reading, the first is repeated."""
    return np.asarray(read[np.maximum(np.arange(len(read))[:, None] - np.arange(TAPS), 0)], dtype=np.float64)


def _left_by(table: Array, fed: Array) -> float:
    """Spread of the residual of `fed` after a fit of the columns, of which the first TAPS are readings; 0 if most of
    `fed` equals one of these readings."""
    same = np.zeros(len(fed), dtype=np.bool_)
    for tap in table[:, :TAPS].T:
        same |= np.abs(tap - fed) < SAME
    if np.mean(same) > 0.5:
        return 0.0
    table = np.column_stack([table, np.ones(len(fed))])
    length = np.sqrt(np.einsum("nk,nk->k", table, table))
    table /= np.where(length > 0, length, 1.0)
    square, left = table.T @ table, fed
    # Normal equations lose half of the digits, which a second pass on what the first has left gives back.
    for _ in range(2):
        sizes, *_ = np.linalg.lstsq(square, table.T @ left, rcond=SINGULAR)
        left = left - table @ sizes
    return spread(left)


def _memories(time_s: Array, read: Array) -> Array:
    """Readings (n,) through low-pass filters of several time constants, (n, k): the memory of filters beyond the
    taps."""
    step_s = float(np.median(np.diff(time_s)))
    return np.asarray(_kept(read, np.exp(-step_s / np.array(MEMORIES_S))), dtype=np.float64)


@njit(cache=True, nogil=True)
def _kept(read: Array, keep: Array) -> Array:
    """Readings (n,) through filters that keep these shares (k,) of their state each step, (n, k)."""
    out = np.empty((len(read), len(keep)))
    held = np.full(len(keep), read[0])
    for i in range(len(read)):
        held = keep * held + (1.0 - keep) * read[i]
        out[i] = held
    return out


def white_noise(read: Array) -> float:
    """Standard deviation of the white noise on readings (n,); 0 if there are too few."""
    return spread(np.diff(read, 2)) / float(np.sqrt(6.0)) if len(read) > TAPS else 0.0


def spread(value: Array) -> float:
    """Standard deviation of the normal bulk of the values, from the median absolute deviation."""
    return float(1.4826 * np.median(np.abs(value - np.median(value))))
