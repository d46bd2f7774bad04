"""Checks whether the controller used the recorded readings. If it used others, the disturbance steers the thrust
unseen.

A likelihood of a closed loop is right only if it is given the readings that the controller acted on (Ljung 1999,
section 13.4). Given other readings, it takes the controller's reaction to the disturbance for mass.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bridge.vehicle.coefficients import DAMPINGS, DOFS, MASSES, QUADRATICS
from bridge.vehicle.config import VehicleFile, Water
from identify.dive import Array, Dive
from identify.estimators.said import axes_named
from identify.fed_velocity import SAME, TAPS, fed_velocity, frozen_velocity, spread, white_noise
from identify.forces import wrench
from identify.identification import Doubt, Identification, Outcome
from identify.side_by_side import side_by_side

HEAVE = 2

LARGEST_UNEXPLAINED = 0.25
"""Share of the controller's wrench that may remain unexplained by recorded readings: rounding and late readings cause
this much."""

LARGEST_FOREIGN = 0.5
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
class Unrecorded:
    """Evidence that the controller of a degree of freedom used a reading that the recording lacks."""

    dof: int
    found: str

    def doubt(self, done: str) -> Doubt:
        """Return the doubt about this axis's mass, with `done` saying how the method handled it."""
        problem, remedy = (
            f"{self.found[0].upper()}{self.found[1:]}",
            f"a fit of {DOFS[self.dof]} takes that for mass, so {MASSES[self.dof].name} {done}, and the true "
            f"{DAMPINGS[self.dof].name} may lie below its value; record the very {READINGS[self.dof]} that the "
            f"controller uses, to know both from {DOFS[self.dof]} itself.",
        )
        return Doubt((MASSES[self.dof].name,), problem, remedy, also=(DAMPINGS[self.dof].name,))


def feedback_doubts(dive: Dive, water: Water) -> tuple[Doubt, ...]:
    """Doubts, for each axis whose controller used an unrecorded reading; for methods that then leave the axis's mass
    out."""
    return tuple(axis.doubt("is left out") for axis in unrecorded(dive, water))


def unrecorded(dive: Dive, water: Water) -> tuple[Unrecorded, ...]:
    """Return the axes whose controller used an unrecorded reading."""
    out = []
    velocities = side_by_side(lambda dof: fed_velocity(dive, dof), range(3))
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


def unchecked(dive: Dive) -> tuple[str, ...]:
    """Return a note if the recording lacks the signals that would show whether the controller used the recorded
    velocity."""
    lacking = _lacking(dive)
    if dive.velocity is None or not lacking:
        return ()
    used = "the recorded velocity" if "NU_FB" in lacking else "recorded readings alone"
    return (
        f"{_listed(lacking)} {'is' if len(lacking) == 1 else 'are'} not recorded: it can't be checked whether the "
        f"controller used {used}; where it used others, masses come out wrong and nothing shows it.",
    )


def depthless_doubts(fit: Identification, dive: Dive, file: VehicleFile) -> tuple[Doubt, ...]:
    """Return a doubt about mass and damping in heave if they were fitted with a controller whose depth is not
    recorded.

    No doubt if the controller's own signals are recorded (`unrecorded` then checks them), if the controller was off
    in heave, or if heave's thrust changes too seldom for a controller to have made it.
    """
    about = tuple(group[HEAVE].name for group in (MASSES, DAMPINGS))
    lacking, depth = _lacking(dive), dive.depth_by(file.vehicle.water)
    valued = [name for name in about if math.isfinite(fit[name].value)]
    by_hand = dive.tau_pid is not None and len(dive.tau_pid) and not np.any(dive.tau_pid.value[:, HEAVE])
    if not valued or not lacking or (depth is not None and len(depth)) or by_hand or not _commanded(dive):
        return ()
    asked = wrench(dive, file, fit.configuration).asked[:, HEAVE]
    if np.mean(np.diff(asked) != 0.0) < OPEN_SHARE:
        return ()
    problem, remedy = (
        f"Depth is not recorded, nor {'is' if len(lacking) == 1 else 'are'} {_listed(lacking)}",
        f"a vehicle that holds "
        "its depth thrusts by a reading that the recording lacks, which a fit of heave takes for mass, so "
        f"{_listed(valued)} may be off by more than their intervals; record the depth that the controller uses.",
    )
    return (Doubt(tuple(valued), problem, remedy, Outcome.DISAGREES),)


def steered_doubts(fit: Identification, dive: Dive, file: VehicleFile) -> tuple[Doubt, ...]:
    """Return a warning about the axes that a stock autopilot steered. The autopilot acted on more readings, and on
    other readings, than the filter outputs in its log."""
    if not dive.velocity_is_filtered or not _lacking(dive) or not _commanded(dive):
        return ()
    asked = wrench(dive, file, fit.configuration).asked
    spread = np.std(asked, axis=0)
    moves = np.mean(np.abs(np.diff(asked, axis=0)) > STEERED * spread, axis=0)
    valued = {
        parameter.name
        for parameter in fit.parameters
        if math.isfinite(parameter.value) and parameter.name not in fit.rest_on_righting
    }
    groups = (MASSES, DAMPINGS, QUADRATICS)
    steered = (dof for dof in range(6) if spread[dof] > 0.0 and moves[dof] > OPEN_SHARE)
    dofs = [dof for dof in steered if MASSES[dof].name in valued]
    about = tuple(group[dof].name for dof in dofs for group in groups if group[dof].name in valued)
    if not about:
        return ()
    problem, remedy = (
        f"An autopilot may have steered in {axes_named(dofs)} by readings that its log lacks, and a fit takes for mass "
        f"and drag what it did about the sea and about its own noise",
        f"{', '.join(about)} may be off by more than "
        "their intervals, and nothing in the log shows by how much; record the very readings that the controller uses, "
        "or drive by stick without its help.",
    )
    return (Doubt(about, problem, remedy),)


def _commanded(dive: Dive) -> bool:
    return any(signal is not None and len(signal) > 1 for signal in (dive.pwm, dive.tau_cmd))


def _lacking(dive: Dive) -> list[str]:
    """Names of the controller signals that the recording lacks."""
    named = {"NU_FB": dive.nu_fb, "TAU_PID": dive.tau_pid, "NU_REF": dive.nu_ref}
    return [name for name, signal in named.items() if signal is None or len(signal) == 0]


def _listed(names: Sequence[str]) -> str:
    return " and ".join(part for part in (", ".join(names[:-1]), names[-1]) if part)


def frozen_doubts(dive: Dive) -> tuple[Doubt, ...]:
    """Return a warning if the recorded velocity froze while the velocity that the controller used went on."""
    by_dof = {dof: frozen for dof in range(3) if _went_on(dive, dof, frozen := frozen_velocity(dive, dof))}
    if not by_dof:
        return ()
    dofs = list(by_dof)
    named = tuple(group[dof].name for dof in dofs for group in (MASSES, DAMPINGS))
    seconds = max(sum(end_s - start_s for start_s, end_s in frozen) for frozen in by_dof.values())
    share = seconds / max(dive.duration_s, 1e-9)
    problem, remedy = (
        f"For {seconds:.0f} s ({100 * share:.1f} % of the dive) the recorded velocity stood still while the "
        f"controller's own (NU_FB) went on in {axes_named(dofs)}",
        f"the logged velocity can't be the one that the "
        f"controller used, so {', '.join(named)} rest on the rest of the dive, and their intervals may be too narrow; "
        "record the very velocity that the controller uses.",
    )
    return (Doubt(named, problem, remedy),)


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
    fitted, *_ = np.linalg.lstsq(turning, fed, rcond=None)
    read = np.zeros((0, 3)) if dive.velocity is None else dive.velocity.value
    noise = white_noise(read[np.isfinite(read[:, dof]), dof])
    return spread(fed - turning @ fitted) > max(LARGEST_FOREIGN * noise, SAME)


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
        table[i : i + window]
        for i in range(0, len(table) - window + 1, window)
        if np.mean(table[i : i + window, -1] == 0.0) < OPEN_SHARE
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
    w, x, y, z = dive.attitude.held_at(time_s + STAMPED_S).T
    if dof == 3:
        return [-np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))]
    if dof == 4:
        return [-np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0))]
    turn = target[:, 12] - np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return [np.remainder(turn + np.pi, 2 * np.pi) - np.pi]


def _left_over(table: Array) -> float | None:
    """Share of the last column that no combination of the others explains; None if the column is constant or too
    short."""
    table = table[np.isfinite(table).all(axis=1)]
    if len(table) < 4 * table.shape[1] or np.std(table[:, -1]) < 1e-9:
        return None
    fitted, *_ = np.linalg.lstsq(table[:, :-1], table[:, -1], rcond=None)
    return float(np.std(table[:, -1] - table[:, :-1] @ fitted) / np.std(table[:, -1]))
