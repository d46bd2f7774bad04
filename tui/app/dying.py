"""Death of the app by an exception: the trace in a file, one sentence to the user, and the process ends in any case."""

import os
import threading
import traceback
from collections.abc import Callable
from pathlib import Path
from typing import Final

from tui.app.preferences import state_file

PATIENCE_S: Final = 5.0
"""Time that the app gets to leave by itself; then the process ends, wherever it hangs."""


def trace_file() -> Path:
    """Path of the trace; it replaces the trace of an earlier death."""
    return state_file().with_name("died.txt")


def keep_trace(error: BaseException) -> str:
    """Write the trace of an error; return a sentence that reports the death."""
    file = trace_file()
    words = " ".join(f"{type(error).__name__}: {error}".split())
    trace_words = f"what it died of is in {file}"
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("".join(traceback.format_exception(error)), encoding="utf-8")
    except OSError as unwritten:
        trace_words = f"no more is known, for {file} can't be written ({unwritten.strerror})"
    return (
        f"seatrial: the app has died ({words}); a recording goes on without it. Start it again; {trace_words}"
    )


def end_within(patience_s: float, give_back: Callable[[], None]) -> None:
    """End the process after `patience_s` even if it hangs; call `give_back` just before."""

    def end() -> None:
        try:
            give_back()
        finally:
            os._exit(1)

    timer = threading.Timer(patience_s, end)
    timer.daemon = True
    timer.start()
