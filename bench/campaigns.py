"""Dives of the source paper's vehicle through bytes, bridge, MAVLink and `.tlog`, kept with their truth.

Each is dived once, into a folder of the cache, and later read from there.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bench.stamp import PAPERS_VEHICLE, reached, stamp
from bridge.arrays import Array
from bridge.links.link import memory_pair
from bridge.simulator.body import Start
from bridge.simulator.dive import TICK_S, WARM_UP_S, SimulatedVehicle, arm_for_mission
from bridge.simulator.missions import mission_named
from bridge.simulator.truth import load_truth
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.vehicle.legs import Mission
from bridge.vehicle.mode import Mode
from bridge.vehicle.parameters import COMMIT, MODE
from bridge.wire.framing import Framer
from bridge.wire.tlog import TlogWriter
from identify.dive import Dive
from identify.ingest.open import read_dive

VEHICLE = "ruvifist"
CONFIGURATIONS = ("survey", "hovering")
"""The two campaigns of the paper: each configuration dives the mission of its own name."""
SOURCES = (reached("bench/campaigns.py"), *PAPERS_VEHICLE)
"""The code that a dive comes from (`bench.stamp`)."""


@dataclass(frozen=True)
class Dived:
    """A recorded dive with its truth, one row per control tick.

    `truth`: all twelve coefficients; `time_s` (n,): boot time; `state` (n, 13): NED position, attitude w x y z, body
    velocity, SI.
    """

    dive: Dive
    file: VehicleFile
    configuration: str
    truth: Mapping[str, float]
    time_s: Array
    state: Array

    @property
    def nu(self) -> Array:
        return self.state[:, 7:]


def dived(
    configuration: str,
    mission: str,
    seed: int,
    cache: Path,
    mode: Mode = Mode.OFF,
    feed_forward: Mapping[str, float] | None = None,
) -> Dived:
    """The dive of a mission by a seed, with `feed_forward` as given; read from `cache` if it was dived before."""
    file = load_vehicle(f"{VEHICLE}:{configuration}")
    given = dict(sorted((feed_forward or {}).items()))
    digest = hashlib.sha256(json.dumps([given, stamp(*SOURCES)]).encode()).hexdigest()[:8]
    folder = cache / f"{configuration}-{mission}-{mode.name.lower()}-{seed}-{digest}"
    log, truth = folder / "telemetry.tlog", folder / "truth.npz"
    if not truth.exists():
        folder.mkdir(parents=True, exist_ok=True)
        log.unlink(missing_ok=True)
        flown = with_model(file, configuration, given) if feed_forward is not None else file
        whole = mission_named(mission, file.vehicle.configurations[configuration])
        time_s, state = dive(flown, configuration, whole, seed, mode, log)
        unfinished = folder / "truth.part.npz"
        np.savez_compressed(unfinished, time_s=time_s, state=state)
        unfinished.rename(truth)
    with np.load(truth) as happened:
        time_s, state = happened["time_s"], happened["state"]
    model = load_truth(file, configuration).model
    return Dived(read_dive(log, None, file), file, configuration, model, time_s, state)


def with_model(file: VehicleFile, configuration: str, model: Mapping[str, float]) -> VehicleFile:
    """The vehicle with the coefficients `model` in force from the start."""
    shapes = dict(file.vehicle.configurations)
    shapes[configuration] = replace(shapes[configuration], model=dict(model))
    return replace(file, vehicle=replace(file.vehicle, configurations=shapes))


def dive(
    file: VehicleFile, configuration: str, mission: Mission, seed: int, mode: Mode, log: Path
) -> tuple[Array, Array]:
    """Dive a mission and record it in `log`; return boot times (n,) and true states (n, 13)."""
    near, far = memory_pair()
    start = Start(
        seed,
        mission.start_depth_m,
        mission.start_heading_rad,
        truth=load_truth(load_vehicle(f"{VEHICLE}:{configuration}"), configuration),
    )
    vehicle = SimulatedVehicle(file, configuration, (near,), start)
    # A vehicle flies no set before its first commit.
    vehicle.parameters.write(COMMIT, float(vehicle.parameters.staged_crc), armed=False)
    vehicle.parameters.write(MODE, float(mode), armed=False)
    arm_for_mission(vehicle.bridge, vehicle.parameters)
    framer = Framer()
    times, states = [], []
    with TlogWriter(log) as writer:
        for _ in range(round((WARM_UP_S + mission.duration_s) / TICK_S)):
            since_s = vehicle.body.time_s + TICK_S - WARM_UP_S
            stretch = vehicle.tick(mission.reference(since_s) if since_s >= 0 else None)
            times.append(float(stretch.time_s[-1]))
            states.append(stretch.state[-1].copy())
            unix_us = round(1e6 * vehicle.clock.unix_s())
            while data := far.read(0.0):
                for frame in framer.feed(data):
                    writer.write(unix_us, frame.raw)
    return np.array(times), np.array(states)


def silent(*_report: object) -> None:
    """Ignore the progress of a fit, and the values so far."""
