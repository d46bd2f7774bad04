"""Trials of the accuracy benchmark, kept: every method's answer to every mission, and each mission's bound.

A trial is a method on a seed, or the bound of a seed. Its key holds a stamp of the code that makes it, so that
a figure of older code is never shown for the present code.
"""

import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec

from bench.accuracy.answers import OWN
from bench.accuracy.answers import method as method_named
from bench.bound.bound import cramer_rao
from bench.missions.mission import draw_one
from bench.remembered import Data, Job, Remembered, finite
from bench.stamp import VEHICLES, reached, stamp
from bridge.errors import FitError
from identify.estimators.table import METHODS
from identify.statistics import Z95

BOUND = "bound"
ORDER = (*METHODS, *OWN)
SEEDS_AT_MOST = {"PySINDy weak": 100}
"""PySINDy's weak form takes some 3 s a mission, so it is run on the short form's missions alone."""

SOURCES = {
    group: (reached("bench/missions/mission.py", module), "bench/accuracy/trials.py", *VEHICLES)
    for group, module in (
        (BOUND, "bench/bound/bound.py"),
        ("product", "identify/estimators/table.py"),
        ("own", "bench/baselines"),
    )
}
"""Code that a trial runs through, by group; a test checks that it names every file that a trial loads."""


@dataclass(frozen=True)
class Stated:
    """A coefficient as a method states it; `doubted` if the method warns of it."""

    value: float
    low95: float
    high95: float
    doubted: bool

    @property
    def std(self) -> float:
        """Relative standard error: of the logarithm, as the interval is, if that is positive; NaN without an
        interval."""
        if not math.isfinite(self.high95 - self.low95) or self.value == 0.0:
            return math.nan
        if self.low95 > 0:
            return math.log(self.high95 / self.low95) / (2 * Z95)
        return (self.high95 - self.low95) / (2 * Z95 * abs(self.value))


@dataclass(frozen=True)
class Bound:
    """A mission, its truth by coefficient, and the least relative error of each."""

    seed: int
    kind: str
    duration_s: float
    truth: dict[str, float]
    least: dict[str, float]


@dataclass(frozen=True)
class Trial:
    """A method's answer to a mission: the coefficients that it states and refuses, and its outcome in words."""

    seed: int
    method: str
    stated: dict[str, Stated]
    refused: tuple[str, ...]
    outcome: str
    seconds: float


def available() -> tuple[str, ...]:
    """The available methods in the page's order; PySINDy comes with the extra `bench`."""
    return tuple(method for method in ORDER if "PySINDy" not in method or find_spec("pysindy") is not None)


def measured(seeds: Sequence[int], kept: Remembered) -> tuple[list[Bound], list[Trial]]:
    """Bounds and trials of all seeds; those missing in `kept` are measured, one core each."""
    jobs: dict[str, Job] = {}
    for seed in seeds:
        jobs[_key(BOUND, seed)] = partial(bound_job, seed)
    for method in available():
        for seed in _seeds_of(method, seeds):
            jobs[_key(method, seed)] = partial(method_job, method, seed)
    results = kept.fill(dict(sorted(jobs.items(), key=lambda job: _seed_of(job[0]))), "accuracy")
    return known(results)


def known(results: dict[str, Data]) -> tuple[list[Bound], list[Trial]]:
    bounds, trials = [], []
    for data in results.values():
        if "least" in data:
            bounds.append(Bound(**data))
        else:
            stated = {name: _stated(row) for name, row in data["stated"].items()}
            trials.append(Trial(**{**data, "stated": stated, "refused": tuple(data["refused"])}))
    return bounds, trials


def bound_job(seed: int) -> Data:
    mission = draw_one(seed)
    return {
        "seed": seed, "kind": mission.kind, "duration_s": mission.dive.duration_s,
        "truth": mission.truth, "least": cramer_rao(mission),
    }  # fmt: skip


def method_job(method: str, seed: int) -> Data:
    """A method's answer to a seed's mission, as JSON; only coefficients whose truth the mission holds."""
    mission = draw_one(seed)
    estimate = method_named(method)
    started = time.perf_counter()
    stated: dict[str, list[float | bool | None]] = {}
    outcome = "refused"
    try:
        identified = estimate(mission.dive, mission.file, mission.configuration, lambda *_report: None)
    except FitError:
        return {
            "seed": seed, "method": method, "stated": stated, "refused": list(mission.truth), "outcome": outcome,
            "seconds": time.perf_counter() - started,
        }  # fmt: skip
    seconds = time.perf_counter() - started
    doubted = {name for doubt in identified.doubts for name in doubt.about}
    for name in mission.truth:
        p = identified[name]
        if p.identifiable:
            stated[name] = [finite(p.value), finite(p.low95), finite(p.high95), name in doubted]
    return {
        "seed": seed, "method": method, "stated": stated, "refused": [n for n in mission.truth if n not in stated],
        "outcome": identified.outcome.value, "seconds": seconds,
    }  # fmt: skip


def _stated(row: list[float | bool | None]) -> Stated:
    value, low95, high95 = (math.nan if number is None else float(number) for number in row[:3])
    return Stated(value, low95, high95, bool(row[3]))


def _seeds_of(method: str, seeds: Sequence[int]) -> Iterable[int]:
    return seeds[: SEEDS_AT_MOST.get(method, len(seeds))]


def _key(method: str, seed: int) -> str:
    group = BOUND if method == BOUND else "own" if method in OWN else "product"
    return f"{seed}:{method}:{stamp(*SOURCES[group])}"


def _seed_of(key: str) -> int:
    return int(key.split(":")[0])


def rows_of(bounds: list[Bound], trials: list[Trial]) -> list[Data]:
    """All results as JSON, by seed and method."""
    rows = [vars(bound) for bound in bounds]
    for trial in trials:
        stated = {
            name: [coefficient.value, coefficient.low95, coefficient.high95, coefficient.doubted]
            for name, coefficient in trial.stated.items()
        }
        rows.append({**vars(trial), "stated": stated})
    return sorted(rows, key=lambda row: (row["seed"], str(row.get("method", ""))))
