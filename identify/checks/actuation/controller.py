"""Checks whether the controller used the readings that were recorded.

A likelihood of a closed loop needs the readings that the controller acted on (Ljung 1999, section 13.4). Given others,
it takes the controller's reaction to the disturbance for mass.
"""

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numba import njit

from bridge.arrays import Array
from bridge.vehicle.coefficients import DAMPINGS, DOFS, HEAVE, MASSES, QUADRATICS
from bridge.vehicle.config import VehicleFile, Water
from identify.checks.readings.frozen import axis_key
from identify.dive import Dive
from identify.doubt import Doubt, Outcome, coefficients_of
from identify.ingest.rotation import euler_angles
from identify.statistics import left_of, spread
from identify.threads import side_by_side
from identify.thrust.wrench import wrench
from identify.words import axes_named, capital, listed

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


LARGEST_UNEXPLAINED = 0.25
"""Share of the controller's wrench that may remain unexplained by recorded readings: rounding and late readings cause
this much."""

LARGEST_FOREIGN = 0.65
"""Residual of NU_FB after a filter of the recorded velocity, as a share of the velocity sensor's noise, that is still
allowed."""

WINDOW_S = 10.0
STEERED = 0.02
"""A command that changes by more than this share of its standard deviation is not mere rounding of pulses."""

OPEN_SHARE = 0.05
"""A window is left out if the controller commanded exactly zero for more than this share of it."""

READINGS = (*["velocity"] * 2, "velocity or depth", *["attitude or rate of turn"] * 3)
STAMPED_S = 0.5e-3 + 1e-6
"""Depth and attitude are stamped in whole milliseconds, so a reading that a controller used may seem later than its
wrench."""

AFTER_S = 1.0
"""Time skipped at the start of a frozen stretch: by then a filter's response to the readings before it has died
away."""


@dataclass(frozen=True)
class Fed:
    """How NU_FB came from the recorded velocity in one degree of freedom.

    left: residual of NU_FB after a causal linear filter of the readings, over their noise. late_s: time from a
    reading's stamp to its use; negative if it was used before its stamp.
    """

    left: float
    late_s: float


def fed_velocity(dive: Dive, dof: int, enough: float = 0.0) -> Fed | None:
    """Return how NU_FB came from the recorded velocity; None if there is too little data.

    Rates of turn are regressors together with the velocity: with a lever arm they carry it to the body's origin. A
    reading reaches the controller with a constant delay below LATEST_S; the delay that explains most is taken. Delays
    below zero, for readings whose stamps are late, are tried only if no other delay explains NU_FB. Spreads are
    medians, which dropouts and wild readings do not affect. No further delay is tried once the residual is `enough`.
    """
    if dive.nu_fb is None or dive.velocity is None or dive.velocity_is_filtered:
        return None
    after = _best(dive, dof, np.arange(0.0, LATEST_S, LATE_STEP_S), enough)
    if after is None or after.left <= max(EXPLAINED, enough):
        return after
    least = EARLIER_SHARE * after.left
    before = _best(dive, dof, -np.arange(LATE_STEP_S, LATEST_S, LATE_STEP_S), min(enough, least))
    return before if before is not None and before.left <= least else after


def stamp_doubts(dive: Dive) -> tuple[Doubt, ...]:
    """Return a doubt if the controller used velocities before their stamps in the recording."""
    by_dof = {dof: fed for dof in range(3) if (fed := fed_velocity(dive, dof)) is not None}
    early = {dof: -fed.late_s for dof, fed in by_dof.items() if fed.late_s < 0}
    if 2 * len(early) <= len(by_dof):
        return ()
    late_ms = 1000 * float(np.median(list(early.values())))
    return (
        Doubt(
            coefficients_of(range(3)),
            f"The controller used velocities (NU_FB) some {late_ms:.0f} ms before the recording says that they were "
            "read",
            "the DVL's stamps are late by that or more, and masses come out too large by it; mend the DVL's clock, or "
            "its latency in the vehicle file: seatrial doctor --wet tells how late each sensor is.",
            Outcome.DISAGREES,
        ),
    )


def filtered_doubts(dive: Dive) -> tuple[Doubt, ...]:
    """Return a warning about the masses if velocity comes from an autopilot's filter. The filter's delay and
    smoothing are fitted, and their remaining error goes into the masses."""
    if not dive.velocity_is_filtered:
        return ()
    return (
        Doubt(
            tuple(mass.name for mass in MASSES[:3]),
            "Velocity comes from the autopilot's own filter, which smooths and delays it",
            "by how much is fitted, but masses in surge, sway and heave may be off by a few per cent more than their "
            "intervals; record the DVL's own readings.",
        ),
    )


def frozen_velocity(dive: Dive, dof: int) -> tuple[tuple[float, float], ...]:
    """Intervals in which the recorded velocity of an axis was frozen, alone or together with all others."""
    return dive.frozen.get("velocity", ()) + dive.frozen.get(axis_key("velocity", DOFS[dof]), ())


def _best(dive: Dive, dof: int, late_s: Array, enough: float) -> Fed | None:
    """The best of the delays (n,) with which readings may be used, or the first that is `enough`; None if too little is
    known."""
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
        if left <= enough:
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
        for k in range(len(keep)):
            held[k] = keep[k] * held[k] + (1.0 - keep[k]) * read[i]
            out[i, k] = held[k]
    return out


def white_noise(read: Array) -> float:
    """Standard deviation of the white noise on readings (n,); 0 if there are too few."""
    return spread(np.diff(read, 2)) / float(np.sqrt(6.0)) if len(read) > TAPS else 0.0


@dataclass(frozen=True)
class Unrecorded:
    """Evidence that the controller of a degree of freedom used a reading that the recording lacks."""

    dof: int
    evidence: str

    def doubt(self, done: str) -> Doubt:
        """Return the doubt about this axis's mass, with `done` saying how the method handled it."""
        axis, mass, damping = DOFS[self.dof], MASSES[self.dof].name, DAMPINGS[self.dof].name
        remedy = (
            f"a fit of {axis} takes that for mass, so {mass} {done}, and the true {damping} may lie below its value; "
            f"record the very {READINGS[self.dof]} that the controller uses, to know both from {axis} itself."
        )
        return Doubt((mass,), capital(self.evidence), remedy, also=(damping,))


def feedback_doubts(dive: Dive, water: Water) -> tuple[Doubt, ...]:
    """Doubts, for each axis whose controller used an unrecorded reading; for methods that then leave the axis's mass
    out."""
    return tuple(axis.doubt("is left out") for axis in unrecorded(dive, water))


def unrecorded(dive: Dive, water: Water) -> tuple[Unrecorded, ...]:
    """Return the axes whose controller used an unrecorded reading."""
    out = []
    velocities = side_by_side(lambda dof: fed_velocity(dive, dof, LARGEST_FOREIGN), range(3))
    for dof, name in enumerate(DOFS):
        share = unexplained_wrench(dive, dof, water)
        fed = velocities[dof] if dof < 3 else None
        if share is not None and share > LARGEST_UNEXPLAINED:
            reason = f"in {name} {100 * share:.0f} % of the controller's wrench (TAU_PID) follows from nothing recorded"
        elif fed is not None and fed.left > LARGEST_FOREIGN:
            reason = (
                f"in {name} the velocity that the controller used (NU_FB) is no filter of the recorded one, and "
                f"{fed.left:.1f} times its noise away from the nearest"
            )
        else:
            continue
        out.append(Unrecorded(dof, reason))
    return tuple(out)


def held_unseen(dive: Dive) -> tuple[int, ...]:
    """Degrees of freedom that a stock autopilot holds by readings that its log lacks: heave, whose depth it holds by a
    climb rate of its own.

    Its thrust follows the sea there unseen, which heave's own equation takes for mass: far too much of a vehicle that
    hardly moves up and down.
    """
    return (HEAVE,) if dive.velocity_is_filtered and _lacking(dive) else ()


def unchecked(dive: Dive) -> tuple[str, ...]:
    """Return a note if the recording lacks the signals that would show whether the controller used the recorded
    velocity."""
    lacking = _lacking(dive)
    if dive.velocity is None or not lacking:
        return ()
    used = "the recorded velocity" if "NU_FB" in lacking else "recorded readings alone"
    return (
        f"{listed(lacking)} {'is' if len(lacking) == 1 else 'are'} not recorded: it can't be checked whether the "
        f"controller used {used}; where it used others, masses come out wrong and nothing shows it.",
    )


def depthless_doubts(
    dive: Dive, file: VehicleFile, configuration: str, fitted: Collection[str]
) -> tuple[Doubt, ...]:
    """Return a doubt about mass and damping in heave if they were fitted with a controller whose depth is not
    recorded.

    No doubt if the controller's own signals are recorded (`unrecorded` then checks them), if the controller was off
    in heave, or if heave's thrust changes too seldom for a controller to have made it.
    """
    lacking, depth = _lacking(dive), dive.depth_by(file.vehicle.water)
    valued = [name for name in coefficients_of([HEAVE]) if name in fitted]
    by_hand = dive.tau_pid is not None and len(dive.tau_pid) and not np.any(dive.tau_pid.value[:, HEAVE])
    if not valued or not lacking or (depth is not None and len(depth)) or by_hand or not _commanded(dive):
        return ()
    asked = wrench(dive, file, configuration).asked[:, HEAVE]
    if np.mean(np.diff(asked) != 0.0) < OPEN_SHARE:
        return ()
    return (
        Doubt(
            tuple(valued),
            f"Depth is not recorded, nor {'is' if len(lacking) == 1 else 'are'} {listed(lacking)}",
            "a vehicle that holds its depth thrusts by a reading that the recording lacks, which a fit of heave takes "
            f"for mass, so {listed(valued)} may be off by more than their intervals; record the depth that the "
            "controller uses.",
            Outcome.DISAGREES,
        ),
    )


def steered_doubts(
    dive: Dive, file: VehicleFile, configuration: str, fitted: Collection[str]
) -> tuple[Doubt, ...]:
    """Return a warning about the axes that a stock autopilot steered. The autopilot acted on more readings, and on
    other readings, than the filter outputs in its log."""
    if not dive.velocity_is_filtered or not _lacking(dive) or not _commanded(dive):
        return ()
    asked = wrench(dive, file, configuration).asked
    spread = np.std(asked, axis=0)
    moves = np.mean(np.abs(np.diff(asked, axis=0)) > STEERED * spread, axis=0)
    groups = (MASSES, DAMPINGS, QUADRATICS)
    steered = (dof for dof in range(6) if spread[dof] > 0.0 and moves[dof] > OPEN_SHARE)
    dofs = [dof for dof in steered if MASSES[dof].name in fitted]
    about = tuple(group[dof].name for dof in dofs for group in groups if group[dof].name in fitted)
    if not about:
        return ()
    return (
        Doubt(
            about,
            f"An autopilot may have steered in {axes_named(dofs)} by readings that its log lacks, and a fit takes for "
            "mass and drag what it did about the sea and about its own noise",
            f"{', '.join(about)} may be off by more than their intervals, and nothing in the log shows by how much; "
            "record the very readings that the controller uses, or drive by stick without its help.",
        ),
    )


def _commanded(dive: Dive) -> bool:
    return any(signal is not None and len(signal) > 1 for signal in (dive.thruster_commands, dive.tau_cmd))


def _lacking(dive: Dive) -> list[str]:
    """Names of the controller signals that the recording lacks."""
    named = {"NU_FB": dive.nu_fb, "TAU_PID": dive.tau_pid, "NU_REF": dive.nu_ref}
    return [name for name, signal in named.items() if signal is None or len(signal) == 0]


def frozen_doubts(dive: Dive) -> tuple[Doubt, ...]:
    """Return a warning if the recorded velocity froze while the velocity that the controller used went on."""
    by_dof = {dof: frozen for dof in range(3) if _went_on(dive, dof, frozen := frozen_velocity(dive, dof))}
    if not by_dof:
        return ()
    dofs = list(by_dof)
    named = tuple(group[dof].name for dof in dofs for group in (MASSES, DAMPINGS))
    seconds = max(sum(end_s - start_s for start_s, end_s in frozen) for frozen in by_dof.values())
    share = seconds / max(dive.duration_s, 1e-9)
    return (
        Doubt(
            named,
            f"For {seconds:.0f} s ({100 * share:.1f} % of the dive) the recorded velocity stood still while the "
            f"controller's own (NU_FB) went on in {axes_named(dofs)}",
            f"the logged velocity can't be the one that the controller used, so {', '.join(named)} rest on the rest of "
            "the dive, and their intervals may be too narrow; record the very velocity that the controller uses.",
        ),
    )


def _went_on(dive: Dive, dof: int, stretches: Sequence[tuple[float, float]]) -> bool:
    """Whether NU_FB moved in these stretches by more than turning on the lever arm and the velocity's noise explain."""
    used = dive.nu_fb
    if used is None:
        return False
    parts = [used.between(start_s + AFTER_S, end_s).value for start_s, end_s in stretches]
    parts = [part[np.isfinite(part).all(axis=1)] for part in parts]
    table = np.concatenate([part - part.mean(axis=0) for part in parts if len(part)] or [np.zeros((0, 6))])
    if len(table) < 2 * TAPS:
        return False
    turning, fed = table[:, 3:], table[:, dof]
    read = np.zeros((0, 3)) if dive.velocity is None else dive.velocity.value
    noise = white_noise(read[np.isfinite(read[:, dof]), dof])
    return spread(left_of(turning, fed)) > max(LARGEST_FOREIGN * noise, SAME)


def unexplained_wrench(dive: Dive, dof: int, water: Water) -> float | None:
    """Share of the feedback controller's recorded wrench that no recorded reading explains; None if it can't be
    found.

    The wrench of a linear controller is a combination of the velocity that it used, its reference, and the errors of
    velocity, depth and angle with their integrals. The residual came from a signal that the recording lacks. The
    result is the median over short windows, so that slow gain scheduling does not count.
    """
    tau, used, reference = dive.tau_pid, dive.nu_fb, dive.nu_ref
    if tau is None or used is None or reference is None or len(tau) < 2:
        return None
    nu, target = used.held_at(tau.time_s)[:, dof], reference.held_at(tau.time_s)
    step_s = np.diff(tau.time_s, prepend=tau.time_s[0])
    errors = [target[:, dof] - nu, *_place_errors(dive, dof, water, tau.time_s, target)]
    columns = [nu, target[:, dof], target[:, 6 + dof], np.ones(len(tau))]
    columns += [e for error in errors for e in (error, np.cumsum(np.nan_to_num(error) * step_s))]
    table = np.column_stack([*columns, tau.value[:, dof]])
    window = max(round(WINDOW_S * tau.rate_hz), 1)
    # While the loop is open, under a push or a stick, no reading could explain the wrench.
    closed = [
        rows[i : i + window]
        for rows in np.split(table, np.searchsorted(tau.time_s, dive.breaks_s))
        for i in range(0, len(rows) - window + 1, window)
        if np.mean(rows[i : i + window, -1] == 0.0) < OPEN_SHARE
    ]
    shares = [_left_over(rows) for rows in closed]
    known = [share for share in shares if share is not None]
    return float(np.median(known)) if known else None


def _place_errors(dive: Dive, dof: int, water: Water, time_s: Array, target: Array) -> list[Array]:
    """Reference less the latest reading, (n,), of depth or of an angle. The reference of roll and pitch is level."""
    depth = dive.depth_by(water)
    if dof == 2 and depth is not None and len(depth):
        return [target[:, 13] - depth.held_at(time_s + STAMPED_S)[:, 0]]
    if dof < 3 or dive.attitude is None or not len(dive.attitude):
        return []
    roll, pitch, heading = euler_angles(dive.attitude.held_at(time_s + STAMPED_S))
    if dof < 5:
        return [-roll if dof == 3 else -pitch]
    turn = target[:, 12] - heading
    return [np.remainder(turn + np.pi, 2 * np.pi) - np.pi]


def _left_over(table: Array) -> float | None:
    """Share of the last column that no combination of the others explains; None if the column is constant or too
    short."""
    table = table[np.isfinite(table).all(axis=1)]
    if len(table) < 4 * table.shape[1] or np.std(table[:, -1]) < 1e-9:
        return None
    fitted, *_ = np.linalg.lstsq(table[:, :-1], table[:, -1], rcond=None)
    return float(np.std(table[:, -1] - table[:, :-1] @ fitted) / np.std(table[:, -1]))
