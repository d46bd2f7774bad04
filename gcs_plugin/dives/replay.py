"""Replay of a recording in its own timing, and access to its frames between any two instants."""

from array import array
from bisect import bisect_left
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import chain
from pathlib import Path
from typing import Final

from bridge.clock import Clock
from bridge.errors import LogError
from bridge.wire.framing import Frame, frame_at, unchecked_frame_at
from bridge.wire.tlog import Record, each_nonempty, read_tlog
from gcs_plugin.dives.recordings import LONGEST_S

LONGEST_WAIT_S = 0.1
LATE_US: Final = 500_000
"""A stamp may run back so far: that of a frame that came late. By more, the recorder's clock was set back."""


def onward(records: Iterable[Record]) -> Iterator[Record]:
    """The records with stamps that never run back: where the clock was set back, or ahead by more than any dive lasts,
    all that follows goes on from there."""
    newest_us: int | None = None
    set_by_us = 0
    for stamp_us, frame in records:
        if newest_us is not None and not -LATE_US <= stamp_us + set_by_us - newest_us <= LONGEST_S * 1e6:
            set_by_us = newest_us - stamp_us
        later_us = stamp_us + set_by_us
        newest_us = later_us if newest_us is None else max(newest_us, later_us)
        yield newest_us, frame


def schedule(
    records: Iterable[Record], speed: float = 1.0, start_s: float = 0.0
) -> Iterator[tuple[float, Record]]:
    """Yield each record with the time when it is due, s after the first record played.

    `speed` times real time, from `start_s` after the first record, with stamps as in `onward`.
    """
    first_us = played_us = None
    for stamp_us, frame in onward(records):
        first_us = stamp_us if first_us is None else first_us
        if (stamp_us - first_us) / 1e6 < start_s:
            continue
        played_us = stamp_us if played_us is None else played_us
        yield (stamp_us - played_us) / 1e6 / speed, (stamp_us, frame)


def play(
    records: Iterable[Record],
    clock: Clock,
    wait: Callable[[float], None],
    speed: float = 1.0,
    start_s: float = 0.0,
) -> Iterator[Record]:
    """Yield each record when it is due, always measured from the start, so that delays don't add up.

    `speed` and `start_s` as in `schedule`; `wait(seconds)` sleeps. Raises LogError for a speed that is not above zero.
    """
    if not speed > 0:
        raise LogError(f"a replay needs a speed above zero, not {speed:g}")
    began_s = clock.boot_s()
    for due_s, record in schedule(records, speed, start_s):
        while (left_s := due_s - (clock.boot_s() - began_s)) > 0:
            wait(min(left_s, LONGEST_WAIT_S))
        yield record


class Reel:
    """The recordings of a dive in their order. Times are seconds since its first frame, and never run back.

    All frames are kept in a single byte array, which takes a third of the memory of objects: 80 MB per hour. Raises
    LogError if a file can't be read, or no file holds a frame.
    """

    def __init__(self, files: Sequence[Path]) -> None:
        self._bytes = bytearray()
        self._begins, self._times_s = array("Q"), array("d")
        first_us = None
        for stamp_us, frame in onward(chain.from_iterable(each_nonempty(files, read_tlog))):
            first_us = stamp_us if first_us is None else first_us
            self._begins.append(len(self._bytes))
            self._times_s.append((stamp_us - first_us) / 1e6)
            self._bytes += frame.raw
        self.began_unix_s = (first_us or 0) / 1e6
        self.length_s = self._times_s[-1] if self._times_s else 0.0

    def between(self, start_s: float, end_s: float) -> Iterator[tuple[float, Frame]]:
        """Frames with their times, from `start_s` (included) to `end_s` (excluded)."""
        first, last = bisect_left(self._times_s, start_s), bisect_left(self._times_s, end_s)
        if first >= last:
            return
        data, origin = bytes(self._bytes[self._begins[first] : self._end(last)]), self._begins[first]
        for n in range(first, last):
            start, size = self._begins[n] - origin, self._end(n + 1) - self._begins[n]
            yield self._times_s[n], frame_at(data, start, size) or unchecked_frame_at(data, start, size)

    def _end(self, count: int) -> int:
        """Byte position after the first `count` frames, at which the next frame begins."""
        return self._begins[count] if count < len(self._begins) else len(self._bytes)
