"""That OFF was ordered on this computer, for whoever raises the feed-forward here meanwhile: OFF wins.

A program that raises sees of another's order only what the vehicle then says, which may be what it said before. So
who sends OFF first touches a small file, one for each system; no clock is compared, only whether it was touched since.
"""

import threading
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from bridge.parameters import MODE
from bridge.vehicle.feedforward import Mode
from gcs_plugin.holder import state_file

WAIT_S: Final = 0.05
"""A disk that stalls holds OFF up no longer; its mark then comes later."""
_NAME: Final = "off-ordered-"


class OffMarks:
    """Marks the orders of one program; OFF waits for no disk and fails by none."""

    def __init__(self) -> None:
        self._thread: threading.Thread | None = None

    def mark(self, messages: Iterable[Any]) -> None:
        """These are sent next: what of them orders OFF is marked."""
        systems = {message.target_system for message in messages if _is_off(message)}
        if systems and (self._thread is None or not self._thread.is_alive()):
            self._thread = threading.Thread(target=_touch, args=(systems,), name="off ordered", daemon=True)
            self._thread.start()
            self._thread.join(WAIT_S)


class OffOrders:
    """What was ordered since this was made."""

    def __init__(self) -> None:
        self._before = {file.name: _touched(file) for file in state_file().parent.glob(f"{_NAME}*")}

    def given(self, system: int) -> bool:
        """Whether some program of this computer has ordered OFF of a system meanwhile."""
        file = _file_of(system)
        return _touched(file) != self._before.get(file.name)


def _is_off(message: Any) -> bool:
    if message.get_type() != "PARAM_SET" or message.param_value != Mode.OFF:
        return False
    return bool(message.param_id in (MODE, MODE.encode()))


def _file_of(system: int) -> Path:
    return state_file().with_name(f"{_NAME}{system}")


def _touch(systems: Iterable[int]) -> None:
    for system in systems:
        file = _file_of(system)
        with suppress(OSError):
            file.parent.mkdir(parents=True, exist_ok=True)
            file.touch()


def _touched(file: Path) -> int | None:
    """When, by the file system; None where it never was."""
    try:
        return file.stat().st_mtime_ns
    except OSError:
        return None
