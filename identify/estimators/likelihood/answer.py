"""Innovations maximum likelihood: a Kalman filter on the vehicle's dynamics with a Gauss-Markov disturbance.

Closed loop does no harm here: the likelihood of each reading given all earlier readings is the same whether or not a
controller chose the thrust from those readings (Ljung 1999, section 13.4), as long as the controller's readings are
among them. If they are not, the mass of that axis is taken from the other axes' Coriolis forces alone. Noise levels
and the disturbance's time constant are fitted with the coefficients; intervals come from the Fisher information.
"""

import time
from collections.abc import Collection, Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from bridge.vehicle.coefficients import COEFFICIENTS, DAMPINGS, DOFS, MASSES
from bridge.vehicle.config import Configuration, VehicleFile
from identify import nuisance
from identify.checks.actuation.controller import held_unseen, unrecorded
from identify.checks.fit.thrust_timing import lateness_note
from identify.checks.sensors.descent_timing import with_depth_of_the_dvl
from identify.dive import Dive, Signal
from identify.doubt import Doubt, coefficients_of
from identify.estimators.answer import Fitted, answer_of, unsettled_doubt
from identify.estimators.axes.axis import Axes
from identify.estimators.filter.state import POSITION
from identify.estimators.likelihood.axis import DISTURBANCE, FORCES, TIME_CONSTANT, AxisFit
from identify.estimators.likelihood.fit import JointFit, fit_axes
from identify.estimators.mass_by_run import kinds_of_runs
from identify.estimators.missing_forces.drag_and_timing import Doubts, doubts_of
from identify.estimators.timing.autopilot_velocity import lasting_axes, shared_axes
from identify.estimators.timing.sampled_commands import with_samples
from identify.estimators.timing.thrust_timing import Timed, with_timing
from identify.identification import Estimate, Identification, Information
from identify.nuisance import Nuisance
from identify.progress import Progress
from identify.statistics import Z95
from identify.thrust.shafts import shafts_note

TELLING_LATE_S, TELLING_SHARE = 0.01, 0.5
"""A coefficient is noted if thrust that acts TELLING_LATE_S later would move it by more than TELLING_SHARE of its
standard error."""

VAGUE_TIME_CONSTANT = 0.45
"""Intervals are doubted if the log of the disturbance's time constant has a larger standard error."""

SHORTEST_STEP_S = 1e-3


def estimate(dive: Dive, file: VehicleFile, configuration_name: str, progress: Progress) -> Identification:
    """Return total masses and linear dampings of all axes that the dive drives, with 95 % intervals.

    Raises FitError if the recording is too short, or holds no thruster command at all.
    """
    began_s = time.perf_counter()
    axes = shared_axes(with_depth_of_the_dvl(dive, file.vehicle.water), file, configuration_name)
    built = axes.value
    configuration = file.vehicle.configurations[configuration_name]
    spoilt = {finding.dof: finding for finding in unrecorded(dive, file.vehicle.water)}
    apart = {*spoilt, *held_unseen(dive)}
    refit = partial(fit_axes, configuration=configuration, progress=progress, feedback_unrecorded=apart)
    joint = refit(built)
    tests = doubts_of(joint.joint, joint.theta)
    sampled = with_samples(dive, (test for dof, test in tests.items() if dof not in spoilt))
    if joint.fits and sampled is not dive:
        progress(1.0, "taking commands for samples of a faster loop")
        dive = sampled
        built = lasting_axes(with_depth_of_the_dvl(dive, file.vehicle.water), file, configuration_name)
        joint = refit(built)
        tests = doubts_of(joint.joint, joint.theta)
    timed, curve = Timed(built, joint), file.vehicle.thrust_curve
    seems_late = _seems_late(tests, built, spoilt)
    if joint.fits and (seems_late or curve.lag_s == curve.delay_s == 0.0):
        progress(1.0, "looking for the delay of the thrust")
        timed = with_timing(
            dive, file, configuration_name, timed, refit, seems_late,
            lambda fit: _seems_late(doubts_of(fit.joint, fit.theta), built, spoilt),
        )  # fmt: skip
    if timed.fit is not joint:
        built, joint = timed.built, timed.fit
        tests = doubts_of(joint.joint, joint.theta)
    progress(1.0, "")
    fits = joint.fits
    fitted = Fitted(
        "likelihood",
        np.array([float(np.exp(value)) for value in joint.log_value]),
        joint.covariance,
        joint.stretch,
        joint.joint,
        joint.theta,
        _nuisance(fits),
        _doubts(fits, joint.stopped_at),
        timed.delay,
        {DOFS[dof]: _usual_speed(fit) for dof, fit in fits.items()},
        {DOFS[dof]: _innovations(fit) for dof, fit in fits.items()},
        {
            dof: kinds
            for dof, fit in fits.items()
            if (kinds := kinds_of_runs(fit.problem, fit.maximum.theta, dive.runs))
        },
    )
    answer = answer_of(
        fitted, tests, built, dive, file, configuration_name, spoilt, weighs_others=True, began_s=began_s
    )
    totals = answer.parameters[: len(COEFFICIENTS)]
    notes = (*_rests_on_gravity(totals, built, configuration), *_rests_on_lag(totals, tests))
    notes = (*notes, *((shafts_note(curve.lag_s),) if timed.by_shafts else ()))
    unknown = [dof for dof in apart if not totals[dof].identifiable]
    return replace(answer, notes=(*answer.notes, *notes), information=_information(joint, unknown))


def _seems_late(doubts: Mapping[int, Doubts], built: Axes, spoilt: Collection[int]) -> bool:
    """Whether thrust seems to act at another time than assumed, in an axis that can show it. Velocity from an
    autopilot's own filter is late by itself, so axes with it are left out."""
    telling = (axis.dof for axis in built.axes if axis.dof in built.pushed and not axis.is_coloured)
    return any(doubts[dof].is_late for dof in telling if dof not in spoilt)


def _innovations(fit: AxisFit) -> Signal:
    """Each reading's innovation over its standard deviation."""
    error, variance = fit.problem.filtered(fit.maximum.theta, np.inf)
    read = np.isfinite(error)
    return Signal(fit.problem.axis.time_s[read], (error[read] / np.sqrt(variance[read]))[:, None])


def _rests_on_gravity(
    totals: tuple[Estimate, ...], built: Axes, configuration: Configuration
) -> tuple[str, ...]:
    """A note that names the coefficients whose scale comes from the vehicle file's centre of gravity, because no
    thruster pushed there."""
    named = [t.name for t in totals if t.identifiable and t.name in built.rest_on_righting]
    if not named:
        return ()
    return (
        f"{', '.join(named)} rest{'s' * (len(named) == 1)} on the vehicle file's centre of gravity, "
        f"{1000 * configuration.centre_of_gravity_below_buoyancy_m:.0f} mm below buoyancy: no thruster pushed there.",
    )


def _rests_on_lag(totals: tuple[Estimate, ...], doubts: Mapping[int, Doubts]) -> tuple[str, ...]:
    """A note that names the coefficients that a delay of TELLING_LATE_S would move by a good part of their interval."""
    moved = {
        totals[row].name: by
        for dof, doubt in doubts.items()
        for row in (dof, 6 + dof)
        if totals[row].identifiable
        and abs(by := TELLING_LATE_S * float(doubt.late.leaning[row]))
        > TELLING_SHARE * totals[row].relative_std
    }
    return (lateness_note(moved, TELLING_LATE_S),) if moved else ()


def _information(joint: JointFit, unknown: Collection[int]) -> Information:
    """Information of the dive on mass, damping and trim of all axes; all other parameters are projected out.

    Also projected out are the masses of the `unknown` degrees of freedom, because another dive of this kind would not
    determine them either, and the linear dampings of a hull that has none.
    """
    names = [
        name for dof in joint.fits for name in (MASSES[dof].name, DAMPINGS[dof].name, f"{DOFS[dof]}_trim")
    ]
    scale = np.array([size for fit in joint.fits.values() for size in (1.0, 1.0, _usual_force(fit))])
    matrix = joint.information * np.outer(scale, scale)
    absent = [DAMPINGS[dof].name for dof in joint.fits if not np.isfinite(joint.log_value[6 + dof])]
    dropped = np.isin(names, [*(MASSES[dof].name for dof in unknown), *absent])
    if not dropped.any():
        return Information(tuple(names), matrix)
    kept, out = np.flatnonzero(~dropped), np.flatnonzero(dropped)
    cross = matrix[np.ix_(kept, out)]
    left = matrix[np.ix_(kept, kept)] - cross @ np.linalg.pinv(matrix[np.ix_(out, out)]) @ cross.T
    return Information(tuple(names[i] for i in kept), np.asarray(left, dtype=np.float64))


def _usual_force(fit: AxisFit) -> float:
    """Root mean square of the force that drove an axis, over steps long enough for a meaningful mean force."""
    axis = fit.problem.axis
    return float(np.sqrt(np.mean(axis.force[axis.step_s > SHORTEST_STEP_S] ** 2)))


def _usual_speed(fit: AxisFit) -> float:
    """Root mean square of an axis's speed or rate of turn over time."""
    axis = fit.problem.axis
    return float(np.sqrt(np.average(axis.speed**2, weights=axis.step_s)))


def _doubts(fits: Mapping[int, AxisFit], stopped_at: str) -> tuple[Doubt, ...]:
    doubts = [
        Doubt(
            coefficients_of([dof]),
            f"The dive is too short to tell how slowly what disturbs {DOFS[dof]} changes, within a factor of "
            f"{np.exp(Z95 * spread):.1f}",
            f"the intervals in {DOFS[dof]} may be too narrow; dive longer.",
        )
        for dof, fit in fits.items()
        if (spread := float(np.sqrt(fit.covariance[TIME_CONSTANT, TIME_CONSTANT]))) > VAGUE_TIME_CONSTANT
    ]
    if stopped_at:
        doubts.append(unsettled_doubt(fits, "all axes", stopped_at))
    return tuple(doubts)


def _nuisance(fits: Mapping[int, AxisFit]) -> dict[Nuisance, float]:
    """Noise levels and trims."""
    out = {}
    for dof, fit in fits.items():
        theta, axis = fit.maximum.theta, fit.problem.axis
        out[nuisance.disturbance(dof)] = float(np.exp(theta[DISTURBANCE]))
        out[nuisance.time_constant(dof)] = float(np.exp(theta[TIME_CONSTANT]))
        out[nuisance.trim(dof)] = float(np.mean(theta[FORCES : FORCES + axis.trims]))
        for i, channel in enumerate(axis.channels):
            name = nuisance.noise(dof, channel.name, channel.state_read == POSITION)
            out[name] = float(np.exp(theta[FORCES + fit.problem.shapes.shape[1] + i]))
    return out
