"""`seatrial demo`: one dive, end to end, on the simulated vehicle."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from bench.reproduce.published import TABLE_5
from bridge import exit_codes
from bridge.command_line import seed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from identify.validate import Row
    from tui.demo import Demo
    from tui.show import Table

EXAMPLE = "seatrial demo --seed 3 --out demo"

MOTIONS = {"surge": "Surge motion", "sway": "Sway motion", "yaw": "Yaw motion"}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--seed", type=seed, default=1, help="of noise and disturbance (default: 1)")
    parser.add_argument(
        "--out", default="demo", metavar="FOLDER", help="takes a folder for this run (default: demo)"
    )
    parser.add_argument("--json", metavar="FILE", help="write the result as JSON; - for standard output")


def run(arguments: argparse.Namespace) -> int:
    from bridge.clock import SystemClock
    from bridge.command_line import check_folder
    from gcs_plugin.dives.folder import new_folder
    from identify.validate import METHOD, compare
    from tui import demo, show
    from tui.files import check_file

    check_file("--json", arguments.json)
    check_folder("--out", arguments.out)
    clock = SystemClock()
    folder = new_folder(Path(arguments.out), clock.unix_s(), f"seed-{arguments.seed}").path
    with show.progress("demo") as tell:
        done = demo.run(folder, arguments.seed, clock.unix_s(), tell)
        rows = compare(done.runs)
        page = write_page(folder / "report.html", done)
    console = show.results(arguments.json)
    for shown in identified_tables(done):
        show.put(console, shown)
    inside = [held for campaign in done.campaigns for held in demo.inside(campaign).values()]
    show.say(console, f"{sum(inside)} of {len(inside)} truths lie in their 95 % intervals.\n")
    show.say(console, f"upload: {done.receipt.sentence}\n")
    show.put(console, tracking_table(list(done.runs), rows))
    show.say(console, f"{METHOD}\n")
    show.say(console, f"report: {page}")
    show.say(console, f"recordings, results and receipt: {folder}")
    show.say(console, f"took {clock.boot_s():.0f} s")
    result = demo.to_json(done, rows) | {"report": str(page), "folder": str(folder)}
    show.write_json(result, str(folder / "result.json"))
    show.write_json(result, arguments.json)
    return exit_codes.DONE if done.receipt.good else exit_codes.NO


def identified_tables(done: "Demo") -> "list[Table]":
    """(a) Identified against true parameters of the simulated vehicle, one table per configuration."""
    from tui import demo, show

    tables = []
    for campaign in done.campaigns:
        holds = demo.inside(campaign)
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
            show.table(
                f"{campaign.configuration}: identified and true parameters (masses: dry {dry_kg:g} kg, and added)",
                ("parameter", "identified", "95 % interval", "true", "truth is"),
                rows,
                numbers=("identified", "95 % interval", "true"),
            )
        )
    return tables


def tracking_table(modes: "Sequence[str]", rows: "Sequence[Row]") -> "Table":
    """(b) Mean absolute tracking errors, laid out like the paper's Table 5, one column per mode."""
    from tui import show

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
    return show.table(
        "mean absolute tracking error, configuration hovering (paper: both)",
        columns,
        lines,
        numbers=columns[2:],
    )


def write_page(path: Path, done: "Demo") -> Path:
    """(c) The report."""
    from identify.report.identification import dive_section, identification_section, innovations_section
    from identify.report.page import Report, with_provenance, write_report
    from identify.report.validation import Reference, tracking_section
    from identify.validate import tracking_errors
    from tui import demo

    inside = [held for campaign in done.campaigns for held in demo.inside(campaign).values()]
    errors = {mode: tracking_errors(dive) for mode, dive in done.runs.items()}
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
        f"{sum(inside)} of {len(inside)} true parameters lie in their 95 % intervals. {done.receipt.sentence}",
        tuple(sections),
    )
    dives = [*(campaign.dive for campaign in done.campaigns), *done.runs.values()]
    return write_report(path, with_provenance(report, dives, done.file, {}))
