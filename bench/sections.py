"""The sections of the benchmark by name, in the page's order, each with its short and its full form."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from bench import paper_network
from bench.accuracy import coverage, prediction, shorter_recordings
from bench.accuracy import section as accuracy
from bench.ardusub import page as ardusub
from bench.diagnosis import page as diagnosis
from bench.diagnosis import power
from bench.diagnosis import speed as diagnosis_time
from bench.field import ground_station
from bench.field import section as field
from bench.mutants import section as mutants
from bench.operation import flying, gap_monitor, station
from bench.speed import bags, reading
from bench.speed import identification as speed
from bench.stamp import Source, stamp
from bench.tracking import ladder
from bench.tracking import section as tracking
from bench.unknown import section as unknown

CAMPAIGN_SEEDS = (901, 902, 903, 904, 905)
"""Seeds of the paper's two campaigns, dived by its vehicle."""


@dataclass(frozen=True)
class Run:
    """Folders of results and page of a run; `short` selects the quick form."""

    cache: Path
    docs: Path
    results: Path
    short: bool

    @property
    def kept(self) -> Path:
        """Folder of the results that most sections keep."""
        return self.cache / "bench"

    @property
    def packed(self) -> Path:
        """Folder of packed rows: the repository's, which hold the full form's alone."""
        return self.kept if self.short else self.results

    @property
    def campaigns(self) -> tuple[int, ...]:
        """Seeds of the paper's campaigns, the first alone in the quick form."""
        return CAMPAIGN_SEEDS[: 1 if self.short else None]

    def seeds(self, short: int, full: int) -> tuple[int, ...]:
        """Seeds from 1 on."""
        return tuple(range(1, (short if self.short else full) + 1))


@dataclass(frozen=True)
class Measurement:
    """A section's module, with the code that its figures depend on as its SOURCES (`bench.stamp`), and what makes its
    page from results kept by earlier runs, measuring those that are missing; `asked`: run only if named."""

    module: ModuleType
    page: Callable[[Run], str]
    asked: bool = False

    @property
    def sources(self) -> tuple[Source, ...]:
        sources: tuple[Source, ...] = self.module.SOURCES
        return sources

    @property
    def code(self) -> str:
        return stamp(*self.sources)


_FIRST = CAMPAIGN_SEEDS[0]
SECTIONS = {
    "accuracy": Measurement(
        accuracy,
        lambda run: accuracy.section(run.seeds(100, 1000), run.cache, run.packed / "accuracy.jsonl.gz"),
    ),
    "speed": Measurement(speed, lambda run: speed.page(run.kept, _FIRST)),
    "reading": Measurement(reading, lambda run: reading.page(run.kept, _FIRST)),
    "bags": Measurement(bags, lambda run: bags.page(run.kept)),
    "station": Measurement(station, lambda run: station.page(run.kept, _FIRST)),
    "thrift": Measurement(shorter_recordings, lambda run: shorter_recordings.page(run.kept, run.campaigns)),
    "prediction": Measurement(
        prediction, lambda run: prediction.page(run.kept, run.campaigns, run.seeds(4, 20))
    ),
    "tracking": Measurement(tracking, lambda run: tracking.page(run.kept, run.campaigns)),
    "gap monitor": Measurement(
        gap_monitor, lambda run: gap_monitor.page(run.kept, *((4, 4) if run.short else (40, 20)))
    ),
    "flying": Measurement(flying, lambda run: flying.page(run.kept, 1 if run.short else 3)),
    "ladder": Measurement(ladder, lambda run: ladder.page(run.kept, run.campaigns)),
    "paper network": Measurement(paper_network, lambda run: paper_network.page(run.kept, _FIRST), asked=True),
    "coverage": Measurement(coverage, lambda run: coverage.section(run.seeds(4, 20), run.kept)),
    "field": Measurement(field, lambda run: field.section(run.kept, run.short)),
    "ground station": Measurement(ground_station, lambda run: ground_station.section(run.kept, run.short)),
    "unknown": Measurement(unknown, lambda run: unknown.section(run.kept, run.short)),
    "diagnosis": Measurement(diagnosis, lambda run: diagnosis.section(run.kept, run.short)),
    "diagnosis time": Measurement(diagnosis_time, lambda run: diagnosis_time.section(run.kept, run.short)),
    "ardusub": Measurement(ardusub, lambda run: ardusub.page(run.cache, run.docs), asked=True),
    "power": Measurement(
        power, lambda run: power.section(run.kept, run.packed / "power.jsonl.gz", run.short), asked=True
    ),
    "mutants": Measurement(mutants, lambda run: mutants.section(run.kept, run.short), asked=True),
}
