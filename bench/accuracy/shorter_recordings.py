"""How well each method does with less data: the first 60, 120, 300 and 1000 s of the source paper's two campaigns."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from bench.accuracy.answers import TITLES, answered
from bench.campaigns import CONFIGURATIONS, dived
from bench.remembered import Data, Remembered
from bench.stamp import PAPERS_VEHICLE, reached, stamp
from bench.words import blocks, paragraph, percent, table

SOURCES = (reached("bench/accuracy/shorter_recordings.py"), *PAPERS_VEHICLE)
LENGTHS_S = (60, 120, 300, 1000)
NAMES = {
    "survey": ("M_u", "M_w", "I_r", "D_u", "D_w", "D_r"),
    "hovering": ("M_u", "M_v", "M_w", "I_r", "D_u", "D_v", "D_w", "D_r"),
}


@dataclass(frozen=True)
class Cell:
    """Errors over the `count` seeds that had an answer: rms relative error, and median half 95 % interval over the
    value.

    `median_half95` is NaN if no interval is stated.
    """

    count: int
    rms_error: float
    median_half95: float


def page(cache: Path, seeds: tuple[int, ...]) -> str:
    kept = Remembered(cache / f"thrift-{stamp(*SOURCES)}.jsonl")
    dives = cache / "dives"
    prepared = {f"dive {c} {s}": partial(_dive, c, s, dives) for c in CONFIGURATIONS for s in seeds}
    kept.fill(prepared, "campaigns")
    jobs = {
        f"{configuration} {seed} {name}": partial(shortened, configuration, seed, name, dives)
        for configuration in CONFIGURATIONS
        for seed in seeds
        for name in TITLES
    }
    results = kept.fill(jobs, "data thrift")
    first = {name: dived(name, name, seeds[0], dives) for name in CONFIGURATIONS}
    return blocks(
        "## Data thrift",
        paragraph(
            f"Relative error (rms over {len(seeds)} seeds) and, behind it, the median of half the 95 % interval, in",
            "per cent, from the first seconds of each campaign of the source paper alone, through bytes, bridge and",
            f"MAVLink. The hovering campaign is over after {first['hovering'].dive.duration_s:.0f} s: its last line is",
            "all of it. A dash: no answer for any seed; `/n`: from n seeds only.",
        ),
        *(_table(name, seeds, results, first[name].truth) for name in CONFIGURATIONS),
    )


def shortened(configuration: str, seed: int, name: str, dives: Path) -> Data:
    """A method's answers to the first LENGTHS_S of a campaign, by length."""
    recorded = dived(configuration, configuration, seed, dives)
    begin_s, end_s = recorded.dive.span_s
    return {
        str(length_s): answered(
            name,
            recorded.dive.between(begin_s, min(begin_s + length_s, end_s + 1.0)),
            recorded.file,
            configuration,
        )
        for length_s in LENGTHS_S
    }


def cell(values: list[float], halves: list[float], truth: float) -> Cell:
    """The errors of one parameter from the seeds' values and half 95 % intervals, NaN for a seed without one."""
    error = np.array(values) / truth - 1.0
    stated = np.array(halves)[np.isfinite(halves)] / np.array(values)[np.isfinite(halves)]
    return Cell(
        len(values),
        float(np.sqrt(np.mean(error**2))) if values else float("nan"),
        float(np.median(stated)) if len(stated) else float("nan"),
    )


def _dive(configuration: str, seed: int, dives: Path) -> Data:
    return {"samples": len(dived(configuration, configuration, seed, dives).time_s)}


def _table(
    configuration: str, seeds: tuple[int, ...], results: Mapping[str, Data], truth: Mapping[str, float]
) -> str:
    names = NAMES[configuration]
    rows = []
    for method, title in TITLES.items():
        for length_s in LENGTHS_S:
            answers = [results[f"{configuration} {seed} {method}"][str(length_s)] for seed in seeds]
            cells = []
            for name in names:
                had = [a for a in answers if name in a["value"]]
                halves = [a["half95"].get(name, float("nan")) for a in had]
                cells.append(_words(cell([a["value"][name] for a in had], halves, truth[name]), len(seeds)))
            rows.append((title, length_s, *cells))
    return table((configuration, "first, s", *names), rows)


def _words(entry: Cell, seeds: int) -> str:
    if entry.count == 0:
        return "-"
    interval = f" ±{percent(entry.median_half95)}" if np.isfinite(entry.median_half95) else ""
    few = f" /{entry.count}" if entry.count < seeds else ""
    return f"{percent(entry.rms_error)}{interval}{few}"
