"""Where the missing force lies, and how much the disturbance takes, in words."""

from collections.abc import Sequence

from identify.diagnose.gap.missing import LEAST_SPEED_M_S
from identify.diagnose.result import Diagnosis, Disturbance, Gap, Phase, Share
from identify.diagnose.shrink.shrunk import CHANCE
from identify.diagnose.verdict import MOST_DISTURBED, swallowing
from identify.diagnose.words.causes import percent_bounded
from identify.diagnose.words.drift import TURNING
from identify.words import fixed, listed, significant

MAY_BE = "a sea or a current that comes and goes, a tether, or thrust that the vehicle file or the recording has wrong"


def disturbance_words(disturbance: Disturbance) -> str:
    """`3.1 N, 62 % of the variance of the thrusters' force`."""
    whole = "the thrusters' force" if disturbance.pushed else "the force that the motion takes"
    return f"{force_words(disturbance)}, {percent_bounded(disturbance.share)} of the variance of {whole}"


def force_words(disturbance: Disturbance) -> str:
    """Its standard deviation with the unit."""
    return f"{significant(disturbance.std, 2)} {'N m' if disturbance.dof in TURNING else 'N'}"


def disturbance_line(disturbance: Sequence[Disturbance]) -> tuple[str, ...]:
    """A line on the fitted disturbance in each pushed degree of freedom."""
    pushed = [axis for axis in disturbance if axis.pushed]
    if not pushed:
        return ()
    phrases = listed([f"in {axis.dof} {force_words(axis)} ({_share_words(axis)})" for axis in pushed])
    line = f"The fitted disturbance takes {phrases}; in brackets the share of the variance of the thrusters' force."
    if swallowing(pushed):
        line += f" More than a third is much: {MAY_BE}."
    return (line,)


def _share_words(disturbance: Disturbance) -> str:
    """Share of the variance; marked in a degree of freedom that is only held, where thrust merely answers the
    disturbance."""
    held = not disturbance.driven and disturbance.share > MOST_DISTURBED
    return f"{percent_bounded(disturbance.share)}, only held" if held else percent_bounded(disturbance.share)


def swallowed_sentence(disturbance: Sequence[Disturbance]) -> str:
    """Sentence that a disturbance takes so much that its model explains too little."""
    text = listed([f"in {axis.dof} it takes {disturbance_words(axis)}" for axis in swallowing(disturbance)])
    return (
        f"No candidate and no force that returns is missing, but the model leaves too much to the disturbance: {text}. "
        f"It may be {MAY_BE}; the model explains too little there to say that there is no gap."
    )


MOST_OF_IT = 0.75
"""Share of a degree of freedom's gap above a speed, for `mostly above`."""

MOST_OF_THAT = 0.5
"""Share of a degree of freedom's gap in one phase, for `most of that`."""

ALL = 0.95
"""Share of the gap from which it is all of it."""

LEAST_NAMED = 0.02
"""Share of the gap below which a part of it is not named."""

LITTLE = 0.1
"""Share of a missing force's power below which it hardly goes with a variable."""

STANDS_OUT = 0.4
"""Share of the gap from which a degree of freedom and a phase are named together."""

PHASES: dict[Phase, str] = {
    "rest": "at rest",
    "accelerating": "accelerating",
    "decelerating": "decelerating",
    "steady": "steady",
    "turning": "turning",
    "reversing": "reversing",
}


def where_line(diagnosis: Diagnosis, most: int = 3) -> str:
    """Where the largest parts of the missing force lie, `surge, steady; yaw, turning`, at most `most`."""
    largest = sorted(diagnosis.gap.where, key=lambda each: -each.share)[:most]
    return "; ".join(f"{item.dof}, {PHASES[item.phase]}" for item in largest if item.share >= LEAST_NAMED)


def gap_sentence(gap: Gap, whole: str = "it") -> str:
    """Location of the gap, and the degree of freedom that drifts furthest in the fitted dive if it is another one."""
    elsewhere = drifts_elsewhere(gap)
    drift = f", while most of the drift in the fitted dive is in {elsewhere}" if elsewhere else ""
    return where_sentence(gap, whole) + drift


def where_sentence(gap: Gap, whole: str = "it") -> str:
    """`most of it lies in surge, steady, mostly above 0.3 m/s`; `whole` names the total."""
    if not gap.where:
        return "no degree of freedom was compared"
    first = max(gap.where, key=lambda each: each.share)
    if first.share >= STANDS_OUT:
        lies = f"{_most(first.share)} of {whole} lies in {first.dof}"
        return f"{lies}, {PHASES[first.phase]}{_above(gap, first.dof)}"
    by_dof = shares_by_dof(gap.where)
    dof = max(by_dof, key=lambda name: by_dof[name])
    of_dof = [item for item in gap.where if item.dof == dof]
    largest = max(of_dof, key=lambda each: each.share)
    part = "most" if largest.share > MOST_OF_THAT * by_dof[dof] else "the largest part"
    lies = f"{_most(by_dof[dof])} of {whole} lies in {dof}"
    return f"{lies}, {part} of that {PHASES[largest.phase]}{_above(gap, dof)}"


def _most(share: float) -> str:
    return "all" if share >= ALL else "most" if share > MOST_OF_THAT else "the largest part"


def drifts_elsewhere(gap: Gap) -> str:
    """The degree of freedom that drifts furthest, "" if it is that of the largest missing force;
    never for drift within noise."""
    by_force, by_drift = shares_by_dof(gap.where), shares_by_dof(gap.drifted)
    if not by_force or not by_drift or gap.before <= 1.0 + CHANCE:
        return ""
    furthest = max(by_drift, key=lambda dof: by_drift[dof])
    return "" if furthest == max(by_force, key=lambda dof: by_force[dof]) else furthest


def strength(share: float) -> str:
    """How closely a missing force goes with a variable, by the share of its power that does."""
    return "closely" if share >= STANDS_OUT else "in part" if share >= LITTLE else "hardly"


def shares_by_dof(where: Sequence[Share]) -> dict[str, float]:
    """The share of each degree of freedom, in their given order."""
    out: dict[str, float] = {}
    for share in where:
        out[share.dof] = out.get(share.dof, 0.0) + share.share
    return out


def _above(gap: Gap, dof: str) -> str:
    """Clause on the speed above which most of a degree of freedom's gap lies; "" if that is rest."""
    slices = sorted(
        (item for item in gap.slices if item.dof == dof and item.by == "speed"), key=lambda each: -each.low
    )
    total = sum(item.share for item in slices)
    summed = 0.0
    for each in slices[:-1]:
        summed += each.share
        if total > 0 and summed >= MOST_OF_IT * total:
            return f", mostly above {fixed(each.low, 2)} m/s" if each.low >= LEAST_SPEED_M_S else ""
    return ""
