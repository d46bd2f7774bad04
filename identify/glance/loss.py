"""How much of what a vehicle sent is not in its recording: by the sequence numbers of each of its components.

A recording of two links holds frames twice, and late ones: numbers are unwrapped first, then counted once each. Who
starts anew begins its numbers anew, which is no loss. Routers keep most of what a camera or a companion says to
themselves, which looks like loss: who says little does not count.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bridge.errors import LogError
from identify.ingest.frames import Fields, Frames, load_frames, message_id
from identify.ingest.messages import REBOOT_S, vehicle_system
from identify.ingest.walk import Rows

ROUND: Final = 256
RESTART_S: Final = 5.0
"""After so long a silence the numbers may have started anew; what was sent in it is not known."""

MAGIC_2: Final = 0xFD
HEADER_1, HEADER_2 = 6, 10
CLOCK: Final = "SYSTEM_TIME"
TRANSFER: Final = "FILE_TRANSFER_PROTOCOL"
LEAST_SHARE: Final = 0.1
"""Of a vehicle's frames, for a component to count."""


@dataclass(frozen=True)
class Loss:
    """Frames of one vehicle: how many different ones came, how many are missing between them."""

    received: int
    lost: int

    @property
    def share(self) -> float:
        return self.lost / max(self.received + self.lost, 1)


def loss_of(paths: Sequence[Path], source: str, beside: Sequence[Path] = ()) -> Loss:
    """Of the vehicle in one or more `.tlog`, by its components that say much. Raises LogError as `read_dive` does.

    `beside`: what the ground heard, where `paths` were made whole of it without what the vehicle said while its files
    were fetched: that was heard, and had numbers too.
    """
    frames = _with_transfers(load_frames(paths), beside)
    own = np.flatnonzero(frames.system == vehicle_system(frames, source)[0])
    by_component = [own[frames.component[own] == c] for c in np.unique(frames.component[own])]
    parts = [_of_component(frames, rows) for rows in by_component if len(rows) >= LEAST_SHARE * len(own)]
    return Loss(sum(p.received for p in parts), sum(p.lost for p in parts))


def _with_transfers(frames: Frames, beside: Sequence[Path]) -> Frames:
    """Them, and what was said of files in other recordings, where each arrived."""
    try:
        other = load_frames(beside) if beside else None
    except LogError:  # what can't be read was not heard
        other = None
    rows = () if other is None else other.rows(TRANSFER)
    if other is None or not len(rows):
        return frames
    arrival_s = np.concatenate((frames.arrival_s, other.arrival_s[rows]))
    order = np.argsort(arrival_s, kind="stable")

    def both(one: NDArray[np.int64], more: NDArray[np.int64]) -> NDArray[np.int64]:
        return np.concatenate((one, more[rows]))[order]

    return Frames(
        np.concatenate((frames.data, other.data)),
        arrival_s[order],
        both(frames.start, other.start + len(frames.data)),
        both(frames.length, other.length),
        both(frames.system, other.system),
        both(frames.component, other.component),
        both(frames.message, other.message),
        frames.counts,
    )


def _of_component(frames: Frames, rows: Rows) -> Loss:
    number = _sequence(frames, rows)
    step = np.diff(number)
    # From one to the next by the shorter way: what comes late steps back.
    step = (step + ROUND // 2) % ROUND - ROUND // 2
    anew = np.diff(frames.arrival_s[rows]) > RESTART_S
    anew[_restarts(frames, rows, step)] = True
    received = lost = 0
    for run in np.split(np.concatenate(([0], step)), np.flatnonzero(anew) + 1):
        different = len(np.unique(np.cumsum(run)))
        received += different
        lost += int(np.ptp(np.cumsum(run))) + 1 - different
    return Loss(received, lost)


def _restarts(frames: Frames, rows: Rows, step: NDArray[np.int64]) -> list[int]:
    """Steps over which the sender started anew: the widest between two tellings of a boot clock that ran back."""
    at = np.flatnonzero(frames.message[rows] == message_id(CLOCK))
    boot_ms = Fields(frames, CLOCK, rows[at])["time_boot_ms"].astype(np.int64)
    back = np.flatnonzero(np.diff(boot_ms) < -1000 * REBOOT_S)
    return [int(at[k] + np.argmax(np.abs(step[at[k] : at[k + 1]] - 1))) for k in back]


def _sequence(frames: Frames, rows: Rows) -> NDArray[np.int64]:
    """(n,) sequence numbers, from the header before each payload."""
    data, start = frames.data, frames.start[rows]
    head = np.maximum(start - HEADER_2, 0)
    second = (data[head] == MAGIC_2) & (data[head + 5] == frames.system[rows])
    second &= (data[head + 6] == frames.component[rows]) & (start >= HEADER_2)
    return np.where(second, data[head + 4], data[start - HEADER_1 + 2]).astype(np.int64)
