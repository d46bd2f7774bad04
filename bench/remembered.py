"""Results kept as JSON lines, so that a benchmark resumes where it stopped, even after a kill."""

import gzip
import json
import math
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterable, Mapping
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

from rich.progress import track

from bridge.errors import LogError
from bridge.files import whole
from gcs_plugin.job import end_with_parent

Data = dict[str, Any]
Job = Callable[[], Data]

PROCESSES = 2
ONE_THREAD = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


class Remembered:
    """Earlier results by key; a new result is appended to the file `path` at once."""

    def __init__(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._path = path
        self._known: dict[str, Data] = {}
        text = path.read_text(encoding="utf-8") if path.exists() else ""
        for line in text.splitlines():
            self._take(line)
        if text and not text.endswith("\n"):
            with path.open("a", encoding="utf-8") as out:
                out.write("\n")

    def __contains__(self, key: str) -> bool:
        return key in self._known

    def get(self, key: str, measure: Callable[[], Data]) -> Data:
        """The result under `key`, measured if it is unknown."""
        if key not in self._known:
            self.put(key, measure())
        return self._known[key]

    def put(self, key: str, data: Data) -> None:
        """Keep a result. Raises LogError if the file can't be written."""
        try:
            with self._path.open("a", encoding="utf-8") as out:
                out.write(json.dumps({"key": key, "data": data}) + "\n")
        except OSError as error:
            raise LogError(f"{self._path}: can't be written ({error.strerror}); free disk space") from None
        self._known[key] = data

    def fill(self, jobs: Mapping[str, Job], words: str) -> dict[str, Data]:
        """The results of all jobs, by key; jobs without a result run in PROCESSES worker processes, one core each.

        A job is picklable, as a `partial` of a module's function is.
        """
        missing = {key: job for key, job in jobs.items() if key not in self._known}
        if missing:
            context = multiprocessing.get_context("spawn")
            with ProcessPoolExecutor(PROCESSES, context, _take_one_core) as pool:
                running = {pool.submit(job): key for key, job in missing.items()}
                try:
                    for done in track(as_completed(running), words, total=len(running)):
                        self.put(running[done], done.result())
                finally:
                    pool.shutdown(cancel_futures=True)
                    # What ran on while another failed, or at Ctrl-C, has ended by now.
                    for ran, key in running.items():
                        if key not in self._known and not ran.cancelled() and ran.exception() is None:
                            self.put(key, ran.result())
        return {key: self._known[key] for key in jobs}

    def _take(self, line: str) -> None:
        """Take in a line of the file; a line that a kill cut short is ignored, so that its job runs again."""
        try:
            kept = json.loads(line)
        except json.JSONDecodeError:
            return
        self._known[kept["key"]] = kept["data"]


def pack(rows: Iterable[Data], path: Path) -> None:
    """Write rows to a gzipped file of JSON lines, whole or not at all; the same rows give the same bytes."""
    text = "".join(json.dumps(row) + "\n" for row in rows)
    path.parent.mkdir(parents=True, exist_ok=True)
    with whole(path) as file:
        file.write(gzip.compress(text.encode(), mtime=0))


def _take_one_core() -> None:
    """Initialise a worker, before it imports torch or numba: one thread, because another worker has the other core.

    Ctrl-C is left to the parent process that waits for the results. If the parent is killed, the worker ends too.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.environ.update(dict.fromkeys(ONE_THREAD, "1"))
    threading.Thread(target=end_with_parent, daemon=True).start()


def finite(value: float) -> float | None:
    """Round a number for JSON; None if it is not finite."""
    return float(f"{value:.6g}") if math.isfinite(value) else None
