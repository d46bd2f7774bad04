"""Operators' names of the feed-forward's modes, and the text for a number of sends."""

from typing import Final

from bridge.vehicle.feedforward import Mode

WORDS: Final = {Mode.OFF: "off", Mode.SHADOW: "shadow", Mode.ALONE: "only", Mode.BOTH: "both"}
"""Operators' name of each mode."""


def sent_text(count: int) -> str:
    """Text for a number of sends."""
    return "sent once" if count == 1 else f"sent {count} times"


def word(value: float) -> str:
    """Operators' name of an FF_MODE value; the number itself if it is no mode."""
    return next((text for mode, text in WORDS.items() if mode == value), f"{value:g}")
