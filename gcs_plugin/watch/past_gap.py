"""The gap monitor of a dive that was under way before it was watched, fed with what its recording holds so far.

A monitor that began now would learn its noise floor now, and take for noise what the vehicle departs from its model
already. Meanwhile the vehicle's frames go to another monitor; the seconds between the two are a hole, which the monitor
bears. The recording is read in a thread, at half the speed that it could be, so that keys are answered in time.
"""

import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import LogError
from bridge.wire.framing import Frame, decode
from bridge.wire.readings import OF_THE_CONTRACT
from bridge.wire.readings import decode as decode_reading
from bridge.wire.tlog import of_those_that_hold_frames, read_tlog
from gcs_plugin.monitor.live import LiveGap

PARAM_VALUE: Final[int] = dialect.MAVLINK_MSG_ID_PARAM_VALUE
READING: Final = "past of the dive"
"""Name of the thread."""
AFTER_S: Final = 3.0
"""The first screen comes before."""
AT_ONCE: Final = 200
"""Frames between two pauses."""


class PastGap:
    """Feeds `gap` what the recordings, in their order, hold of a system; `ready` once all of it was taken: never where
    one can't be read."""

    def __init__(self, gap: LiveGap, system: int, recordings: Sequence[Path]) -> None:
        self.gap, self.ready = gap, False
        self._system, self._recordings = system, recordings
        self._unwanted = threading.Event()
        threading.Thread(target=self._read, name=READING, daemon=True).start()

    def drop(self) -> None:
        """End the reading: nobody wants its result any more."""
        self._unwanted.set()

    def _read(self) -> None:
        if self._unwanted.wait(AFTER_S):
            return
        with suppress(LogError):
            for records in of_those_that_hold_frames(self._recordings, read_tlog):
                since_s = time.monotonic()
                for count, (_, frame) in enumerate(records, start=1):
                    take(self.gap, frame, self._system)
                    if count % AT_ONCE == 0:
                        if self._unwanted.wait(time.monotonic() - since_s):
                            return
                        since_s = time.monotonic()
            self.ready = True


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
