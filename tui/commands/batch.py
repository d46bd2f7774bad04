"""`seatrial batch`: identify many dives, tabulate their parameters, and show how these drift."""

import argparse
import math
import sys
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from bridge import exit_codes
from bridge.command_line import size

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from bridge.clock import Clock
    from bridge.vehicle.config import VehicleFile
    from identify.batch.drift import Drift
    from identify.batch.recordings import Found
    from identify.batch.rows import Row
    from identify.batch.run import Engine, Standing
    from tui.show import Tell

EXAMPLE = "seatrial batch dives --vehicle ruvifist --out batch --csv dives.csv"

PAGE, KEPT = "trends.html", "results.jsonl"
PAPER = "bench.reproduce.paper"
"""Module of the source paper's method, offered as `paper`."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "dives",
        nargs="+",
        metavar="DIVES",
        help="recordings, dive folders, folders of them, or quoted patterns such as 'dives/2026-*'",
    )
    parser.add_argument(
        "--vehicle",
        required=True,
        metavar="FILE[:CONFIGURATION]",
        help="the vehicle file of all dives; each dive's VEH_CFG chooses the configuration where none is named",
    )
    parser.add_argument("--method", default="likelihood", help="one of identify's (default: likelihood)")
    parser.add_argument(
        "--scheduler",
        metavar="ADDRESS",
        help="of a Dask cluster, as tcp://10.0.0.5:8786 (default: this computer's cores)",
    )
    parser.add_argument("--processes", type=size, metavar="N", help="on this computer (default: one a core)")
    parser.add_argument(
        "--out",
        default="batch",
        metavar="FOLDER",
        help=f"takes the page {PAGE}, and {KEPT} from which a batch that was stopped goes on (default: batch)",
    )
    parser.add_argument("--columns", metavar="MAP", help="YAML map from the columns of a CSV to signals")
    parser.add_argument("--json", metavar="FILE", help="write all as JSON; - for standard output")
    parser.add_argument("--csv", metavar="FILE", help="write the table as CSV; - for standard output")


def run(arguments: argparse.Namespace) -> int:
    from bridge.clock import SystemClock
    from bridge.vehicle.config import load_vehicle
    from identify.batch.jobs import IDENTIFY, column_file, job_for
    from identify.batch.recordings import find_recordings
    from identify.batch.rows import rows_of
    from identify.batch.run import Cache, run_batch
    from tui import show

    check(arguments)
    file = load_vehicle(arguments.vehicle)
    columns = column_file(arguments.columns)
    with show.progress("find the recordings") as tell:
        recordings_found = find_recordings(arguments.dives, tell)
    cache = Cache(Path(arguments.out) / KEPT)

    method = PAPER if arguments.method == "paper" else arguments.method
    try:
        jobs = [
            job_for(IDENTIFY, recording, file, method, columns) for recording in recordings_found.recordings
        ]
        with show.progress(f"identify {len(jobs)} dives") as tell:
            results = run_batch(jobs, cache, engine(arguments), teller(tell, SystemClock()))
    except KeyboardInterrupt:
        show.say(show.words(), f"what is done is kept in {cache.path}; the same command goes on from there")
        raise
    finally:
        cache.close()
    rows = rows_of([*results, *recordings_found.unreadable])
    return finish(arguments, file, recordings_found, rows)


def check(arguments: argparse.Namespace) -> None:
    """Raise UsageError for contradicting options, and for outputs that can't be written."""
    from bridge.command_line import check_folder
    from identify.estimators.table import METHODS
    from tui.files import check_files
    from tui.show import STANDARD_OUTPUT

    if arguments.method not in (*METHODS, "paper"):
        raise exit_codes.UsageError(
            f"--method {arguments.method}: no such method; give one of {', '.join(METHODS)}, paper"
        )
    if arguments.scheduler and arguments.processes:
        raise exit_codes.UsageError("--processes is for this computer; leave it out with --scheduler")
    if arguments.json == STANDARD_OUTPUT == arguments.csv:
        raise exit_codes.UsageError("--json - and --csv - would mix on standard output; give one a file")
    check_files({"--json": arguments.json, "--csv": arguments.csv})
    check_folder("--out", arguments.out)


def engine(arguments: argparse.Namespace) -> "Engine":
    """Return the engine: this computer's cores, or a cluster; Dask is imported only for a cluster."""
    if arguments.scheduler:
        from bridge.links.addresses import of_link
        from bridge.text import say
        from identify.batch.cluster import run_on_cluster

        for sentence in of_link(f"tcp:{arguments.scheduler.partition('://')[2]}", "the scheduler"):
            say(sentence)
        return lambda jobs: run_on_cluster(jobs, arguments.scheduler)
    from identify.batch.run import cores, run_here

    return lambda jobs: run_here(jobs, arguments.processes or cores())


def teller(tell: "Tell", clock: "Clock") -> "Callable[[Standing], None]":
    """Return a callback that shows the batch's progress: dives done, dives failed, time left."""
    started_s = clock.boot_s()

    def told(standing: "Standing") -> None:
        words = f"{standing.kept + standing.done} of {standing.total} dives"
        if standing.kept:
            words += f", {standing.kept} known before"
        words += f", {standing.failed} failed"
        left_s = standing.time_left_s(clock.boot_s() - started_s)
        tell(standing.share, words if left_s is None else f"{words}, {duration(left_s)} left")

    return told


def duration(seconds: float) -> str:
    """Format a duration: `40 s`, `12 min`, `3 h 5 min`."""
    if seconds < 60:
        return f"{seconds:.0f} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"


def finish(
    arguments: argparse.Namespace, file: "VehicleFile", recordings: "Found", rows: "Sequence[Row]"
) -> int:
    """Show and write the results of the batch, and return the exit code."""
    from identify.batch.drift import drift_of
    from identify.batch.page import batch_report
    from identify.batch.rows import by_configuration, to_json
    from identify.report.page import Read, with_provenance, write_report
    from tui import pages, show
    from tui.answers import drifts_to_json
    from tui.files import Files

    drifts = {name: drift_of(group) for name, group in by_configuration(rows).items()}
    tell(arguments, recordings, rows, drifts)
    twins = [(str(twin.path), twin.why, str(twin.counted)) for twin in recordings.twins]
    with Files() as files:
        files.attempt(partial(write_csv, rows, arguments.csv))
        files.json(
            {
                "vehicle": {"name": file.vehicle.name, "sha256": file.sha256},
                "method": arguments.method,
                "dives": [to_json(row) for row in rows],
                "counted_once": [
                    {"recording": path, "why": why, "same_as": counted} for path, why, counted in twins
                ],
                "trends": drifts_to_json(drifts),
            },
            arguments.json,
        )
        page = Path(arguments.out) / PAGE
        report = batch_report(file.vehicle.name, arguments.method, rows, twins, drifts)
        read = [
            Read(
                row.dive, Path(row.source), row.sha256, math.nan if row.duration_s is None else row.duration_s
            )
            for row in rows
            if row.sha256
        ]
        page_report = with_provenance(report, read, file, pages.settings(arguments))
        if files.attempt(partial(write_report, page, page_report)):
            show.say(show.words(), f"trends: {page}")
    identified = sum(bool(row.values) for row in rows)
    if identified == len(rows):
        return files.code(exit_codes.DONE)
    return files.code(exit_codes.PARTLY if identified else exit_codes.NO)


def tell(
    arguments: argparse.Namespace, recordings: "Found", rows: "Sequence[Row]", drifts: "Mapping[str, Drift]"
) -> None:
    """Print the tables and sentences to the terminal."""
    from identify.batch.rows import by_configuration
    from tui import show
    from tui.answers import dive_table, parameter_tables, trend_table

    taken = show.STANDARD_OUTPUT in (arguments.json, arguments.csv)
    console = show.results(show.STANDARD_OUTPUT if taken else None)
    show.put(console, dive_table(rows))
    for configuration, group in by_configuration(rows).items():
        drift = drifts[configuration]
        for table in parameter_tables(rows, group, drift, configuration):
            show.put(console, table)
        if drift.trends:
            show.put(console, trend_table(drift, configuration))
        show.say(console, f"{configuration}: {drift.sentence}")
    for twin in recordings.twins:
        show.say(console, f"counted once: {twin.path} {twin.why} {twin.counted}")


def write_csv(rows: "Sequence[Row]", target: str | None) -> None:
    """Write the table to a file, or to standard output for `-`. Raises LogError if it can't be written."""
    from bridge.errors import LogError
    from identify.batch.rows import to_csv
    from tui.show import STANDARD_OUTPUT, harmless, replace_file

    if target == STANDARD_OUTPUT:
        sys.stdout.write(harmless(to_csv(rows)))
    elif target is not None:
        try:
            replace_file(Path(target), to_csv(rows))
        except OSError as error:
            raise LogError(
                f"{target}: the CSV can't be written ({error.strerror}); give another file"
            ) from None
