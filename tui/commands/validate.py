"""`seatrial validate`: tracking errors of dives, by feed-forward mode."""

import argparse
import math
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich.console import Console

from bridge import exit_codes
from bridge.exit_codes import UsageError
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.vehicle.mode import Mode
from gcs_plugin.params.last_accepted import model_in_force
from identify.dive import Dive, Kind, Signal
from identify.ingest.open import read_dive
from identify.run.validate import Validation, validate, verdict
from identify.validation.against_forecast import (
    Foretelling,
    Foretellings,
    began_for_receipts,
    ended_for_receipts,
    verdict_of,
)
from identify.validation.raising import BASELINE, MARKS, Raising
from identify.validation.tracking import (
    LEAST_SPEED,
    METHOD,
    TRACKED_DOFS,
    Row,
    TrackingErrors,
    measured_speed,
    whole_rows,
)
from identify.words import axes_named, speed
from tui import show
from tui.files import Files
from tui.parameter_files import foretelling_of, sidecar_of_file
from tui.recordings import column_map_for
from tui.show import Table
from tui.unsent_diagnosis import how_to_send, unsent

if TYPE_CHECKING:
    from identify.report.page import Report


def run(arguments: argparse.Namespace) -> int:
    file = load_vehicle(arguments.vehicle)
    columns = column_map_for(arguments.columns, arguments.dives)
    dives = [read_dive(Path(path), columns, file) for path in arguments.dives]
    refuse_repeated(dives)
    receipts = Path(arguments.receipts)
    foretold = foretellings(arguments.foretold, receipts, file)
    done = validate(dives, file, foretold, partial(send_first, receipts, file))
    console = show.results(arguments.json)
    with Files() as files:
        files.json(done.to_json(), arguments.json)
        # The page comes last because drawing takes long. It is written even if the reader of the tables has left.
        left: BrokenPipeError | None = None
        try:
            tell(console, done)
        except BrokenPipeError as error:
            left = error
        files.publish(arguments, lambda: page_of(done), [run.dive for run in done.runs], file)
        if left is not None:
            raise left
        for run in done.runs:
            # The errors cover only the data that these notes leave.
            for note in run.dive.notes:
                if run.dive.frozen or getattr(note, "kind", None) in (Kind.LACKING, Kind.UNHEARD):
                    show.say(console, f"note: {run.label}: {note}")
        for run in done.runs:
            if run.raising is not None:
                show.say(console, *criteria_lines(run.label, run.raising))
        show.say(console, *files.written)
        nothing = [run.dive for run in done.runs if not run.compared]
        show.say(show.words(), *(f"{dive.name}: {_why_nothing(dive)}" for dive in nothing))
    return files.code(exit_codes.NO if nothing else exit_codes.DONE)


def refuse_repeated(dives: Sequence[Dive]) -> None:
    """Raise UsageError for a dive that is given twice: it would be compared with itself."""
    first: dict[str, Dive] = {}
    for dive in dives:
        if (same := first.setdefault(dive.sha256, dive)) is not dive:
            raise UsageError(f"{dive.source}: the same recording as {same.source}; give it once")


def tell(console: Console, done: Validation) -> None:
    """Print which mode errs least, go or no-go of each dive, and the tables."""
    errors = {run.label: run.errors for run in done.runs}
    if any(run.compared for run in done.runs):
        show.say(console, verdict(errors))
    for run in done.runs:
        if run.held:
            show.say(console, f"{run.label}: {verdict_of(run.held)}")
        if run.raising is not None:
            show.say(console, f"{run.label}: {run.raising.sentence}")
        elif run.is_baseline:
            show.say(console, f"{run.label}: {BASELINE}")
    if whole := whole_table(errors):
        show.say(console, "")
        show.put(console, whole)
    if rows := done.rows():
        show.put(console, error_table(list(errors), rows))
        show.say(console, f"{METHOD}\n")
        if any(axis.speeds for tracking in errors.values() for axis in tracking.axes):
            show.put(console, speed_table(errors))
        show.put(console, _lags(errors))


def foretellings(given: str | None, receipts: Path, file: VehicleFile) -> Foretellings:
    """What each dive is compared with: the named file, or else the upload in `receipts` that was in force.

    Raises UsageError for a named file that is not there, foretells nothing, or is of another vehicle or configuration.
    """
    if given is None:
        return partial(_foretold_in_force, receipts, file)
    if not Path(given).exists():
        raise UsageError(f"--foretold {given}: no such file; check the name")
    sidecar = sidecar_of_file(Path(given))
    foretold = None if sidecar is None else foretelling_of(sidecar)
    if foretold is None:
        raise UsageError(
            f"--foretold {given}: foretells nothing; give the .param that diagnose --accept wrote, with its sidecar"
        )
    if foretold.vehicle != file.vehicle.name or file.configuration not in (None, foretold.configuration):
        raise UsageError(
            f"--foretold {given}: is of vehicle '{foretold.vehicle}', configuration '{foretold.configuration}', so it "
            f"foretells nothing of a dive with {file.path}; give that vehicle's own"
        )
    return lambda _dive, _mode, _configuration: foretold


def _foretold_in_force(
    receipts: Path, file: VehicleFile, dive: Dive, mode: Mode, configuration: str
) -> Foretelling | None:
    # A dive in shadow is judged by the model loaded at its end: that is the one the feed-forward would act by.
    at_utc = began_for_receipts(dive) if mode.applies_feedforward else ended_for_receipts(dive)
    model = model_in_force(receipts, file.vehicle.name, configuration, at_utc)
    return None if model is None else foretelling_of(model.sidecar)


def send_first(receipts: Path, file: VehicleFile, dive: Dive, configuration: str) -> str:
    """Advice before a diagnosis: upload accepted effects that were never sent; "" without such."""
    diagnosis = unsent(receipts, dive, file, configuration)
    return "" if diagnosis is None else how_to_send(*diagnosis)


def whole_table(errors: Mapping[str, TrackingErrors]) -> Table | None:
    """Every axis over the whole mission, in mm/s and deg/s, one column per run; None without any."""
    rows = [
        (row.axis, row.phase, *(_speed(value, row.axis) for value in row.values))
        for row in whole_rows(errors)
    ]
    if not rows:
        return None
    return show.Table(
        "rms over the whole mission of measured less wanted, every axis",
        ("axis", "part", *errors),
        rows,
        numbers=tuple(errors),
    )


def _speed(value: float, axis: str) -> str:
    return speed(value, "m/s" if DOFS.index(axis) < 3 else "rad/s") if math.isfinite(value) else "-"


def page_of(done: Validation) -> "Report":
    from identify.report.validation import validation_report  # loads matplotlib

    return validation_report(done)


def criteria_lines(label: str, judged: Raising) -> list[str]:
    """The criteria of a dive's go or no-go, a line for each."""
    return [
        f"{label}: what {'GO' if judged.go else 'NO-GO'} rests on",
        *(
            f"  {MARKS[criterion.passed]:<7} {criterion.quantity}: {criterion.words}"
            for criterion in judged.criteria
        ),
    ]


def error_table(runs: Sequence[str], rows: Sequence[Row]) -> Table:
    return show.Table(
        "mean absolute error by phase, while the axis is asked to move",
        ("motion", "phase", *runs),
        [(r.axis, r.phase, *(_speed(v, r.axis) for v in r.values)) for r in rows],
        numbers=runs,
    )


def speed_table(errors: dict[str, TrackingErrors]) -> Table:
    """Table of mean-speed errors by axis and commanded speed, one column per run."""
    axes = dict.fromkeys(axis.axis for tracking in errors.values() for axis in tracking.axes)
    held = {
        (axis.axis, at.speed, label): at.error
        for label, tracking in errors.items()
        for axis in tracking.axes
        for at in axis.speeds
    }
    rows = [
        (axis, _speed(at, axis), *(_speed(held.get((axis, at, label), math.nan), axis) for label in errors))
        for axis in axes
        for at in sorted({at for name, at, _ in held if name == axis})
    ]
    columns = ("axis", "speed held", *errors)
    return show.Table(
        "mean speed less the speed asked for, while it is held", columns, rows, numbers=columns[1:]
    )


def _why_nothing(dive: Dive) -> str:
    if dive.nu_ref is None:
        return "has no reference (NU_REF), so nothing to compare with; record the dive of a mission"
    if dive.velocity is None and dive.gyro is None and dive.fog is None:
        return "has neither velocity nor rates, so nothing to compare; record the DVL or a gyro"
    unmeasured = [dof for dof in TRACKED_DOFS if _moves(dive.nu_ref, dof) and not _is_measured(dive, dof)]
    if unmeasured:
        return (
            f"its reference (NU_REF) moves in {axes_named(unmeasured)}, where no speed is measured, so nothing to "
            "compare; record the DVL for surge and sway, a gyro for yaw"
        )
    return (
        f"its reference (NU_REF) does not move in the {dive.duration_s:.1f} s recorded, so nothing to compare; "
        "record longer"
    )


def _moves(reference: Signal, dof: int) -> bool:
    return bool((np.abs(reference.value[:, dof]) > LEAST_SPEED).any())


def _is_measured(dive: Dive, dof: int) -> bool:
    measured = measured_speed(dive, dof, (0.0, 0.0, 0.0))
    return measured is not None and bool(np.isfinite(measured.value).any())


def _lags(errors: dict[str, TrackingErrors]) -> Table:
    columns = ("axis", "dive", "delay, ms", "error in acceleration, delay removed", "mean |PID| when steady")
    rows = [
        (
            axis.axis,
            label,
            "-" if math.isnan(axis.delay_s) else f"{round(1000 * axis.delay_s)}",
            _speed(axis.acceleration_less_delay, axis.axis),
            f"{show.number(axis.pid_magnitude, 3)} {'N' if axis.unit == 'm/s' else 'N m'}"
            if math.isfinite(axis.pid_magnitude)
            else "-",
        )
        for label, tracking in errors.items()
        for axis in tracking.axes
    ]
    return show.Table(
        "delay behind the reference, and what the PID still does", columns, rows, numbers=columns[2:]
    )
