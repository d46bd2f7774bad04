"""The gap monitor of a dive that was under way before it was watched, fed with what its recording holds so far.

A monitor that began now would learn its noise floor now, and count the departure that is already there as noise. The
recording is read in a thread, at half the speed that it could be, so that keys are answered in time; the readings heard
meanwhile follow.
"""

import threading
import time
from collections import deque
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import LogError
from bridge.wire.framing import Frame, decode
from bridge.wire.readings import OF_THE_CONTRACT, Reading
from bridge.wire.readings import decode as decode_reading
from bridge.wire.tlog import Record, each_nonempty, read_tlog
from gcs_plugin.monitor.live import LiveGap

PARAM_VALUE: Final[int] = dialect.MAVLINK_MSG_ID_PARAM_VALUE
THREAD_NAME: Final = "past of the dive"
AFTER_S: Final = 3.0
"""The first screen comes before."""
AT_ONCE: Final = 200
"""Frames between two pauses."""


class PastGap:
    """Feeds `gap` what the recordings, in their order, hold of a system; `ready` once all of it was taken: never where
    one can't be read. Readings that are heard meanwhile follow those of the last recording."""

    def __init__(self, gap: LiveGap, system: int, recordings: Sequence[Path]) -> None:
        self.gap, self.ready = gap, False
        self._system, self._recordings = system, recordings
        self._later: deque[Reading] = deque()
        self._unwanted = threading.Event()
        threading.Thread(target=self._read, name=THREAD_NAME, daemon=True).start()

    def hear(self, reading: Reading) -> None:
        """Take a reading of the vehicle."""
        if not self._unwanted.is_set():
            self._later.append(reading)

    def up_to_now(self) -> LiveGap:
        """The gap with all that was heard, once it is ready."""
        while self._later:
            self.gap.take(self._later.popleft())
        return self.gap

    def drop(self) -> None:
        """End the reading: nobody wants its result any more."""
        self._unwanted.set()

    def _read(self) -> None:
        try:
            self._feed()
        finally:
            if not self.ready:
                self._unwanted.set()
                self._later.clear()

    def _feed(self) -> None:
        if self._unwanted.wait(AFTER_S):
            return
        with suppress(LogError):
            for records in each_nonempty(self._recordings, self._loaded):
                since_s = time.monotonic()
                for count, (_, frame) in enumerate(records, start=1):
                    take(self.gap, frame, self._system)
                    if count % AT_ONCE == 0:
                        if self._unwanted.wait(time.monotonic() - since_s):
                            return
                        since_s = time.monotonic()
            self.up_to_now()
            self.ready = True

    def _loaded(self, path: Path) -> Iterator[Record]:
        """The records of a file, which holds all that was heard until now: it is loaded whole."""
        self._later.clear()
        return read_tlog(path)


def take(gap: LiveGap, frame: Frame, system: int) -> None:
    """Feed a gap what it needs of a frame, if that is of this system."""
    if frame.system != system or not frame.known:
        return
    if frame.message_id in OF_THE_CONTRACT:
        reading = decode_reading(frame)
        if reading is not None:
            gap.take(reading)
    elif frame.message_id == PARAM_VALUE:
        message = decode(frame)
        if message is not None:
            gap.parameter(message.param_id, message.param_value)
