"""What an app that dies of an exception leaves: the trace in a file, and one sentence; gone it is in any case."""

import os
import threading
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Final

from tui.app.preferences import state_file

PATIENCE_S: Final = 5.0
"""How long the app may take to leave by itself; after that the process ends, wherever it hangs."""


def trace_file() -> Path:
    """Where the trace goes, in place of that of an earlier death."""
    return state_file().with_name("died.txt")


def keep_trace(error: BaseException) -> str:
    """Write the trace of an error; the sentence that tells of it."""
    file = trace_file()
    words = " ".join(f"{type(error).__name__}: {error}".split())
    where = f"what it died of is in {file}"
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("".join(traceback.format_exception(error)), encoding="utf-8")
    except OSError as unwritten:
        where = f"no more is known, for {file} can't be written ({unwritten.strerror})"
    return f"seatrial: the app has died ({words}); a recording goes on without it. Start it again; {where}"


def end_within(patience_s: float, give_back: Callable[[], None]) -> None:
    """End the process after so long, whatever it waits for then; `give_back` is called just before."""

    def end() -> None:
        try:
            give_back()
        finally:
            os._exit(1)

    timer = threading.Timer(patience_s, end)
    timer.daemon = True
    timer.start()
