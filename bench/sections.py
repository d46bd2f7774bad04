"""The sections of the benchmark by name, in the page's order: what each runs, in its short and in its full form."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rich.progress import track

from bench import accuracy, coverage, paper_noise


@dataclass(frozen=True)
class Run:
    """Where results are kept and where the page lies; `short` is the form for a quick look."""

    cache: Path
    docs: Path
    results: Path
    short: bool


def _accuracy(run: Run) -> str:
    seeds = range(1, 101) if run.short else range(1, 1001)
    return accuracy.section(seeds, run.cache, run.results / "accuracy.jsonl.gz")


def _coverage(run: Run) -> str:
    seeds = range(1, 5) if run.short else range(1, 41)
    found = coverage.trials(seeds, run.cache / "coverage.jsonl")
    return coverage.page(list(track(found, "coverage", total=14 * len(seeds))))


def _paper_noise(run: Run) -> str:
    return paper_noise.page(run.docs / "paper_noise.html")


SECTIONS: dict[str, Callable[[Run], str]] = {
    "accuracy": _accuracy,
    "coverage": _coverage,
    "paper noise": _paper_noise,
}
