"""Whether a check dive contradicts the causes, or bears them out, and that in words."""

import math

from identify.diagnose.shrink.shrink import LEAST_GAP
from identify.diagnose.shrink.shrunk import CHANCE, Shrink
from identify.words import fixed, significant

LEAST_PART = 0.5
"""Share of the predicted shrink that a check dive must show. An inexact form closes less in other flight; less than
half leaves more than it closes."""

LEAST_SAID = 0.005
"""Least share that counts as more than none."""


def contradicted(foretold: Shrink | None, measured: Shrink | None) -> bool:
    """Whether a check dive contradicts the causes.

    It does if the 95 % intervals of the two shrinks are disjoint and it closes less than `LEAST_PART` of the
    prediction; or if there is no gap to close, but the model with the causes drifts further than without, and than
    noise.
    """
    if foretold is None or measured is None:
        return False
    if not math.isfinite(measured.value):
        return measured.after > max(measured.floor + CHANCE, measured.before + LEAST_GAP)
    apart = measured.high95 < foretold.low95
    return bool(apart and measured.value < LEAST_PART * foretold.value)


def shown(foretold: Shrink | None, measured: Shrink | None) -> bool:
    """Whether a check dive shows the causes at all: it does not where it contradicts them, and the model drifts further
    with them than without. So it is on a dive from before they set in."""
    return measured is None or not (contradicted(foretold, measured) and measured.after > measured.before)


def contradiction_clause(foretold: Shrink | None, measured: Shrink | None, conjunction: str = "but") -> str:
    """Clause for a verdict that a check dive contradicts, begun by a conjunction; "" otherwise."""
    if foretold is None or measured is None or not contradicted(foretold, measured):
        return ""
    if not shown(foretold, measured):
        return f", {conjunction} the check dive shows no such effect ({_both_drifts(measured)})"
    return f", {conjunction} the check dive does not bear that out ({_both_shrinks(foretold, measured)})"


def contradiction_note(foretold: Shrink | None, measured: Shrink | None) -> tuple[str, ...]:
    """The contradiction as a sentence, with advice; empty otherwise."""
    if foretold is None or measured is None or not contradicted(foretold, measured):
        return ()
    if not shown(foretold, measured):
        return (
            f"The check dive shows no such effect: {_both_drifts(measured)}. Either it was dived before the causes set "
            "in, or they are no more than a guess. Dive again as the diagnosed dive was flown, check on that, and "
            "send nothing of them to the vehicle before.",
        )
    return (
        f"The check dive does not bear the causes out: {_both_shrinks(foretold, measured)}. "
        "Look whether it was dived with the same vehicle and configuration and nothing was changed in between; if so, "
        "take the causes for no more than a guess, send nothing of them to the vehicle, and dive again.",
    )


def _both_drifts(measured: Shrink) -> str:
    """The drift of a check dive that does not show the causes."""
    without, with_them = (
        significant(drift / measured.floor, 2) for drift in (measured.before, measured.after)
    )
    return f"its 5 s drift is {without} times what noise makes it without the causes, and {with_them} times with them"


def _both_shrinks(foretold: Shrink, measured: Shrink) -> str:
    """How much of a drift was foretold to close, and how much of it does."""
    share = fixed(100 * measured.value, 0)
    closes = f"{share} % does" if measured.value >= LEAST_SAID else "none does"
    return f"{fixed(100 * foretold.value, 0)} % of the drift beyond noise was foretold to close there, and {closes}"
