"""The complete recording of a dive, and the recordings that it replaces."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

WHOLE: Final = "telemetry.whole.tlog"
"""Lies next to the ground's `telemetry.tlog`, which stays unchanged. Holds its frames and those the vehicle kept."""


def standing_for(recordings: Sequence[Path]) -> list[Path]:
    """Return the recordings of a dive to read: the complete recording if there is one, otherwise all recordings."""
    whole = [path for path in recordings if path.name == WHOLE]
    return whole or list(recordings)
