"""How the velocity that the controller used (NU_FB) came from the recorded readings, and how long after them."""

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
SAME = 1e-5
"""m/s: two velocities nearer than this are one."""

EXPLAINED = 0.1
"""Of the velocity sensor's noise: where no more than that is left of NU_FB, its timing needs no other explanation."""

EARLIER_SHARE = 0.5
"""Readings that were used before their stamps leave so much less unexplained than those after."""


@dataclass(frozen=True)
class Fed:
    """How NU_FB came from the recorded velocity in one degree of freedom.

    left: what no causal linear filter of the readings gives of it, over their noise. late_s: how long after its stamp a
    reading was used; where it is negative, before.
    """

    left: float
    late_s: float


def fed_velocity(dive: Dive, dof: int) -> Fed | None:
    """How NU_FB came from the recorded velocity; None where there is too little to tell.

    Rates of turn stand beside the velocity: with a lever arm they carry it to the body's origin. A reading reaches
    the controller late by a constant of LATEST_S at most: the one that explains most is taken. Only where none
    explains it are readings tried that the recording says came later. Spreads are medians, which dropouts and wild
    readings leave alone.
    """
    if dive.nu_fb is None or dive.velocity is None or dive.velocity_is_filtered:
        return None
    after = _best(dive, dof, np.arange(0.0, LATEST_S, LATE_STEP_S))
    if after is None or after.left <= EXPLAINED:
        return after
    before = _best(dive, dof, -np.arange(LATE_STEP_S, LATEST_S, LATE_STEP_S))
    return before if before is not None and before.left < EARLIER_SHARE * after.left else after


def stamp_doubts(dive: Dive) -> tuple[Doubt, ...]:
    """A doubt where the controller used velocities before the recording says that they were read."""
    by_dof = {dof: fed for dof in range(3) if (fed := fed_velocity(dive, dof)) is not None}
    early = {dof: -fed.late_s for dof, fed in by_dof.items() if fed.late_s < 0}
    if 2 * len(early) <= len(by_dof):
        return ()
    about = tuple(group[dof].name for group in (MASSES, DAMPINGS) for dof in range(3))
    late_ms = 1000 * float(np.median(list(early.values())))
    sentence = (
        f"The controller used velocities (NU_FB) some {late_ms:.0f} ms before the recording says that they were read: "
        "the DVL's stamps are late by that or more, and masses come out too large by it; mend the DVL's clock, or its "
        "latency in the vehicle file: seatrial doctor --wet tells how late each sensor is."
    )
    return (Doubt(about, sentence, Outcome.DISAGREES),)


def filtered_doubts(dive: Dive) -> tuple[Doubt, ...]:
    """A warning about the masses where velocity comes from an autopilot's filter: its lateness and smoothing are
    fitted, and what is left of them goes into the masses."""
    if not dive.velocity_is_filtered:
        return ()
    sentence = (
        "Velocity comes from the autopilot's own filter, which smooths and delays it: by how much is fitted, but "
        "masses in surge, sway and heave may be off by a few per cent more than their intervals; record the DVL's own "
        "readings."
    )
    return (Doubt(tuple(mass.name for mass in MASSES[:3]), sentence),)


def frozen_velocity(dive: Dive, dof: int) -> tuple[tuple[float, float], ...]:
    """From when to when the recorded velocity of an axis stood still, by itself or with all others."""
    return dive.frozen.get("velocity", ()) + dive.frozen.get(axis_key("velocity", DOFS[dof]), ())


def _best(dive: Dive, dof: int, late_s: Array) -> Fed | None:
    """The best of the times (n,) by which readings may be used late; None where too little is known."""
    assert dive.nu_fb is not None
    assert dive.velocity is not None
    good = np.isfinite(dive.velocity.value[:, dof])
    time_s, read = dive.velocity.time_s[good], dive.velocity.value[good, dof]
    noise = white_noise(read)
    if not noise > 0:
        return None
    table = np.column_stack([_past(read), _memories(time_s, read)])
    fed = dive.nu_fb.value[:, dof]
    frozen = np.zeros(len(fed), dtype=np.bool_)  # `frozen_doubts` tells of those
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
    """Each reading (n,) and those before it, (n, TAPS); the first ones' past is the first."""
    return np.asarray(read[np.maximum(np.arange(len(read))[:, None] - np.arange(TAPS), 0)], dtype=np.float64)


def _left_by(table: Array, fed: Array) -> float:
    """Spread of what no combination of the columns, the first TAPS of them readings, gives of `fed`."""
    if np.mean(np.abs(table[:, :TAPS] - fed[:, None]).min(axis=1) < SAME) > 0.5:
        return 0.0
    table = np.column_stack([table, np.ones(len(fed))])
    fitted, *_ = np.linalg.lstsq(table, fed, rcond=None)
    return spread(fed - table @ fitted)


def _memories(time_s: Array, read: Array) -> Array:
    """Readings (n,) through low-pass filters of several time constants, (n, k): what filters keep beyond the taps."""
    step_s = float(np.median(np.diff(time_s)))
    return np.asarray(_kept(read, np.exp(-step_s / np.array(MEMORIES_S))), dtype=np.float64)


@njit(cache=True, nogil=True)
def _kept(read: Array, keep: Array) -> Array:
    """Readings (n,) through filters that keep these shares (k,) of what they held, (n, k)."""
    out = np.empty((len(read), len(keep)))
    held = np.full(len(keep), read[0])
    for i in range(len(read)):
        held = keep * held + (1.0 - keep) * read[i]
        out[i] = held
    return out


def white_noise(read: Array) -> float:
    """Standard deviation of the white noise on readings (n,); 0 where they are too few."""
    return spread(np.diff(read, 2)) / float(np.sqrt(6.0)) if len(read) > TAPS else 0.0


def spread(value: Array) -> float:
    """Standard deviation of a normal bulk, by its median."""
    return float(1.4826 * np.median(np.abs(value - np.median(value))))
