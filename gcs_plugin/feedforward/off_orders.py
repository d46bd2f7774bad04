"""The OFF orders of all programs on this computer, marked in files that they share.

OFF wins: a program that raises the feed-forward gives up if another orders OFF meanwhile. The vehicle's reports may not
show that order, since they can be the same as before. So a program touches a small file, one per vehicle system, just
before it sends OFF, and others look whether the file was touched since they started. The computer's clock matters only
for orders in the moments in which a program starts: everything later is told from a change of the file's time.
"""

import math
import threading
import time
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from bridge.vehicle.mode import Mode
from bridge.vehicle.parameters import MODE
from gcs_plugin.recording.state import state_file

WAIT_S: Final = 0.05
"""A stalled disk delays OFF by no more than this; the mark is then made later."""
_NAME: Final = "off-ordered-"

TICK_NS: Final = 10_000_000
"""A file's time may be a tick of the system's clock behind the time at which it was touched."""


class OffMarks:
    """Marks the OFF orders of this program; the disk neither stops an OFF nor delays it by more than WAIT_S."""

    def __init__(self) -> None:
        self._thread: threading.Thread | None = None

    def mark(self, messages: Iterable[Any]) -> None:
        """Mark the OFF orders among `messages`; call it just before they are sent."""
        systems = {
            message.target_system
            for message in messages
            if message.get_type() == "PARAM_SET"
            and message.param_id in (MODE, MODE.encode())
            and message.param_value == Mode.OFF
        }
        if systems and (self._thread is None or not self._thread.is_alive()):
            self._thread = threading.Thread(target=_touch, args=(systems,), name="off ordered", daemon=True)
            self._thread.start()
            self._thread.join(WAIT_S)


class OffOrders:
    """The OFF orders marked since this object was made, or since `began_unix_s`, when its program began to start."""

    def __init__(self, began_unix_s: float = math.inf) -> None:
        began_ns = began_unix_s * 1e9 - TICK_NS
        marks = {file.name: _touched(file) for file in state_file().parent.glob(f"{_NAME}*")}
        # A mark of the future was made before the clock was set back; one made while they are read is none of these.
        now_ns = time.time_ns()
        self._before = {
            name: at_ns for name, at_ns in marks.items() if at_ns is None or not began_ns <= at_ns <= now_ns
        }

    def has_ordered_off(self, system: int) -> bool:
        """Whether any program on this computer has ordered OFF for that system since then."""
        file = _file_of(system)
        return _touched(file) != self._before.get(file.name)


def _file_of(system: int) -> Path:
    return state_file().with_name(f"{_NAME}{system}")


def _touch(systems: Iterable[int]) -> None:
    for system in systems:
        file = _file_of(system)
        with suppress(OSError):
            file.parent.mkdir(parents=True, exist_ok=True)
            file.touch()


def _touched(file: Path) -> int | None:
    """Modification time of a mark, ns, by the file system's clock; None if it does not exist."""
    try:
        return file.stat().st_mtime_ns
    except OSError:
        return None
