"""What an identification doubts of its own values, from its plain data, and which doubts leave a trend as it is."""

from collections.abc import Collection, Mapping
from typing import Any

from bridge.vehicle.coefficients import ADDED_MASS_NAMES, MASSES
from identify.identification import Doubt, Outcome

MISSING_FORCES = (
    "a force that grows as the speed squared is missing from the model",
    "thrust acts at another time than the vehicle file's lag",
)
"""What doubts of a drag that the model lacks, and of thrust's timing, say: real vehicles have these, in all dives
alike. Any other that ends in disagreement is about one recording, or about whose it is."""

OF_PRIORS = "rest on this very dive"
"""What the doubt about priors that were left out for that says; it is about these alone, and no value of the dive."""

_OUTCOMES = {outcome.value: outcome for outcome in Outcome}
_TOTAL = dict(zip(ADDED_MASS_NAMES, (mass.name for mass in MASSES), strict=True))


def doubts_in(identification: Mapping[str, Any]) -> tuple[Doubt, ...]:
    """The doubts that bear on the values of an identification's JSON."""
    return tuple(
        Doubt(
            tuple(map(str, doubt.get("about") or ())),
            str(doubt["sentence"]),
            _OUTCOMES.get(str(doubt.get("outcome")), Outcome.DISAGREES),
        )
        for doubt in identification.get("doubts") or ()
        if OF_PRIORS not in str(doubt["sentence"])
    )


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


def is_alike_in_all_dives(doubt: Doubt) -> bool:
    """Whether it is of a force that the model lacks."""
    return any(words in doubt.sentence for words in MISSING_FORCES)
