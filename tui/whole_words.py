"""Sentences for the crew about merged recordings: frames missing everywhere, left out, or dated by a guess."""

from collections.abc import Sequence
from typing import Final

from gcs_plugin.fetch.holes import Hole
from gcs_plugin.fetch.one_clock import Step
from identify.ingest.unheard import clock

TOLD: Final = 3
"""Number of entries that are named individually if there are many."""


def lacking_words(holes: Sequence[Hole], lost: int) -> str:
    """`58 s of it, from 0:18 on, nobody has`; "" if nothing shows that frames are missing."""
    longest = sorted(sorted(holes, key=lambda hole: -hole.length_s)[:TOLD], key=lambda hole: hole.after_s)
    parts = [f"{hole.length_s:.0f} s of it, from {clock(hole.after_s)} on" for hole in longest]
    if len(holes) > len(longest):
        parts.append(f"{len(holes) - len(longest)} shorter times")
    if lost:
        parts.append(f"{lost} {'single frames' if lost > 1 else 'single frame'}")
    return f"{_listed(parts)}, nobody has" if parts else ""


def steps_words(steps: Sequence[Step], begins_us: int) -> str:
    """`It was set, or began anew, by -60.0 s at 1:00 of the dive; each part is dated by itself`; "" if the clock went
    on evenly."""
    if not steps:
        return ""
    parts = [
        f"by {step.by_us * 1e-6:+.1f} s at {clock((step.at_us - begins_us) * 1e-6)}" for step in steps[:TOLD]
    ]
    if len(steps) > TOLD:
        parts.append(f"{len(steps) - TOLD} times more")
    return f"It was set, or began anew, {_listed(parts)} of the dive; each part is dated by itself"


def beyond_words(beyond: int) -> str:
    """Number of frames left out because of their time; "" for none."""
    if not beyond:
        return ""
    were = "frame of it was" if beyond == 1 else "frames of it were"
    are = "is" if beyond == 1 else "are"
    return f"{beyond} {were} sent before the dive's first frame or after its last and {are} left out"


def guessed_words(guessed: int) -> str:
    """Number of frames that are dated by a guess; "" for none."""
    if not guessed:
        return ""
    return (
        f"When {guessed} frames of it were sent is a guess: between two of its starts nobody else heard any, and they "
        "are dated from the end of the one before"
    )


def _listed(told: Sequence[str]) -> str:
    return told[0] if len(told) == 1 else f"{', '.join(told[:-1])} and {told[-1]}"
