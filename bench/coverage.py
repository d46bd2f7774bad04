"""How often the demo's 95 % intervals hold the truth: many seeds through the whole chain, bytes and all."""

import json
import multiprocessing
import tempfile
from collections.abc import Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from scipy.stats import norm

from tui.demo import CAMPAIGNS, campaign

PROCESSES = 2
EPOCH_S = 1_790_000_000.0


@dataclass(frozen=True)
class Trial:
    """One coefficient of one dive; `z` is its error in standard errors, of its logarithm as the interval is."""

    seed: int
    configuration: str
    name: str
    truth: float
    value: float
    low95: float
    high95: float
    outcome: str

    @property
    def inside(self) -> bool:
        return self.low95 <= self.truth <= self.high95

    @property
    def relative_std(self) -> float:
        return float(np.log(self.high95 / self.low95) / (2 * norm.ppf(0.975)))

    @property
    def z(self) -> float:
        return float(np.log(self.value / self.truth) / self.relative_std)


def trials(seeds: Iterable[int], cache: Path) -> Iterator[Trial]:
    """The trials of all seeds; those that `cache` (JSON lines) holds are not dived again, new ones are added."""
    known = _read(cache)
    wanted = [(c, s) for s in seeds for c in CAMPAIGNS]
    for job in wanted:
        yield from known.get(job, [])
    missing = [job for job in wanted if job not in known]
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(PROCESSES, context) as pool, cache.open("a", encoding="utf-8") as out:
        for found in pool.map(_dive, missing):
            out.write(json.dumps([asdict(trial) for trial in found]) + "\n")
            out.flush()
            yield from found


def _read(cache: Path) -> dict[tuple[str, int], list[Trial]]:
    if not cache.exists():
        return {}
    lines = [json.loads(line) for line in cache.read_text(encoding="utf-8").splitlines()]
    found = [[Trial(**trial) for trial in line] for line in lines if line]
    return {(group[0].configuration, group[0].seed): group for group in found}


def _dive(job: tuple[str, int]) -> list[Trial]:
    configuration, seed = job
    with tempfile.TemporaryDirectory() as folder:
        one = campaign(configuration, Path(folder), seed, EPOCH_S, lambda _: None)
    return [
        Trial(seed, configuration, p.name, one.truth[p.name], p.value, p.low95, p.high95,
              one.identification.outcome.value)
        for p in one.identification.parameters
        if p.identifiable and p.name in one.truth
    ]  # fmt: skip


def wilson(hits: int, count: int) -> tuple[float, float]:
    """The 95 % Wilson bounds of a rate (Wilson 1927)."""
    z = float(norm.ppf(0.975))
    rate, spread = hits / count, z * z / count
    middle = (rate + spread / 2) / (1 + spread)
    half = z * np.sqrt(rate * (1 - rate) / count + z * z / (4 * count * count)) / (1 + spread)
    return float(middle - half), float(middle + half)


def page(found: list[Trial]) -> str:
    """The section of docs/benchmarks.md."""
    seeds = len({trial.seed for trial in found})
    lines = [
        "## Coverage of the demo's intervals",
        "",
        f"{seeds} seeds, both campaigns of the source paper, each through bytes, bridge, MAVLink and recorder, then",
        "`likelihood`. `z` is the error in standard errors: 0 on average, 1 in spread where intervals are right;",
        "a spread above 1 means that they are too narrow. The simulator shares the estimator's equations: this proves",
        "the chain and the intervals, not that a real vehicle obeys the model.",
        "",
        "| configuration | parameter | trials | inside 95 % | mean z | spread of z | median relative standard error |",
        "|---|---|---|---|---|---|---|",
    ]
    for configuration in CAMPAIGNS:
        for name in sorted({t.name for t in found if t.configuration == configuration}):
            own = [t for t in found if (t.configuration, t.name) == (configuration, name)]
            z = np.array([t.z for t in own])
            share = 100 * np.mean([t.inside for t in own])
            width = 100 * np.median([t.relative_std for t in own])
            lines.append(
                f"| {configuration} | {name} | {len(own)} | {share:.0f} % | {z.mean():+.2f} | {z.std():.2f} "
                f"| {width:.2f} % |"
            )
    hits = sum(t.inside for t in found)
    low, high = wilson(hits, len(found))
    z = np.array([t.z for t in found])
    lines += [
        "",
        f"Pooled: {hits} of {len(found)} inside, {100 * hits / len(found):.1f} % "
        f"(Wilson bounds {100 * low:.1f} to {100 * high:.1f} %); spread of z {z.std():.2f}; "
        f"{np.sum(abs(z) > 3)} beyond 3 standard errors, the largest {abs(z).max():.1f}.",
        "",
    ]
    return "\n".join(lines)
