"""How much of the feed-forward's gain is the PID's: the validation mission with three PIDs, each alone and with it.

The PIDs differ in the gains of surge and sway and in the thrust below which the thrusters stay in their dead zone:
the source paper's slow one, the stiffer one that `configs/gains.yaml` gives it beside the feed-forward (`fed`), and
the best of a grid, sought for the PID alone in water of its own. Each flies with the same gains in both columns.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import yaml

from bench import words
from bench.accuracy.answers import answered
from bench.campaigns import VEHICLE, dived
from bench.remembered import Data, Remembered
from bench.stamp import PAPERS_VEHICLE, reached, stamp
from bench.words import blocks, paragraph
from bridge.simulator.direct import simulate_truth
from bridge.simulator.missions import mission_named
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.controller import GAINS
from bridge.vehicle.mode import Mode
from identify.estimators.table import DEFAULT
from identify.validation.tracking import phases

SOURCES = (reached("bench/tracking/ladder.py"), *PAPERS_VEHICLE)
CONFIGURATION, MISSION = "hovering", "validation"
AXES = {"surge": 0, "sway": 1}
OTHER_SEA, TUNING_SEA = 700, 1700
"""Added to a campaign's seed for the flights after it, and for those that the tuned PID is sought in."""
PROPORTIONAL, INTEGRAL = (2.0, 4.0, 8.0, 12.0, 16.0, 24.0), (4.0, 16.0, 64.0, 128.0, 256.0, 512.0)
"""Factors of the grid on the paper's gains."""


@dataclass(frozen=True)
class Pid:
    """Factors on the paper's proportional and integral gains of surge and sway; `straight_below_n`: the thrust below
    which pulses run straight to neutral, into the dead zone."""

    proportional: float
    integral: float
    straight_below_n: float


def page(cache: Path, seeds: Sequence[int]) -> str:
    kept = Remembered(cache / f"ladder-{stamp(*SOURCES)}.jsonl")
    seen = kept.fill({f"tuned {seeds[0]}": partial(_tuned, seeds[0])}, "tuning")[f"tuned {seeds[0]}"]
    tuned = Pid(seen["proportional"], seen["integral"], seen["straight_below_n"])
    jobs = {f"{seed} {tuned}": partial(_flights, tuned, seed, cache / "dives") for seed in seeds}
    flights = list(kept.fill(jobs, "ladder").values())
    return blocks("## The PID's part, and the feed-forward's", *shown(tuned, flights))


def paper_table() -> dict[str, Any]:
    gains: dict[str, Any] = yaml.safe_load(GAINS.read_text(encoding="utf-8"))[CONFIGURATION]
    return gains


def table(pid: Pid) -> dict[str, Any]:
    """The paper's table with these factors; alone and with the feed-forward it is the same."""
    gains = paper_table()
    for axis in AXES:
        rows = gains[axis]
        gains[axis] = {
            "kp": [pid.proportional * gain for gain in rows["kp"]],
            "ki": [pid.integral * gain for gain in rows["ki"]],
            "kd": rows["kd"],
        }
    fed = {"gain": 1.0, "straight_below_n": pid.straight_below_n}
    return {**gains, "straight_below_n": pid.straight_below_n, "fed": fed}


def _pids(tuned: Pid) -> dict[str, Pid]:
    gains = paper_table()
    fed = gains["fed"]
    return {
        "the paper's": Pid(1.0, 1.0, gains["straight_below_n"]),
        "as beside the feed-forward": Pid(fed["gain"], fed["gain"], fed["straight_below_n"]),
        "tuned": tuned,
    }


def _tuned(seed: int) -> Data:
    """The PID of the grid with the least sum of surge's and sway's error, alone."""
    fed = paper_table()["fed"]["straight_below_n"]
    grid = [Pid(p, i, fed) for p, i in product(PROPORTIONAL, INTEGRAL)]
    best = min(grid, key=lambda pid: sum(_errors(pid, Mode.OFF, {}, seed + TUNING_SEA).values()))
    return {"proportional": best.proportional, "integral": best.integral, "straight_below_n": fed}


def _flights(tuned: Pid, seed: int, dives: Path) -> Data:
    """Errors in m/s by PID, mode and axis; the feed-forward's coefficients come from the campaign of that seed."""
    learnt = dived(CONFIGURATION, CONFIGURATION, seed, dives)
    model = answered(DEFAULT, learnt.dive, learnt.file, CONFIGURATION)["value"]
    return {
        name: {mode.name: _errors(pid, mode, model, seed + OTHER_SEA) for mode in (Mode.OFF, Mode.BOTH)}
        for name, pid in _pids(tuned).items()
    }


def _errors(pid: Pid, mode: Mode, model: Mapping[str, float], seed: int) -> dict[str, float]:
    """Mean size of true less wanted velocity in m/s while the reference moves, by axis; infinite if it diverges."""
    file = load_vehicle(f"{VEHICLE}:{CONFIGURATION}")
    mission = mission_named(MISSION, file.vehicle.configurations[CONFIGURATION])
    with TemporaryDirectory() as folder:
        gains = Path(folder) / "gains.yaml"
        gains.write_text(yaml.safe_dump({CONFIGURATION: table(pid)}), encoding="utf-8")
        run = simulate_truth(
            file, CONFIGURATION, mission, seed=seed, parameters=model, mode=mode, gains=gains
        )
    wanted = run.nu_ref
    errors = {}
    for axis, dof in AXES.items():
        moving = phases(wanted[:, dof], np.gradient(wanted[:, dof], run.time_s)).any
        errors[axis] = float(np.abs(run.nu[moving, dof] - wanted[moving, dof]).mean())
    return {axis: error if np.isfinite(error) else np.inf for axis, error in errors.items()}


def shown(tuned: Pid, flights: Sequence[Data]) -> tuple[str, str]:
    rows = []
    for name in _pids(tuned):
        cells = []
        for axis in AXES:
            alone, both = (1e3 * _mean(flights, name, mode, axis) for mode in (Mode.OFF, Mode.BOTH))
            cells += [f"{alone:.1f}", f"{both:.1f}", f"{alone / both:.1f}"]
        rows.append((name, *cells))
    head = [column for axis in AXES for column in (f"{axis}, alone", f"{axis}, with feed-forward", "ratio")]
    return (
        paragraph(
            f"Mean absolute error of the true velocity in mm/s while the reference moves, over the {MISSION}",
            f"mission in {CONFIGURATION}, {len(flights)} seas; coefficients identified from each sea's own campaign.",
            "In each row both columns fly the same gains of surge and sway and the same dead zone. The tuned PID has",
            f"the least error alone of a grid of {len(PROPORTIONAL) * len(INTEGRAL)}, in a sea of its own:",
            f"{tuned.proportional:g} times the paper's proportional gain, {tuned.integral:g} times its integral one.",
            "`seatrial` flies the second row's PID beside the feed-forward, and the first row's without it.",
        ),
        words.table(("PID", *head), rows),
    )


def _mean(flights: Sequence[Data], pid: str, mode: Mode, axis: str) -> float:
    return float(np.mean([flight[pid][mode.name][axis] for flight in flights]))
