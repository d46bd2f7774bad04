"""The times of signatures: never the same twice, never going back, kept over restarts.

A frame is refused if its stream (system, component, link) sent that time or a later one before, or if it is more than
a minute behind the newest time known here: this computer's clock, or a later time that was received. Outgoing frames
take the newest time as well, so that a side whose clock is behind learns the time from the first frame that it
accepts.
"""

import json
from enum import Enum
from pathlib import Path
from typing import Any, Final

from bridge.clock import Clock
from bridge.file_size import read_small
from bridge.new_file import whole
from bridge.plain import from_json

EPOCH_UNIX_S: Final = 1_420_070_400  # 2015-01-01
STEPS_A_S: Final = 100_000
MINUTE: Final = 60 * STEPS_A_S
LATEST: Final = (1 << 48) - 1
KEEP_EVERY_S: Final = 60.0

Stream = tuple[int, int, int]
"""System, component and link number."""


class Refusal(Enum):
    """Why a frame is not let in. In messages, the value follows a number of frames."""

    UNSIGNED = "unsigned"
    OTHER_KEY = "of another key"
    REPLAYED = "replayed or late"
    OLD = "a minute old"


class Times:
    """The times of one link. `file` keeps them over restarts; without a file they are forgotten.

    `fault` says why they can't be kept, "" if they can.
    """

    def __init__(self, clock: Clock, file: Path | None = None) -> None:
        self.fault = ""
        self._clock, self._file = clock, file
        self._sent, self._heard = _kept(file) if file else (0, {})
        self._newest = max(self._heard.values(), default=0)
        self._reserved = self._sent
        self._keep_due_s = clock.boot_s()

    def next(self) -> int:
        """Return the time for the next outgoing frame, later than all before."""
        self._sent = min(max(self._now(), self._sent + 1), LATEST)
        # The file already holds a time that is later than any sent before the next save: a killed program repeats none.
        if self._sent >= self._reserved:
            self._reserved = self._sent + MINUTE
            self._keep()
        return self._sent

    def take(self, stream: Stream, time: int) -> Refusal | None:
        """Accept the time of a frame whose signature is right, or return why the frame is refused."""
        if time <= self._heard.get(stream, -1):
            return Refusal.REPLAYED
        if time + MINUTE < self._now():
            return Refusal.OLD
        self._heard[stream] = time
        self._newest = max(self._newest, time)
        if self._clock.boot_s() >= self._keep_due_s:
            self._keep()
        return None

    def knows(self, system: int) -> bool:
        """Whether a frame of that system was ever accepted."""
        return any(heard == system for heard, _, _ in self._heard)

    def close(self) -> None:
        """Save the times as they are now."""
        self._reserved = self._sent
        self._keep()

    def _now(self) -> int:
        clock = round((self._clock.unix_s() - EPOCH_UNIX_S) * STEPS_A_S)
        return max(clock, self._newest, 0)

    def _keep(self) -> None:
        self._keep_due_s = self._clock.boot_s() + KEEP_EVERY_S
        if self._file is None:
            return
        heard = {" ".join(map(str, stream)): time for stream, time in self._heard.items()}
        try:
            self._file.parent.mkdir(parents=True, exist_ok=True)
            with whole(self._file) as file:
                file.write(json.dumps({"sent": self._reserved, "heard": heard}).encode())
            self.fault = ""
        except OSError as error:
            self.fault = (
                f"{self._file}: the times of signatures can't be kept ({error.strerror}), so that after a restart "
                "a frame of the last minute could be replayed; check the disk"
            )


def _kept(file: Path) -> tuple[int, dict[Stream, int]]:
    """Return the kept times: the last that may have been sent, and the last heard of each stream.

    If the file is absent or invalid they are 0 and {}: the clock serves then.
    """
    try:
        kept = from_json(read_small(file))
        return _time(kept["sent"]), {_stream(name): _time(time) for name, time in kept["heard"].items()}
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return 0, {}


def _time(told: Any) -> int:
    if isinstance(told, bool) or not isinstance(told, int) or not 0 <= told <= LATEST:
        raise ValueError
    return told


def _stream(name: str) -> Stream:
    system, component, link = map(int, name.split())
    return system, component, link
