"""Turns the fit of any estimator into a result for the user: doubts, bounds, priors, identifiability, outcome."""

import math
from dataclasses import replace

from bridge.dates import date_in_name
from bridge.vehicle.config import VehicleFile
from identify.bounds import with_bounds, with_drag_forces
from identify.checks.contradictions import contradictions
from identify.checks.controller import feedback_doubts, unchecked
from identify.dates import utc
from identify.dive import Dive
from identify.identifiability import with_identifiability
from identify.identification import Doubt, Estimate, Identification, Outcome, added_mass, outcome_of, worst
from identify.priors import with_priors


def answered(fit: Identification, dive: Dive, file: VehicleFile) -> Identification:
    """Return the result that a user may rely on, with its stated limits, from the fit of any method."""
    vehicle = file.vehicle
    shape = vehicle.configurations[fit.configuration]
    fitted = {p.name for p in fit.parameters if math.isfinite(p.value)} - {*fit.rest_on_righting}
    doubts = (*fit.doubts, *contradictions(dive, file, fit.configuration, fitted))
    notes = (*fit.notes, *unchecked(dive))
    result = replace(fit, dived=_date(dive), dive_opening=dive.opening, doubts=doubts, notes=notes)
    if fit.weighed_by_others is None:
        result = without_masses(result, feedback_doubts(dive, vehicle.water))
    result = with_bounds(result, shape)
    result = with_priors(result, shape.priors, vehicle.thrust_curve.scale_std)
    result = with_identifiability(with_drag_forces(result))
    totals = result.parameters[:12]
    whole = (*totals, *(added_mass(total, shape) for total in totals[:6]), *result.parameters[18:])
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


def _left_out(one: Estimate, reasons: dict[str, str]) -> Estimate:
    if one.name not in reasons or not math.isfinite(one.value):
        return one
    nan = math.nan
    return replace(
        one, value=nan, std=nan, low95=nan, high95=nan, identifiable=False, reason=reasons[one.name]
    )


def _outcome(by_fit: Outcome, by_doubts: Outcome) -> Outcome:
    """The worse of the fit's outcome and the doubts' outcome. The doubts' alone if either is NOT_IDENTIFIABLE: they
    are based on the final estimates."""
    if by_doubts is Outcome.NOT_IDENTIFIABLE or by_fit is Outcome.NOT_IDENTIFIABLE:
        return by_doubts
    return worst((by_fit, by_doubts))
