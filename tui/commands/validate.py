"""`seatrial validate`: tracking errors of dives, by feed-forward mode."""

import argparse
import math
from collections.abc import Sequence
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tui import exit_codes
from tui.pages import add_figures

if TYPE_CHECKING:
    from bridge.vehicle.config import Vector3, VehicleFile
    from identify.dive import Dive
    from identify.glance.criteria import Raising
    from identify.validate import Row, TrackingErrors
    from tui.show import Table

EXAMPLE = "seatrial validate dives/pid dives/both --vehicle ruvifist"

MODES = ("PID", "shadow", "FF", "both")
"""Labels by FF_MODE."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("dives", nargs="+", metavar="DIVE", help="a dive folder or a recording; one a mode")
    parser.add_argument(
        "--vehicle", required=True, metavar="FILE", help="the vehicle file: where its DVL sits"
    )
    parser.add_argument("--columns", metavar="MAP", help="YAML map from the columns of a CSV to signals")
    parser.add_argument("--json", metavar="FILE", help="write the errors as JSON; - for standard output")
    parser.add_argument("--report", metavar="HTML", help="write a page with the errors and the curves")
    add_figures(parser)


def run(arguments: argparse.Namespace) -> int:
    from bridge.ring.made_since import AFTERWARDS
    from bridge.vehicle.config import load_vehicle
    from identify.glance.criteria import in_one_mode
    from identify.ingest.messages import UNHEARD
    from identify.ingest.open import read_dive
    from identify.validate import METHOD, compare, tracking_errors
    from tui import pages, show
    from tui.files import Files, check_files
    from tui.recordings import column_map_for

    check_files({"--json": arguments.json, "--report": arguments.report})
    pages.check(arguments)
    file = load_vehicle(arguments.vehicle)
    columns = column_map_for(arguments.columns, arguments.dives)
    all_dives = in_order([read_dive(Path(path), columns, file) for path in arguments.dives])
    # Errors averaged over two modes would describe neither.
    dives = [in_one_mode(dive).dive for dive in all_dives]
    runs = dict(zip(labels(dives), dives, strict=True))
    dvl = file.vehicle.sensors.dvl
    lever_m = dvl.mounting.position_m if dvl else (0.0, 0.0, 0.0)
    errors = {label: tracking_errors(dive, lever_m) for label, dive in runs.items()}
    rows = [row for row in compare(runs, lever_m) if not all(map(math.isnan, row.values))]
    console = show.results(arguments.json)
    if rows:
        show.put(console, error_table(list(runs), rows))
        show.say(console, f"{METHOD}\n")
        if any(axis.speeds for tracking in errors.values() for axis in tracking.axes):
            show.put(console, speed_table(errors))
        show.put(console, _lags(errors))
    raised = {
        label: raising(dive, file) if _has_errors(errors[label]) else None
        for label, dive in zip(runs, all_dives, strict=True)
    }
    plain = [_plain(label, dive, errors[label], raised[label], lever_m) for label, dive in runs.items()]
    with Files() as files:
        files.json(plain, arguments.json)
        if pages.wanted(arguments):
            from identify.report.validation import validation_report

            page = partial(validation_report, file, runs, errors, raised, lever_m)
            pages.publish(files, arguments, page, dives, file)
        for label, dive in runs.items():
            # The errors cover only the data that these notes leave.
            for note in dive.notes:
                if dive.frozen or AFTERWARDS in note or note.startswith(UNHEARD):
                    show.say(console, f"note: {label}: {note}")
        for label, judged in raised.items():
            for line in raising_lines(label, judged) if judged is not None else ():
                show.say(console, line)
        for sentence in files.written:
            show.say(console, sentence)
        nothing = [label for label, tracking in errors.items() if not _has_errors(tracking)]
        for label in nothing:
            show.say(show.words(), f"{runs[label].name}: {_why_nothing(runs[label])}")
    return files.code(exit_codes.NO if nothing else exit_codes.DONE)


def raising(dive: "Dive", file: "VehicleFile") -> "Raising | None":
    """Judge whether the feed-forward may be raised; None if the dive or the vehicle file can't decide that."""
    from bridge.errors import ConfigError
    from identify.glance.raising import go_no_go

    try:
        configuration = file.configuration_of(dive.configuration_index())
    except ConfigError:
        return None
    return go_no_go(dive, file, configuration)


def raising_lines(label: str, judged: "Raising") -> list[str]:
    """Lines for a dive: go or no-go, then each criterion."""
    from identify.glance.criteria import MARKS

    return [
        f"{label}: {judged.sentence}",
        *(
            f"  {MARKS[criterion.passed]:<7} {criterion.what}: {criterion.words}"
            for criterion in judged.criteria
        ),
    ]


def error_table(runs: Sequence[str], rows: "Sequence[Row]") -> "Table":
    """Table of errors, one column per run."""
    from tui import show

    return show.table(
        "mean absolute tracking error",
        ("motion", "phase", *runs),
        [(f"{r.axis}, {r.unit}", r.phase, *(show.number(v, 3) for v in r.values)) for r in rows],
        numbers=runs,
    )


def speed_table(errors: "dict[str, TrackingErrors]") -> "Table":
    """Table of mean-speed errors by axis and commanded speed, one column per run."""
    from tui import show

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
    return show.table(
        "mean speed less the speed asked for, while it is held", columns, rows, numbers=columns[1:]
    )


def _signed(error: float | None) -> str:
    return "-" if error is None else f"{error:+.4f}"


def _has_errors(found: "TrackingErrors") -> bool:
    return any(math.isfinite(axis.overall) for axis in found.axes)


def _why_nothing(dive: "Dive") -> str:
    if dive.nu_ref is None:
        return "has no reference (NU_REF), so nothing to compare with; record the dive of a mission"
    if dive.velocity is None and dive.gyro is None and dive.fog is None:
        return "has neither velocity nor rates, so nothing to compare; record the DVL or a gyro"
    return (
        f"its reference (NU_REF) does not move in the {dive.duration_s:.1f} s recorded, so nothing to compare; "
        "record longer"
    )


def in_order(dives: "Sequence[Dive]") -> "list[Dive]":
    """Sort dives by the FF_MODE that is judged: PID, shadow, FF, both, then those without a known mode."""
    from identify.glance.criteria import in_one_mode

    modes = [in_one_mode(dive).mode for dive in dives]
    return [dives[n] for n in sorted(range(len(dives)), key=lambda n: _rank(modes[n]))]


def _rank(mode: int | None) -> int:
    return len(MODES) if mode is None else mode


def labels(dives: "Sequence[Dive]") -> list[str]:
    """Label of each dive in the table: its mode, with the dive's name if two dives share the mode."""
    modes = [_mode(dive) for dive in dives]
    named = [
        m if m and modes.count(m) == 1 else f"{dive.name} {m}".strip()
        for m, dive in zip(modes, dives, strict=True)
    ]
    return [name if named.index(name) == i else f"{name} ({i + 1})" for i, name in enumerate(named)]


def _mode_number(dive: "Dive") -> int | None:
    import numpy as np

    if dive.ff_mode is None or not len(dive.ff_mode):
        return None
    values, counts = np.unique(dive.ff_mode.value[:, 0], return_counts=True)
    return int(values[np.argmax(counts)])


def _mode(dive: "Dive") -> str:
    mode = _mode_number(dive)
    if mode is None:
        return ""
    return MODES[mode] if 0 <= mode < len(MODES) else f"mode {mode}"


def _lags(errors: "dict[str, TrackingErrors]") -> "Table":
    from tui import show

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
    return show.table(
        "delay behind the reference, and what the PID still does", columns, rows, numbers=columns[2:]
    )


def _with_unit(value: float, unit: str) -> str:
    from tui import show

    return f"{show.number(value, 3)} {unit}" if math.isfinite(value) else "-"


def _plain(
    label: str, dive: "Dive", found: "TrackingErrors", judged: "Raising | None", lever_m: "Vector3"
) -> dict[str, Any]:
    from identify.glance.following import followed

    return {
        "run": label,
        "mode": _mode(dive),
        "dive": found.dive,
        "axes": [asdict(axis) for axis in found.axes],
        "raising": judged.to_json() if judged is not None else None,
        "curves": [curve.to_json() for curve in followed(dive, lever_m)],
    }
