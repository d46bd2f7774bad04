"""Whether a further dive bears the causes out: the gap there closes by about what was foretold."""

import math

from identify.diagnose.diagnosis import Shrink
from identify.diagnose.shrink import CHANCE, LEAST_GAP
from identify.report.text import fixed, significant

LEAST_PART = 0.5
"""Of the foretold shrink, what a check dive must show. A form that is not quite true closes less where a vehicle is
flown otherwise; what closes less than half of it leaves more than it closes."""

LEAST_SAID = 0.005
"""A share that is told as more than none."""


def contradicted(foretold: Shrink | None, measured: Shrink | None) -> bool:
    """Whether a check dive speaks against the causes.

    It does where the 95 % intervals of the two shrinks do not meet, so that it is not by chance, and less than
    `LEAST_PART` of what was foretold closes; and where nothing is there to close, but with the causes in the model
    drifts further than without, and than noise.
    """
    if foretold is None or measured is None:
        return False
    if not math.isfinite(measured.value):
        return measured.after > max(measured.floor + CHANCE, measured.before + LEAST_GAP)
    apart = measured.high95 < foretold.low95
    return bool(apart and measured.value < LEAST_PART * foretold.value)


def clause(foretold: Shrink | None, measured: Shrink | None) -> str:
    """What follows a verdict that a check dive contradicts; "" where it does not."""
    if foretold is None or measured is None or not contradicted(foretold, measured):
        return ""
    return f", but the check dive does not bear that out ({_how(foretold, measured)})"


def note(foretold: Shrink | None, measured: Shrink | None) -> tuple[str, ...]:
    """The same in a sentence, with what to do."""
    if foretold is None or measured is None or not contradicted(foretold, measured):
        return ()
    return (
        f"The check dive does not bear the causes out: {_how(foretold, measured)}. Look whether it was dived with the "
        "same vehicle and configuration and nothing was changed in between; if so, take the causes for no more than a "
        "guess, send nothing of them to the vehicle, and dive again.",
    )


def _how(foretold: Shrink, measured: Shrink) -> str:
    if not math.isfinite(measured.value):
        return (
            f"with the causes its 5 s drift is {significant(measured.after, 2)} floors, without them "
            f"{significant(measured.before, 2)}"
        )
    share = fixed(100 * measured.value, 0)
    closes = f"{share} % does" if measured.value >= LEAST_SAID else "none does"
    return (
        f"{fixed(100 * foretold.value, 0)} % of what can be closed was foretold to close there, and {closes}"
    )
