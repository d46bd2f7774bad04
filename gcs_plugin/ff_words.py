"""What operators call the modes of the feed-forward, and how often something was sent."""

from typing import Final

from bridge.vehicle.feedforward import Mode

WORDS: Final = {Mode.OFF: "off", Mode.SHADOW: "shadow", Mode.ALONE: "only", Mode.BOTH: "both"}
"""What each mode is called by operators."""


def sent_text(count: int) -> str:
    """How often something was sent."""
    return "sent once" if count == 1 else f"sent {count} times"


def word(value: float) -> str:
    """A value of FF_MODE as an operator reads it."""
    return next((text for mode, text in WORDS.items() if mode == value), f"{value:g}")
