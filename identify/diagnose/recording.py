"""Checks of a recording before diagnosis: refusals, outliers in velocity, contradicting sensors, hints at another
vehicle.

A fit drops some outliers itself. Many of them inflate its noise levels, and their apparent motion turns into causes, so
velocity spikes are removed first: readings that no motion links to their neighbours, as when a DVL loses its echo.
"""

import math
from collections.abc import Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.errors import FitError
from bridge.vehicle.coefficients import (
    DOFS,
    MASSES,
    SURGE,
    SWAY,
)
from bridge.vehicle.config import Configuration, VehicleFile, Water
from identify.checks.fit.loud_noise import loud, loud_note
from identify.checks.sensors.descent import depth_contradicts
from identify.diagnose.causes.evidence import FOLDS
from identify.diagnose.filters.nominal import Nominal, nominal_of
from identify.diagnose.filters.regression import PIECE_S
from identify.diagnose.gap.missing import PUSHED, disturbance_of, drowned
from identify.dive import Dive, Signal
from identify.effects.course import Course
from identify.effects.effect import OWN_DESCENT, OWN_VELOCITY, PULSES, QUICK_COMMANDS
from identify.estimators.identifiability import MOST_ADDED
from identify.estimators.refusals import longest_common_s, refuse_unmoved, refuse_unpushed, solvable
from identify.estimators.timing.thrust_delay import coarse_delay_of_all_s, coarse_delay_s
from identify.ingest.commands import sampled_seldom
from identify.statistics import Z95
from identify.thrust.wrench import tells_thrusters, wrench
from identify.words import listed, significant

LEAST_S = LEAST_CHECK_S = 20.0
LEAST_RUN_S = 8.0
ENOUGH_S = 2 * FOLDS * PIECE_S
"""A shorter dive is diagnosed, but a fold then holds a piece or none."""

ENOUGH_CHECK_S = 60.0
"""A shorter check dive is simulated, but a dozen windows of 5 s are too few."""

MOST_STILL = 0.5
"""Share of a dive with a frozen velocity from which the remaining velocity is not used either."""

NEIGHBOURS = 2
"""Neighbours on either side of a reading."""

FAR = 8.0
"""Least deviation of a spike from its neighbours' median, in standard deviations of sound readings."""

LEAST_SPIKE_M_S = 0.05
"""Least size of a spike: coarse or noiseless readings have next to no deviation."""

AGREE = 0.5
"""Largest span of a spike's neighbours, relative to its size: a start or a stop is no spike."""

MANY = 0.005
"""Share of spikes from which the verdict mentions them."""

LEAST_PUSHING = 0.25
"""Share of a dive in which some thruster pushes, below which a crew is told so."""

NORMAL = 0.6745
"""Median magnitude of a standard normal variable."""


def refuse_short(dive: Dive, least_s: float) -> None:
    """Raise FitError for a recording that is too short."""
    if dive.duration_s < least_s:
        cut = "ends in the middle of a record, and what comes before " if dive.counts.get("cut") else ""
        mend = "copy the whole file, or " if cut else ""
        raise FitError(
            f"{cut}lasts {math.floor(dive.duration_s)} s, too short to tell one cause from another; "
            f"{mend}record {least_s:.0f} s or more, with starts, stops and turns",
            of=dive.source,
        )
    together_s = longest_common_s(dive)
    if round(together_s) < least_s:
        raise FitError(
            f"thruster commands and readings of motion are both in it for {together_s:.0f} s of "
            f"{dive.duration_s:.0f} s, too short to tell one cause from another; record both for {least_s:.0f} s or "
            "more, with starts, stops and turns",
            of=dive.source,
        )


def refuse_short_runs(dive: Dive) -> None:
    """Raise FitError if no run of a dive made of several lasts for LEAST_RUN_S."""
    longest_s = max((run.duration_s for run in dive.runs), default=LEAST_S)
    if longest_s < LEAST_RUN_S:
        raise FitError(
            f"the longest of its {len(dive.runs)} runs lasts {longest_s:.1f} s, too short to tell how a model drifts; "
            f"give runs of {LEAST_RUN_S:.0f} s or more",
            of=dive.source,
        )


def without_still_velocity(dive: Dive, name: str = "") -> tuple[Dive, tuple[str, ...]]:
    """The dive without a velocity that stands still for most of it, and a sentence on that. name: of another dive."""
    still_s = sum(end_s - start_s for start_s, end_s in dive.frozen.get("velocity", ()))
    if dive.velocity is None or still_s <= MOST_STILL * dive.duration_s:
        return dive, ()
    return replace(dive, velocity=None), (
        f"The velocity{f' of {name}' if name else ''} repeats one value for {still_s:.0f} s of {dive.duration_s:.0f} s "
        "while the vehicle goes on, and was left out whole; check the DVL, and what passes its readings on.",
    )


def lacking(dive: Dive, check: Dive | None, configuration: Configuration, water: Water) -> frozenset[str]:
    """The inputs that effects need (`Effect.needs`) and that a dive or its check dive lacks; a late thrust need not
    show in the check dive."""
    dives = [dive] if check is None else [dive, check]
    filtered = [each.velocity_is_filtered and _has_velocity(each) for each in dives]
    has = {
        PULSES: all(tells_thrusters(each, configuration) for each in dives),
        QUICK_COMMANDS: not _seldom(dive, configuration),
        OWN_VELOCITY: not any(filtered),
        OWN_DESCENT: not filtered[0] or depth_contradicts(dive, water),
    }
    return frozenset(name for name, is_there in has.items() if not is_there)


def unjudged_causes(lacks: Collection[str]) -> tuple[str, ...]:
    """Sentences on the causes that can't be judged without these inputs, and on the data to record."""
    words = {
        PULSES: "No pulses tell what each thruster did: causes in a single thruster, or in the thrusters' curve, were "
        "not judged; record ACTUATOR_OUTPUT_STATUS or SERVO_OUTPUT_RAW.",
        QUICK_COMMANDS: "Thruster commands come too seldom: a delay or a lag of the thrusters was not judged; record "
        "them at 10 Hz or more.",
        OWN_VELOCITY: "The velocity is that of an autopilot's filter. How late it is was fitted with the nominal "
        "model, and a late DVL was not judged; record the DVL's own readings for that.",
        OWN_DESCENT: "An autopilot's filter takes its speed up and down from the depth sensor as well: a wrong scale "
        "of that sensor was not judged.",
    }
    return tuple(sentence for name, sentence in words.items() if name in lacks)


def unjudged_by_check(lacks: Collection[str]) -> tuple[str, ...]:
    """Sentences on the causes that can't be judged because the check dive lacks these inputs, and on the way out."""
    words = {
        PULSES: "No pulses of the check dive tell what each thruster did: causes in a single thruster, or in the "
        "thrusters' curve, were not judged; check on a dive that has them, or leave the check out.",
        OWN_VELOCITY: "The velocity of the check dive is that of an autopilot's filter: a late DVL was not judged; "
        "check on a dive of the DVL's own readings, or leave the check out.",
    }
    return tuple(sentence for name, sentence in words.items() if name in lacks)


def _has_velocity(dive: Dive) -> bool:
    return dive.velocity is not None and bool(np.isfinite(dive.velocity.value).any())


def _seldom(dive: Dive, configuration: Configuration) -> bool:
    commands = dive.thruster_commands if tells_thrusters(dive, configuration) else dive.tau_cmd
    if dive.reckoned is not None:
        return not dive.reckoned.tells_timing
    return commands is not None and sampled_seldom(commands)


def fitted_nominal(
    dive: Dive, file: VehicleFile, configuration_name: str, like: Nominal | None = None
) -> Nominal:
    """The nominal fit of a dive, with the lateness of an autopilot's velocity as in the fit `like`, if given.

    Raises FitError if no thruster pushed, the dive is of another vehicle, or its equations have no solution.
    """
    try:
        refuse_unpushed(dive, file, configuration_name)
        refuse_unmoved(dive)
        with solvable(dive):
            nominal = nominal_of(dive, file, configuration_name, like.timing_s if like else None)
            if like is None and not dive.velocity_is_filtered:
                nominal = _with_late_thrust(nominal, dive, file, configuration_name)
    except FitError as error:
        # The source separates two recordings of one name.
        raise FitError(error.reason, of=dive.source) from None
    if nominal.built.strange:
        raise FitError(
            f"{nominal.built.strange}; give the vehicle file and the configuration that it was dived with",
            of=dive.source,
        )
    return nominal


def _with_late_thrust(nominal: Nominal, dive: Dive, file: VehicleFile, configuration_name: str) -> Nominal:
    """The fit with the delay of the thrust that the likelihood prefers, coarsely, from which the search begins.

    Columns for small delays lead to a large delay only where the likelihood rises all the way.
    """
    if _seldom(dive, file.vehicle.configurations[configuration_name]):
        return nominal
    forces = wrench(dive, file, configuration_name)
    # A delay at which the equations have no solution ends the search: without a delay they have one.
    with suppress(np.linalg.LinAlgError):
        delay_of = coarse_delay_of_all_s if drowned(disturbance_of(nominal)) else coarse_delay_s
        delay_s = delay_of(forces, nominal.built, nominal.joint, nominal.theta)
        return replace(nominal, late_thrust_s=(delay_s, 0.0))
    return nominal


def short_dive_note(dive: Dive) -> tuple[str, ...]:
    """A note that a short dive has too few held-out pieces to separate small causes from chance."""
    together_s = longest_common_s(dive)
    if round(together_s) >= ENOUGH_S:
        return ()
    return (
        f"Thruster commands and motion were recorded together for {together_s:.0f} s: with so little of it to hold "
        f"out, a small cause can hardly be told from chance; dive {ENOUGH_S:.0f} s or more.",
    )


def short_check_note(check: Dive | None) -> tuple[str, ...]:
    """A note that a check dive is too short."""
    if check is None or round(together_s := longest_common_s(check)) >= ENOUGH_CHECK_S:
        return ()
    return (
        f"Of the check dive thruster commands and motion were recorded together for {together_s:.0f} s, too short to "
        f"tell how far the gap shrinks; dive {ENOUGH_CHECK_S:.0f} s or more to check on.",
    )


def recording_notes(dive: Dive, nominal: Nominal) -> tuple[str, ...]:
    unrecorded = [
        f"In {DOFS[dof]} the controller used a reading that was not recorded: what its thrust did there is left out "
        "of the evidence."
        for dof in nominal.feedback_unrecorded
    ]
    loud_axes = loud(nominal.joint, nominal.theta, nominal.built.pushed)
    loudest = (*(axis.doubt.sentence for axis in loud_axes if axis.inflated), *loud_note(loud_axes))
    notes = (*unrecorded, *idle_note(nominal.course), *outliers_note(nominal), *loudest)
    return tuple(dict.fromkeys((*notes, *nominal.built.notes, *dive.notes)))


def idle_note(course: Course) -> tuple[str, ...]:
    """A note that the thrusters rested for most of the dive: that part tells nothing of thrust."""
    pushing_s = course.step_s * float(np.count_nonzero(np.any(course.asked_n != 0.0, axis=1)))
    long_s = course.step_s * len(course.asked_n)
    if pushing_s > LEAST_PUSHING * long_s:
        return ()
    return (
        f"The thrusters pushed for {pushing_s:.0f} s of {long_s:.0f} s alone; the rest tells nothing of what thrust "
        "does: drive the vehicle for most of a dive.",
    )


MOST_SPIKES = 0.01
"""Share of the readings up to which those that the fit dropped may be a sensor's spikes."""


def unjudged_notes(nominal: Nominal) -> tuple[str, ...]:
    """Sentences on degrees of freedom that were not judged, why, and what to record: the verdict does not cover them.

    Roll and pitch right themselves; without thrust there, nobody misses them.
    """
    built = nominal.built
    missing = (
        f"{DOFS[dof].capitalize()} was not judged: {why}."
        for dof, why in sorted(built.missing.items())
        if dof in PUSHED or dof not in built.unpushed
    )
    unseen = (
        f"In {listed([DOFS[dof] for dof in nominal.velocity_unread])} no unknown force was looked for: without a "
        "velocity the climb that a controller knows, and a drift that turns the hull, look like one; record the DVL.",
    )
    used = listed([DOFS[dof] for dof in nominal.feedback_unrecorded if dof in (SURGE, SWAY)])
    foreign = (
        f"In {listed([DOFS[dof] for dof in nominal.feedback_suspected])} no unknown force was looked for: the "
        f"controller used a reading that was not recorded in {used}, and may have done so there; record the very "
        "velocity that it uses.",
    )
    return (
        *missing,
        *(unseen if nominal.velocity_unread else ()),
        *(foreign if nominal.feedback_suspected else ()),
    )


def outliers_note(nominal: Nominal) -> tuple[str, ...]:
    """A note of readings that the fit dropped as outliers, by degree of freedom."""
    shares = {}
    counts = []
    for problem in nominal.joint.problems:
        read = np.isfinite(problem.axis.reading)
        wild = int(np.count_nonzero(read & ~np.isfinite(problem.reading)))
        if wild:
            dof = DOFS[problem.axis.dof]
            shares[dof] = wild / int(np.count_nonzero(read))
            counts.append(f"{wild} in {dof} ({100.0 * shares[dof]:.2g} %)")
    if not counts:
        return ()
    many = [dof for dof, share in shares.items() if share > MOST_SPIKES]
    lacks = f"; so many in {listed(many)} are motion that the model lacks, rather than spikes" if many else ""
    return (
        f"Readings far off what the fit expects there, as spikes are, were left out: {', '.join(counts)}{lacks}.",
    )


@dataclass(frozen=True)
class Spikes:
    """Count of spikes among the readings of a degree of freedom."""

    dof: int
    count: int
    of: int

    @property
    def share(self) -> float:
        return self.count / self.of


def without_spikes(dive: Dive) -> tuple[Dive, tuple[Spikes, ...]]:
    """The dive without velocity spikes, and their counts.

    An autopilot's filter smears spikes, so its velocity is left alone.
    """
    if dive.velocity is None or dive.velocity_is_filtered:
        return dive, ()
    value, spikes = dive.velocity.value.copy(), []
    for dof in range(3):
        read = np.flatnonzero(np.isfinite(value[:, dof]))
        spiky = _spikes(value[read, dof])
        if spiky.any():
            spikes.append(Spikes(dof, int(spiky.sum()), len(read)))
            value[read[spiky], dof] = np.nan
    return (replace(dive, velocity=Signal(dive.velocity.time_s, value)) if spikes else dive), tuple(spikes)


def spikes_sentence(spikeses: Sequence[Spikes], name: str = "") -> str:
    """A sentence on the spikes dropped. name: of another dive."""
    counts = ", ".join(
        f"{spikes.count} in {DOFS[spikes.dof]} ({100 * spikes.share:.2g} %)" for spikes in spikeses
    )
    return (
        f"Velocities{f' of {name}' if name else ''} stand off from those before and after as no motion does: these "
        f"spikes were left out: {counts}; look at the DVL, and at what passes its readings on."
    )


def _spikes(value: Array) -> NDArray[np.bool_]:
    """Whether each reading (n,) of a velocity is a spike; no reading at either end is."""
    out = np.zeros(len(value), dtype=np.bool_)
    width = 2 * NEIGHBOURS + 1
    if len(value) < 2 * width:
        return out
    windows = sliding_window_view(value, width)
    neighbours = np.delete(windows, NEIGHBOURS, axis=1)
    off = np.abs(windows[:, NEIGHBOURS] - np.median(neighbours, axis=1))
    least = max(FAR * float(np.median(off)) / NORMAL, LEAST_SPIKE_M_S)
    # One neighbour may be a spike, too: the span of the others is the vehicle's motion.
    inner = np.sort(neighbours, axis=1)
    span = np.minimum(inner[:, -2] - inner[:, 0], inner[:, -1] - inner[:, 1])
    out[NEIGHBOURS:-NEIGHBOURS] = (off > least) & (span < AGREE * off)
    return out


def mass_hints(now: Nominal, log_stds: Sequence[float], configuration: Configuration) -> tuple[str, ...]:
    """Sentences on masses in surge, sway or heave that are impossible for the file's rigid body in water.

    log_stds (axes,): relative standard errors of the masses.
    """
    light, heavy = [], []
    for problem, std in zip(now.joint.problems, log_stds, strict=True):
        dof = problem.axis.dof
        if dof > 2 or dof in now.feedback_unrecorded:
            continue
        rigid, rigid_std = configuration.rigid_body(dof)
        mass, wide = float(now.course.mass[dof]), float(np.exp(Z95 * std))
        text = f"{MASSES[dof].name} {significant(mass, 3)} kg"
        if mass * wide < rigid - Z95 * rigid_std:
            light.append(text)
        if mass / wide > (1.0 + MOST_ADDED) * (rigid + Z95 * rigid_std):
            heavy.append(text)
    dry = f"the vehicle file's dry mass of {configuration.dry_mass_kg:g} kg"
    whats = (
        (light, f"below {dry}, which no water can take away"),
        (heavy, f"at more than {dry} can come to with the water round it"),
    )
    return tuple(
        f"{', '.join(text)} came out {what}: the file may be of another vehicle, or its mass or thrust is wrong; look "
        "at that before you rely on any cause."
        for text, what in whats
        if text
    )
