"""Doubts about a fit whose model lacks a force: a drag, or a force known by its kind alone."""

import math
from collections.abc import Mapping, Sequence

from bridge.vehicle.coefficients import DAMPINGS, DOFS, MASSES, QUADRATICS
from bridge.vehicle.config import Damping
from identify.doubt import Culprit, Doubt, Outcome
from identify.estimators.missing_forces.drag_and_timing import Multiplier
from identify.estimators.missing_forces.forms import Kind
from identify.estimators.missing_forces.screening import Lack
from identify.words import axes_named, listed, significant


def drag_doubts(lacking: Mapping[int, Multiplier], damping: Damping = "linear") -> tuple[Doubt, ...]:
    """Doubts that a drag is missing in each of these axes, for a hull with this damping in its vehicle file."""
    if damping == "quadratic":
        return tuple(_linear_doubt(dof, tested) for dof, tested in lacking.items())
    return tuple(
        Doubt(
            (MASSES[dof].name, DAMPINGS[dof].name),
            f"In {DOFS[dof]} a force that grows as the speed squared is missing from the model "
            f"({tested.score:+.0f} standard errors)",
            "mass and linear damping hold for the speeds of this dive alone; the intervals of all that it bears on are "
            "widened by what such a force would change. Where another axis moved at one speed alone, its damping holds "
            "for that.",
            Outcome.DISAGREES,
            Culprit.MODEL,
        )
        for dof, tested in lacking.items()
    )


def _linear_doubt(dof: int, test: Multiplier) -> Doubt:
    return Doubt(
        (MASSES[dof].name, QUADRATICS[dof].name),
        f"In {DOFS[dof]} a force that grows as the speed itself is missing from the model ({test.score:+.0f} standard "
        "errors), for the vehicle file's damping is quadratic",
        "the intervals of all that it bears on are widened by what such a force would change; write damping: both into "
        "it.",
        Outcome.DISAGREES,
        Culprit.MODEL,
    )


def missing_forces_words(
    lacking: Sequence[int], late: Sequence[int], others: Sequence[Lack] = (), damping: Damping = "linear"
) -> str:
    """The forces that the model of a hull with this damping lacks in these axes, as part of a sentence; empty if
    none. others: those known by their kind alone."""
    parts = []
    if lacking:
        power = "itself" if damping == "quadratic" else "squared"
        parts.append(f"a drag that grows as the speed {power} in {axes_named(lacking)}")
    if late:
        parts.append(f"thrust at another time in {axes_named(late)}")
    for kind in dict.fromkeys(other.kind for other in others):
        dofs = sorted(other.dof for other in others if other.kind is kind)
        parts.append(f"a force in {axes_named(dofs)} {KIND_WORDS[kind].partition(',')[0]}")
    return listed(parts)


def why_not_identifiable(name: str, axis: str, std: float, shift: float, value: float, missing: str) -> str:
    """Why a coefficient of relative standard error `std` is not identifiable; `shift` is the change of its logarithm
    if the `missing` forces were included."""
    if abs(shift) > 0.5 * std:
        return f"the model lacks {missing}: with that {name} would be {significant(value * math.exp(shift))}"
    return f"the dive says too little of {axis}: the relative standard error is {100 * std:.0f} %"


KIND_WORDS: Mapping[Kind, str] = {
    Kind.WORLD: "which goes with the heading or the place, as a current's or a tether's does",
    Kind.THRUST: "which goes with the thrust, as where thrusters are weak near zero, astern or later in the dive",
    Kind.ACROSS: "which goes with other axes' thrust, as where a thruster that drives both is weak or sits elsewhere",
    Kind.TURNING: "which goes with the turning, as where the DVL sits elsewhere than the vehicle file says",
    Kind.SWING: "which swings, as that of waves does",
}

OF_THE_VEHICLE = (Kind.THRUST, Kind.ACROSS, Kind.TURNING)
"""Kinds that the next dive has as well."""


def lacking_doubts(lacks: Sequence[Lack], damping: Damping) -> tuple[Doubt, ...]:
    """A doubt for each kind of force that the model lacks, of a hull with this damping in its vehicle file."""
    kinds = dict.fromkeys(lack.kind for lack in lacks)
    return tuple(_doubt([lack for lack in lacks if lack.kind is kind], damping) for kind in kinds)


def _doubt(lacks: Sequence[Lack], damping: Damping) -> Doubt:
    """The doubt about missing forces of one kind, of which the clearest comes first."""
    clearest, dofs = lacks[0], sorted(lack.dof for lack in lacks)
    period = f", every {clearest.period_s:.2g} s" if clearest.period_s else ""
    groups = {"linear": (MASSES, DAMPINGS), "quadratic": (MASSES, QUADRATICS)}
    where = "there and in those axes" if clearest.kind is Kind.ACROSS else "there"
    return Doubt(
        tuple(
            group[dof].name for group in groups.get(damping, (MASSES, DAMPINGS, QUADRATICS)) for dof in dofs
        ),
        f"In {axes_named(dofs)} the recording holds a force that the model lacks, {KIND_WORDS[clearest.kind]}{period} "
        f"({clearest.score:.0f} standard errors)",
        f"masses and dampings {where} are off by what it does, and the intervals of all that it bears on are widened "
        "by an estimate of that, and may still be too narrow; seatrial diagnose looks for its cause.",
        Outcome.DISAGREES,
        Culprit.MODEL if clearest.kind in OF_THE_VEHICLE else Culprit.RECORDING,
    )
