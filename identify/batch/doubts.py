"""What an identification doubts of its own values, from its plain data."""

from collections.abc import Collection, Mapping
from typing import Any

from bridge.vehicle.coefficients import ADDED_MASS_NAMES, MASSES
from identify.identification import Culprit, Doubt, Outcome

_OUTCOMES = {outcome.value: outcome for outcome in Outcome}
_CULPRITS = {culprit.value: culprit for culprit in Culprit}
_TOTAL = dict(zip(ADDED_MASS_NAMES, (mass.name for mass in MASSES), strict=True))


def doubts_in(identification: Mapping[str, Any]) -> tuple[Doubt, ...]:
    """The doubts that bear on the values of an identification's JSON."""
    every = (
        Doubt(
            tuple(map(str, doubt.get("about") or ())),
            str(doubt["sentence"]),
            _OUTCOMES.get(str(doubt.get("outcome")), Outcome.DISAGREES),
            _CULPRITS.get(str(doubt.get("culprit")), Culprit.RECORDING),
        )
        for doubt in identification.get("doubts") or ()
    )
    return tuple(doubt for doubt in every if doubt.culprit is not Culprit.PRIOR)


def is_about(doubt: Doubt, name: str) -> bool:
    """Whether a doubt is about a parameter; one about a total mass is about the added mass in it, too."""
    return name in doubt.about or _TOTAL.get(name) in doubt.about


def clauses(doubts: Collection[Doubt], names: Collection[str]) -> dict[str, str]:
    """What speaks against each of these parameters that is doubted, the first clause of every doubt about it."""
    told = {
        name: tuple(dict.fromkeys(doubt.clause for doubt in doubts if is_about(doubt, name)))
        for name in names
    }
    return {name: "; ".join(some) for name, some in told.items() if some}
