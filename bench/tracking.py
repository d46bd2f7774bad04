"""How well the simulated vehicle follows its references by parameters that it was identified with.

The paper's vehicle is identified from its campaign and flies again in other water: by feed-forward alone over both
campaigns, for the steady error at every speed; and over the validation mission in the paper's three modes.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from bench.answers import answer, answered
from bench.campaigns import CONFIGURATIONS, Dived, dived
from bench.remembered import Data, Remembered
from bench.stamp import LEARNT, SIMULATED, stamp
from bench.words import paragraph
from bridge.simulator.dive import WARM_UP_S
from bridge.simulator.missions import Leg, mission_named
from bridge.vehicle.feedforward import Mode
from identify.dive import Dive, Signal
from identify.estimators.table import DEFAULT
from identify.validate import PHASES, tracking_errors

SOURCES = (*SIMULATED, *LEARNT, "bench/answers.py", "bench/campaigns.py", "bench/tracking.py")
OTHER_SEA = 700
"""Added to a campaign's seed for the flights after it."""

SETTLE_S = 2.0
"""What a leg's steady part leaves out at its beginning, where the transient dies away."""

MODES = {"PID": Mode.OFF, "feed-forward": Mode.ALONE, "both": Mode.BOTH}
AXES = {"surge": 0, "sway": 1, "yaw": 5}
UNITS = {"surge": "mm/s", "sway": "mm/s", "yaw": "mrad/s"}
SPEED_UNITS = {"surge": "m/s", "sway": "m/s", "yaw": "rad/s"}
PAPER_STEADY_MM_S = {("survey", "surge"): 33.6, ("hovering", "surge"): 29.5, ("hovering", "sway"): 2.1}
PAPER_TABLE_5 = {
    "surge": dict(zip(PHASES, (9.1, 3.6, 4.8, 5.1), strict=True)),
    "sway": dict(zip(PHASES, (6.9, 3.0, 2.6, 3.5), strict=True)),
}
GOAL_MM_S = 2.0


def page(cache: Path, seeds: tuple[int, ...]) -> str:
    """The section of docs/benchmarks.md; what was measured before is read from `cache`."""
    kept = Remembered(cache / f"tracking-{stamp(*SOURCES)}.jsonl")
    jobs = {
        f"{configuration} {seed}": partial(flights, configuration, seed, cache / "dives")
        for configuration in CONFIGURATIONS
        for seed in seeds
    }
    found = kept.fill(jobs, "tracking")
    steady = {c: _pooled([found[f"{c} {s}"]["steady"] for s in seeds]) for c in CONFIGURATIONS}
    table_5 = [found[f"hovering {s}"]["validation"] for s in seeds]
    return "\n".join(
        ["## Tracking by identified parameters", "", *steady_lines(steady, len(seeds)), *_table_5(table_5)]
    )


def flights(configuration: str, seed: int, dives: Path) -> Data:
    """Errors in m/s and rad/s: `steady`, by axis and speed a leg each, and in hovering `validation`, by mode."""
    learnt = dived(configuration, configuration, seed, dives)
    model = answer(answered(DEFAULT, learnt.dive, learnt.file, configuration)).value
    sea = seed + OTHER_SEA
    alone = dived(configuration, configuration, sea, dives, Mode.ALONE, model)
    shape = alone.file.vehicle.configurations[configuration]
    spans = mission_named(configuration, shape).spans()
    found: Data = {"steady": steady_errors(alone, spans), "validation": {}}
    if configuration == "hovering":
        for words, mode in MODES.items():
            flown = dived(configuration, "validation", sea, dives, mode, model)
            found["validation"][words] = {
                "measured": _phases(flown.dive, flown),
                "true": _phases(truly(flown), flown),
            }
    return found


def steady_errors(flown: Dived, spans: tuple[tuple[Leg, float, float], ...]) -> dict[str, list[float]]:
    """Mean true velocity less the wanted one over each leg that holds a speed, by `axis speed`."""
    out: dict[str, list[float]] = {}
    since_s = flown.time_s - WARM_UP_S
    for leg, start_s, end_s in spans:
        if leg.transient_s > 0 or leg.phase not in ("steady", "turning"):
            continue
        inside = (since_s >= start_s + SETTLE_S) & (since_s < end_s)
        for axis, wanted in (("surge", leg.surge_m_s), ("sway", leg.sway_m_s), ("yaw", leg.yaw_rad_s)):
            if wanted and inside.any():
                ahead = 1.0 if wanted > 0 else -1.0
                error = ahead * (float(flown.nu[inside, AXES[axis]].mean()) - wanted)
                out.setdefault(f"{axis} {abs(wanted):.3g}", []).append(error)
    return out


def truly(flown: Dived) -> Dive:
    """The dive as sensors without noise at the origin would have told it."""
    velocity, rates = flown.nu[:, :3], flown.nu[:, 3:]
    return replace(
        flown.dive, velocity=Signal(flown.time_s, velocity), gyro=Signal(flown.time_s, rates), fog=None
    )


def _phases(dive: Dive, flown: Dived) -> dict[str, dict[str, float]]:
    dvl = flown.file.vehicle.sensors.dvl
    told = dive is flown.dive and dvl is not None
    lever_m = dvl.mounting.position_m if told and dvl is not None else (0.0, 0.0, 0.0)
    errors = tracking_errors(dive, lever_m)
    return {axis.axis: {phase: axis.phase(phase) for phase in PHASES} for axis in errors.axes}


def _pooled(legs: list[dict[str, list[float]]]) -> dict[str, list[float]]:
    pooled: dict[str, list[float]] = {}
    for one in legs:
        for speed, errors in one.items():
            pooled.setdefault(speed, []).extend(errors)
    return pooled


def steady_lines(found: Mapping[str, dict[str, list[float]]], seeds: int) -> list[str]:
    """The steady part of the page; `found` has leg errors in m/s or rad/s by configuration and `axis speed`."""
    lines = [
        f"Feed-forward alone, parameters by `{DEFAULT}` from the campaign before, {seeds} seeds: true velocity less",
        f"wanted velocity over each leg that holds a speed, from {SETTLE_S:g} s after reaching it, in mm/s (yaw:",
        "mrad/s). An error is that of one leg, whichever its sign; it holds what the parameters do and what the",
        "disturbance does, which nothing answers in this mode. `signed`: the mean over the legs, positive where the",
        "vehicle is too fast, in which the disturbance averages out. The paper has one figure each.",
        "",
        "| configuration | axis | speed | legs | mean absolute error | signed | its standard error | paper |",
        "|---|---|---|---|---|---|---|---|",
    ]
    errors_of: dict[str, list[tuple[float, str]]] = {axis: [] for axis in AXES}
    for configuration, speeds in found.items():
        for words, errors in sorted(speeds.items()):
            axis, speed = words.split()
            mm = 1e3 * np.array(errors)
            paper = PAPER_STEADY_MM_S.get((configuration, axis))
            size = float(np.abs(mm).mean())
            errors_of[axis].append((size, f"{configuration} at {speed}"))
            lines.append(
                f"| {configuration} | {axis} | {speed} | {len(mm)} | {size:.1f} | {mm.mean():+.1f} "
                f"| {_standard_error(mm):.1f} | {'-' if paper is None else f'{paper:g}'} |"
            )
    return [*lines, "", *_verdict(errors_of), ""]


def _verdict(errors_of: Mapping[str, list[tuple[float, str]]]) -> list[str]:
    """Each axis by its worst speed; `errors_of` has mean absolute errors with where they were made."""
    told = []
    for axis, rows in errors_of.items():
        if not rows:
            told.append(f"{axis} was not flown")
            continue
        worst, where = max(rows)
        verdict = "met" if worst <= GOAL_MM_S else "**missed**"
        told.append(f"{axis} {worst:.1f} {UNITS[axis]} ({where} {SPEED_UNITS[axis]}): {verdict}")
    return paragraph(
        f"The goal of {GOAL_MM_S:g} mm/s at every speed, by the mean absolute error at the worst one, axis by axis:",
        f"{'; '.join(told)}. Yaw is judged by {GOAL_MM_S:g} mrad/s, which is {GOAL_MM_S:g} mm/s at 1 m from the axis",
        "of turning; heave is not judged.",
    )


def _standard_error(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    return float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else float("nan")


def _table_5(found: list[Data]) -> list[str]:
    lines = [
        "The paper's Table 5, row by row: mean absolute error in mm/s over the validation mission in hovering. `true`",
        "judges by the true velocity, all others by the measured one as `seatrial validate` does; the paper's own",
        "processing of what it measured is not known.",
        "",
        "| axis | phase | PID | feed-forward | both | both, true | paper, both | half of it met |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for axis, rows in PAPER_TABLE_5.items():
        for phase, paper in rows.items():
            told = [1e3 * _mean(found, mode, "measured", axis, phase) for mode in MODES]
            true = 1e3 * _mean(found, "both", "true", axis, phase)
            cells = " | ".join(f"{value:.1f}" for value in (*told, true))
            met = f"{'yes' if told[-1] <= paper / 2 else 'no'} ({told[-1] / paper:.2f} of the paper's)"
            lines.append(f"| {axis} | {phase.lower()} | {cells} | {paper:g} | {met} |")
    return [*lines, ""]


def _mean(found: list[Data], mode: str, judged: str, axis: str, phase: str) -> float:
    return float(np.nanmean([one[mode][judged][axis][phase] for one in found]))
