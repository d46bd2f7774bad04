"""The answer on further runs: in the form of a diagnosis for programs, in sentences for a crew."""

from typing import Any, Final

import numpy as np

from identify.diagnose.result import Phase, plain_effect
from identify.diagnose.words.causes import (
    alike_sentence,
    cause_sentence,
    name_of,
    shown_parameters,
    value_words,
)
from identify.repeats.judge import Judged
from identify.repeats.marks import DEPTH, MARKS, UNITS
from identify.words import capital, listed, significant

PLACES: Final[tuple[tuple[str, Phase], ...]] = (
    ("heave", "rest"),
    ("heave", "steady"),
    ("roll", "steady"),
    ("pitch", "steady"),
    ("yaw", "accelerating"),
)
"""Where each mark is seen, as a diagnosis says it."""


def plain(judged: Judged) -> dict[str, Any]:
    """The answer in the form of `seatrial diagnose --json`; its gap is that of the marks, in standard deviations of a
    mean of so many runs, and its force is the mean that the accepted runs do not have."""
    square = judged.off**2
    finding = judged.finding
    separation = finding.cause.effect.separation if finding is not None and finding.is_ambiguous else None
    return {
        "verdict": judged.verdict,
        "gap": {
            "before": float(np.sqrt(square.mean())),
            "floor": 1,
            "force": {dof: abs(float(judged.shift[k])) for k, (dof, _) in enumerate(PLACES) if k != DEPTH},
            "where": [
                {"dof": dof, "phase": phase, "share": float(square[k] / max(square.sum(), 1e-300))}
                for k, (dof, phase) in enumerate(PLACES)
            ],
            "depends_on": [],
            "unexplained": judged.unexplained,
        },
        "effects": [] if finding is None else [plain_effect(finding)],
        "character": None,
        "shrink": {"heldout": None, "check": None},
        "next": None
        if separation is None
        else {
            "manoeuvre": "; ".join(separation.manoeuvres) or None,
            "sensor": "; ".join(separation.sensors) or None,
            "splits": [finding.name, *finding.also] if finding is not None and finding.also else [],
        },
    }


def sentences(judged: Judged) -> tuple[str, ...]:
    far = "; ".join(
        f"{name} {significant(float(shift), 2)} {unit} ({significant(abs(float(off)), 2)} standard deviations)"
        for name, shift, unit, off in zip(MARKS, judged.shift, UNITS, judged.off, strict=True)
    )
    differ = "this run differs" if judged.runs == 1 else f"{judged.runs} runs together differ"
    marks = f"Against the accepted runs, {differ} by: {far}."
    finding = judged.finding
    if finding is None:
        nothing = "No gap: the runs scatter about the accepted ones as these do among themselves."
        something = f"Something is there that no candidate explains, in {listed(judged.left)}."
        return (something if judged.left else nothing, marks)
    values = "; ".join(value_words(name, value) for name, value in shown_parameters(finding).items())
    whole = "part of the gap" if judged.left else "the gap"
    left = (f"It leaves something in {listed(judged.left)}.",) if judged.left else ()
    doubt = (alike_sentence(finding),) if finding.is_ambiguous else ()
    explains = f"{capital(name_of(finding))} explains {whole}: {values}."
    return (explains, cause_sentence(finding), *doubt, *left, marks)
