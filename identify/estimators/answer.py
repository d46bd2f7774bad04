"""From a fit of the axes' equations to a user's answer, for every method: intervals, doubts, reasons, outcome.

Intervals include the forces that the model lacks, and the time at which forces act.
"""

import math
import time
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bridge.arrays import Array
from bridge.clock import date_in_name
from bridge.vehicle.coefficients import DAMPINGS, DOFS, MASSES, OF_HULL, Coefficient
from bridge.vehicle.config import VehicleFile
from identify.checks.actuation.controller import Unrecorded, feedback_doubts, unchecked
from identify.checks.contradictions import contradictions
from identify.checks.fit.hardly_this_vehicle import crossed, crossed_doubts, strange_doubts
from identify.checks.fit.loud_noise import loud, loud_doubts, loud_note
from identify.checks.fit.missing_forces import (
    drag_doubts,
    lacking_doubts,
    missing_forces_words,
    why_not_identifiable,
)
from identify.checks.fit.thrust_timing import delay_doubt, late_doubts, seldom_doubts
from identify.checks.fit.unread_speeds import unread_doubts
from identify.dive import Dive, Signal
from identify.doubt import Doubt, Outcome, coefficients_of, worst
from identify.estimators.axes.axis import Axes
from identify.estimators.identifiability import (
    with_bounds,
    with_drag_forces,
    with_identifiability,
    without_implausible,
)
from identify.estimators.likelihood.joint import JointLikelihood
from identify.estimators.mass_by_run import Kinds, unlike_doubts
from identify.estimators.missing_forces.drag_and_timing import (
    Admitted,
    Doubts,
    admitted,
    by_hidden_steps,
    timing_of,
)
from identify.estimators.missing_forces.screening import lacks_of, widened
from identify.identification import (
    LARGEST_RELATIVE_STD,
    Estimate,
    Identification,
    ThrustDelay,
    added_mass,
    outcome_of,
)
from identify.identification import estimate as as_estimate
from identify.nuisance import Nuisance
from identify.priors import with_priors
from identify.statistics import Z95
from identify.words import utc


@dataclass(frozen=True)
class Fitted:
    """The fit of a method.

    value (18,): the coefficients in the order of `OF_HULL`, NaN for those not fitted; covariance (18, 18) of their
    logarithms. stretch (18, 2): factors on the lower and the upper half of each interval. joint, theta: the likelihood
    of all axes at these values. doubts: the method's own. delay: extra delay of the thrust, if one was fitted.
    usual_speeds, innovations: as in `Identification`. kinds: by degree of freedom, where its runs fall into two.
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
    kinds: dict[int, Kinds] = field(default_factory=dict)


NO_LINEAR = "the vehicle file's damping is quadratic: its hull has no linear damping"


def answer_of(
    fitted: Fitted,
    tests: Mapping[int, Doubts],
    built: Axes,
    dive: Dive,
    file: VehicleFile,
    configuration_name: str,
    spoilt: Mapping[int, Unrecorded],
    *,
    weighs_others: bool,
    began_s: float,
) -> Identification:
    """The identification of a dive, without `information`.

    tests: of the fit, by degree of freedom. spoilt: the degrees of freedom whose controller used an unrecorded reading;
    weighs_others: whether the method then took their masses from the other axes. began_s: as `time.perf_counter`.
    """
    configuration = file.vehicle.configurations[configuration_name]
    joint, theta, delay = fitted.joint, fitted.theta, fitted.delay
    lacking = {dof: test.drag for dof, test in tests.items() if test.lacks_drag}
    # Thrust that follows the disturbance through an unrecorded reading seems to come late, so such axes don't count.
    # Nor do those that no thruster pushed: thrust that hardly changes has no time at which it acts.
    late = {
        dof: test.late
        for dof, test in tests.items()
        if test.is_late and dof in built.pushed and dof not in spoilt
    }
    others = lacks_of(joint, theta, built, dive, spoilt, tests)
    let_in = widened(admitted(joint, theta, lacking, late, _timing(fitted, tests)), joint, theta, others)
    missing = missing_forces_words(tuple(lacking), tuple(late), others, configuration.damping)
    hull = OF_HULL.values() if configuration.damping != "linear" else (*MASSES, *DAMPINGS)
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
        *unread_doubts(built),
        *seldom_doubts(built.axes),
        *(() if delay is None else (delay_doubt(delay, built.pushed),)),
        *late_doubts(late, built.pushed),
        *drag_doubts(lacking, configuration.damping),
        *lacking_doubts(others, configuration.damping),
        *fitted.doubts,
        *unlike_doubts(fitted.kinds, others),
        *by_others,
    )
    names, covariance = _covariance(estimates, fitted, let_in)
    return Identification(
        fitted.method,
        outcome_of(totals, doubts),
        (*totals, *(added_mass(total, configuration) for total in totals[:6]), *squared),
        configuration_name,
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
        weighed_by_others=tuple(MASSES[dof].name for dof in joint.apart) if weighs_others else None,
        thrust_delay=delay,
        usual_speeds=fitted.usual_speeds,
    )


def _timing(fitted: Fitted, tests: Mapping[int, Doubts]) -> Array:
    """Change of the logarithms, (k, 18), for one standard error in the time at which forces act: by the stamps and by
    the slow samples of the commands of each degree of freedom, and by the delay, for all at once."""
    delay = fitted.delay
    known = [timing_of(tests), by_hidden_steps(fitted.joint, fitted.theta)]
    if delay is not None:
        known.append(delay.std_s * np.sum([test.late.leaning for test in tests.values()], axis=0)[None, :])
    return np.vstack(known)


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
    value, fitted_std = float(fitted.value[row]), float(np.sqrt(fitted.covariance[row, row]))
    if not np.isfinite(value):
        return as_estimate(name, nan, nan, nan, nan, NO_LINEAR)
    std, (below, above) = let_in.std(row, fitted_std), let_in.reach(row, fitted_std, fitted.stretch[row])
    reason, widest = "", max(below, above) / Z95
    if widest > LARGEST_RELATIVE_STD:
        text = why_not_identifiable(name, DOFS[dof], widest, float(let_in.shift[row]), value, missing)
        why = f"; {built.unpushed[dof]}" if dof in built.unpushed else ""
        reason = spoilt[row].evidence if row in spoilt else f"{text}{why}"
    if np.isinf(below):
        reason = f"the dive can't tell {name} from none: it is below {value * np.exp(above):.3g} {of.unit}"
    low, high = value * np.exp(-below), value * np.exp(above)
    return as_estimate(name, value, value * std, float(low), float(high), reason)


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


def answered(fit: Identification, dive: Dive, file: VehicleFile) -> Identification:
    """Return the result that a user may rely on, with its stated limits, from the fit of any method."""
    vehicle = file.vehicle
    configuration = vehicle.configurations[fit.configuration]
    fitted = {p.name for p in fit.parameters if math.isfinite(p.value)} - {*fit.rest_on_righting}
    doubts = (*fit.doubts, *contradictions(dive, file, fit.configuration, fitted))
    notes = (*fit.notes, *unchecked(dive))
    result = replace(fit, dived=_date(dive), dive_opening=dive.opening, doubts=doubts, notes=notes)
    if fit.weighed_by_others is None:
        result = without_masses(result, feedback_doubts(dive, vehicle.water))
    result = with_bounds(result, configuration)
    result = with_priors(result, configuration.priors, vehicle.thrust_curve.scale_std)
    result = without_implausible(result, configuration)
    result = with_identifiability(with_drag_forces(result))
    totals = result.parameters[:12]
    whole = (*totals, *(added_mass(total, configuration) for total in totals[:6]), *result.parameters[18:])
    return replace(result, parameters=whole, outcome=_outcome(fit.outcome, outcome_of(totals, result.doubts)))


def _date(dive: Dive) -> str:
    """The day on which a dive began, by the vehicle's clock or else the dive's name, as `2026-11-20`; empty if
    unknown."""
    began_s = date_in_name(dive.name) if dive.unix_at_boot_s is None else dive.unix_at_boot_s + dive.span_s[0]
    return "" if began_s is None else utc(began_s)[: len("2026-11-20")]


def without_masses(fit: Identification, doubts: tuple[Doubt, ...]) -> Identification:
    """The fit without the coefficients that the doubts are about; the problem of a doubt is the reason."""
    reasons = {name: doubt.clause for doubt in reversed(doubts) for name in doubt.about}
    return replace(
        fit,
        parameters=tuple(_left_out(parameter, reasons) for parameter in fit.parameters),
        doubts=(*fit.doubts, *doubts),
    )


def _left_out(parameter: Estimate, reasons: dict[str, str]) -> Estimate:
    if parameter.name not in reasons or not math.isfinite(parameter.value):
        return parameter
    nan = math.nan
    return replace(
        parameter,
        value=nan,
        std=nan,
        low95=nan,
        high95=nan,
        identifiable=False,
        reason=reasons[parameter.name],
    )


def _outcome(by_fit: Outcome, by_doubts: Outcome) -> Outcome:
    """The worse of the fit's outcome and the doubts' outcome. The doubts' alone if either is NOT_IDENTIFIABLE: they
    are based on the final estimates."""
    if by_doubts is Outcome.NOT_IDENTIFIABLE or by_fit is Outcome.NOT_IDENTIFIABLE:
        return by_doubts
    return worst((by_fit, by_doubts))


def unsettled_doubt(dofs: Collection[int], where: str, bound: str) -> Doubt:
    """Doubt that the search in these degrees of freedom settled: it stopped at its bound of steps."""
    return Doubt(
        coefficients_of(dofs),
        f"In {where} the search stopped at its bound of {bound} before it settled",
        f"don't rely on what it says of {where}; dive longer, with more changes of thrust.",
        Outcome.AT_BOUND,
    )
