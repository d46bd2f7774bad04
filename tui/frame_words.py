"""Words on the frames that a merged or fetched recording lacks, leaves out, or dates by a guess."""

from collections.abc import Sequence
from typing import Final

from gcs_plugin.fetch.holes import Hole
from identify.ingest.messages import clock
from identify.words import listed

MOST_NAMED: Final = 3
"""Number of entries that are named individually if there are many."""


def lacking_words(holes: Sequence[Hole], lost: int) -> str:
    """`58 s of it, from 0:18 on, nobody has`; "" if nothing shows that frames are missing."""
    longest = sorted(
        sorted(holes, key=lambda hole: -hole.length_s)[:MOST_NAMED], key=lambda hole: hole.after_s
    )
    parts = [f"{hole.length_s:.0f} s of it, from {clock(hole.after_s)} on" for hole in longest]
    if len(holes) > len(longest):
        parts.append(f"{len(holes) - len(longest)} shorter times")
    if lost:
        parts.append(f"{lost} {'single frames' if lost > 1 else 'single frame'}")
    return f"{listed(parts)}, nobody has" if parts else ""


def beyond_words(beyond: int) -> str:
    """Number of frames left out because of their time; "" for none."""
    if not beyond:
        return ""
    were, are = ("frame of it was", "is") if beyond == 1 else ("frames of it were", "are")
    return f"{beyond} {were} sent before the dive's first frame or after its last and {are} left out"


def guessed_words(guessed: int) -> str:
    """Number of frames that are dated by a guess; "" for none."""
    if not guessed:
        return ""
    return (
        f"When {guessed} frames of it were sent is a guess: between two of its starts nobody else heard any, and they "
        "are dated from the end of the one before"
    )
