"""Run a verb in a process of its own: the program that waits follows its progress and can end it for good.

A job does exactly what the verb does, because it is the verb. If its listener is gone, it goes on to its end: an
upload is not cut short because a terminal was closed.
"""

import asyncio
import contextlib
import os
import signal
import sys
import tempfile
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from bridge.new_file import clear_way
from bridge.plain import from_json
from tui import progress
from tui.progress import Report

PATIENCE_S = 3.0
"""How long a verb that is asked to stop may take to finish cleanly."""

MOST_SAID = 50
LONGEST_LINE_BYTES = 1 << 28
"""A result that can't be written to disk is a single line of the verb's output."""

LEAVES = ("--json", "--param", "--report", "--accept")
"""Options that name the files a verb leaves next to a dive, under names chosen by this program."""


@dataclass(frozen=True)
class Done:
    """How a verb ended.

    Its exit code (`tui.exit_codes`), its result as written to `--json`, None if there is none, its last lines of output
    other than progress, its errors, and the names of their classes.
    """

    code: int
    result: Any
    said: tuple[str, ...] = ()
    errors: tuple[str, ...] = ()
    error_names: tuple[str, ...] = ()

    @property
    def why(self) -> str:
        """Its errors as one text, or its last line if it reported none; empty if it said nothing."""
        return " ".join(self.errors or self.said[-1:])


async def work(words: Sequence[str], hear: Callable[[Report], None]) -> Done:
    """Run the verb and its arguments in `words` to the end. If cancelled, end the verb and every process it started.

    If `words` contain `--json FILE`, the result is also in that file afterwards.
    """
    for option, place in pairwise(words):
        if option in LEAVES:
            clear_way(Path(place))
    with tempfile.TemporaryDirectory(prefix="seatrial-") as folder:
        result = _own_target(words) or Path(folder) / "result.json"
        before_ns = _written_ns(result)
        target = () if _own_target(words) else ("--json", str(result))
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "tui", *words, *target),
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.DEVNULL,
            stderr=asyncio.subprocess.PIPE,
            env=os.environ | {progress.VARIABLE: progress.FORM},
            start_new_session=True,
            limit=LONGEST_LINE_BYTES,
        )
        try:
            said, errors = await _listen(process, hear)
            sentences, names = tuple(error.words for error in errors), tuple(error.stage for error in errors)
            code = await process.wait()
        finally:
            await _end(process)
        # An unchanged file is the result of an earlier run.
        answer = _result(result) if _written_ns(result) != before_ns else None
        return Done(code, answer, said, sentences, names)


def _own_target(words: Sequence[str]) -> Path | None:
    """The file that the words themselves name for the result."""
    return Path(words[words.index("--json") + 1]) if "--json" in words else None


def _written_ns(path: Path) -> int:
    """Time of a file's last change, in ns; 0 if there is no file."""
    return path.stat().st_mtime_ns if path.exists() else 0


async def _listen(
    process: asyncio.subprocess.Process, hear: Callable[[Report], None]
) -> tuple[tuple[str, ...], tuple[Report, ...]]:
    """The last lines of a verb other than its reports, and the reports of its errors; `hear` gets all others."""
    assert process.stderr is not None
    said: deque[str] = deque(maxlen=MOST_SAID)
    errors: list[Report] = []
    async for raw in process.stderr:
        line = raw.decode("utf-8", "replace").rstrip()
        heard = progress.read(line)
        if heard is not None and heard.of == progress.ERROR:
            errors.append(heard)
        elif heard is not None:
            hear(heard)
        elif line:
            said.append(line)
    return tuple(said), tuple(errors[-MOST_SAID:])


async def _end(process: asyncio.subprocess.Process) -> None:
    """End the process and its children if it still runs: by SIGINT as Ctrl-C does, then at once."""
    if process.returncode is not None:
        return
    _signal(process.pid, signal.SIGINT)
    try:
        await asyncio.wait_for(process.wait(), PATIENCE_S)
    except TimeoutError:
        _signal(process.pid, signal.SIGKILL)
        await process.wait()


def _signal(group: int, number: signal.Signals) -> None:
    with contextlib.suppress(ProcessLookupError):
        os.killpg(group, number)


def _result(path: Path) -> Any:
    if not path.exists():
        return None
    try:
        return from_json(path.read_text(encoding="utf-8"))
    except ValueError:  # cut off while being written
        return None
