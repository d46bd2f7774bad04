"""Checks a fit against the limits of each coefficient: the listed bounds, the rigid body's own mass, and the largest
plausible added mass.

Total drag of an axis from its linear and quadratic damping, for dives that determine the sum better than either part.

At speeds that hardly vary, the two dampings trade off: each is known loosely, but the drag at those speeds is known
well. Then both are kept with their uncertainty, because a model with only one of them, or with neither, would be
wrong.
"""

import math
from dataclasses import replace

import numpy as np

from bridge.vehicle.coefficients import BY_NAME, DAMPINGS, DOFS, MASSES, OF_HULL, QUADRATICS, Coefficient
from bridge.vehicle.config import Configuration
from identify.identification import (
    LARGEST_RELATIVE_STD,
    Z95,
    Doubt,
    DragForce,
    Estimate,
    Identification,
    Outcome,
)

TRADED = 0.9
"""Absolute correlation from which on either of two coefficients means little without the other."""


def with_drag_forces(found: Identification) -> Identification:
    """Return the identification with the drag of each axis that has both dampings; if that drag is known well, both
    dampings are kept."""
    forces = tuple(force for dof in range(6) if (force := _force(found, dof)) is not None)
    known = [force for force in forces if force.relative_std <= LARGEST_RELATIVE_STD]
    kept = {name for force in known for name in (force.linear, force.quadratic)}
    kept -= {name for doubt in found.doubts if _holds_back(doubt) for name in doubt.about}
    return replace(
        found,
        parameters=tuple(
            _kept(parameter) if parameter.name in kept else parameter for parameter in found.parameters
        ),
        drag_forces=forces,
        notes=(*found.notes, *(_note(force) for force in known if abs(force.correlation) > TRADED)),
    )


def trades(found: Identification, name: str) -> bool:
    """Whether a coefficient is one of two dampings of an axis that were fitted together."""
    if OF_HULL[name].kind == "mass":
        return False
    dof = OF_HULL[name].dof
    return {DAMPINGS[dof].name, QUADRATICS[dof].name} <= set(found.covariance_of)


def _holds_back(doubt: Doubt) -> bool:
    return doubt.outcome is Outcome.AT_BOUND


def _kept(one: Estimate) -> Estimate:
    return replace(one, identifiable=True, reason="")


def _force(found: Identification, dof: int) -> DragForce | None:
    linear, quadratic = DAMPINGS[dof].name, QUADRATICS[dof].name
    speed = found.usual_speeds.get(DOFS[dof], 0.0)
    if not {linear, quadratic} <= set(found.covariance_of) or speed <= 0.0:
        return None
    values = np.array([found[linear].value, found[quadratic].value])
    if not np.isfinite(values).all():
        return None
    at = [found.covariance_of.index(linear), found.covariance_of.index(quadratic)]
    covariance = found.covariance[np.ix_(at, at)]
    by = np.array([speed, speed * speed])
    force, std = float(by @ values), math.sqrt(float(by @ covariance @ by))
    correlation = float(covariance[0, 1] / math.sqrt(covariance[0, 0] * covariance[1, 1]))
    low, high = max(force - Z95 * std, 0.0), force + Z95 * std
    return DragForce(DOFS[dof], linear, quadratic, speed, force, std, low, high, correlation)


def _note(one: DragForce) -> str:
    unit, per = ("N", "m/s") if one.axis in DOFS[:3] else ("N m", "rad/s")
    return (
        f"{one.linear} and {one.quadratic} hold together (correlation {one.correlation:+.2f}): take both or neither. "
        f"At {one.speed:.2g} {per}, the usual speed of this dive, drag in {one.axis} is {one.force:.3g} {unit} "
        f"({one.low95:.3g} to {one.high95:.3g})."
    )


NEAR = 1e-3
"""Relative distance from a nonzero bound within which a value counts as at the bound."""

TELLING_PER_S = 0.1
"""A damping with a standard error below this share of the rigid body's mass (1/s) is small, not unknown."""

MOST_ADDED = 3.0
"""Largest added mass in a translation over the dry mass. A disc moving broadside has 8/3 rho r^3 (DNV-RP-H103 2011,
table A-2): three times the mass of its own water if its thickness is a seventh of its width. Vehicles have less: open
frames in heave have two."""


FARTHEST = 10.0
"""A mass or inertia more than this many times above or below the rigid body's own says nothing about this vehicle."""

WIDEST = 5.0
"""Ratio of the upper to the lower end of a mass's interval: a wider interval says nothing either."""


def with_bounds(found: Identification, configuration: Configuration) -> Identification:
    """Return the identification with values held to their bounds and reported, masses below the rigid body's doubted,
    and axes with an absurd mass called not identifiable.

    A logarithm can't reach a bound of 0. A damping counts as at that bound if the dive determines it well in N/(m/s)
    and its interval includes zero. If an axis has two dampings, either may well be zero, so neither counts as at the
    bound.
    """
    parameters, doubts = [], list(found.doubts)
    for parameter in found.parameters:
        held, doubt = (
            _held(parameter, configuration, trades(found, parameter.name))
            if parameter.name in OF_HULL
            else (parameter, None)
        )
        parameters.append(held)
        doubts += [] if doubt is None else [doubt]
    absurd = {
        BY_NAME[parameter.name].dof: reason
        for parameter in parameters
        if parameter.name in BY_NAME and (reason := _absurd(parameter, configuration))
    }
    doubted = {name for doubt in doubts for name in doubt.about}
    for dof, (problem, what_follows) in absurd.items():
        if MASSES[dof].name not in doubted:
            about = MASSES[dof].name, DAMPINGS[dof].name
            remedy = f"{what_follows}; check the vehicle file's thrusters and mass, and the sensors' axes and units."
            doubts.append(Doubt(about, problem, remedy, Outcome.DISAGREES))
    left = tuple(
        replace(parameter, identifiable=False, reason=": ".join(absurd[BY_NAME[parameter.name].dof]))
        if parameter.identifiable and parameter.name in BY_NAME and BY_NAME[parameter.name].dof in absurd
        else parameter
        for parameter in parameters
    )
    return replace(found, parameters=left, doubts=tuple(doubts))


def _absurd(one: Estimate, configuration: Configuration) -> tuple[str, str] | None:
    """Why a mass is absurd for this vehicle, and what follows; None if it is plausible, or not identifiable anyway."""
    coefficient = BY_NAME[one.name]
    if coefficient.kind != "mass" or not one.identifiable or not math.isfinite(one.value):
        return None
    rigid, axis = configuration.rigid_body(coefficient.dof)[0], DOFS[coefficient.dof]
    came_out = f"{one.name} came out at {_written_out(one.value)} {one.unit}"
    if one.low95 > FARTHEST * rigid or one.high95 < rigid / FARTHEST:
        return (
            f"{came_out}, where the rigid body's own is {rigid:g}",
            f"the fit of {axis} is none of this vehicle's, and tells neither its mass nor its damping",
        )
    if one.high95 > WIDEST * one.low95:
        ends = f"{_written_out(one.low95)} to {_written_out(one.high95)}"
        return f"{came_out}, with an interval from {ends}", f"it tells nothing of {axis}"
    return None


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
        problem, remedy = (
            f"{came_out}, below the rigid body's own {rigid:g}, which no water can take away",
            "the vehicle file's thrust is too weak or its mass too large; measure both again.",
        )
        return one, Doubt((one.name,), problem, remedy, Outcome.DISAGREES)
    most = (1.0 + MOST_ADDED) * (rigid + Z95 * rigid_std)
    if coefficient.kind == "mass" and coefficient.dof < 3 and one.identifiable and one.low95 > most:
        problem, remedy = (
            f"{came_out}, {one.value / rigid:.1f} times the vehicle file's dry "
            "mass, which no water round it can make up",
            "it can hardly be this vehicle's; check the DVL's axes and "
            "scale, the order of the thrusters, and that the vehicle file and its dry mass are this vehicle's.",
        )
        return one, Doubt((one.name,), problem, remedy, Outcome.DISAGREES)
    return one, None


def _at(one: Estimate, coefficient: Coefficient, side: str, bound: float) -> tuple[Estimate, Doubt]:
    """The estimate held to its bound, and the doubt that names both."""
    upper = max(one.value + Z95 * one.std, bound) if math.isfinite(one.std) else math.nan
    dive_limit = (
        f"; the dive puts it below {_written_out(upper)}" if bound == 0.0 and math.isfinite(upper) else ""
    )
    reason = f"{one.name} stopped at its {side} bound of {bound:g} {one.unit}{dive_limit}"
    low, high = (bound, upper) if side == "lower" else (min(one.low95, bound), bound)
    held = replace(
        one,
        value=min(max(one.value, coefficient.low), coefficient.high),
        low95=low,
        high95=high,
        identifiable=False,
        reason=reason,
    )
    problem, remedy = (
        f"{reason}",
        "the signs of its thrust and of its readings, or a force that the model lacks, drive it there; "
        "look at these before you rely on what else was identified.",
    )
    return held, Doubt((one.name,), problem, remedy, Outcome.AT_BOUND)


def _written_out(value: float) -> str:
    """Three significant digits, never as a power of ten."""
    return np.format_float_positional(value, 3, unique=False, fractional=False, trim="-")
