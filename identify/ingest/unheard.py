"""What a recording did not hear of its vehicle: the silences of the component that says most."""

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
"""The name by which a vehicle that keeps a recording of its own tells its boot."""
NAME_AT: Final = 8
"""In NAMED_VALUE_INT, behind time and value."""


def silences_of(frames: Frames, system: int) -> tuple[Silence, ...]:
    """The silences of the component of `system` that says most, by the Unix time of the recording."""
    rows = np.flatnonzero(frames.system == system)
    if not len(rows):
        return ()
    component = int(np.argmax(np.bincount(frames.component[rows])))
    rows = rows[frames.component[rows] == component]
    return silences(frames.arrival_s[rows], boot_times_s(frames, rows), sequence(frames, rows))


def unheard_notes(frames: Frames, system: int) -> tuple[str, ...]:
    """A note on what was not heard, and who may have it; none where all was."""
    found = silences_of(frames, system)
    return (note(frames, found, keeps_ring(frames, system)),) if found else ()


def note(frames: Frames, found: Sequence[Silence], ring: bool) -> str:
    """The longest silence, and what brings the frames; "" without one. `ring`: does the vehicle keep a recording."""
    worst = longest(found)
    if worst is None:
        return ""
    begins_s = max(0.0, worst.begins_s - float(frames.arrival_s[0]))
    more = {1: "", 2: ", and once more for less"}.get(
        len(found), f", and {len(found) - 1} times more for less"
    )
    return f"{UNHEARD} for {worst.seconds:.0f} s at a stretch, from {clock(begins_s)} on{more}: {way_to_mend(ring)}."


def clock(seconds: float) -> str:
    """`0:18`, `1:02:03`: a time in a recording, whole seconds that are over."""
    minutes, rest = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"


def keeps_ring(frames: Frames, system: int) -> bool:
    """Whether the vehicle tells that it keeps a recording of its own."""
    rows = frames.rows("NAMED_VALUE_INT")
    starts = frames.start[rows[frames.system[rows] == system]]
    name = np.frombuffer(BOOT_ID, np.uint8)
    at = starts[:, None] + NAME_AT + np.arange(len(name))
    return bool((frames.data[np.minimum(at, len(frames.data) - 1)] == name).all(axis=1).any())


def boot_times_s(frames: Frames, rows: Rows) -> Array:
    """(n,) boot times that one component's frames in `rows` state, NaN where none."""
    system, component = int(frames.system[rows[0]]), int(frames.component[rows[0]])
    stating, stated = timed_rows(frames, system, component)
    boot_s = np.full(len(rows), np.nan)
    boot_s[np.searchsorted(rows, stating)] = stated
    return boot_s


def sequence(frames: Frames, rows: Rows) -> NDArray[np.int64]:
    """(n,) sequence numbers, from the header before each payload."""
    data, start = frames.data, frames.start[rows]
    head = np.maximum(start - HEADER_2, 0)
    second = (data[head] == MAGIC_2) & (data[head + 5] == frames.system[rows])
    second &= (data[head + 6] == frames.component[rows]) & (start >= HEADER_2)
    return np.where(second, data[head + 4], data[start - HEADER_1 + 2]).astype(np.int64)
