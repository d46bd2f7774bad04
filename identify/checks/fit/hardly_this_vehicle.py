"""Doubts that a recording is of this vehicle: the velocity answers to another axis's thrust, or the file says so."""

from collections.abc import Mapping

from bridge.arrays import Array
from bridge.vehicle.coefficients import BY_NAME, DOFS, SURGE, SWAY
from identify.doubt import Doubt, Outcome, coefficients_of
from identify.estimators.likelihood.joint import JointLikelihood
from identify.estimators.missing_forces.drag_and_timing import DOUBTFUL_SCORE, Force, Multiplier, with_forces
from identify.words import axes_named

LARGEST_SHARE = 0.1
"""Share of another axis's thrust: a DVL mounted about 4 degrees off its axes causes as much."""


def crossed(joint: JointLikelihood, theta: Array) -> dict[tuple[int, int], Multiplier]:
    """For each (axis, other) of surge and sway: the share of the other's thrust that moves the axis in addition to
    its own.

    The share is zero if readings and thrust have the same axes. If the DVL is rotated, it is about the tangent of the
    angle.
    """
    events = {problem.axis.dof: problem.axis for problem in joint.problems}
    if not {SURGE, SWAY} <= set(events):
        return {}
    pairs = ((SURGE, SWAY), (SWAY, SURGE))
    forces = [Force(dof, events[other].thrust_over(events[dof])) for dof, other in pairs]
    return dict(zip(pairs, with_forces(joint, theta, forces).tested(), strict=True))


def crossed_doubts(tests: Mapping[tuple[int, int], Multiplier]) -> tuple[Doubt, ...]:
    """A doubt about the axes that another axis's thrust moves, by more than LARGEST_SHARE of it and beyond chance."""
    moved = {
        pair: tested
        for pair, tested in tests.items()
        if abs(tested.score) > DOUBTFUL_SCORE and abs(tested.size) > LARGEST_SHARE
    }
    if not moved:
        return ()
    worst = max(moved, key=lambda pair: abs(moved[pair].score))
    axis, other = (DOFS[dof] for dof in worst)
    dofs = sorted(dof for dof, _ in moved)
    return (
        Doubt(
            coefficients_of(dofs),
            f"The velocity in {axis} answers to the thrust in {other} ({moved[worst].size:+.2g} of it, beside its own; "
            f"{abs(moved[worst].score):.0f} standard errors)",
            f"the DVL's axes or the thrusters are not as the vehicle file has them, and what is said of "
            f"{axes_named(dofs)} can hardly be this vehicle's; check the DVL's mounting and the order of the "
            "thrusters: seatrial doctor --wet tells of both.",
            Outcome.DISAGREES,
        ),
    )


def strange_doubts(strange: str) -> tuple[Doubt, ...]:
    """Doubt that the recording is of this vehicle, for the reason in `strange`; none if that is empty."""
    if not strange:
        return ()
    remedy = f"{strange}. Give the vehicle file and configuration of the dive."
    return (Doubt(tuple(BY_NAME), "These values can hardly be this vehicle's", remedy, Outcome.DISAGREES),)
