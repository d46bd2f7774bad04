"""`seatrial validate`: tracking errors of dives, by feed-forward mode."""

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from bridge import exit_codes
from bridge.vehicle.config import load_vehicle
from identify.dive import Dive, Kind
from identify.glance.raising import MARKS, Raising
from identify.ingest.open import read_dive
from identify.run.validate import Validation, validate
from identify.validate import METHOD, Row, TrackingErrors
from tui import pages, show
from tui.files import Files
from tui.recordings import column_map_for
from tui.show import Table

if TYPE_CHECKING:
    from identify.report.page import Report


def run(arguments: argparse.Namespace) -> int:
    file = load_vehicle(arguments.vehicle)
    columns = column_map_for(arguments.columns, arguments.dives)
    done = validate([read_dive(Path(path), columns, file) for path in arguments.dives], file)
    console = show.results(arguments.json)
    errors = {run.label: run.errors for run in done.runs}
    if rows := done.rows():
        show.put(console, error_table(list(errors), rows))
        show.say(console, f"{METHOD}\n")
        if any(axis.speeds for tracking in errors.values() for axis in tracking.axes):
            show.put(console, speed_table(errors))
        show.put(console, _lags(errors))
    with Files() as files:
        files.json(done.to_json(), arguments.json)
        pages.publish(files, arguments, lambda: page_of(done), [run.dive for run in done.runs], file)
        for run in done.runs:
            # The errors cover only the data that these notes leave.
            for note in run.dive.notes:
                if run.dive.frozen or getattr(note, "kind", None) in (Kind.LACKING, Kind.UNHEARD):
                    show.say(console, f"note: {run.label}: {note}")
        for run in done.runs:
            if run.raising is not None:
                show.say(console, *raising_lines(run.label, run.raising))
        show.say(console, *files.written)
        nothing = [run.dive for run in done.runs if not run.compared]
        show.say(show.words(), *(f"{dive.name}: {_why_nothing(dive)}" for dive in nothing))
    return files.code(exit_codes.NO if nothing else exit_codes.DONE)


def page_of(done: Validation) -> "Report":
    """Return the report of the errors."""
    from identify.report.validation import validation_report  # loads matplotlib

    return validation_report(done)


def raising_lines(label: str, judged: Raising) -> list[str]:
    """Lines for a dive: go or no-go, then each criterion."""
    return [
        f"{label}: {judged.sentence}",
        *(
            f"  {MARKS[criterion.passed]:<7} {criterion.what}: {criterion.words}"
            for criterion in judged.criteria
        ),
    ]


def error_table(runs: Sequence[str], rows: Sequence[Row]) -> Table:
    """Table of errors, one column per run."""
    return show.Table(
        "mean absolute tracking error",
        ("motion", "phase", *runs),
        [(f"{r.axis}, {r.unit}", r.phase, *(show.number(v, 3) for v in r.values)) for r in rows],
        numbers=runs,
    )


def speed_table(errors: dict[str, TrackingErrors]) -> Table:
    """Table of mean-speed errors by axis and commanded speed, one column per run."""
    units = {axis.axis: axis.unit for tracking in errors.values() for axis in tracking.axes}
    held = {
        (axis.axis, at.speed, label): at.error
        for label, tracking in errors.items()
        for axis in tracking.axes
        for at in axis.speeds
    }
    rows = [
        (f"{axis}, {unit}", f"{speed:.2f}", *(_signed(held.get((axis, speed, label))) for label in errors))
        for axis, unit in units.items()
        for speed in sorted({speed for name, speed, _ in held if name == axis})
    ]
    columns = ("axis", "speed held", *errors)
    return show.Table(
        "mean speed less the speed asked for, while it is held", columns, rows, numbers=columns[1:]
    )


def _signed(error: float | None) -> str:
    return "-" if error is None else f"{error:+.4f}"


def _why_nothing(dive: Dive) -> str:
    if dive.nu_ref is None:
        return "has no reference (NU_REF), so nothing to compare with; record the dive of a mission"
    if dive.velocity is None and dive.gyro is None and dive.fog is None:
        return "has neither velocity nor rates, so nothing to compare; record the DVL or a gyro"
    return (
        f"its reference (NU_REF) does not move in the {dive.duration_s:.1f} s recorded, so nothing to compare; "
        "record longer"
    )


def _lags(errors: dict[str, TrackingErrors]) -> Table:
    columns = ("axis", "dive", "delay, ms", "acceleration less delay", "mean |PID| when steady")
    rows = [
        (
            axis.axis,
            label,
            "-" if math.isnan(axis.delay_s) else f"{round(1000 * axis.delay_s)}",
            _with_unit(axis.acceleration_less_delay, axis.unit),
            _with_unit(axis.pid_magnitude, "N" if axis.unit == "m/s" else "N m"),
        )
        for label, tracking in errors.items()
        for axis in tracking.axes
    ]
    return show.Table(
        "delay behind the reference, and what the PID still does", columns, rows, numbers=columns[2:]
    )


def _with_unit(value: float, unit: str) -> str:
    return f"{show.number(value, 3)} {unit}" if math.isfinite(value) else "-"
