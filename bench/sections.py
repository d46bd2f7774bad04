"""The sections of the benchmark by name, in the page's order, each with its short and its full form."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from bench import paper_network
from bench.accuracy import coverage, prediction, thrift
from bench.accuracy import section as accuracy
from bench.accuracy import trials as accuracy_trials
from bench.ardusub import page as ardusub
from bench.ardusub.sources import SOURCES as ARDUSUB
from bench.diagnosis import page as diagnosis
from bench.diagnosis import power
from bench.diagnosis import sources as of_diagnosis
from bench.field import ground_station
from bench.field import section as field
from bench.field.sources import GROUND_STATION
from bench.field.sources import SECTION as FIELD
from bench.mutants import section as mutants
from bench.operation import flying, gap_monitor, station
from bench.speed import bags, reading
from bench.speed import identification as speed
from bench.stamp import Source, reached, stamp
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
    """A section's page, and the code that its figures depend on (`bench.stamp`); `asked`: run only if named."""

    page: Callable[[Run], str]
    sources: tuple[Source, ...]
    asked: bool = False

    @property
    def code(self) -> str:
        return stamp(*self.sources)


_TRIALS = tuple(source for group in accuracy_trials.SOURCES.values() for source in group)
_TOLD = reached(*(f"bench/accuracy/{name}.py" for name in ("section", "tally", "pooled", "trials")))
_FIRST = CAMPAIGN_SEEDS[0]
SECTIONS = {
    "accuracy": Measurement(
        lambda run: accuracy.section(run.seeds(100, 1000), run.cache, run.packed / "accuracy.jsonl.gz"),
        (*_TRIALS, *_TOLD),
    ),
    "speed": Measurement(lambda run: speed.page(run.kept, _FIRST), speed.SOURCES),
    "reading": Measurement(lambda run: reading.page(run.kept, _FIRST), reading.SOURCES),
    "bags": Measurement(lambda run: bags.page(run.kept), bags.SOURCES),
    "station": Measurement(lambda run: station.page(run.kept, _FIRST), station.SOURCES),
    "thrift": Measurement(lambda run: thrift.page(run.kept, run.campaigns), thrift.SOURCES),
    "prediction": Measurement(
        lambda run: prediction.page(run.kept, run.campaigns, run.seeds(4, 20)), prediction.SOURCES
    ),
    "tracking": Measurement(lambda run: tracking.page(run.kept, run.campaigns), tracking.SOURCES),
    "gap monitor": Measurement(
        lambda run: gap_monitor.page(run.kept, *((4, 4) if run.short else (40, 20))), gap_monitor.SOURCES
    ),
    "flying": Measurement(lambda run: flying.page(run.kept, 1 if run.short else 3), flying.SOURCES),
    "ladder": Measurement(lambda run: ladder.page(run.kept, run.campaigns), ladder.SOURCES),
    "paper network": Measurement(
        lambda run: paper_network.page(run.kept, _FIRST), paper_network.SOURCES, asked=True
    ),
    "coverage": Measurement(lambda run: coverage.section(run.seeds(4, 20), run.kept), coverage.SOURCES),
    "field": Measurement(lambda run: field.section(run.kept, run.short), FIELD),
    "ground station": Measurement(lambda run: ground_station.section(run.kept, run.short), GROUND_STATION),
    "unknown": Measurement(lambda run: unknown.section(run.kept, run.short), unknown.SOURCES),
    "diagnosis": Measurement(lambda run: diagnosis.section(run.kept, run.short), of_diagnosis.SECTION),
    "ardusub": Measurement(lambda run: ardusub.page(run.cache, run.docs), ARDUSUB, asked=True),
    "power": Measurement(
        lambda run: power.section(run.kept, run.packed / "power.jsonl.gz", run.short),
        of_diagnosis.POWER,
        asked=True,
    ),
    "mutants": Measurement(lambda run: mutants.section(run.kept, run.short), mutants.SOURCES, asked=True),
}
