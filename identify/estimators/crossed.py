"""Tests whether the thrust of another axis moves an axis, as it does if the DVL's axes or the thrusters differ from
the vehicle file."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DAMPINGS, DOFS, MASSES
from identify.estimators.axes import Axis
from identify.estimators.doubts import DOUBTFUL_SCORE
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.multiplier import Force, Tested, with_forces
from identify.estimators.said import axes_named
from identify.identification import Doubt, Outcome

Array = NDArray[np.float64]

SURGE, SWAY = 0, 1

LARGEST_SHARE = 0.1
"""Share of another axis's thrust: a DVL mounted about 4 degrees off its axes causes as much."""


def crossed(joint: JointLikelihood, theta: Array) -> dict[tuple[int, int], Tested]:
    """For each (axis, other) of surge and sway: the share of the other's thrust that moves the axis in addition to
    its own.

    The share is zero if readings and thrust have the same axes. If the DVL is rotated, it is about the tangent of the
    angle.
    """
    events = {problem.axis.dof: problem.axis for problem in joint.problems}
    if not {SURGE, SWAY} <= set(events):
        return {}
    pairs = ((SURGE, SWAY), (SWAY, SURGE))
    forces = [Force(dof, _thrust_over(events[other], events[dof])) for dof, other in pairs]
    return dict(zip(pairs, with_forces(joint, theta, forces).tested(), strict=True))


def crossed_doubts(found: Mapping[tuple[int, int], Tested]) -> tuple[Doubt, ...]:
    """A doubt about the axes that another axis's thrust moves, by more than LARGEST_SHARE of it and beyond chance."""
    moved = {
        pair: tested
        for pair, tested in found.items()
        if abs(tested.score) > DOUBTFUL_SCORE and abs(tested.size) > LARGEST_SHARE
    }
    if not moved:
        return ()
    worst = max(moved, key=lambda pair: abs(moved[pair].score))
    axis, other = (DOFS[dof] for dof in worst)
    dofs = sorted(dof for dof, _ in moved)
    problem, remedy = (
        f"The velocity in {axis} answers to the thrust in {other} ({moved[worst].size:+.2g} of it, beside its own; "
        f"{abs(moved[worst].score):.0f} standard errors)",
        f"the DVL's axes or the thrusters are not as the vehicle file "
        f"has them, and what is said of {axes_named(dofs)} can hardly be this vehicle's; check the DVL's mounting and "
        "the order of the thrusters: seatrial doctor --wet tells of both.",
    )
    about = tuple(group[dof].name for group in (MASSES, DAMPINGS) for dof in dofs)
    return (Doubt(about, problem, remedy, Outcome.DISAGREES),)


def _thrust_over(other: Axis, axis: Axis) -> Array:
    """Mean force (n,) of the other axis over each step of `axis`."""
    impulse = np.cumsum(other.force.mean(axis=1) * other.step_s)
    gained = np.diff(np.interp(axis.time_s, other.time_s, impulse), prepend=0.0)
    some = axis.step_s > 0
    return np.asarray(np.where(some, gained / np.where(some, axis.step_s, 1.0), 0.0))
