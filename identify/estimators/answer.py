"""From a fit of the axes' equations to an identification, for every method: intervals, doubts, reasons.

Intervals include the forces that the model lacks, and the time at which forces act.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DAMPINGS, DOFS, MASSES, OF_HULL, Coefficient
from bridge.vehicle.config import VehicleFile
from identify.checks.controller import Unrecorded
from identify.checks.fit import (
    crossed,
    crossed_doubts,
    delay_doubt,
    drag_doubts,
    late_doubts,
    loud,
    loud_doubts,
    loud_note,
    missing_forces,
    strange_doubts,
    too_little,
    unseen_doubts,
)
from identify.dive import Dive, Signal
from identify.estimators.axes import Axes
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.misfit import Admitted, Doubts, admitted, timing_of
from identify.identification import (
    LARGEST_RELATIVE_STD,
    Z95,
    Doubt,
    Estimate,
    Identification,
    Nuisance,
    ThrustDelay,
    added_mass,
    outcome_of,
)
from identify.identification import estimate as as_estimate

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Fitted:
    """The fit of a method.

    value (18,): the coefficients in the order of `OF_HULL`, NaN for those not fitted; covariance (18, 18) of their
    logarithms. stretch (18, 2): factors on the lower and the upper half of each interval. joint, theta: the likelihood
    of all axes at these values. doubts: the method's own. delay: extra delay of the thrust, if one was fitted.
    usual_speeds, innovations: as in `Identification`.
    """

    method: str
    value: Array
    covariance: Array
    stretch: Array
    joint: JointLikelihood
    theta: Array
    nuisance: dict[Nuisance, float] = field(default_factory=dict)
    doubts: tuple[Doubt, ...] = ()
    delay: ThrustDelay | None = None
    usual_speeds: dict[str, float] = field(default_factory=dict)
    innovations: dict[str, Signal] = field(default_factory=dict)


def answer_of(
    fitted: Fitted,
    tests: Mapping[int, Doubts],
    built: Axes,
    dive: Dive,
    file: VehicleFile,
    configuration: str,
    spoilt: Mapping[int, Unrecorded],
    *,
    weighs_others: bool,
    began_s: float,
) -> Identification:
    """The identification of a dive, without `information`.

    tests: of the fit, by degree of freedom. spoilt: the degrees of freedom whose controller used an unrecorded reading;
    weighs_others: whether the method then took their masses from the other axes. began_s: as `time.perf_counter`.
    """
    shape = file.vehicle.configurations[configuration]
    joint, theta, delay = fitted.joint, fitted.theta, fitted.delay
    lacking = {dof: test.drag for dof, test in tests.items() if test.lacks_drag}
    # Thrust that follows the disturbance through an unrecorded reading seems to come late, so such axes don't count.
    late = {dof: test.late for dof, test in tests.items() if test.is_late and dof not in spoilt}
    let_in = admitted(joint, theta, lacking, late, _timing(tests, delay))
    missing = missing_forces(tuple(lacking), tuple(late), shape.damping)
    hull = OF_HULL.values() if shape.damping != "linear" else (*MASSES, *DAMPINGS)
    reasons = spoilt if weighs_others else {}
    estimates = [
        _estimate(coefficient, row, fitted, let_in, missing, built, reasons)
        for row, coefficient in enumerate(hull)
    ]
    totals, squared = estimates[:12], estimates[12:]
    noisy = loud(joint, theta, built.pushed)
    by_others = (_of_others(unheard, totals[dof]) for dof, unheard in reasons.items())
    doubts = (
        *strange_doubts(built.strange),
        *crossed_doubts(crossed(joint, theta)),
        *loud_doubts(noisy),
        *unseen_doubts(built),
        *(() if delay is None else (delay_doubt(delay, built.pushed),)),
        *late_doubts(late, built.pushed),
        *drag_doubts(lacking, shape.damping),
        *fitted.doubts,
        *by_others,
    )
    names, covariance = _covariance(estimates, fitted, let_in)
    return Identification(
        fitted.method,
        outcome_of(totals, doubts),
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
        fitted.nuisance,
        (*dive.notes, *built.notes, *loud_note(noisy)),
        time.perf_counter() - began_s,
        fitted.innovations,
        doubts=doubts,
        rest_on_righting=built.rest_on_righting,
        weighed_by_others=tuple(MASSES[dof].name for dof in spoilt) if weighs_others else None,
        thrust_delay=delay,
        usual_speeds=fitted.usual_speeds,
    )


def _timing(tests: Mapping[int, Doubts], delay: ThrustDelay | None) -> Array:
    """Change of the logarithms, (k, 18), for one standard error in the time at which forces act: by the stamps of
    each degree of freedom, and by the delay, for all at once."""
    by_stamps = timing_of(tests)
    if delay is None:
        return by_stamps
    return np.vstack(
        [by_stamps, delay.std_s * np.sum([test.late.leaning for test in tests.values()], axis=0)]
    )


def _estimate(
    of: Coefficient,
    row: int,
    fitted: Fitted,
    let_in: Admitted,
    missing: str,
    built: Axes,
    spoilt: Mapping[int, Unrecorded],
) -> Estimate:
    """A coefficient with the interval of its logarithm, or with the reason why it has none."""
    name, dof, nan = of.name, of.dof, float("nan")
    if dof not in {problem.axis.dof for problem in fitted.joint.problems}:
        return as_estimate(name, nan, nan, nan, nan, built.missing[dof])
    value, own_std = float(fitted.value[row]), float(np.sqrt(fitted.covariance[row, row]))
    if not np.isfinite(value):
        return as_estimate(name, nan, nan, nan, nan, _absent(of, built))
    std, (below, above) = let_in.std(row, own_std), let_in.reach(row, own_std, fitted.stretch[row])
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


def _of_others(unheard: Unrecorded, mass: Estimate) -> Doubt:
    little = "" if mass.identifiable else ", which say too little of it"
    return unheard.doubt(f"is taken from the other axes' Coriolis forces alone{little}")


def _covariance(
    estimates: Sequence[Estimate], fitted: Fitted, let_in: Admitted
) -> tuple[tuple[str, ...], Array]:
    """Names and covariance of the fitted coefficients."""
    kept = [row for row in range(len(estimates)) if np.isfinite(fitted.value[row])]
    relative = (fitted.covariance + let_in.covariance)[np.ix_(kept, kept)]
    values = np.array([estimates[row].value for row in kept])
    return tuple(estimates[row].name for row in kept), relative * np.outer(values, values)
