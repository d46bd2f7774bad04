"""The trace of a crash of the app, kept in a file."""

import traceback
from pathlib import Path

from gcs_plugin.recording.state import state_file


def trace_file() -> Path:
    """Path of the trace; a new one replaces that of an earlier crash."""
    return state_file().with_name("died.txt")


def keep_trace(error: BaseException) -> str:
    """Write the trace of an error; return a sentence for the user that reports the crash."""
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
