"""A verb at work in a process of its own: the program that waits hears its progress, and can end it for good.

What a job does is what the verb does, for it is the verb. One whose listener is gone goes on to its end: an upload is
not cut short because a terminal was closed.
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
"""How long a verb that is asked to stop may take to leave things as they should be."""

MOST_SAID = 50
LONGEST_LINE_BYTES = 1 << 28
"""A result that finds no place on the disk is one line of what a verb tells."""

LEAVES = ("--json", "--param", "--report", "--accept")
"""Options that name what a verb leaves beside a dive, by names of ours."""


@dataclass(frozen=True)
class Done:
    """How a verb ended: its exit code (`tui.exit_codes`), its result as it wrote it to `--json`, None where there is
    none, and what it said beside its progress, the last lines."""

    code: int
    result: Any
    said: tuple[str, ...]


async def work(words: Sequence[str], hear: Callable[[Report], None]) -> Done:
    """Run the verb and its arguments in `words` to its end. Cancelled, it ends the verb and all that this started.

    A `--json FILE` among the words is where its result lies afterwards as well.
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
            said = await _listen(process, hear)
            code = await process.wait()
        finally:
            await _end(process)
        # What lay there before is the result of another run.
        return Done(code, _result(result) if _written_ns(result) != before_ns else None, said)


def _own_target(words: Sequence[str]) -> Path | None:
    """The file that the words themselves name for the result."""
    return Path(words[words.index("--json") + 1]) if "--json" in words else None


def _written_ns(path: Path) -> int:
    """When a file was last written, 0 where there is none."""
    return path.stat().st_mtime_ns if path.exists() else 0


async def _listen(process: asyncio.subprocess.Process, hear: Callable[[Report], None]) -> tuple[str, ...]:
    assert process.stderr is not None
    said: deque[str] = deque(maxlen=MOST_SAID)
    async for raw in process.stderr:
        line = raw.decode("utf-8", "replace").rstrip()
        heard = progress.read(line)
        if heard is not None:
            hear(heard)
        elif line:
            said.append(line)
    return tuple(said)


async def _end(process: asyncio.subprocess.Process) -> None:
    """End the process and those that it started, if it still runs: as Ctrl-C does, then at once."""
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
    except ValueError:  # cut off while it was written
        return None
