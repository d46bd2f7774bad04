"""Share of a vehicle's messages that its recording lacks, by the sequence numbers of each of its components.

A recording of two links holds frames twice, and late frames: numbers are unwrapped first, then counted once each. The
sequence numbers wrap after 256 frames. Over a pause that may be longer, the sender's boot clock and rate give the
number of wraps. A restarted sender begins its numbers anew, which is no loss. Routers drop most messages of a camera
or a companion, which looks like loss: components that send little are not counted.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bridge.errors import LogError
from bridge.wire.silences import LEAST_S, ROUND, Spacing, pauses, unheard
from identify.ingest.mavlink.frames import Fields, Frames, Rows, load_frames, message_id
from identify.ingest.mavlink.messages import (
    REBOOT_S,
    boot_times_s,
    keeps_ring,
    note,
    sequence,
    silences_of,
    vehicle_system,
)

LEAST_PAUSE_S: Final = 0.25
MAY_GO_ROUND: Final = ROUND // 4
"""Sequence numbers can't wrap in a pause shorter than LEAST_PAUSE_S or than the usual time of this many frames."""
AROUND_S: Final = 10
"""Seconds on either side of a pause that determine the rate."""

CLOCK: Final = "SYSTEM_TIME"
TRANSFER: Final = "FILE_TRANSFER_PROTOCOL"
LEAST_SHARE: Final = 0.1
"""Share of a vehicle's frames that a component must have to count."""


@dataclass(frozen=True)
class Loss:
    """Frames of a vehicle: how many different frames arrived, and how many are missing between them.

    `unheard_s` is the longest silence of the component that sends most, 0 for none; `note` describes it in a
    sentence, with the way to get the frames.
    """

    received: int
    lost: int
    unheard_s: float = 0.0
    note: str = ""

    @property
    def share(self) -> float:
        return self.lost / max(self.received + self.lost, 1)


def loss_of(paths: Sequence[Path], source: str, logs: Sequence[Path] = ()) -> Loss:
    """Loss of the vehicle in one or more `.tlog`, by its components that send much. Raises LogError as `read_dive`.

    `logs`: recordings of the ground, if `paths` were completed from it without the messages that the vehicle sent
    while its files were fetched. These messages arrived and had sequence numbers too.
    """
    frames = _with_transfers(load_frames(paths), logs)
    system = vehicle_system(frames, source)[0]
    vehicle_rows = np.flatnonzero(frames.system == system)
    by_component = [
        vehicle_rows[frames.component[vehicle_rows] == c] for c in np.unique(frames.component[vehicle_rows])
    ]
    parts = [
        _of_component(frames, rows) for rows in by_component if len(rows) >= LEAST_SHARE * len(vehicle_rows)
    ]
    silences = silences_of(frames, system)
    return Loss(
        sum(received for received, _ in parts),
        sum(lost for _, lost in parts),
        max((silence.seconds for silence in silences), default=0.0),
        note(frames, silences, keeps_ring(frames, system)),
    )


def _with_transfers(frames: Frames, logs: Sequence[Path]) -> Frames:
    """Merge in the file-transfer messages of other recordings, by arrival time."""
    try:
        heard = load_frames(logs) if logs else None
    except LogError:  # an unreadable recording counts as not heard
        heard = None
    rows = () if heard is None else heard.rows(TRANSFER)
    if heard is None or not len(rows):
        return frames
    order = np.argsort(np.concatenate((frames.stamp_us, heard.stamp_us[rows])), kind="stable")
    heard = replace(heard, start=heard.start + len(frames.data))

    def both(name: str) -> Rows:
        return np.concatenate((getattr(frames, name), getattr(heard, name)[rows]))[order]

    data = np.concatenate((frames.data, heard.data))
    length, system, component, message = map(both, ("length", "system", "component", "message"))
    return Frames(data, both("stamp_us"), both("start"), length, system, component, message, frames.counts)


def _of_component(frames: Frames, rows: Rows) -> tuple[int, int]:
    """Number of different frames that arrived, and of frames that did not."""
    number = sequence(frames, rows)
    step = np.diff(number)
    # Take the shorter way to the next number: a late frame steps back.
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
    """Steps of the sequence number with wraps during pauses added, and the rows that begin a silence.

    In a silence the sender went on without being heard. The number of wraps follows from the length of the pause by
    the sender's clock and from the sender's rate around it.
    """
    usual_s = float(np.ptp(arrival_s)) / max(len(step), 1)
    least_s = min(max(LEAST_PAUSE_S, MAY_GO_ROUND * usual_s), LEAST_S)
    all_pauses = pauses(arrival_s, boot_s, number, least_s)
    steps_s = np.maximum(np.diff(arrival_s), 0.0)
    quick = steps_s <= LEAST_S
    short_s = steps_s[quick]
    long = [pause for pause in all_pauses if pause.seconds > LEAST_S or steps_s[pause.row] > LEAST_S]
    silent = unheard(long, Spacing(float(short_s.sum()), float(np.square(short_s).sum())))
    rows, silent_rows = [pause.row for pause in long], {pause.row for pause in silent}
    known = [p for p in all_pauses if p.row in silent_rows or (p.by_clock and p.row not in rows)]
    at_s, sent = np.maximum.accumulate(arrival_s), np.concatenate(([0], np.cumsum(step)))
    out = step.copy()
    for pause in known:
        if not pause.anew:
            rate_hz = _rate_hz(at_s, sent, rows, pause.row)
            out[pause.row] = _nearest(int(step[pause.row]), 1.0 + rate_hz * pause.seconds)
    return out, [pause.row for pause in silent if not pause.anew]


def _rate_hz(at_s: NDArray[np.float64], sent: NDArray[np.int64], long: Sequence[int], row: int) -> float:
    """Frames per second of a sender: the median over the seconds before and after the pause that begins in `row`.

    A median, because a link that delivers stored frames at once makes some seconds full. `sent` counts the frames up
    to each frame.
    """
    first = max((neighbour + 1 for neighbour in long if neighbour < row), default=0)
    last = min((neighbour for neighbour in long if neighbour > row), default=len(at_s) - 1)
    counts = []
    for begin, end, seconds in (
        (first, row, -np.arange(AROUND_S + 1.0)),
        (row + 1, last, np.arange(AROUND_S + 1.0)),
    ):
        span_s, anchor_s = at_s[begin : end + 1], at_s[row] if seconds[-1] < 0 else at_s[row + 1]
        edges_s = anchor_s + seconds
        edges_s = np.sort(edges_s[(edges_s >= span_s[0]) & (edges_s <= span_s[-1])])
        counts += np.diff(sent[begin + np.searchsorted(span_s, edges_s)]).tolist()
    return float(np.median(counts)) if counts else 0.0


def _nearest(step: int, expected: float) -> int:
    """The step that is equal modulo 256 and nearest to the expected step."""
    return step + ROUND * round((expected - step) / ROUND)


def _restarts(frames: Frames, rows: Rows, step: NDArray[np.int64]) -> list[int]:
    """Steps at which the sender restarted: the largest step between two readings of a boot clock that ran back."""
    at = np.flatnonzero(frames.message[rows] == message_id(CLOCK))
    boot_ms = Fields(frames, CLOCK, rows[at])["time_boot_ms"].astype(np.int64)
    back = np.flatnonzero(np.diff(boot_ms) < -1000 * REBOOT_S)
    return [int(at[k] + np.argmax(np.abs(step[at[k] : at[k + 1]] - 1))) for k in back]
