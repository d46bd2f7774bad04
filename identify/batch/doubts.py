"""Reads the doubts that an identification raised about its own values from its JSON."""

from collections.abc import Collection, Mapping
from typing import Any

from bridge.vehicle.coefficients import ADDED_MASS_NAMES, MASSES
from identify.identification import Culprit, Doubt, Outcome

_OUTCOMES = {outcome.value: outcome for outcome in Outcome}
_CULPRITS = {culprit.value: culprit for culprit in Culprit}
_TOTAL = dict(zip(ADDED_MASS_NAMES, (mass.name for mass in MASSES), strict=True))


def doubts_in(identification: Mapping[str, Any]) -> tuple[Doubt, ...]:
    """Doubts in an identification's JSON that concern its values; doubts of a prior are left out."""
    every = (
        Doubt(
            tuple(map(str, doubt.get("about") or ())),
            str(doubt.get("problem") or doubt["sentence"]),
            str(doubt.get("remedy") or ""),
            _OUTCOMES.get(str(doubt.get("outcome")), Outcome.DISAGREES),
            _CULPRITS.get(str(doubt.get("culprit")), Culprit.RECORDING),
            tuple(map(str, doubt.get("also") or ())),
        )
        for doubt in identification.get("doubts") or ()
    )
    return tuple(doubt for doubt in every if doubt.culprit is not Culprit.PRIOR)


def is_about(doubt: Doubt, name: str) -> bool:
    """Whether a doubt is about a parameter. A doubt about a total mass is also about the added mass in it."""
    return name in doubt.about or _TOTAL.get(name) in doubt.about


def clauses(doubts: Collection[Doubt], names: Collection[str]) -> dict[str, str]:
    """For each doubted parameter of `names`, the problem of every doubt about it, joined by semicolons."""
    clauses_of = {
        name: tuple(dict.fromkeys(doubt.clause for doubt in doubts if is_about(doubt, name)))
        for name in names
    }
    return {name: "; ".join(some) for name, some in clauses_of.items() if some}
