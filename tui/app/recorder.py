"""The recording next to the app: found if it runs, else started detached, so that it outlives the app."""

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final

from bridge import reports
from bridge.clock import Clock, SystemClock
from bridge.errors import LinkError
from gcs_plugin.recording.state import Holding, held, how_to_end, hung, state_file
from tui import links

PATIENCE_S: Final = 15.0
LOOK_EVERY_S: Final = 0.1


def recording(now_unix_s: float) -> Holding | None:
    return held(now_unix_s) or hung(now_unix_s)


def recorded() -> Path | None:
    """The folder of the dive being recorded."""
    holding = links.holding_now()
    return None if holding is None else Path(holding.folder)


def options(recorded: Sequence[str], out: str, vehicle: str, sign_key: str = "") -> list[str]:
    named = ["--vehicle", vehicle] if vehicle else []
    key = ["--sign-key", sign_key] if sign_key else []
    return [*(word for link in recorded for word in ("--link", link)), "--out", out, *named, *key]


def begin_again(arguments: Sequence[str]) -> None:
    """Start a recording if none runs, and wait until it reports.

    Raises LinkError, also if a hanging recorder holds the links.
    """
    clock = SystemClock()
    if held(clock.unix_s()) is not None:
        return
    if holding := hung(clock.unix_s()):
        raise LinkError(f"the recorder hangs and keeps the link: {how_to_end(holding.pid)}")
    begin(arguments, clock)


def record_command(arguments: Sequence[str]) -> list[str]:
    """Command line of `seatrial record` with the running Python."""
    return [sys.executable, "-m", "tui", "record", *arguments]


def begin(
    arguments: Sequence[str],
    clock: Clock,
    wait: Callable[[float], None] = time.sleep,
    find: Callable[[float], Holding | None] = held,
) -> Holding:
    """Start `seatrial record` in a session of its own, and return once it reports.

    Raises LinkError with the process's own last words if it ends instead, or if it can't be started.
    """
    log = state_file().with_name("record.log")
    try:
        log.parent.mkdir(parents=True, exist_ok=True)
        with log.open("wb") as words:
            process = subprocess.Popen(
                record_command(arguments),
                stdin=subprocess.DEVNULL,
                stdout=words,
                stderr=words,
                start_new_session=True,
                env=os.environ | {reports.VARIABLE: reports.FORM},
            )
    except OSError as error:
        raise LinkError(
            f"the recording did not start: {error.filename or log}: {error.strerror}; check the rights of its "
            "folder, and the disk"
        ) from None
    # A killed process would otherwise remain as a zombie, and look alive, until this process ends.
    threading.Thread(target=process.wait, name="end of the recording", daemon=True).start()
    until_s = clock.boot_s() + PATIENCE_S
    while clock.boot_s() < until_s:
        holding = find(clock.unix_s())
        if holding is not None:
            return holding
        if process.poll() is not None:
            raise LinkError(f"the recording did not start: {_last_line(log)}")
        wait(LOOK_EVERY_S)
    raise LinkError(f"the recording has not reported for {PATIENCE_S:.0f} s; see {log}")


def _last_line(log: Path) -> str:
    lines = log.read_text(encoding="utf-8", errors="replace").strip().splitlines()
    report = reports.read(lines[-1]) if lines else None
    return report.words if report else lines[-1] if lines else f"it said nothing; see {log}"
