"""How much of what a vehicle sent is not in its recording: by the sequence numbers of each of its components.

A recording of two links holds frames twice, and late ones: numbers are unwrapped first, then counted once each. Numbers
come again after 256 frames: over a pause that may be longer, the sender's own clock and its rate say how often they
went round. Who starts anew begins its numbers anew, which is no loss. Routers keep most of what a camera or a companion
says to themselves, which looks like loss: who says little does not count.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bridge.errors import LogError
from bridge.silences import LEAST_S, ROUND, Spacing, pauses, unheard
from identify.ingest.frames import Fields, Frames, load_frames, message_id
from identify.ingest.messages import REBOOT_S, vehicle_system
from identify.ingest.unheard import boot_times_s, keeps_ring, note, sequence, silences_of
from identify.ingest.walk import Rows

LEAST_PAUSE_S: Final = 0.25
MAY_GO_ROUND: Final = ROUND // 4
"""In less than so long, and so many frames, no numbers go round."""
AROUND_S: Final = 10
"""Seconds on either side of a pause by which the rate is told."""

CLOCK: Final = "SYSTEM_TIME"
TRANSFER: Final = "FILE_TRANSFER_PROTOCOL"
LEAST_SHARE: Final = 0.1
"""Of a vehicle's frames, for a component to count."""


@dataclass(frozen=True)
class Loss:
    """Frames of one vehicle: how many different ones came, how many are missing between them.

    `unheard_s` is the longest silence of the component that says most, 0 for none; `note` says it in a sentence, with
    what brings the frames.
    """

    received: int
    lost: int
    unheard_s: float = 0.0
    note: str = ""

    @property
    def share(self) -> float:
        return self.lost / max(self.received + self.lost, 1)


def loss_of(paths: Sequence[Path], source: str, beside: Sequence[Path] = ()) -> Loss:
    """Of the vehicle in one or more `.tlog`, by its components that say much. Raises LogError as `read_dive` does.

    `beside`: what the ground heard, where `paths` were made whole of it without what the vehicle said while its files
    were fetched: that was heard, and had numbers too.
    """
    frames = _with_transfers(load_frames(paths), beside)
    system = vehicle_system(frames, source)[0]
    own = np.flatnonzero(frames.system == system)
    by_component = [own[frames.component[own] == c] for c in np.unique(frames.component[own])]
    parts = [_of_component(frames, rows) for rows in by_component if len(rows) >= LEAST_SHARE * len(own)]
    found = silences_of(frames, system)
    return Loss(
        sum(received for received, _ in parts),
        sum(lost for _, lost in parts),
        max((silence.seconds for silence in found), default=0.0),
        note(frames, found, keeps_ring(frames, system)),
    )


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


def _of_component(frames: Frames, rows: Rows) -> tuple[int, int]:
    """How many different frames came, and how many did not."""
    number = sequence(frames, rows)
    step = np.diff(number)
    # From one to the next by the shorter way: what comes late steps back.
    step = (step + ROUND // 2) % ROUND - ROUND // 2
    arrival_s = frames.arrival_s[rows]
    anew = np.diff(arrival_s) > LEAST_S
    step, known = _unwrapped(step, arrival_s, boot_times_s(frames, rows), number)
    anew[known] = False
    anew[_restarts(frames, rows, step)] = True
    received = lost = 0
    for run in np.split(np.concatenate(([0], step)), np.flatnonzero(anew) + 1):
        different = len(np.unique(np.cumsum(run)))
        received += different
        lost += int(np.ptp(np.cumsum(run))) + 1 - different
    return received, lost


def _unwrapped(
    step: NDArray[np.int64], arrival_s: NDArray[np.float64], boot_s: NDArray[np.float64], number: Rows
) -> tuple[NDArray[np.int64], list[int]]:
    """The steps with what was sent in pauses in which the numbers may have gone round, and after which rows these are.

    By how long each was by the sender's clock, and by how many it sent a second before and after.
    """
    usual_s = float(np.ptp(arrival_s)) / max(len(step), 1)
    least_s = min(max(LEAST_PAUSE_S, MAY_GO_ROUND * usual_s), LEAST_S)
    found = pauses(arrival_s, boot_s, number, least_s)
    steps_s = np.maximum(np.diff(arrival_s), 0.0)
    quick = steps_s <= LEAST_S
    short_s = steps_s[quick]
    long = [pause for pause in found if pause.seconds > LEAST_S or steps_s[pause.row] > LEAST_S]
    silent = unheard(long, Spacing(float(short_s.sum()), float(np.square(short_s).sum())))
    rows, silent_rows = [pause.row for pause in long], {pause.row for pause in silent}
    known = [p for p in found if p.row in silent_rows or (p.told and p.row not in rows)]
    at_s, sent = np.maximum.accumulate(arrival_s), np.concatenate(([0], np.cumsum(step)))
    out = step.copy()
    for pause in known:
        if not pause.anew:
            rate_hz = _rate_hz(at_s, sent, rows, pause.row)
            out[pause.row] = _nearest(int(step[pause.row]), 1.0 + rate_hz * pause.seconds)
    return out, [pause.row for pause in silent if not pause.anew]


def _rate_hz(at_s: NDArray[np.float64], sent: NDArray[np.int64], long: Sequence[int], row: int) -> float:
    """How many a sender sends in a second, in the middle of those before and after the pause that begins in `row`.

    A link that brings at once what it kept makes some seconds full. `sent` is counted up to each frame.
    """
    first = max((other + 1 for other in long if other < row), default=0)
    last = min((other for other in long if other > row), default=len(at_s) - 1)
    counts = []
    for begin, end, seconds in (
        (first, row, -np.arange(AROUND_S + 1.0)),
        (row + 1, last, np.arange(AROUND_S + 1.0)),
    ):
        own_s, anchor_s = at_s[begin : end + 1], at_s[row] if seconds[-1] < 0 else at_s[row + 1]
        edges_s = anchor_s + seconds
        edges_s = np.sort(edges_s[(edges_s >= own_s[0]) & (edges_s <= own_s[-1])])
        counts += np.diff(sent[begin + np.searchsorted(own_s, edges_s)]).tolist()
    return float(np.median(counts)) if counts else 0.0


def _nearest(step: int, expected: float) -> int:
    """The step that is as good, by its number, and the nearest to what is expected."""
    return step + ROUND * round((expected - step) / ROUND)


def _restarts(frames: Frames, rows: Rows, step: NDArray[np.int64]) -> list[int]:
    """Steps over which the sender started anew: the widest between two tellings of a boot clock that ran back."""
    at = np.flatnonzero(frames.message[rows] == message_id(CLOCK))
    boot_ms = Fields(frames, CLOCK, rows[at])["time_boot_ms"].astype(np.int64)
    back = np.flatnonzero(np.diff(boot_ms) < -1000 * REBOOT_S)
    return [int(at[k] + np.argmax(np.abs(step[at[k] : at[k + 1]] - 1))) for k in back]
