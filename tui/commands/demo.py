"""`seatrial demo`: one dive, end to end, on the simulated vehicle."""

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from bench.reproduce.published import TABLE_5
from bridge import clock as clocks
from bridge import exit_codes
from bridge.onboard.parameters import parameters_of
from bridge.simulator.missions import mission_named
from bridge.simulator.truth import load_truth
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.vehicle.mode import Mode
from gcs_plugin import simulated
from gcs_plugin.dives.folder import new_folder
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
from identify.report.identification import dive_section, identification_section, innovations_section
from identify.report.page import Report, with_provenance, write_report
from identify.report.validation import Reference, tracking_section
from identify.run.identify import identify
from identify.validation.tracking import METHOD, Row, TrackingErrors, compare, tracking_errors
from tui import show
from tui.show import Table

MOTIONS = {"surge": "Surge motion", "sway": "Sway motion", "yaw": "Yaw motion"}


VEHICLE = "ruvifist"
CAMPAIGNS = ("survey", "hovering")
MODES = {mode.word: mode for mode in (Mode.OFF, Mode.ALONE, Mode.BOTH)}
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


def run(arguments: argparse.Namespace) -> int:
    clock = clocks.SystemClock()
    folder = new_folder(Path(arguments.out), clock.unix_s(), f"seed-{arguments.seed}").path
    with show.progress("demo") as tell:
        done = fly(folder, arguments.seed, clock.unix_s(), tell)
        errors = {mode: tracking_errors(dive) for mode, dive in done.runs.items()}
        rows = compare(errors)
        page = write_page(folder / "report.html", done, errors)
    console = show.results(arguments.json)
    for shown in identified_tables(done):
        show.put(console, shown)
    show.say(console, f"{counted(done)} truths lie in their 95 % intervals.\n")
    show.say(console, f"upload: {done.receipt.sentence}\n")
    show.put(console, tracking_table(list(done.runs), rows))
    show.say(console, f"{METHOD}\n")
    show.say(console, f"report: {page}")
    show.say(console, f"recordings, results and receipt: {folder}")
    show.say(console, f"took {clock.boot_s():.0f} s")
    result = to_json(done, rows) | {"report": str(page), "folder": str(folder)}
    show.write_json(result, str(folder / "result.json"))
    show.write_json(result, arguments.json)
    return exit_codes.DONE if done.receipt.good else exit_codes.NO


def identified_tables(done: Demo) -> list[Table]:
    """(a) Identified against true parameters of the simulated vehicle, one table per configuration."""
    tables = []
    for campaign in done.campaigns:
        holds = inside(campaign)
        dry_kg = done.file.vehicle.configurations[campaign.configuration].dry_mass_kg
        rows = [
            (
                f"{p.name}, {p.unit}",
                show.number(p.value),
                f"{show.number(p.low95)} to {show.number(p.high95)}",
                show.number(campaign.truth[p.name]),
                "inside" if holds[p.name] else "outside",
            )
            for p in campaign.identification.parameters
            if p.name in holds
        ]
        tables.append(
            show.Table(
                f"{campaign.configuration}: identified and true parameters (masses: dry {dry_kg:g} kg, and added)",
                ("parameter", "identified", "95 % interval", "true", "truth is"),
                rows,
                numbers=("identified", "95 % interval", "true"),
            )
        )
    return tables


def tracking_table(modes: Sequence[str], rows: Sequence[Row]) -> Table:
    """(b) Mean absolute tracking errors, laid out like the paper's Table 5, one column per mode."""
    columns = ("motion", "phase", *modes, "paper")
    lines = []
    for row in rows:
        paper = TABLE_5.get((row.axis, row.phase))
        lines.append(
            (
                f"{MOTIONS.get(row.axis, row.axis)}, {row.unit}" if row.phase == "Acceleration" else "",
                row.phase,
                *(f"{value:.4f}" for value in row.values),
                f"{paper:.4f}" if paper else "-",
            )
        )
    return show.Table(
        "mean absolute tracking error, configuration hovering (paper: both)",
        columns,
        lines,
        numbers=columns[2:],
    )


def write_page(path: Path, done: Demo, errors: Mapping[str, TrackingErrors]) -> Path:
    """(c) The report."""
    paper = Reference("paper, both", "Vangi et al., Table 5, configuration hovering", TABLE_5)
    sections = [tracking_section(errors, done.runs, paper)]
    for campaign in done.campaigns:
        shape = done.file.vehicle.configurations[campaign.configuration]
        sections.append(identification_section(campaign.identification, campaign.truth, shape))
        sections.append(innovations_section(campaign.identification.innovations, campaign.dive.name))
        sections.append(dive_section(campaign.dive, done.file.vehicle.water))
    report = Report(
        "One dive, end to end",
        f"simulated vehicle {done.file.vehicle.name}: two campaigns identified, uploaded, dived again",
        f"{counted(done)} true parameters lie in their 95 % intervals. {done.receipt.sentence}",
        tuple(sections),
    )
    dives = [*(campaign.dive for campaign in done.campaigns), *done.runs.values()]
    return write_report(path, with_provenance(report, dives, done.file, {}))


def fly(root: Path, seed: int, unix_s: float, tell: Tell) -> Demo:
    """Run the demo; recordings, identifications, uploaded parameters and receipt go into the new folder `root`."""
    file = load_vehicle(VEHICLE)
    campaigns = _campaigns(root, seed, unix_s, tell)
    tell(CAMPAIGN_SHARE, "upload with read-back")
    store = root / "vehicle-parameters.json"
    for result in campaigns:
        show.write_json(result.identification.to_json(), str(root / f"{result.configuration}.json"))
        write_identified(root / f"{result.configuration}.param", result.identification.to_json(), file)
    receipt = _upload(file, campaigns, root, seed, store, unix_s)
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
    folder = simulated.record_dive(
        file,
        configuration,
        mission,
        root,
        seed=seed,
        unix_s=unix_s,
        mode=Mode.OFF,
        progress=lambda share: progress(DIVE_SHARE * share),
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
    file: VehicleFile, campaigns: tuple[Campaign, ...], root: Path, seed: int, store: Path, unix_s: float
) -> Receipt:
    """Upload both parameter sets in one plan, through the real client, into the vehicle's store."""
    targets: dict[str, float] = {}
    for result in campaigns:
        veh_cfg = file.vehicle.veh_cfg(result.configuration)
        targets |= parameters_from_identification(result.identification.to_json(), veh_cfg)
    link, clock = simulated.afloat(file, CAMPAIGNS[0], seed, parameters_of(file, store), unix_s)
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
        unix_s=unix_s,
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


def counted(demo: Demo) -> str:
    """How many truths lie in their 95 % intervals: `21 of 22`."""
    holds = [held for campaign in demo.campaigns for held in inside(campaign).values()]
    return f"{sum(holds)} of {len(holds)}"


def to_json(demo: Demo, rows: Any) -> dict[str, Any]:
    return {
        "identified": {c.configuration: c.identification.to_json() for c in demo.campaigns},
        "truth": {c.configuration: dict(c.truth) for c in demo.campaigns},
        "inside": {c.configuration: inside(c) for c in demo.campaigns},
        "receipt": demo.receipt.to_json(),
        "modes": list(demo.runs),
        "tracking": [vars(row) for row in rows],
    }
