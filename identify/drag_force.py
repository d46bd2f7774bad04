"""Total drag of an axis from its linear and quadratic damping, for dives that determine the sum better than either
part.

At speeds that hardly vary, the two dampings trade off: each is known loosely, but the drag at those speeds is known
well. Then both are kept with their uncertainty, because a model with only one of them, or with neither, would be
wrong.
"""

import math
from dataclasses import replace

import numpy as np

from bridge.vehicle.coefficients import DAMPINGS, DOFS, OF_HULL, QUADRATICS
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
