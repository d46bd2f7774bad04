"""How well the simulated vehicle follows its references with the parameters identified from its own campaign.

The paper's vehicle is identified from its campaign and flies again in other water: by feed-forward alone over both
campaigns, for the steady error at every speed (`steady`), and over the validation mission in the paper's three
modes.
"""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from bench.accuracy.answers import answered
from bench.campaigns import CONFIGURATIONS, Dived, dived
from bench.remembered import Data, Remembered
from bench.stamp import PAPERS_VEHICLE, reached, stamp
from bench.tracking import steady
from bench.words import blocks, paragraph, table
from bridge.simulator.missions import mission_named
from bridge.vehicle.mode import Mode
from identify.dive import Dive, Signal
from identify.estimators.table import DEFAULT
from identify.validation.tracking import PHASES, lever_of, tracking_errors

SOURCES = (reached("bench/tracking/section.py"), *PAPERS_VEHICLE)
OTHER_SEA = 700
"""Added to a campaign's seed for the flights after it."""

IDENTIFIED, TRUE = "identified", "true"
MODES = {mode.word: mode for mode in (Mode.OFF, Mode.ALONE, Mode.BOTH)}
PAPER_TABLE_5 = {
    "surge": dict(zip(PHASES, (9.1, 3.6, 4.8, 5.1), strict=True)),
    "sway": dict(zip(PHASES, (6.9, 3.0, 2.6, 3.5), strict=True)),
}


def page(cache: Path, seeds: tuple[int, ...]) -> str:
    kept = Remembered(cache / f"tracking-{stamp(*SOURCES)}.jsonl")
    jobs = {
        f"{configuration} {seed}": partial(flights, configuration, seed, cache / "dives")
        for configuration in CONFIGURATIONS
        for seed in seeds
    }
    results = kept.fill(jobs, "tracking")
    speeds: list[steady.Held] = []
    for configuration in CONFIGURATIONS:
        legs = [results[f"{configuration} {seed}"]["steady"] for seed in seeds]
        speeds += steady.held(
            configuration, [(leg_errors[IDENTIFIED], leg_errors[TRUE]) for leg_errors in legs]
        )
    table_5 = [results[f"hovering {s}"]["validation"] for s in seeds]
    return blocks(
        "## Tracking by identified parameters", steady.words(speeds, len(seeds)), *_table_5(table_5)
    )


def flights(configuration: str, seed: int, dives: Path) -> Data:
    """Errors in m/s and rad/s of the flights.

    `steady`: of the legs, by parameters, axis and speed; `validation`, in hovering only: of the paper's modes.
    """
    learnt = dived(configuration, configuration, seed, dives)
    model = answered(DEFAULT, learnt.dive, learnt.file, configuration)["value"]
    sea = seed + OTHER_SEA
    shape = learnt.file.vehicle.configurations[configuration]
    spans = mission_named(configuration, shape).spans()
    errors: Data = {"steady": {}, "validation": {}}
    for whose, fed in ((IDENTIFIED, model), (TRUE, learnt.truth)):
        alone = dived(configuration, configuration, sea, dives, Mode.ALONE, fed)
        errors["steady"][whose] = steady.steady_errors(alone, spans)
    if configuration == "hovering":
        for words, mode in MODES.items():
            flown = dived(configuration, "validation", sea, dives, mode, model)
            errors["validation"][words] = {
                "measured": _phases(flown.dive, flown),
                "true": _phases(truly(flown), flown),
            }
    return errors


def truly(flown: Dived) -> Dive:
    """The dive as noise-free sensors at the origin would have recorded it."""
    velocity, rates = flown.nu[:, :3], flown.nu[:, 3:]
    return replace(
        flown.dive, velocity=Signal(flown.time_s, velocity), gyro=Signal(flown.time_s, rates), fog=None
    )


def _phases(dive: Dive, flown: Dived) -> dict[str, dict[str, float]]:
    # The true velocity is that of the origin.
    errors = tracking_errors(dive, *([lever_of(flown.file)] if dive is flown.dive else []))
    return {axis.axis: {phase: axis.phase(phase) for phase in PHASES} for axis in errors.axes}


def _table_5(dives: list[Data]) -> tuple[str, str]:
    words = paragraph(
        "The paper's Table 5, row by row: mean absolute error in mm/s over the validation mission in hovering. `true`",
        "judges by the true velocity, all others by the measured one as `seatrial validate` does; the paper's own",
        "processing of what it measured is not known.",
    )
    rows = []
    for axis, phases in PAPER_TABLE_5.items():
        for phase, paper in phases.items():
            errors = [1e3 * _mean(dives, mode, "measured", axis, phase) for mode in MODES]
            true = 1e3 * _mean(dives, "both", "true", axis, phase)
            cells = [f"{value:.1f}" for value in (*errors, true)]
            met = f"{'yes' if errors[-1] <= paper / 2 else 'no'} ({errors[-1] / paper:.2f} of the paper's)"
            rows.append((axis, phase.lower(), *cells, f"{paper:g}", met))
    head = ("axis", "phase", "PID", "feed-forward", "both", "both, true", "paper, both", "half of it met")
    return words, table(head, rows)


def _mean(dives: list[Data], mode: str, judged: str, axis: str, phase: str) -> float:
    return float(np.nanmean([flight[mode][judged][axis][phase] for flight in dives]))
