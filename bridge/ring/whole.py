"""The recording of a dive that was made whole, and what it stands in place of."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

WHOLE: Final = "telemetry.whole.tlog"
"""Beside the ground's own `telemetry.tlog`, which stays as it is: all of that, and what the vehicle kept."""


def standing_for(recordings: Sequence[Path]) -> list[Path]:
    """The recordings of a dive that are to be read: the whole one alone where there is one, else all."""
    whole = [path for path in recordings if path.name == WHOLE]
    return whole or list(recordings)
