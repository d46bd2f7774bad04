"""How often the 95 % intervals of the paper's two campaigns hold the truth, over many seeds of the whole chain."""

import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from bench.accuracy.pooled import share95
from bench.campaigns import CONFIGURATIONS, dived
from bench.remembered import Data, Remembered
from bench.stamp import PAPERS_VEHICLE, reached, stamp
from bench.words import blocks, paragraph, table
from bridge.errors import FitError
from identify.estimators.table import DEFAULT, estimator
from identify.statistics import Z95

GOAL = 0.93, 0.97
HEAD = (
    "configuration", "parameter", "trials", "inside 95 %", "mean z", "spread of z", "median relative standard error",
)  # fmt: skip
SOURCES = (reached("bench/accuracy/coverage.py"), *PAPERS_VEHICLE)


@dataclass(frozen=True)
class Trial:
    """One coefficient of one dive; `z` is its error in standard errors, of the logarithm, as the interval is."""

    seed: int
    configuration: str
    name: str
    truth: float
    value: float
    low95: float
    high95: float

    @property
    def inside(self) -> bool:
        return self.low95 <= self.truth <= self.high95

    @property
    def relative_std(self) -> float:
        return float(np.log(self.high95 / self.low95) / (2 * Z95))

    @property
    def z(self) -> float:
        return float(np.log(self.value / self.truth) / self.relative_std)


@dataclass(frozen=True)
class Tried:
    """A dive: `outcome` in words, and a trial for each identifiable coefficient; `trials` may be empty."""

    configuration: str
    seed: int
    outcome: str
    trials: tuple[Trial, ...]


def section(seeds: Sequence[int], cache: Path) -> str:
    return page(measured(seeds, Remembered(cache / f"coverage-{stamp(*SOURCES)}.jsonl")))


def measured(seeds: Sequence[int], kept: Remembered) -> list[Tried]:
    """The dives of all seeds; those missing in `kept` are dived and identified, one core each."""
    jobs = {f"{c} {seed}": partial(dive_job, c, seed) for seed in seeds for c in CONFIGURATIONS}
    return [tried(data) for data in kept.fill(jobs, "coverage").values()]


def dive_job(configuration: str, seed: int) -> Data:
    """Dive a campaign and identify from its recording; return a `Tried` as JSON."""
    with tempfile.TemporaryDirectory() as folder:
        recorded = dived(configuration, configuration, seed, Path(folder))
        try:
            identified = estimator(DEFAULT)(
                recorded.dive, recorded.file, configuration, lambda *_report: None
            )
        except FitError as error:
            return {"configuration": configuration, "seed": seed, "outcome": str(error), "trials": []}
    stated = [p for p in identified.parameters if p.identifiable and p.name in recorded.truth]
    trials = [
        {
            "seed": seed, "configuration": configuration, "name": p.name, "truth": recorded.truth[p.name],
            "value": p.value, "low95": p.low95, "high95": p.high95,
        }
        for p in stated
    ]  # fmt: skip
    return {
        "configuration": configuration, "seed": seed, "outcome": identified.outcome.value, "trials": trials,
    }  # fmt: skip


def tried(data: Data) -> Tried:
    return Tried(**{**data, "trials": tuple(Trial(**trial) for trial in data["trials"])})


def page(dives: Sequence[Tried]) -> str:
    trials = [trial for dive in dives for trial in dive.trials]
    without = [f"{dive.configuration} {dive.seed} ({dive.outcome})" for dive in dives if not dive.trials]
    return blocks(
        "## Coverage of the campaigns' intervals",
        paragraph(
            f"{len({dive.seed for dive in dives})} seeds, both campaigns of the source paper, each through bytes,",
            f"bridge, MAVLink and `.tlog`, then `{DEFAULT}`. `z` is the error in standard errors: 0 on average, 1 in",
            "spread where intervals are right; a spread above 1 means that they are too narrow. The simulator shares",
            "the estimator's equations: this proves the chain and the intervals, not that a real vehicle obeys the",
            "model.",
        ),
        f"Dives of which nothing could be told: {', '.join(without) if without else 'none'}, of {len(dives)}.",
        _tables(trials) if trials else "",
    )


def _tables(stated: Sequence[Trial]) -> str:
    rows = []
    by_row: Mapping[tuple[str, str], list[Trial]] = {
        (configuration, name): [t for t in stated if (t.configuration, t.name) == (configuration, name)]
        for configuration in CONFIGURATIONS
        for name in sorted({t.name for t in stated if t.configuration == configuration})
    }
    for (configuration, name), row in by_row.items():
        z = np.array([t.z for t in row])
        inside = f"{100 * np.mean([t.inside for t in row]):.0f} %"
        spread = f"{100 * np.median([t.relative_std for t in row]):.2f} %"
        rows.append((configuration, name, len(row), inside, f"{z.mean():+.2f}", f"{z.std():.2f}", spread))
    hits = [t.inside for t in stated]
    share, low, high = share95(hits, [(t.configuration, t.seed) for t in stated])
    z = np.array([t.z for t in stated])
    return blocks(
        table(HEAD, rows),
        paragraph(
            f"Pooled: {sum(hits)} of {len(stated)} inside, {100 * share:.1f} %",
            f"({100 * low:.1f} to {100 * high:.1f} %, the coefficients of one dive taken as they hang together,",
            f"`bench/accuracy/pooled.py`); spread of z {z.std():.2f}; {np.sum(abs(z) > 3)} beyond 3 standard errors,",
            f"the largest {abs(z).max():.1f}. Goal of {100 * GOAL[0]:.0f} to {100 * GOAL[1]:.0f} %:",
            f"{'met' if GOAL[0] <= share <= GOAL[1] else '**missed** by the share itself'}.",
        ),
    )
