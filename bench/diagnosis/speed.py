"""Wall time of a diagnosis: the command as a crew types it, on 10-minute dives, with all cores and with one."""

import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from bench.diagnosis.plan import BENCH, SPEED
from bench.diagnosis.sources import SPEED as SOURCES
from bench.remembered import Data, Remembered
from bench.stamp import stamp
from bench.words import paragraph
from bridge.errors import FitError
from identify.challenge.case import Case, dive_of, draw_case
from identify.challenge.recording import tlog_of

LONG_S = 600.0
GOAL_S = 10.0
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
ONE_CORE = {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1"}


def measured(kept: Remembered, short: bool) -> list[Data]:
    """Seconds of every dive, on all cores and on one; nothing else may run at the same time."""
    hidden = HIDDEN[:2] if short else HIDDEN
    return [
        kept.get(f"speed {BENCH + SPEED + i} {os.cpu_count()}:{stamp(*SOURCES)}", partial(_timed, i))
        for i in range(len(hidden))
    ]


def lines(found: Sequence[Data]) -> list[str]:
    """The paragraph of the page."""
    all_s, single_s = (statistics.median(data[what] for data in found) for what in ("cores", "one core"))
    slowest = max(data["cores"] for data in found)
    return paragraph(
        f"Speed: `seatrial diagnose` from a cold start to its answer, {len(found)} dives of {LONG_S / 60:.0f} minutes,",
        f"one after the other: median {all_s:.1f} s on {found[0]['count']} cores, {slowest:.1f} s at most,",
        f"{single_s:.1f} s on one core. The goal of {GOAL_S:g} s on 2 cores is",
        f"{'met' if all_s < GOAL_S else '**missed**'} by the median, and",
        f"{'met' if slowest < GOAL_S else '**missed**'} by the slowest.",
    )


def _timed(i: int) -> Data:
    case = draw_case(BENCH + SPEED + i, names=HIDDEN[i], seconds=LONG_S)
    with tempfile.TemporaryDirectory() as folder:
        log, vehicle = Path(folder) / "dive.tlog", Path(folder) / "vehicle.yaml"
        log.write_bytes(tlog_of(dive_of(case)))
        vehicle.write_text(case.vehicle.text, encoding="utf-8")
        every = os.sched_getaffinity(0)
        whole_s = _verb(log, vehicle, case, {})
        os.sched_setaffinity(0, {min(every)})
        try:
            one_s = _verb(log, vehicle, case, ONE_CORE)
        finally:
            os.sched_setaffinity(0, every)
    return {"cores": whole_s, "one core": one_s, "count": len(every)}


def _verb(log: Path, vehicle: Path, case: Case, environment: dict[str, str]) -> float:
    command = shutil.which("seatrial", path=str(Path(sys.executable).parent))
    if command is None:
        raise FitError("the command 'seatrial' is not beside this Python; install the package first")
    answer = log.with_suffix(".json")
    answer.unlink(missing_ok=True)
    words = [
        command,
        "diagnose",
        str(log),
        "--vehicle",
        f"{vehicle}:{case.configuration}",
        "--json",
        str(answer),
    ]
    began = time.perf_counter()
    done = subprocess.run(words, capture_output=True, text=True, env={**os.environ, **environment})
    seconds = time.perf_counter() - began
    if not answer.exists():
        raise FitError(f"seatrial diagnose of {case.name} gave no answer: {done.stderr.strip()}")
    return seconds
