"""Doubts about a fit whose model lacks a force: its kind, and the coefficients that it affects."""

from collections.abc import Mapping, Sequence

from bridge.vehicle.coefficients import DAMPINGS, MASSES, QUADRATICS
from bridge.vehicle.config import Damping
from identify.doubt import Culprit, Doubt, Outcome
from identify.estimators.forms import Kind
from identify.estimators.unmodelled import Lack
from identify.words import axes_named

LIKE: Mapping[Kind, str] = {
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
    """The doubt of forces of the same kind, the clearest first."""
    clearest, dofs = lacks[0], sorted(lack.dof for lack in lacks)
    period = f", every {clearest.period_s:.2g} s" if clearest.period_s else ""
    groups = {"linear": (MASSES, DAMPINGS), "quadratic": (MASSES, QUADRATICS)}
    where = "there and in those axes" if clearest.kind is Kind.ACROSS else "there"
    return Doubt(
        tuple(
            group[dof].name for group in groups.get(damping, (MASSES, DAMPINGS, QUADRATICS)) for dof in dofs
        ),
        f"In {axes_named(dofs)} the recording holds a force that the model lacks, {LIKE[clearest.kind]}{period} "
        f"({clearest.score:.0f} standard errors)",
        f"masses and dampings {where} are off by what it does, and the intervals of all that it bears on are widened "
        "by an estimate of that, and may still be too narrow; seatrial diagnose looks for its cause.",
        Outcome.DISAGREES,
        Culprit.MODEL if clearest.kind in OF_THE_VEHICLE else Culprit.RECORDING,
    )
