"""The section of docs/benchmarks.md: field dives as a ground station records them, pulses twice a second."""

from pathlib import Path

from bench.field.export import STATION
from bench.field.score import Judged
from bench.field.section import SOURCES as FIELD
from bench.field.section import cases_of, further_figures, goals, wrong
from bench.words import blocks, paragraph

SOURCES = (*FIELD, "bench/field/ground_station.py")
SEED, COUNT = 610_000, 120
SHORT_SEED, SHORT_COUNT = 395_000, 8
"""Nothing is tuned on dives of SEED; the short form, which anyone may look at, uses seeds of development."""


def section(cache: Path, short: bool) -> str:
    seed, count = (SHORT_SEED, SHORT_COUNT) if short else (SEED, COUNT)
    return page(cases_of(cache, seed, count, STATION), seed)


def page(cases: list[Judged], seed: int) -> str:
    return blocks(
        "## Field dives as a ground station records them",
        paragraph(
            f"{len(cases)} further [field dives](#field-dives) (seed {seed}) with pulses, accelerometer and pressure",
            "twice a second, position at 3.3 Hz, attitude and the sticks at 20 Hz. The pulses between two are reckoned",
            "from the sticks and the attitude. The goals are those of the others.",
        ),
        goals(cases),
        further_figures(cases),
        wrong(cases),
    )
