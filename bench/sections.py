"""The sections of the benchmark by name, in the page's order, each with its short and its full form."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from bench import (
    accuracy,
    accuracy_trials,
    bags,
    coverage,
    deepxde_surge,
    flying,
    gap_monitor,
    ladder,
    paper_noise,
    paper_small,
    prediction,
    reading,
    speed,
    station,
    thrift,
    tracking,
)
from bench.ardusub.sources import SOURCES as ARDUSUB
from bench.diagnosis import sources as of_diagnosis
from bench.field.sources import SECTION as FIELD
from bench.stamp import stamp
from bench.unknown.sources import SECTION as UNKNOWN

CAMPAIGN_SEEDS = (901, 902, 903, 904, 905)
"""Seeds of the paper's two campaigns, dived by its vehicle."""


@dataclass(frozen=True)
class Run:
    """Folders of results and page of a run; `short` selects the quick form."""

    cache: Path
    docs: Path
    results: Path
    short: bool


def _accuracy(run: Run) -> str:
    seeds = range(1, 101) if run.short else range(1, 1001)
    return accuracy.section(seeds, run.cache, run.results / "accuracy.jsonl.gz")


def _coverage(run: Run) -> str:
    seeds = range(1, 5) if run.short else range(1, 21)
    return coverage.section(seeds, run.cache / "bench")


def _paper_noise(run: Run) -> str:
    return paper_noise.page(run.docs / "paper_noise.html")


def _speed(run: Run) -> str:
    return speed.page(run.cache / "bench", CAMPAIGN_SEEDS[0])


def _reading(run: Run) -> str:
    return reading.page(run.cache / "bench", CAMPAIGN_SEEDS[0])


def _bags(run: Run) -> str:
    return bags.page(run.cache / "bench")


def _station(run: Run) -> str:
    return station.page(run.cache / "bench", CAMPAIGN_SEEDS[0])


def _thrift(run: Run) -> str:
    return thrift.page(run.cache / "bench", CAMPAIGN_SEEDS[: 1 if run.short else 5])


def _prediction(run: Run) -> str:
    campaigns, missions = (1, 4) if run.short else (5, 20)
    seeds = tuple(range(1, missions + 1))
    return prediction.page(run.cache / "bench", CAMPAIGN_SEEDS[:campaigns], seeds)


def _tracking(run: Run) -> str:
    return tracking.page(run.cache / "bench", CAMPAIGN_SEEDS[: 1 if run.short else 5])


def _gap_monitor(run: Run) -> str:
    return gap_monitor.page(run.cache / "bench", 4 if run.short else 40, 4 if run.short else 20)


def _flying(run: Run) -> str:
    return flying.page(run.cache / "bench", 1 if run.short else 3)


def _ladder(run: Run) -> str:
    return ladder.page(run.cache / "bench", CAMPAIGN_SEEDS[: 1 if run.short else 5])


def _paper_small(run: Run) -> str:
    return paper_small.page(run.cache / "bench", tuple(range(1, 2 if run.short else 6)))


def _deepxde(run: Run) -> str:
    return deepxde_surge.page(run.cache / "bench", tuple(range(1, 2 if run.short else 4)))


def _diagnosis(run: Run) -> str:
    from bench.diagnosis import page

    return page.section(run.cache / "bench", run.short)


def _field(run: Run) -> str:
    from bench.field import section

    return section.section(run.cache / "bench", run.short)


def _unknown(run: Run) -> str:
    from bench.unknown import section

    return section.section(run.cache / "bench", run.short)


def _power(run: Run) -> str:
    from bench.diagnosis import power

    results = run.cache / "bench" if run.short else run.results
    return power.section(run.cache / "bench", results / "power.jsonl.gz", run.short)


def _ardusub(run: Run) -> str:
    from bench.ardusub import page

    return page.page(run.cache, run.docs)


@dataclass(frozen=True)
class Measurement:
    """A section's page, and the code that its figures depend on (`bench.stamp`); `asked`: run only if named."""

    page: Callable[[Run], str]
    sources: tuple[str, ...]
    asked: bool = False

    @property
    def code(self) -> str:
        return stamp(*self.sources)


_TRIALS = tuple(source for group in accuracy_trials.SOURCES.values() for source in group)
SECTIONS = {
    "accuracy": Measurement(_accuracy, _TRIALS),
    "speed": Measurement(_speed, speed.SOURCES),
    "reading": Measurement(_reading, reading.SOURCES),
    "bags": Measurement(_bags, bags.SOURCES),
    "station": Measurement(_station, station.SOURCES),
    "thrift": Measurement(_thrift, thrift.SOURCES),
    "prediction": Measurement(_prediction, prediction.SOURCES),
    "tracking": Measurement(_tracking, tracking.SOURCES),
    "gap monitor": Measurement(_gap_monitor, gap_monitor.SOURCES),
    "flying": Measurement(_flying, flying.SOURCES),
    "ladder": Measurement(_ladder, ladder.SOURCES),
    "paper small": Measurement(_paper_small, paper_small.SOURCES),
    "deepxde": Measurement(_deepxde, deepxde_surge.SOURCES),
    "coverage": Measurement(_coverage, coverage.SOURCES),
    "paper noise": Measurement(_paper_noise, paper_noise.SOURCES),
    "field": Measurement(_field, FIELD),
    "unknown": Measurement(_unknown, UNKNOWN),
    "diagnosis": Measurement(_diagnosis, of_diagnosis.SECTION),
    "ardusub": Measurement(_ardusub, ARDUSUB, asked=True),
    "power": Measurement(_power, of_diagnosis.POWER, asked=True),
}
