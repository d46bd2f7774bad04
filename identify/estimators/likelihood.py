"""Innovations maximum likelihood: a Kalman filter on the vehicle's dynamics with a Gauss-Markov disturbance.

Closed loop does no harm here: the likelihood of each reading given all earlier readings is the same whether or not a
controller chose the thrust from those readings (Ljung 1999, section 13.4), as long as the controller's readings are
among them. If they are not, the mass of that axis is taken from the other axes' Coriolis forces alone. Noise levels
and the disturbance's time constant are fitted with the coefficients; intervals come from the Fisher information.
"""

import time
from collections.abc import Collection, Mapping
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DAMPINGS, DOFS, MASSES, QUADRATICS, Coefficient
from bridge.vehicle.config import Configuration, VehicleFile
from identify import identification
from identify.checks.controller import Unrecorded, unrecorded
from identify.checks.fit import (
    crossed,
    crossed_doubts,
    delay_doubt,
    drag_doubts,
    late_doubts,
    lateness_note,
    loud,
    loud_doubts,
    loud_note,
    missing_forces,
    strange_doubts,
    too_little,
    unseen_doubts,
    unsettled_doubt,
)
from identify.dive import Dive, Signal
from identify.estimators.autopilot_velocity import shared_axes
from identify.estimators.axes import Axes
from identify.estimators.delay import with_delay
from identify.estimators.innovations import POSITION
from identify.estimators.likelihood_axis import (
    DISTURBANCE,
    FORCES,
    TIME_CONSTANT,
    AxisFit,
)
from identify.estimators.likelihood_fit import JointFit, fit_axes
from identify.estimators.misfit import Admitted, Doubts, admitted, doubts_of, timing_of
from identify.estimators.refusals import long_enough
from identify.forces import wrench
from identify.identification import (
    LARGEST_RELATIVE_STD,
    Z95,
    Doubt,
    Estimate,
    Identification,
    Information,
    Nuisance,
    ThrustDelay,
    added_mass,
    outcome_of,
)
from identify.identification import estimate as as_estimate
from identify.progress import Progress

Array = NDArray[np.float64]

TELLING_LATE_S, TELLING_SHARE = 0.01, 0.5
"""A coefficient is noted if thrust that acts TELLING_LATE_S later would move it by more than TELLING_SHARE of its
standard error."""

VAGUE_TIME_CONSTANT = 0.45
"""Intervals are doubted if the log of the disturbance's time constant has a larger standard error."""

SHORTEST_STEP_S = 1e-3


def estimate(dive: Dive, file: VehicleFile, configuration: str, progress: Progress) -> Identification:
    """Return total masses and linear dampings of all axes that the dive drives, with 95 % intervals.

    Raises FitError if the recording is too short, or holds no thruster command at all.
    """
    began = time.perf_counter()
    long_enough(dive)
    axes = shared_axes(dive, file, configuration)
    built = axes.value
    shape = file.vehicle.configurations[configuration]
    spoilt = {finding.dof: finding for finding in unrecorded(dive, file.vehicle.water)}
    joint = fit_axes(built, shape, progress, spoilt)
    doubts = doubts_of(joint.joint, joint.theta)
    delay = None
    curve, seems_late = file.vehicle.thrust_curve, _seems_late(doubts, built, spoilt)
    if joint.fits and (seems_late or curve.lag_s == curve.delay_s == 0.0):
        progress(1.0, "looking for the delay of the thrust")
        forces = wrench(dive, file, configuration)
        refit = partial(fit_axes, configuration=shape, progress=progress, doubted=spoilt)
        try:
            late_fit = with_delay(forces, curve.delay_s, built, joint, refit, seems_late)
        except np.linalg.LinAlgError:
            # A delay at which the equations have no solution is rejected; without a delay they have one.
            late_fit = None
        if late_fit is not None:
            delay, built, joint = late_fit.delay, late_fit.built, late_fit.fit
            doubts = doubts_of(joint.joint, joint.theta)
    fits = joint.fits
    lacking = {dof: finding.drag for dof, finding in doubts.items() if finding.lacks_drag}
    # Thrust that follows the disturbance through an unrecorded reading seems to come late, so such axes don't count.
    late = {dof: finding.late for dof, finding in doubts.items() if finding.is_late and dof not in spoilt}
    let_in = admitted(joint.joint, joint.theta, lacking, late, _timing(doubts, delay))
    progress(1.0, "done")
    missing = missing_forces(tuple(lacking), tuple(late), shape.damping)
    totals = tuple(
        _one(c, row, joint, let_in, missing, built, spoilt) for row, c in enumerate((*MASSES, *DAMPINGS))
    )
    squared = tuple(
        _one(c, row, joint, let_in, missing, built, spoilt)
        for row, c in enumerate(QUADRATICS, start=len(totals))
        if shape.damping != "linear"
    )
    names, covariance = _covariance((*totals, *squared), joint, let_in)
    by_others = tuple(_of_others(finding, totals[dof]) for dof, finding in spoilt.items())
    noisy = loud(joint.joint, joint.theta, built.pushed)
    all_doubts = (
        *strange_doubts(built.strange),
        *crossed_doubts(crossed(joint.joint, joint.theta)),
        *loud_doubts(noisy),
        *unseen_doubts(built),
        *(() if delay is None else (delay_doubt(delay, built.pushed),)),
        *late_doubts(late, built.pushed),
        *drag_doubts(lacking, shape.damping),
        *_doubts(fits, joint.stopped_at),
        *by_others,
    )
    return Identification(
        "likelihood",
        outcome_of(totals, all_doubts),
        (*totals, *(added_mass(total, shape) for total in totals[:6]), *squared),
        configuration,
        dive.name,
        dive.sha256,
        file.vehicle.name,
        file.sha256,
        dive.duration_s,
        sum(int(np.isfinite(axis.reading).sum()) for axis in built.axes),
        covariance,
        names,
        _nuisance(fits),
        (
            *dive.notes,
            *built.notes,
            *loud_note(noisy),
            *_rests_on_gravity(totals, built, shape),
            *_rests_on_lag(totals, doubts),
        ),
        time.perf_counter() - began,
        {DOFS[dof]: _innovations(fit) for dof, fit in fits.items()},
        _information(joint, [dof for dof in spoilt if not totals[dof].identifiable]),
        all_doubts,
        rest_on_righting=built.rest_on_righting,
        weighed_by_others=tuple(MASSES[dof].name for dof in spoilt),
        thrust_delay=delay,
        usual_speeds={DOFS[dof]: _usual_speed(fit) for dof, fit in fits.items()},
    )


def _seems_late(doubts: Mapping[int, Doubts], built: Axes, spoilt: Collection[int]) -> bool:
    """Whether thrust seems to act at another time than assumed, in an axis that can show it. Velocity from an
    autopilot's own filter is late by itself, so axes with it are left out."""
    telling = (axis.dof for axis in built.axes if axis.dof in built.pushed and not axis.is_coloured)
    return any(doubts[dof].is_late for dof in telling if dof not in spoilt)


def _timing(doubts: Mapping[int, Doubts], delay: ThrustDelay | None) -> Array:
    """Change of the logarithms, (k, 18), for one standard error in the time at which forces act: by the stamps of
    each degree of freedom, and by the delay, for all at once."""
    by_stamps = timing_of(doubts)
    if delay is None:
        return by_stamps
    return np.vstack(
        [by_stamps, delay.std_s * np.sum([doubt.late.leaning for doubt in doubts.values()], axis=0)]
    )


def _of_others(spoilt: Unrecorded, mass: Estimate) -> Doubt:
    too_little = "" if mass.identifiable else ", which say too little of it"
    return spoilt.doubt(f"is taken from the other axes' Coriolis forces alone{too_little}")


def _innovations(fit: AxisFit) -> Signal:
    """Each reading's innovation over its standard deviation."""
    error, variance = fit.problem.filtered(fit.maximum.theta, np.inf)
    read = np.isfinite(error)
    return Signal(fit.problem.axis.time_s[read], (error[read] / np.sqrt(variance[read]))[:, None])


def _one(
    of: Coefficient,
    row: int,
    joint: JointFit,
    let_in: Admitted,
    missing: str,
    built: Axes,
    spoilt: Mapping[int, Unrecorded],
) -> Estimate:
    """Return a coefficient with the interval of its logarithm, or with the reason why it has none."""
    name, dof, nan = of.name, of.dof, float("nan")
    if dof not in joint.fits:
        return as_estimate(name, nan, nan, nan, nan, built.missing[dof])
    if not np.isfinite(joint.log_value[row]):
        return as_estimate(name, nan, nan, nan, nan, _absent(of, built))
    value, own_std = float(np.exp(joint.log_value[row])), float(np.sqrt(joint.covariance[row, row]))
    std, (below, above) = let_in.std(row, own_std), let_in.reach(row, own_std, joint.stretch[row])
    reason, widest = "", max(below, above) / Z95
    if widest > LARGEST_RELATIVE_STD:
        text = too_little(name, DOFS[dof], widest, float(let_in.shift[row]), value, missing)
        why = f"; {built.unpushed[dof]}" if dof in built.unpushed else ""
        reason = spoilt[row].found if row in spoilt else f"{text}{why}"
    if np.isinf(below):
        reason = f"the dive can't tell {name} from none: it is below {value * np.exp(above):.3g} {of.unit}"
    low, high = value * np.exp(-below), value * np.exp(above)
    return as_estimate(name, value, value * std, float(low), float(high), reason)


def _absent(of: Coefficient, built: Axes) -> str:
    """Why the model of a fitted axis lacks this coefficient."""
    if of.kind == "quadratic":
        return f"{built.unpushed[of.dof]}, and the little motion there tells no drag by its square"
    return "the vehicle file's damping is quadratic: its hull has no linear damping"


def _rests_on_gravity(totals: tuple[Estimate, ...], built: Axes, shape: Configuration) -> tuple[str, ...]:
    """A note that names the coefficients whose scale comes from the vehicle file's centre of gravity, because no
    thruster pushed there."""
    named = [t.name for t in totals if t.identifiable and t.name in built.rest_on_righting]
    if not named:
        return ()
    return (
        f"{', '.join(named)} rest on the vehicle file's centre of gravity, "
        f"{1000 * shape.centre_of_gravity_below_buoyancy_m:.0f} mm below buoyancy: no thruster pushed there.",
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


def _covariance(
    totals: tuple[Estimate, ...], joint: JointFit, let_in: Admitted
) -> tuple[tuple[str, ...], Array]:
    """Names and covariance of the fitted coefficients."""
    kept = [i for i in range(len(totals)) if np.isfinite(joint.log_value[i])]
    relative = (joint.covariance + let_in.covariance)[np.ix_(kept, kept)]
    values = np.array([totals[i].value for i in kept])
    return tuple(totals[i].name for i in kept), relative * np.outer(values, values)


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
            (MASSES[dof].name, DAMPINGS[dof].name),
            f"The dive is too short to tell how slowly what disturbs {DOFS[dof]} changes, within a factor of "
            f"{np.exp(Z95 * spread):.1f}",
            f"the intervals in {DOFS[dof]} may be too narrow; dive longer.",
        )
        for dof, fit in fits.items()
        if (spread := float(np.sqrt(fit.covariance[TIME_CONSTANT, TIME_CONSTANT]))) > VAGUE_TIME_CONSTANT
    ]
    if stopped_at:
        names = tuple(group[dof].name for group in (MASSES, DAMPINGS) for dof in fits)
        doubts.append(unsettled_doubt(names, "all axes", stopped_at))
    return tuple(doubts)


def _nuisance(fits: Mapping[int, AxisFit]) -> dict[Nuisance, float]:
    """Noise levels and trims."""
    out = {}
    for dof, fit in fits.items():
        theta, axis = fit.maximum.theta, fit.problem.axis
        out[identification.disturbance(dof)] = float(np.exp(theta[DISTURBANCE]))
        out[identification.time_constant(dof)] = float(np.exp(theta[TIME_CONSTANT]))
        out[identification.trim(dof)] = float(theta[FORCES])
        for i, channel in enumerate(axis.channels):
            name = identification.noise(dof, channel.name, channel.state_read == POSITION)
            out[name] = float(np.exp(theta[FORCES + fit.problem.shapes.shape[1] + i]))
    return out
