"""The section of docs/benchmarks.md: 240 field dives, each with a drawn vehicle, velocity filter and sea."""

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from bench.field import tables
from bench.field.diagnosed import Planned, planned_job
from bench.field.draw import DIVE_S, plan
from bench.field.export import COMPANION, STATION, Rates
from bench.field.score import Judged, judged
from bench.field.sources import ANSWERS
from bench.remembered import Remembered
from bench.stamp import stamp
from bench.words import paragraph

SEED, COUNT = 600_000, 240
STATION_SEED, STATION_COUNT = 610_000, 56
SHORT_SEED, SHORT_COUNT = 390_000, 16
"""Nothing is tuned on dives of SEED; the short form, which anyone may look at, uses seeds of development."""


def section(cache: Path, short: bool) -> str:
    """The section, from the results in `cache`; runs the dives that are missing there."""
    kept = Remembered(cache / "field.jsonl")

    def cases_of(seed: int, count: int, rates: Rates) -> list[Judged]:
        dives = [Planned(seed, number, effect, rates) for number, effect in plan(seed, count)]
        jobs = {f"{dive.name}:{stamp(*ANSWERS)}": partial(planned_job, dive) for dive in dives}
        return [judged(data) for data in kept.fill(jobs, "field dives").values()]

    if short:
        return page(cases_of(SHORT_SEED, SHORT_COUNT, COMPANION), SHORT_SEED, [])
    by_station = cases_of(STATION_SEED, STATION_COUNT, STATION)
    return page(cases_of(SEED, COUNT, COMPANION), SEED, by_station)


def page(cases: Sequence[Judged], seed: int, by_station: Sequence[Judged]) -> str:
    """The section from its dives, and from those that a ground station recorded."""
    slow = _by_station(by_station) if by_station else []
    return "\n".join(["## Field dives", "", *_introduction(cases, seed), "", *lines(cases), *slow, ""])


def _by_station(cases: Sequence[Judged]) -> list[str]:
    return [
        "",
        *paragraph(
            f"As a ground station records them: {len(cases)} further dives (seed {STATION_SEED}) with pulses,",
            "accelerometer and pressure twice a second, position at 3.3 Hz, attitude and the sticks at 20 Hz. The",
            "pulses between two are reckoned from the sticks and the attitude. The goals are those of the others.",
        ),
        "",
        *tables.goals(cases),
        "",
        *tables.beside_goals(cases),
        "",
        *tables.wrong(cases),
    ]


def lines(cases: Sequence[Judged]) -> list[str]:
    """The tables."""
    return [
        *tables.goals(cases),
        "",
        *tables.beside_goals(cases),
        "",
        *paragraph(
            "Power by effect. Sizes over the sea: the rms of what a refit of masses, linear and quadratic dampings",
            "leaves of the planted wrench, over the standard deviation of the sea, in the degree of freedom where it",
            "is largest. Errors of sizes are over what was planted.",
        ),
        "",
        *tables.by_effect(cases),
        "",
        "By size, all effects together:",
        "",
        *tables.by_size(cases),
        "",
        *tables.wrong(cases),
        "",
        *paragraph(
            "Prediction: the check dive, another mission of the same vehicle, foretold from the measured velocity by",
            "recorded thrust and attitude alone, by what was learnt of the dive; medians over the dives of the rms",
            "over windows. The velocity that all begin with and are held against is the one that the diagnosis",
            "smoothed, as late as the autopilot's filter. The regressions know that drag is linear and quadratic, and",
            "seek one delay of thrust on a grid; the last row has the true coefficients, no delay, and nothing of what",
            "hides.",
        ),
        "",
        *tables.prediction(cases),
    ]


def _introduction(cases: Sequence[Judged], seed: int) -> list[str]:
    empty = sum(case.empty for case in cases)
    return paragraph(
        f"{len(cases)} dives of {DIVE_S[0]:g} to {DIVE_S[1]:g} s as a stock ArduSub records them (`bench/field`,",
        f"seed {seed}): no wrench, no DVL, velocity from the autopilot's own filter, 20 to 120 ms late, smoothed over",
        "30 to 200 ms, with 5 to 25 mm/s of coloured noise. Each draws an ROV of 8 to 30 kg with six or eight",
        "thrusters, mostly quadratic drag within a factor of two of a published hull, a pilot, a mixer, the filter,",
        f"and a sea of 0.5 to 3 % of full thrust. {empty} hide nothing, the others one effect each. A cause counts as",
        "named where it is the first of all or accepted (0.5 probable or more) and the verdict is explained or partly,",
        "or where it is accepted and the verdict is ambiguous. Quadratic drag is the hull's own, and counts neither",
        "way. A false cause is an accepted one that is not there.",
    )
