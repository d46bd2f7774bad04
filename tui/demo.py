"""The whole chain on the simulated vehicle: dive, record, identify, upload, dive again in three modes."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from bridge.onboard.parameters import parameters_of
from bridge.simulator.missions import mission_named
from bridge.simulator.truth import load_truth
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.vehicle.mode import Mode
from gcs_plugin import simulated
from gcs_plugin.job import side_by_side
from gcs_plugin.params.client import ParameterClient
from gcs_plugin.params.identified import parameters_from_identification, write_identified
from gcs_plugin.params.plan import make_plan
from gcs_plugin.params.receipt import Receipt
from gcs_plugin.params.session import Order
from identify.dive import Dive
from identify.estimators.table import DEFAULT, estimator
from identify.identification import Identification
from identify.ingest.open import read_dive
from identify.run.identify import identify
from tui import show

VEHICLE = "ruvifist"
CAMPAIGNS = ("survey", "hovering")
MODES = {"PID": Mode.OFF, "FF": Mode.ALONE, "both": Mode.BOTH}
CAMPAIGN_SHARE, UPLOAD_SHARE = 0.72, 0.03
DIVE_SHARE = 0.75
"""Share of the dive itself in a campaign's work; the rest is the identification."""

Tell = Callable[[float, str], None]


@dataclass(frozen=True)
class Campaign:
    """A mission of the paper: the recorded dive, and the identification from it."""

    configuration: str
    folder: Path
    dive: Dive
    identification: Identification
    truth: Mapping[str, float]


@dataclass(frozen=True)
class Demo:
    """All results of the demo. `runs` are the validation dives by mode, in hovering."""

    file: VehicleFile
    campaigns: tuple[Campaign, ...]
    receipt: Receipt
    runs: Mapping[str, Dive]


def run(root: Path, seed: int, unix_s: float, tell: Tell) -> Demo:
    """Run the demo; recordings, identifications, uploaded parameters and receipt go into the new folder `root`."""
    file = load_vehicle(VEHICLE)
    campaigns = _campaigns(root, seed, unix_s, tell)
    tell(CAMPAIGN_SHARE, "upload with read-back")
    store = root / "vehicle-parameters.json"
    for result in campaigns:
        show.write_json(result.identification.to_json(), str(root / f"{result.configuration}.json"))
        write_identified(root / f"{result.configuration}.param", result.identification.to_json(), file)
    receipt = _upload(file, campaigns, root, seed, store)
    show.write_json(receipt.to_json(), str(root / "receipt.json"))
    runs = {}
    begun, each = CAMPAIGN_SHARE + UPLOAD_SHARE, (1.0 - CAMPAIGN_SHARE - UPLOAD_SHARE) / len(MODES)
    for words, mode in MODES.items():
        runs[words] = _validation(file, root, seed + 1, unix_s, store, mode, _part(tell, begun, each, words))
        begun += each
    tell(1.0, "done")
    return Demo(file, campaigns, receipt, runs)


def _part(tell: Tell, begun: float, whole: float, words: str) -> Callable[[float], None]:
    """Progress callback for a part of the demo."""
    return lambda share: tell(begun + whole * share, f"dive: {words}")


def campaign(
    configuration: str, root: Path, seed: int, unix_s: float, progress: Callable[[float], None]
) -> Campaign:
    """Dive the paper's mission of a configuration with its PID alone, and identify from the recording."""
    file = load_vehicle(VEHICLE)
    mission = mission_named(configuration, file.vehicle.configurations[configuration])
    folder = simulated.dive_with_pid(
        file, configuration, mission, root, seed, unix_s, lambda share: progress(DIVE_SHARE * share)
    )
    dive = read_dive(folder.path, None, file)
    identification = identify(
        dive,
        file,
        configuration,
        {DEFAULT: estimator(DEFAULT)},
        lambda step: progress(DIVE_SHARE + (1 - DIVE_SHARE) * step.share),
    ).answer
    return Campaign(configuration, folder.path, dive, identification, load_truth(file, configuration).model)


def _campaigns(root: Path, seed: int, unix_s: float, tell: Tell) -> tuple[Campaign, ...]:
    """Run both campaigns in parallel, each in its own process."""

    def heard(done: Mapping[str, float]) -> None:
        words = ", ".join(f"{c} {'dives' if s < DIVE_SHARE else 'identified'}" for c, s in done.items())
        tell(CAMPAIGN_SHARE * sum(done.values()) / len(done), words)

    jobs = {c: partial(campaign, c, root, seed, unix_s) for c in CAMPAIGNS}
    return tuple(side_by_side(jobs, heard).values())


def _upload(
    file: VehicleFile, campaigns: tuple[Campaign, ...], root: Path, seed: int, store: Path
) -> Receipt:
    """Upload both parameter sets in one plan, through the real client, into the vehicle's store."""
    targets: dict[str, float] = {}
    for result in campaigns:
        veh_cfg = file.vehicle.veh_cfg(result.configuration)
        targets |= parameters_from_identification(result.identification.to_json(), veh_cfg)
    link, clock = simulated.afloat(file, CAMPAIGNS[0], seed, parameters_of(file, store))
    client = ParameterClient(link, clock)
    client.find_vehicle()
    return client.apply(Order(make_plan(targets, client.read_all()), root / "before-upload.param"))


def _validation(
    file: VehicleFile,
    root: Path,
    seed: int,
    unix_s: float,
    store: Path,
    mode: Mode,
    progress: Callable[[float], None],
) -> Dive:
    """Make a validation dive in hovering with the parameters in the vehicle's store; every mode has the same sea."""
    configuration = "hovering"
    mission = mission_named("validation", file.vehicle.configurations[configuration])
    parameters = parameters_of(file, store)
    folder = simulated.record_dive(
        file,
        configuration,
        mission,
        root,
        seed=seed,
        unix_s=unix_s - simulated.lasts_s(mission),
        parameters=parameters,
        mode=mode,
        progress=progress,
    )
    return read_dive(folder.path, None, file)


def inside(campaign: Campaign) -> dict[str, bool]:
    """For each identifiable coefficient, whether its 95 % interval contains the truth."""
    return {
        p.name: p.low95 <= campaign.truth[p.name] <= p.high95
        for p in campaign.identification.parameters
        if p.identifiable and p.name in campaign.truth
    }


def to_json(demo: Demo, rows: Any) -> dict[str, Any]:
    """The result as plain data."""
    return {
        "identified": {c.configuration: c.identification.to_json() for c in demo.campaigns},
        "truth": {c.configuration: dict(c.truth) for c in demo.campaigns},
        "inside": {c.configuration: inside(c) for c in demo.campaigns},
        "receipt": demo.receipt.to_json(),
        "modes": list(demo.runs),
        "tracking": [
            {
                "axis": row.axis,
                "phase": row.phase,
                "unit": row.unit,
                "values": [v if math.isfinite(v) else None for v in row.values],
            }
            for row in rows
        ],
    }
