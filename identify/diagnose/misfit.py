"""What the fit beside the accepted causes still gets wrong: the doubts that `identify` has of any fit, and by how much
coefficients would change, were what they speak of let in."""

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DAMPINGS, DOFS
from identify.diagnose.nominal import Nominal
from identify.estimators.admitted import timing_of
from identify.estimators.doubts import doubts_of
from identify.estimators.multiplier import Tested
from identify.estimators.said import drag_doubts, late_doubts
from identify.identification import Culprit, Doubt

Array = NDArray[np.float64]

MOST = 3.0
"""A change of a logarithm beyond which nothing is known of the coefficient anyway."""


@dataclass(frozen=True)
class Misfit:
    """doubts: of mass and damping, in sentences. off (12,): what the logarithms of the coefficients, masses first, are
    off by beside their standard errors."""

    doubts: tuple[Doubt, ...]
    off: Array


NONE = Misfit((), np.zeros(12))


def misfit_of(now: Nominal, quadratic: Collection[int]) -> Misfit:
    """Of a fit beside causes, of which a quadratic drag acts in the degrees of freedom `quadratic`.

    Where the dive wants more or less of that drag than was accepted, it can't tell it from the linear damping. Degrees
    of freedom that are doubted as a whole are left out: their thrust seems late without being so.
    """
    found = {dof: one for dof, one in doubts_of(now.joint, now.theta).items() if dof not in now.doubted}
    late = {dof: one.late for dof, one in found.items() if one.is_late}
    drag = {dof: one.drag for dof, one in found.items() if one.lacks_drag}
    beside = {dof: one for dof, one in drag.items() if dof in quadratic}
    lacking = {dof: one for dof, one in drag.items() if dof not in beside}
    # One step from none is as far as the form of these forces, which is a guess, is worth following.
    steps = [one.size * one.leaning for one in (*drag.values(), *late.values())]
    off = np.sqrt(np.sum(np.square([np.zeros(12), *steps, *timing_of(found)]), axis=0))
    return Misfit(
        (
            *late_doubts(late, [dof for dof in now.built.pushed if dof in found]),
            *drag_doubts(lacking),
            *(_not_apart(dof, one) for dof, one in beside.items()),
        ),
        np.minimum(off, MOST),
    )


def _not_apart(dof: int, one: Tested) -> Doubt:
    more, less = ("more", "less") if one.size > 0 else ("less", "more")
    return Doubt(
        (DAMPINGS[dof].name,),
        f"In {DOFS[dof]} {more} quadratic drag than was accepted and {less} linear damping would fit this dive better "
        f"({one.score:+.0f} standard errors): the two hold together, at the speeds of this dive, and the interval of "
        "the linear one is widened by what is between them; coast down from full speed to tell them apart.",
        culprit=Culprit.MODEL,
    )
