"""Where a gap lies, in sentences."""

from collections.abc import Sequence
from dataclasses import replace

from identify.diagnose.diagnosis import Diagnosis, Gap, Phase, Share
from identify.diagnose.shrink import CHANCE
from identify.diagnose.where import LEAST_SPEED_M_S
from identify.diagnose.words import DRIFT_S, percent
from identify.report.text import fixed

MOST_OF_IT = 0.75
"""Of a degree of freedom's gap, what counts as most of it."""

MOST_OF_THAT = 0.5
"""Of a degree of freedom's gap, above what one phase's is called most of that."""

STANDS_OUT = 0.4
"""The share of the gap from which one degree of freedom in one phase is named together."""

PHASES: dict[Phase, str] = {
    "rest": "at rest",
    "accelerating": "accelerating",
    "decelerating": "decelerating",
    "steady": "steady",
    "turning": "turning",
    "reversing": "reversing",
}


def where_lines(diagnosis: Diagnosis, most: int = 3) -> tuple[str, ...]:
    """The largest parts of the squared gap, `71 % surge, steady`, no more than `most` of them."""
    largest = sorted(diagnosis.gap.where, key=lambda one: -one.share)[:most]
    return tuple(
        f"{percent(one.share)} {one.dof}, {PHASES[one.phase]}" for one in largest if one.share >= 0.005
    )


def gap_sentence(gap: Gap, whole: str = "it") -> str:
    """Where the gap lies: by drift, which it is measured by, where that is another degree of freedom than by force."""
    by_force = where_sentence(gap, whole)
    if not drifts_elsewhere(gap):
        return by_force
    by_drift = where_sentence(replace(gap, where=gap.drifted, slices=()), whole)
    return f"by drift {by_drift} (by force {where_sentence(replace(gap, slices=()), whole)})"


def where_sentence(gap: Gap, whole: str = "it") -> str:
    """`71 % of it is in surge, steady, mostly above 0.3 m/s`; `whole` says of what."""
    if not gap.where:
        return "no degree of freedom was compared"
    first = max(gap.where, key=lambda one: one.share)
    if first.share >= STANDS_OUT:
        return f"{percent(first.share)} of {whole} is in {first.dof}, {PHASES[first.phase]}{_above(gap, first.dof)}"
    by_dof = shares_by_dof(gap.where)
    dof = max(by_dof, key=lambda name: by_dof[name])
    mine = [one for one in gap.where if one.dof == dof]
    largest = max(mine, key=lambda one: one.share)
    part = "most" if largest.share > MOST_OF_THAT * by_dof[dof] else "the largest part"
    return f"{percent(by_dof[dof])} of {whole} is in {dof}, {part} of that {PHASES[largest.phase]}{_above(gap, dof)}"


def drifts_elsewhere(gap: Gap) -> bool:
    """Whether the model drifts most in another degree of freedom than in that which lacks most force; where it drifts
    no more than noise may, it does so nowhere."""
    by_force, by_drift = shares_by_dof(gap.where), shares_by_dof(gap.drifted)
    if not by_force or not by_drift or gap.before <= 1.0 + CHANCE:
        return False
    return max(by_force, key=lambda dof: by_force[dof]) != max(by_drift, key=lambda dof: by_drift[dof])


def where_note(gap: Gap) -> str:
    """That the gap by drift is in another degree of freedom than by force; "" where both agree."""
    if not drifts_elsewhere(gap):
        return ""
    by_drift = shares_by_dof(gap.drifted)
    dof = max(by_drift, key=lambda name: by_drift[name])
    return (
        f"By drift it is another: {percent(by_drift[dof])} of what the squared {DRIFT_S:g} s drift is beyond noise, in "
        f"floors, is in {dof}. Shares are of the missing force, over the disturbance there."
    )


def shares_by_dof(where: Sequence[Share]) -> dict[str, float]:
    """The share of each degree of freedom, in the order in which they come."""
    out: dict[str, float] = {}
    for one in where:
        out[one.dof] = out.get(one.dof, 0.0) + one.share
    return out


def _above(gap: Gap, dof: str) -> str:
    """The speed above which most of a degree of freedom's gap lies, where there is such a one: not below that at which
    a vehicle counts as at rest."""
    slices = sorted(
        (one for one in gap.slices if one.dof == dof and one.by == "speed"), key=lambda one: -one.low
    )
    whole = sum(one.share for one in slices)
    held = 0.0
    for one in slices[:-1]:
        held += one.share
        if whole > 0 and held >= MOST_OF_IT * whole:
            return f", mostly above {fixed(one.low, 2)} m/s" if one.low >= LEAST_SPEED_M_S else ""
    return ""
