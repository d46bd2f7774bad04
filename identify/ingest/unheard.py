"""Silences of a vehicle in a recording, by the component that sends most."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bridge.silences import Array, Silence, longest, silences, way_to_mend
from identify.ingest.frames import Frames
from identify.ingest.messages import timed_rows
from identify.ingest.walk import Rows

MAGIC_2: Final = 0xFD
HEADER_1, HEADER_2 = 6, 10
UNHEARD: Final = "Nothing was heard of the vehicle"
BOOT_ID: Final = b"BOOT_ID"
"""Name under which a vehicle that keeps its own recording sends its boot id."""
NAME_AT: Final = 8
"""Offset of the name in NAMED_VALUE_INT, after time and value."""


def silences_of(frames: Frames, system: int) -> tuple[Silence, ...]:
    """Silences of the component of `system` that sends most, by the Unix time of the recording."""
    rows = np.flatnonzero(frames.system == system)
    if not len(rows):
        return ()
    component = int(np.argmax(np.bincount(frames.component[rows])))
    rows = rows[frames.component[rows] == component]
    return silences(frames.arrival_s[rows], boot_times_s(frames, rows), sequence(frames, rows))


def unheard_notes(frames: Frames, system: int) -> tuple[str, ...]:
    """A note on the silences and on who may have the missing frames; empty without silences."""
    silences = silences_of(frames, system)
    return (note(frames, silences, keeps_ring(frames, system)),) if silences else ()


def note(frames: Frames, found: Sequence[Silence], ring: bool) -> str:
    """Describe the longest silence and how to get the frames; "" without silences. `ring`: the vehicle keeps a
    recording.
    """
    worst = longest(found)
    if worst is None:
        return ""
    begins_s = max(0.0, worst.begins_s - float(frames.arrival_s[0]))
    more = {1: "", 2: ", and once more for less"}.get(
        len(found), f", and {len(found) - 1} times more for less"
    )
    return f"{UNHEARD} for {worst.seconds:.0f} s at a stretch, from {clock(begins_s)} on{more}: {way_to_mend(ring)}."


def clock(seconds: float) -> str:
    """A time in a recording in completed seconds, such as `0:18` or `1:02:03`."""
    minutes, seconds_left = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{seconds_left:02d}" if hours else f"{minutes}:{seconds_left:02d}"


def keeps_ring(frames: Frames, system: int) -> bool:
    """Whether the vehicle reports that it keeps its own recording."""
    rows = frames.rows("NAMED_VALUE_INT")
    starts = frames.start[rows[frames.system[rows] == system]]
    name = np.frombuffer(BOOT_ID, np.uint8)
    at = starts[:, None] + NAME_AT + np.arange(len(name))
    return bool((frames.data[np.minimum(at, len(frames.data) - 1)] == name).all(axis=1).any())


def boot_times_s(frames: Frames, rows: Rows) -> Array:
    """Boot times (n,) that a component's frames in `rows` state, NaN if they state none."""
    system, component = int(frames.system[rows[0]]), int(frames.component[rows[0]])
    stating, stated = timed_rows(frames, system, component)
    boot_s = np.full(len(rows), np.nan)
    boot_s[np.searchsorted(rows, stating)] = stated
    return boot_s


def sequence(frames: Frames, rows: Rows) -> NDArray[np.int64]:
    """Sequence numbers (n,), from the header before each payload."""
    data, start = frames.data, frames.start[rows]
    head = np.maximum(start - HEADER_2, 0)
    second = (data[head] == MAGIC_2) & (data[head + 5] == frames.system[rows])
    second &= (data[head + 6] == frames.component[rows]) & (start >= HEADER_2)
    return np.where(second, data[head + 4], data[start - HEADER_1 + 2]).astype(np.int64)
