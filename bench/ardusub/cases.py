"""The dives of the firmware's benchmark: what is planted, and the recordings, kept as long as nothing flown changes."""

import json
import shutil
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final

from bench.ardusub.flight import VEHICLE, fly
from bench.stamp import stamp
from bridge.files import write_whole
from bridge.simulator.missions import load_mission
from bridge.simulator.onset import EAST, HEIGHT, PERIOD, TETHER
from bridge.simulator.truth import DELAY, Truth, load_truth
from bridge.vehicle.config import load_vehicle

MISSIONS: Final = Path(__file__).parent
FLOWN: Final = (
    "bench/ardusub/firmware.py", "bench/ardusub/flight.py", "bridge", "configs/vehicles/bluerov2.yaml",
    "configs/thrusters/*.csv",
)  # fmt: skip
"""The code that a recording depends on, beside its case (`bench.stamp`)."""


@dataclass(frozen=True)
class Case:
    """Dives of one kind: their mission in this folder, and what is planted, by the names of `simulator/truth`."""

    words: str
    mission: str = "mission.yaml"
    planted: Mapping[str, float] = field(default_factory=dict)


PLAIN: Final = "plain"
CASES: Final = {
    PLAIN: Case("nothing planted", "with_legs.yaml"),
    "half": Case("thruster 2 at half its thrust", planted={"T2_gain": 0.5}),
    "delay": Case("thrust 0.15 s late", planted={DELAY: 0.15}),
    "current": Case("a current of 0.3 m/s towards east", "turned.yaml", {EAST: 0.3}),
    "tether": Case("a tether of 2 N/m", "out_and_back.yaml", {TETHER: 2.0}),
    "waves": Case("waves of 0.3 m and 5 s", planted={HEIGHT: 0.3, PERIOD: 5.0}),
}


def recording_of(path: Path, runs: Path, name: str, seed: int) -> Path:
    """The recording of a case's dive in a folder of its own in `runs`; it is flown where the folder has none, or one
    that other code flew. Another `seed` is another sea."""
    case, folder = CASES[name], runs / f"{name}-{seed}"
    mission, note = MISSIONS / case.mission, folder / "flown.json"
    mark = {"stamp": stamp(*FLOWN, f"bench/ardusub/{case.mission}"), "planted": dict(case.planted)}
    if note.exists():
        flown = json.loads(note.read_text(encoding="utf-8"))
        if {key: flown[key] for key in mark} == mark:
            return folder / str(flown["recording"])
    shutil.rmtree(folder, ignore_errors=True)
    flight = fly(path, folder, load_mission(mission), truth_of(case), seed=seed)
    left = {"recording": str(flight.recording.relative_to(folder)), "version": flight.version}
    write_whole(note, json.dumps(mark | left) + "\n")
    return flight.recording


def versions(runs: Path) -> list[str]:
    """The firmware's versions that flew the recordings in `runs`."""
    flown = (json.loads(note.read_text(encoding="utf-8")) for note in runs.glob("*/flown.json"))
    return sorted({str(each["version"]) for each in flown})


def truth_of(case: Case) -> Truth:
    """The BlueROV2 of configs, in a stationary sea, with the effects of a case."""
    return replace(load_truth(load_vehicle(VEHICLE), "standard"), onset=dict(case.planted))
