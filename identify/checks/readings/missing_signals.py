"""Says in sentences which signals a recording lacks, and the coefficients that it can't tell without them."""

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import DOFS, HEAVE
from identify.checks.readings.flipping_commands import flipping_commands
from identify.checks.readings.frozen import axis_key
from identify.dive import Dive
from identify.ingest.commands import unknown_between
from identify.words import axes_named

SLOWEST_VELOCITY_HZ = 2.0
SLOWEST_GYRO_HZ = 5.0
SHORTEST_GAP_S = 2.0
ENOUGH_HZ = 20.0
"""Thruster commands at this rate tell their force well enough, but for an autopilot whose faster loop is known."""

NO_VELOCITY, NO_RATE = "There is no velocity to go by", "There is no rate of turn to go by"
"""Of a signal that was not recorded, or of which another check left nothing and said why."""


def missing_signals(dive: Dive) -> tuple[str, ...]:
    """A sentence for each signal that is missing, comes too rarely or can't be believed."""
    level = (
        () if dive.attitude is not None else ("No attitude is recorded: the vehicle is taken to be level.",)
    )
    return (*_velocity(dive), *_rates(dive), *_forces(dive), *level)


def _velocity(dive: Dive) -> list[str]:
    signal = dive.velocity
    if signal is None or not np.isfinite(signal.value).any():
        if dive.depth is None and dive.pressure is None:
            return [f"{NO_VELOCITY}: mass and damping in surge, sway and heave can't be identified."]
        return [
            f"{NO_VELOCITY}: mass and damping in surge and sway can't be identified, those in heave by depth alone."
        ]
    notes = []
    if signal.rate_hz < SLOWEST_VELOCITY_HZ:
        notes.append(f"Velocity comes at {signal.rate_hz:.1f} Hz, too slow to identify masses.")
    axes = np.isfinite(signal.value).any(axis=0)
    if not axes.all():
        notes.append(_lacking(dive, np.flatnonzero(axes).tolist(), np.flatnonzero(~axes).tolist()))
    known = np.isfinite(signal.value[:, axes])
    believed = np.ones(len(signal), np.bool_)
    for axis in DOFS[:3]:
        for start_s, end_s in dive.frozen.get(axis_key("velocity", axis), ()):
            believed &= (signal.time_s < start_s) | (signal.time_s > end_s)
    unlocked = float(np.mean(believed & ~known.any(axis=1)))
    if unlocked > 0.01:
        notes.append(f"The DVL had no bottom lock in {100 * unlocked:.0f} % of its samples.")
    parted = float(np.mean(believed & known.any(axis=1) & ~known.all(axis=1)))
    if parted > 0.01:
        notes.append(
            f"In {100 * parted:.0f} % of the velocities some axes are known and others are not, as where a log writes "
            "each into a row of its own."
        )
    return notes


def _lacking(dive: Dive, known: list[int], lacking: list[int]) -> str:
    """A sentence on the axes of the velocity that no sample tells."""
    by_depth = HEAVE in lacking and (dive.depth is not None or dive.pressure is not None)
    untold = [dof for dof in lacking if not (dof == HEAVE and by_depth)]
    cannot = [f"mass and damping in {axes_named(untold)} can't be identified"] if untold else []
    if by_depth:
        cannot.append(f"{'those' if untold else 'mass and damping'} in heave by depth alone")
    return f"Velocity is known in {axes_named(known)} alone: {', '.join(cannot)}."


def _rates(dive: Dive) -> list[str]:
    fastest = max((s.rate_hz for s in (dive.gyro, dive.fog) if s is not None), default=0.0)
    if fastest == 0.0:
        if dive.attitude is not None:
            return [
                f"{NO_RATE}: inertias and dampings in roll, pitch and yaw are identified by the "
                f"attitude alone, at {dive.attitude.rate_hz:.1f} Hz."
            ]
        return [f"{NO_RATE}: inertia and damping in yaw can't be identified."]
    if fastest < SLOWEST_GYRO_HZ:
        return [f"Rates of turn come at {fastest:.1f} Hz, too slow to identify inertia in yaw."]
    return []


def _forces(dive: Dive) -> list[str]:
    recorded = (dive.thruster_commands, dive.effort, dive.tau_cmd)
    signal = next((commands for commands in recorded if commands is not None), None)
    if signal is None and dive.rpm is not None:
        return [
            "Of the thrusters the shafts' speeds alone are recorded: without a vehicle file, whose forward_n_s2 and "
            "reverse_n_s2 make thrust of them, nothing can be identified."
        ]
    if signal is None:
        return ["Neither thruster commands nor wrenches are recorded: nothing can be identified."]
    notes = []
    if unknown_between(dive, signal):
        often = "at 20 Hz or more" if signal.rate_hz < ENOUGH_HZ else "as often as that loop runs"
        notes.append(
            f"Thruster commands come at {signal.rate_hz:.1f} Hz, too slow to know the force between them where a "
            f"faster loop sends them: what they do there is taken for a noise then. Record them {often}."
        )
    notes += flipping_commands(dive, signal)
    gap_s = longest_gap_s(signal.time_s)
    if gap_s > SHORTEST_GAP_S and gap_s > 5.0 / max(signal.rate_hz, 1e-9):
        notes.append(f"Thruster commands are missing for up to {gap_s:.1f} s at a stretch.")
    if never_armed(dive):
        notes.append("The vehicle was never armed in this recording: the thrusters did not push.")
    return notes


def never_armed(dive: Dive) -> bool:
    """Whether a recording that tells of arming shows the vehicle disarmed all the time."""
    return dive.armed is not None and not (dive.armed.value > 0).any()


def longest_gap_s(time_s: Array) -> float:
    """Longest time between readings at these times (n,); 0 for fewer than two."""
    return float(np.diff(time_s).max(initial=0.0))
