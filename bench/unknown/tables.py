"""Tables of drawn forces: goals, results by part of the grammar, wrong names, and known effects called unknown."""

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from itertools import pairwise

from bench.diagnosis.goals import told
from bench.unknown.trials import Judged
from bench.words import paragraph
from identify.challenge.score import Rate

LEAST_CALLED, MOST_MISTAKEN = 0.85, 0.02
DRIFTS = (1.5, 2.5, 4.0, 6.6)
"""Ends of the ranges of drift, in floors; a force is scaled to within a tenth of its drawn drift."""


def goals(drawn: Sequence[Judged], known: Sequence[Judged]) -> list[str]:
    """Table of the goals, and of the other outcomes."""
    called, mistaken = (
        _rate(drawn, lambda one: one.called),
        _rate(known, lambda one: one.verdict == "unknown"),
    )
    by_name = [one for one in drawn if one.verdict == "unknown"]
    return [
        "| goal | figure (95 % bounds) | |",
        "|---|---|---|",
        f"| unknown called so: 85 % | {told(called)} | {_met(called.share >= LEAST_CALLED)} |",
        f"| known called unknown: 2 % | {told(mistaken)} | {_met(mistaken.share <= MOST_MISTAKEN)} |",
        "",
        "Beside them:",
        "",
        "| what | figure |",
        "|---|---|",
        f"| unknown told by a known cause alone | {told(_rate(drawn, _by_cause))} |",
        f"| unknown called no gap | {told(_rate(drawn, lambda one: one.verdict == 'no_gap'))} |",
        f"| unknown refused | {told(_rate(drawn, lambda one: one.verdict == 'refused'))} |",
        f"| unknown with a likely cause, in any verdict | {told(_rate(drawn, lambda one: bool(one.told)))} |",
        f"| of those with the verdict unknown, right degree of freedom | {told(_rate(by_name, _right))} |",
        f"| known called partly | {told(_rate(known, lambda one: one.verdict == 'partly'))} |",
    ]


def by_part(drawn: Sequence[Judged]) -> list[str]:
    """A row for each word of the grammar, each degree of freedom, hull, and range of drift."""
    rows = [
        "| part | | dives | called unknown | by a known cause | no gap |",
        "|---" * 6 + "|",
    ]
    for part in dict.fromkeys(part for dive in drawn for part in dive.parts):
        for word in sorted({dive.parts[part] for dive in drawn}):
            rows.append(_row(part, word, [dive for dive in drawn if dive.parts[part] == word]))
    for dof in dict.fromkeys(dof for dive in drawn for dof in dive.dofs):
        rows.append(_row("degree of freedom", dof, [dive for dive in drawn if dof in dive.dofs]))
    for hull in sorted({dive.hull for dive in drawn}):
        rows.append(_row("hull", hull, [dive for dive in drawn if dive.hull == hull]))
    for low, high in pairwise(DRIFTS):
        in_range = [dive for dive in drawn if low <= max(dive.multiple, DRIFTS[0]) < high]
        if in_range:
            rows.append(_row("drift", f"{low:g} to {min(high, 6.0):g} floors", in_range))
    return rows


def misnamed(drawn: Sequence[Judged]) -> list[str]:
    """The causes that were said to explain a drawn force."""
    said = _counted(name for dive in drawn if _by_cause(dive) for name in dive.told)
    return paragraph(f"Known causes told instead of an unknown one: {said}.")


def mistaken(known: Sequence[Judged]) -> list[str]:
    """The effects that were called unknown."""
    return paragraph(
        f"Known effects called unknown: {_counted(dive.hidden for dive in known if dive.verdict == 'unknown')}."
    )


def _counted(names: Iterable[str]) -> str:
    return ", ".join(f"`{name}` ({count})" for name, count in Counter(names).most_common()) or "none"


def _row(part: str, word: str, own: Sequence[Judged]) -> str:
    no_gap = sum(dive.verdict == "no_gap" for dive in own)
    called, by_cause = (_rate(own, what) for what in (_called, _by_cause))
    return f"| {part} | {word} | {len(own)} | {100 * called.share:.0f} % | {by_cause.hits} | {no_gap} |"


def _called(one: Judged) -> bool:
    return one.called


def _by_cause(one: Judged) -> bool:
    return not one.called and one.verdict in ("explained", "ambiguous", "partly")


def _right(one: Judged) -> bool:
    return one.right_axis


def _rate(dives: Sequence[Judged], what: Callable[[Judged], bool]) -> Rate:
    return Rate(sum(what(dive) for dive in dives), len(dives))


def _met(met: bool) -> str:
    return "met" if met else "**missed**"
