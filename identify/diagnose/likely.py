"""Which causes are accepted: those that are likelier there than not, with masses and dampings fitted beside them."""

from collections.abc import Sequence
from dataclasses import replace

from bridge.effects.effect import Effect
from bridge.vehicle.config import Configuration
from identify.diagnose.accept import accepted_of
from identify.diagnose.cause import Cause
from identify.diagnose.diagnosis import Accepted, Found
from identify.diagnose.known import altogether
from identify.diagnose.nominal import Nominal
from identify.diagnose.probability import LIKELY
from identify.diagnose.search import Explanation, explained_by
from identify.diagnose.words import listed, name_of, percent_sure


def accepted(
    causes: Sequence[Found],
    found: Explanation,
    nominal: Nominal,
    library: Sequence[Effect],
    holds: Sequence[Cause],
    shape: Configuration,
) -> Accepted:
    """What accepting the likely ones of the causes comes to, beside those that the model `holds` already."""
    likely = [one for one in causes if one.probability >= LIKELY]
    now = found.now
    if len(likely) < len(causes):
        kept = {one.cause.key for one in likely}
        now = explained_by([one for one in found.causes if one.key in kept], nominal, library).now
    made = accepted_of(altogether(likely, holds), now, shape)
    left = tuple(
        f"{_capital(name_of(one))} was not accepted: it is {percent_sure(one.probability)} probable, likelier absent "
        "than present."
        for one in causes
        if one.probability < LIKELY
    )
    return replace(made, sentences=(*left, *made.sentences))


def none_accepted(causes: Sequence[Found]) -> str:
    """Why nothing is accepted, in a clause."""
    if not causes:
        return "no cause was found that could be accepted"
    told = listed([f"{name_of(one)} ({percent_sure(one.probability)} probable)" for one in causes])
    return f"what was found is likelier absent than present, and so not accepted: {told}"


def _capital(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"
