"""Opening a recording: from a `.tlog` to aligned arrays, compared with pymavlink's reading of the same file."""

import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from pymavlink import mavutil

from bench.campaigns import SOURCES as DIVED
from bench.campaigns import VEHICLE, dive, dived
from bench.remembered import Data, Remembered
from bench.stamp import PAPERS_VEHICLE, reached, stamp
from bench.words import blocks, paragraph, table
from bridge.simulator.missions import load_mission
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.mode import Mode
from bridge.wire.tlog import TlogReader
from identify.ingest.open import read_dive

SOURCES = (reached("bench/speed/reading.py"), *PAPERS_VEHICLE)
CONFIGURATION = "survey"
ROUNDS = 3
HOUR = """
name: an hour
legs:
  - {name: surge, duration_s: 60, surge_m_s: 0.4, alternate: 30}
  - {name: yaw, duration_s: 60, yaw_rad_s: 0.1, alternate: 30}
"""
GOAL = 20.0

OURS, CAREFUL, THEIRS = (
    "`read_dive`: aligned arrays",
    "our careful path: frames alone",
    "pymavlink's `recv_match`",
)


def page(cache: Path, seed: int) -> str:
    kept = Remembered(cache / f"reading-{stamp(*SOURCES)}.jsonl")
    log = dived(CONFIGURATION, CONFIGURATION, seed, cache / "dives").dive.source
    campaign = kept.get(f"{CONFIGURATION} {seed}", lambda: measured(log))
    of_an_hour = kept.get(f"an hour {seed}", lambda: measured(hour(cache, seed)))
    return blocks(words_of(campaign), hour_words(of_an_hour))


def hour(cache: Path, seed: int) -> Path:
    """The recording of a one-hour dive, dived once."""
    log = cache / "dives" / f"hour-{seed}-{stamp(*DIVED, 'bench/speed/reading.py')}.tlog"
    if not log.exists():
        legs, part = log.with_suffix(".yaml"), log.with_suffix(".part")
        legs.write_text(HOUR, encoding="utf-8")
        part.unlink(missing_ok=True)
        file = load_vehicle(f"{VEHICLE}:{CONFIGURATION}")
        dive(file, CONFIGURATION, load_mission(legs), seed, Mode.OFF, part)
        part.rename(log)
    return log


def measured(log: Path) -> Data:
    """Median seconds of each reader over ROUNDS turns, in which all readers meet the same load."""
    readers: dict[str, Callable[[Path], int]] = {OURS: _ours, CAREFUL: _careful, THEIRS: _theirs}
    messages = {name: read(log) for name, read in readers.items()}
    seconds: dict[str, list[float]] = {name: [] for name in readers}
    for _ in range(ROUNDS):
        for name, read in readers.items():
            began = time.perf_counter()
            read(log)
            seconds[name].append(time.perf_counter() - began)
    medians = {name: float(np.median(each)) for name, each in seconds.items()}
    return {"bytes": log.stat().st_size, "messages": messages, "seconds": medians}


def _ours(log: Path) -> int:
    return read_dive(log).counts["records"]


def _careful(log: Path) -> int:
    return sum(1 for _ in TlogReader(log))


def _theirs(log: Path) -> int:
    reader = mavutil.mavlink_connection(str(log), dialect="ardupilotmega")
    count = 0
    while reader.recv_match() is not None:
        count += 1
    reader.close()
    return count


def words_of(timed: Data) -> str:
    """The section, but for the hour."""
    theirs_s = timed["seconds"][THEIRS]
    ratio = theirs_s / timed["seconds"][OURS]
    rows = [
        (
            name,
            timed["messages"][name],
            f"{seconds:.3g}",
            f"{timed['messages'][name] / seconds:.3g}",
            f"{theirs_s / seconds:.3g} x",
        )
        for name, seconds in timed["seconds"].items()
    ]
    return blocks(
        "## Opening a recording",
        paragraph(
            f"The log of the paper's survey, {timed['bytes'] / 1e6:.1f} MB, read by each in turn in one run, the",
            f"median of {ROUNDS}. Every reader checks every checksum; the arrays are also on one clock and in SI",
            "units, which pymavlink's messages are not yet.",
        ),
        table(("reader", "messages", "seconds", "messages/s", "pymavlink takes"), rows),
        f"Goal of {GOAL:g} times pymavlink: {ratio:.3g}, {'met' if ratio >= GOAL else 'missed'}.",
    )


def hour_words(timed: Data) -> str:
    ours_s, theirs_s = timed["seconds"][OURS], timed["seconds"][THEIRS]
    return paragraph(
        f"The recording of an hour, {timed['messages'][OURS]} messages in {timed['bytes'] / 1e6:.1f} MB, opens in",
        f"{ours_s:.2g} s; pymavlink takes {theirs_s:.3g} s, {theirs_s / ours_s:.3g} times as long.",
    )
