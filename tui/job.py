"""Run a verb in a process of its own: the program that waits follows its progress and can end it for good.

A job does exactly what the verb does, because it is the verb. If its listener is gone, it goes on to its end: an
upload is not cut short because a terminal was closed.
"""

import asyncio
import tempfile
import time
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from bridge import reports
from bridge.files import clear_way
from bridge.plain import from_json
from bridge.reports import Report
from gcs_plugin.job import Job

MOST_SAID = 50
LOOK_EVERY_S = 0.05
ASKED = {reports.VARIABLE: reports.FORM}

LEAVES = ("--json", "--param", "--report", "--accept")
"""Options that name the files a verb leaves next to a dive, under names chosen by this program."""


@dataclass(frozen=True)
class Done:
    """How a verb ended.

    Its exit code (`bridge.exit_codes`), its result as written to `--json`, None if there is none, its last lines of
    output other than progress, its errors, and the names of their classes.
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
        job = Job(words[0], ("-m", "tui", *words, *target), time.monotonic(), ASKED, errors_alone=True)
        said: deque[str] = deque(maxlen=MOST_SAID)
        errors: deque[Report] = deque(maxlen=MOST_SAID)
        try:
            while job.code is None:
                for line in job.lines(time.monotonic()):
                    report = reports.read(line)
                    if report is None:
                        said.extend((line,) if line else ())
                    elif report.of == reports.ERROR:
                        errors.append(report)
                    else:
                        hear(report)
                await asyncio.sleep(LOOK_EVERY_S)
        except asyncio.CancelledError:
            job.cancel(time.monotonic())
            while job.code is None:
                job.lines(time.monotonic())
                await asyncio.sleep(LOOK_EVERY_S)
            raise
        # An unchanged file is the result of an earlier run.
        answer = _result(result) if _written_ns(result) != before_ns else None
        sentences, names = tuple(error.words for error in errors), tuple(error.stage for error in errors)
        return Done(job.code, answer, tuple(said), sentences, names)


def _own_target(words: Sequence[str]) -> Path | None:
    """The file that the words themselves name for the result."""
    return Path(words[words.index("--json") + 1]) if "--json" in words else None


def _written_ns(path: Path) -> int:
    """Time of a file's last change, in ns; 0 if there is no file."""
    return path.stat().st_mtime_ns if path.exists() else 0


def _result(path: Path) -> Any:
    if not path.exists():
        return None
    try:
        return from_json(path.read_text(encoding="utf-8"))
    except ValueError:  # cut off while being written
        return None
