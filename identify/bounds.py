"""Where a fit ended at what a coefficient may not pass: the bounds of the list, the rigid body's own mass, and what the
water round it can weigh at most."""

import math
from dataclasses import replace

import numpy as np

from bridge.vehicle.coefficients import BY_NAME, DAMPINGS, DOFS, MASSES, OF_HULL, Coefficient
from bridge.vehicle.config import Configuration
from identify.drag_force import trades
from identify.identification import Z95, Doubt, Estimate, Identification, Outcome

NEAR = 1e-3
"""Relative distance from a bound other than 0 within which a value stands at it."""

TELLING_PER_S = 0.1
"""A damping known to better than this share of the rigid body's mass (1/s) is small, not unknown."""

MOST_ADDED = 3.0
"""Added mass in a translation over the dry mass. A disc broadside has 8/3 rho r^3 (DNV-RP-H103 2011, table A-2): three
times its own water where it is a seventh as thick as it is wide. Vehicles have less: open frames, two in heave."""


FARTHEST = 10.0
"""Times the rigid body's own, or that part of it: a mass or inertia beyond is no statement about this vehicle."""

WIDEST = 5.0
"""Upper over lower end of a mass's interval: a wider one is no statement either."""


def with_bounds(found: Identification, configuration: Configuration) -> Identification:
    """The identification with values at a bound named, and held to it; masses below the rigid body's doubted; and axes
    whose mass is out of all reason called not identifiable.

    A bound of 0 can't be reached by a logarithm: a damping stands there where the dive knows it well in N/(m/s), and
    none at all is within its interval. Of two dampings of one axis either may well be none.
    """
    parameters, doubts = [], list(found.doubts)
    for one in found.parameters:
        held, doubt = (
            _held(one, configuration, trades(found, one.name)) if one.name in OF_HULL else (one, None)
        )
        parameters.append(held)
        doubts += [] if doubt is None else [doubt]
    absurd = {
        BY_NAME[one.name].dof: told
        for one in parameters
        if one.name in BY_NAME and (told := _no_statement(one, configuration))
    }
    doubted = {name for doubt in doubts for name in doubt.about}
    for dof, told in absurd.items():
        if MASSES[dof].name not in doubted:
            sentence = (
                f"{told}; check the vehicle file's thrusters and mass, and the sensors' axes and units."
            )
            doubts.append(Doubt((MASSES[dof].name, DAMPINGS[dof].name), sentence, Outcome.DISAGREES))
    left = tuple(
        replace(one, identifiable=False, reason=absurd[BY_NAME[one.name].dof])
        if one.identifiable and one.name in BY_NAME and BY_NAME[one.name].dof in absurd
        else one
        for one in parameters
    )
    return replace(found, parameters=left, doubts=tuple(doubts))


def _no_statement(one: Estimate, configuration: Configuration) -> str:
    """Why a mass is out of all reason for this vehicle, empty where it is not, or is not told anyway."""
    coefficient = BY_NAME[one.name]
    if coefficient.kind != "mass" or not one.identifiable or not math.isfinite(one.value):
        return ""
    rigid, axis = configuration.rigid_body(coefficient.dof)[0], DOFS[coefficient.dof]
    came_out = f"{one.name} came out at {_written_out(one.value)} {one.unit}"
    if one.low95 > FARTHEST * rigid or one.high95 < rigid / FARTHEST:
        return (
            f"{came_out}, where the rigid body's own is {rigid:g}: the fit of {axis} is none of this vehicle's, and "
            "tells neither its mass nor its damping"
        )
    if one.high95 > WIDEST * one.low95:
        ends = f"{_written_out(one.low95)} to {_written_out(one.high95)}"
        return f"{came_out}, with an interval from {ends}, which tells nothing of {axis}"
    return ""


def _held(one: Estimate, configuration: Configuration, traded: bool) -> tuple[Estimate, Doubt | None]:
    coefficient = OF_HULL[one.name]
    rigid, rigid_std = configuration.rigid_body(coefficient.dof)
    if not math.isfinite(one.value):
        return one, None
    small = 0 < one.std < TELLING_PER_S * rigid and one.value < Z95 * one.std
    if coefficient.low == 0.0 and small and not traded:
        return _at(one, coefficient, "lower", 0.0)
    if coefficient.low > 0 and one.value <= coefficient.low * (1 + NEAR):
        return _at(one, coefficient, "lower", coefficient.low)
    if one.value >= coefficient.high * (1 - NEAR):
        return _at(one, coefficient, "upper", coefficient.high)
    came_out = f"{one.name} came out at {_written_out(one.value)} {one.unit}"
    if coefficient.kind == "mass" and one.identifiable and one.high95 < rigid - Z95 * rigid_std:
        sentence = (
            f"{came_out}, below the rigid body's own {rigid:g}, which no water "
            "can take away: the vehicle file's thrust is too weak or its mass too large; measure both again."
        )
        return one, Doubt((one.name,), sentence, Outcome.DISAGREES)
    most = (1.0 + MOST_ADDED) * (rigid + Z95 * rigid_std)
    if coefficient.kind == "mass" and coefficient.dof < 3 and one.identifiable and one.low95 > most:
        sentence = (
            f"{came_out}, {one.value / rigid:.1f} times the vehicle file's dry "
            "mass, which no water round it can make up: it can hardly be this vehicle's; check the DVL's axes and "
            "scale, the order of the thrusters, and that the vehicle file and its dry mass are this vehicle's."
        )
        return one, Doubt((one.name,), sentence, Outcome.DISAGREES)
    return one, None


def _at(one: Estimate, coefficient: Coefficient, side: str, bound: float) -> tuple[Estimate, Doubt]:
    """The estimate held to its bound, and the doubt that names both."""
    upper = max(one.value + Z95 * one.std, bound) if math.isfinite(one.std) else math.nan
    told = f"; the dive puts it below {_written_out(upper)}" if bound == 0.0 and math.isfinite(upper) else ""
    reason = f"{one.name} stopped at its {side} bound of {bound:g} {one.unit}{told}"
    low, high = (bound, upper) if side == "lower" else (min(one.low95, bound), bound)
    held = replace(
        one,
        value=min(max(one.value, coefficient.low), coefficient.high),
        low95=low,
        high95=high,
        identifiable=False,
        reason=reason,
    )
    sentence = (
        f"{reason}: the signs of its thrust and of its readings, or a force that the model lacks, drive it there; "
        "look at these before you rely on what else was identified."
    )
    return held, Doubt((one.name,), sentence, Outcome.AT_BOUND)


def _written_out(value: float) -> str:
    """Three significant digits, never as a power of ten."""
    return np.format_float_positional(value, 3, unique=False, fractional=False, trim="-")
