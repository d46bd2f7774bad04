"""Sentences beside the verdict: on a short dive, on thrusters that rested, outliers, impossible masses."""

from collections.abc import Sequence

import numpy as np

from bridge.vehicle.coefficients import DOFS, MASSES
from bridge.vehicle.config import Configuration
from identify.checks.fit.loud_noise import loud, loud_note
from identify.diagnose.causes.evidence import FOLDS
from identify.diagnose.filters.nominal import Nominal
from identify.diagnose.filters.regression import PIECE_S
from identify.dive import Dive
from identify.effects.course import Course
from identify.estimators.identifiability import MOST_ADDED
from identify.estimators.refusals import longest_common_s
from identify.statistics import Z95
from identify.words import listed, significant

ENOUGH_S = 2 * FOLDS * PIECE_S
"""A shorter dive is diagnosed, but a fold then holds a piece or none."""

ENOUGH_CHECK_S = 60.0
"""A shorter check dive is simulated, but a dozen windows of 5 s are too few."""

LEAST_PUSHING = 0.25
"""A note says so if thrusters pushed during a smaller share of the dive."""

MOST_SPIKES = 0.01
"""Share of the readings up to which those that the fit dropped may be a sensor's spikes."""


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
