"""The section of docs/benchmarks.md on the wall time of a diagnosis: the command as a crew types it, on 10-minute
dives, with all cores and with one."""

import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from functools import cache, partial
from pathlib import Path

from bench.diagnosis.plan import BENCH, DEVELOPMENT, SPEED
from bench.field.draw import draw, effects_of
from bench.remembered import Data, Remembered
from bench.stamp import CURVES, reached, stamp
from bench.words import blocks, in_a_word, paragraph
from bridge.errors import FitError
from identify.challenge.case import dive_of, draw_case
from identify.challenge.tlog import tlog_of

SOURCES = (reached("bench/diagnosis/speed.py", "tui/commands/diagnose.py"), CURVES)
DIVE, VEHICLE = "dive.tlog", "vehicle.yaml"
LONG_S = 600.0
GOAL_S, SLOWEST_GOAL_S = 5.0, 15.0
HIDDEN: tuple[tuple[str, ...], ...] = (
    (),
    ("quadratic_drag",),
    ("steady_current", "dead_zone"),
    ("thruster_lag",),
    (),
    ("dvl_lever_arm", "weak_thruster"),
    ("tether",),
    ("knocks",),
)
EACH = 30
"""Dives by our own contract, which hide HIDDEN in turn, and field dives, as many of each."""

SINGLE = len(HIDDEN)
"""Dives of each kind that are timed on one core, too."""

ONE_CORE = {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}


def section(cache: Path, short: bool) -> str:
    return page(measured(Remembered(cache / "diagnosis-speed.jsonl"), short))


def measured(kept: Remembered, short: bool) -> list[Data]:
    """Seconds of every dive, on all cores, and of some on one; nothing else may run at the same time."""
    count, first = (2, DEVELOPMENT) if short else (EACH, BENCH)
    return [
        kept.get(
            f"speed {kind} {first + SPEED + i} {os.cpu_count()}:{stamp(*SOURCES)}",
            partial(_timed, make, i, first),
        )
        for kind, make in (("contract", contract_dive), ("field", field_dive))
        for i in range(count)
    ]


def page(results: Sequence[Data]) -> str:
    all_s, both_s = [data["cores"] for data in results], [data for data in results if "one core" in data]
    median_s, slowest_s = statistics.median(all_s), max(all_s)
    ratio = statistics.median(data["one core"] / data["cores"] for data in both_s)
    return blocks(
        "## Time of a diagnosis",
        paragraph(
            f"`seatrial diagnose` from a cold start to its answer, {len(results)} dives of {LONG_S / 60:.0f} minutes,",
            "half of them by our own contract and half field dives, one after the other:",
            f"median {median_s:.1f} s on {results[0]['count']} cores, {slowest_s:.1f} s at most; one core takes",
            f"{ratio:.2f} times as long (median of {len(both_s)} dives).",
        ),
        paragraph(
            f"Goals: {GOAL_S:g} s on 2 cores in the median: {in_a_word(median_s < GOAL_S)}; {SLOWEST_GOAL_S:g} s for",
            f"the slowest: {in_a_word(slowest_s < SLOWEST_GOAL_S)}.",
        ),
    )


def contract_dive(i: int, first: int, folder: Path) -> str:
    """Write the i-th dive by our own contract into a folder, and return its vehicle file with the configuration."""
    case = draw_case(first + SPEED + i, names=HIDDEN[i % len(HIDDEN)], seconds=LONG_S)
    (folder / DIVE).write_bytes(tlog_of(dive_of(case)))
    (folder / VEHICLE).write_text(case.vehicle.text, encoding="utf-8")
    return f"{folder / VEHICLE}:{case.configuration}"


def field_dive(i: int, first: int, folder: Path) -> str:
    """Write the i-th field dive into a folder, and return its vehicle file."""
    case = draw(first + SPEED, i, effects_of(first + SPEED, EACH)[i], seconds=LONG_S)
    (folder / DIVE).write_bytes(case.recording(0))
    (folder / VEHICLE).write_text(case.vehicle.text, encoding="utf-8")
    return str(folder / VEHICLE)


def _timed(make: Callable[[int, int, Path], str], i: int, first: int) -> Data:
    _kernels_compiled()
    with tempfile.TemporaryDirectory() as name:
        vehicle = make(i, first, Path(name))
        every = os.sched_getaffinity(0)
        data: Data = {"cores": _verb(Path(name) / DIVE, vehicle, {}), "count": len(every)}
        if i < SINGLE:
            os.sched_setaffinity(0, {min(every)})
            try:
                data["one core"] = _verb(Path(name) / DIVE, vehicle, ONE_CORE)
            finally:
                os.sched_setaffinity(0, every)
    return data


@cache
def _kernels_compiled() -> None:
    """Diagnose a dive, so that no dive that is timed waits until the kernels of a fresh clone are compiled."""
    with tempfile.TemporaryDirectory() as name:
        vehicle = contract_dive(0, DEVELOPMENT, Path(name))
        _verb(Path(name) / DIVE, vehicle, {})


def _verb(log: Path, vehicle: str, environment: dict[str, str]) -> float:
    command = shutil.which("seatrial", path=str(Path(sys.executable).parent))
    if command is None:
        raise FitError("the command 'seatrial' is not beside this Python; install the package first")
    answer = log.with_suffix(".json")
    answer.unlink(missing_ok=True)
    words = [command, "diagnose", str(log), "--vehicle", vehicle, "--json", str(answer)]
    # A crew's Python keeps what it has compiled of the modules.
    its = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}
    began = time.perf_counter()
    done = subprocess.run(words, capture_output=True, text=True, env={**its, **environment})
    seconds = time.perf_counter() - began
    if not answer.exists():
        raise FitError(f"seatrial diagnose of {log} gave no answer: {done.stderr.strip()}")
    return seconds
