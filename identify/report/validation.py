"""Page of `seatrial validate`, and its parts: how a vehicle followed its reference, mode by mode.

Errors are laid out as in Table 5 of the source paper, curves as in its Figs 10 to 17.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from operator import attrgetter

import numpy as np

from bridge.arrays import Vector3
from bridge.vehicle.coefficients import DOFS
from identify.align import low_pass
from identify.dive import Dive, Signal
from identify.report import cells
from identify.report.cells import Cell
from identify.report.figures import TIME_TITLE, error_unit, known_at, signal_line, time_panel
from identify.report.page import Figure, Report, Section, Table
from identify.report.plot import REFERENCE, Group, Line, Panel, grouped, lines_panel, stack
from identify.report.traces import MODES, Traces
from identify.run.validate import Run, Validation, verdict
from identify.validation.against_forecast import verdict_of
from identify.validation.raising import BASELINE, MARKS, Raising
from identify.validation.tracking import (
    CUTOFF_HZ,
    LEAST_SPEED,
    METHOD,
    PHASES,
    SETTLED_S,
    TRACKED_DOFS,
    AxisErrors,
    SteadyError,
    TrackingErrors,
    measured_speed,
    whole_rows,
)
from identify.words import MISSING, fixed

TITLES = {
    0: ("surge speed u, m/s", "surge force X, N"),
    1: ("sway speed v, m/s", "sway force Y, N"),
    5: ("yaw rate r, rad/s", "yaw moment N, N m"),
}

DECIMALS = {"mm/s": 1, "deg/s": 2}

LEAST_SAMPLES = 20
"""With fewer samples, no error curve is drawn."""

STEP_S = 0.1
"""Between instants of the curves on the page."""

AROUND_S = 3.0
"""Shown before the reference moves, and after."""


@dataclass(frozen=True)
class Reference:
    """Published errors of others, by axis and phase, m/s or rad/s.

    `label` heads their column, `source` says where they come from: `Vangi et al., Table 5`.
    """

    label: str
    source: str
    values: Mapping[tuple[str, str], float]


def validation_report(validation: Validation) -> Report:
    """Build the page. The verdict says GO or NO-GO, whether it came as foretold, which mode errs least, by how much."""
    runs = validation.runs
    dives = {run.label: run.dive for run in runs}
    errors = {run.label: run.errors for run in runs}
    judged = {run.label: run.raising for run in runs if run.raising is not None}
    file, lever_m = validation.file, validation.lever_m
    axes = [_axis(dof, dives, errors, lever_m) for dof in _moved(errors)]
    judgements = tuple((raising.go, f"{label}: {raising.sentence}") for label, raising in judged.items())
    said = [f"{run.label}: {' '.join(words)}" for run in runs if (words := _said_first(run))]
    baselines = "\n\n".join(f"{run.label}: {BASELINE}" for run in runs if run.is_baseline)
    notes = "\n\n".join(f"{label}: {note}" for label, dive in dives.items() for note in dive.notes)
    sections = (
        Section("May the feed-forward be raised?", baselines, judged=judgements)
        if judgements or baselines
        else None,
        _whole(errors),
        *axes,
        _criteria(judged),
        Section("Notes of the recordings", notes) if notes else None,
    )
    return Report(
        f"{file.vehicle.name}: how the reference was followed",
        "; ".join(f"{label}: {dive.name}" for label, dive in dives.items()),
        " ".join((*said, verdict(errors))),
        tuple(section for section in sections if section is not None),
    )


def _said_first(run: Run) -> tuple[str, ...]:
    """GO or NO-GO of a run, and whether it came as foretold, as far as either is known."""
    goes = () if run.raising is None else ("GO." if run.raising.go else "NO-GO.",)
    return (*goes, verdict_of(run.held)) if run.held else goes


def _whole(errors: Mapping[str, TrackingErrors]) -> Section | None:
    rows = [
        (f"{row.axis.capitalize()}, {row.phase}", *(cells.speed(value, row.unit) for value in row.values))
        for row in whole_rows(errors)
    ]
    caption = (
        "Measured less wanted velocity, rms, of every axis, asked to move or not; 'while others move' is "
        f"of an axis that has rested for {SETTLED_S:g} s. {METHOD}"
    )
    table = Table(("Axis", *errors), tuple(rows), caption)
    return Section("Every axis, over the whole mission", "", (table,)) if rows else None


def _moved(errors: Mapping[str, TrackingErrors]) -> list[int]:
    return [dof for dof in TRACKED_DOFS if any(run.axis(DOFS[dof]) for run in errors.values())]


def _criteria(judged: Mapping[str, Raising]) -> Section | None:
    tables = tuple(
        Table(
            ("Criterion", "Passed", "Figure and limit"),
            tuple(
                (criterion.quantity, MARKS[criterion.passed], criterion.words)
                for criterion in raised.criteria
            ),
            f"{label}: what was looked at.",
        )
        for label, raised in judged.items()
    )
    return Section("What go and no-go rest on", "", tables) if tables else None


def _axis(
    dof: int, dives: Mapping[str, Dive], errors: Mapping[str, TrackingErrors], lever_m: Vector3
) -> Section:
    """Section of an axis: errors side by side, then each dive's curves, then the numbers as in Table 5."""
    axis = DOFS[dof]
    of_axis = {label: run for label, run in errors.items() if run.axis(axis) is not None}
    compared = _compared(dof, dives, lever_m) if len(of_axis) > 1 else None
    curves = tuple(_curves(dof, label, dive, lever_m) for label, dive in dives.items())
    return Section(
        axis.capitalize(),
        "",
        _error_tables(of_axis, [dof]),
        (_by_phase(axis, of_axis),),
        traces=_overlaid(dof, dives, lever_m),
        filed=tuple(figure for figure in (compared, *curves) if figure is not None),
    )


def _overlaid(dof: int, dives: Mapping[str, Dive], lever_m: Vector3) -> tuple[Traces, ...]:
    """All dives overlaid on a common scale, each from the first motion of its reference; nothing for an axis without
    any, and no panel of what is zero throughout, as the feed-forward of a baseline."""
    moving_s = {label: span_s for label, dive in dives.items() if (span_s := _moving_s(dof, dive))}
    if not moving_s:
        return ()
    begun_s = {label: first_s - AROUND_S for label, (first_s, _) in moving_s.items()}
    longest_s = max(last_s - first_s for first_s, last_s in moving_s.values())
    time_s = np.arange(0.0, longest_s + 2 * AROUND_S, STEP_S)
    scale, shown = error_unit(dof)
    push, wrench = ("force", "N") if dof < 3 else ("moment", "N m")
    nothing = np.full(len(time_s), np.nan)
    speeds, errors, pid, fed = [], [], [], []
    for label, at_s in begun_s.items():
        dive, line = dives[label], error_line(dof, dives[label], lever_m)
        speeds.append(scale * known_at(measured_speed(dive, dof, lever_m), 0, at_s + time_s))
        within_s = at_s - dive.span_s[0] + time_s
        errors.append(
            nothing if line is None else scale * np.interp(within_s, line.x, line.y, np.nan, np.nan)
        )
        pid.append(known_at(dive.tau_pid, dof, at_s + time_s))
        fed.append(known_at(dive.tau_ff, dof, at_s + time_s))
    first, first_s = next(iter(begun_s.items()))
    reference = scale * known_at(dives[first].nu_ref, dof, first_s + time_s)
    panels = (
        (f"speed, {shown}", np.array([*speeds, reference])),
        (f"error, {shown}", np.array([*errors, nothing])),
        (f"{push} of the PID, {wrench}", np.array([*pid, nothing])),
        (f"{push} of the feed-forward, {wrench}", np.array([*fed, nothing])),
    )
    caption = (
        f"Each dive from {AROUND_S:g} s before its reference moves; the reference is that of {first}, errors are below "
        f"{CUTOFF_HZ:g} Hz. The buttons stretch time and height; stretched time can be moved sideways."
    )
    modes = (MODES[k % len(MODES)] for k in range(len(begun_s)))
    return (
        Traces(
            f"{DOFS[dof]} of all dives",
            caption,
            (*begun_s, "reference"),
            time_s,
            np.zeros(len(time_s), dtype=np.intp),
            tuple((title, curves) for title, curves in panels if np.nan_to_num(curves).any()),
            (*modes, "reference"),
        ),
    )


def _by_phase(axis: str, errors: Mapping[str, TrackingErrors]) -> Figure:
    scale, shown = error_unit(DOFS.index(axis))
    groups = [
        Group(label, tuple(scale * of_axis.phase(phase) for phase in PHASES))
        for label, run in errors.items()
        if (of_axis := run.axis(axis))
    ]
    return Figure(
        f"errors in {axis} by phase",
        f"Mean absolute tracking error in {axis} by phase of the motion, as Table 5 of the source paper has it.",
        stack([grouped(f"error in {axis}, {shown}", PHASES, groups)]),
    )


def _error_title(dof: int) -> str:
    return f"error in {DOFS[dof]}, {'m/s' if dof < 3 else 'rad/s'}"


def _compared(dof: int, dives: Mapping[str, Dive], lever_m: Vector3) -> Figure | None:
    lines = []
    for style, (label, dive) in enumerate(dives.items()):
        moving_s = _moving_s(dof, dive)
        line = error_line(dof, dive, lever_m)
        if line is not None and moving_s is not None:
            x = line.x + dive.span_s[0] - moving_s[0]
            lines.append(Line(x[x >= 0], line.y[x >= 0], label, style % REFERENCE))
    if not lines:
        return None
    return Figure(
        f"errors in {DOFS[dof]} of all dives",
        f"The error in {DOFS[dof]} of each dive, from where its reference first moves.",
        stack([lines_panel(_error_title(dof), TIME_TITLE, lines, holds=(0.0,), height_in=2.2)]),
    )


def _moving_s(dof: int, dive: Dive) -> tuple[float, float] | None:
    """Boot times between which the reference of an axis moves."""
    if dive.nu_ref is None:
        return None
    moving = np.flatnonzero(np.abs(dive.nu_ref.value[:, dof]) > LEAST_SPEED)
    time_s = dive.nu_ref.time_s
    return (float(time_s[moving[0]]), float(time_s[moving[-1]])) if len(moving) else None


def _error_tables(
    errors: Mapping[str, TrackingErrors], moved: Sequence[int], paper: Reference | None = None
) -> tuple[Table, ...]:
    """Tables for each axis that any run moved along: errors by phase, then by held speed, the runs side by side."""
    by_phase = [_error_table(DOFS[dof], "N" if dof < 3 else "N m", errors, paper) for dof in moved]
    by_speed = [_speed_table(DOFS[dof], errors) for dof in moved]
    return (*by_phase, *(table for table in by_speed if table.rows))


def _error_table(
    axis: str, wrench_unit: str, errors: Mapping[str, TrackingErrors], paper: Reference | None
) -> Table:
    runs = [run.axis(axis) for run in errors.values()]
    scale, unit = error_unit(DOFS.index(axis))
    places = DECIMALS[unit]

    def row(
        name: str, decimals: int, value: Callable[[AxisErrors], float], factor: float = 1.0
    ) -> tuple[Cell, ...]:
        return name, *(MISSING if run is None else cells.fixed(factor * value(run), decimals) for run in runs)

    speeds: dict[str, Callable[[AxisErrors], float]] = {
        phase: partial(AxisErrors.phase, name=phase) for phase in PHASES
    }
    speeds["Acceleration, delay taken out"] = attrgetter("acceleration_less_delay")
    rows: tuple[tuple[Cell, ...], ...] = (
        *(row(f"{words}, {unit}", places, value, scale) for words, value in speeds.items()),
        row("Delay, ms", 0, lambda run: 1000 * run.delay_s),
        row(f"Steady |PID|, {wrench_unit}", 2, lambda run: run.pid_magnitude),
        row(f"Steady |PID − feed-forward|, {wrench_unit}", 2, lambda run: run.pid_minus_ff),
    )
    columns: tuple[str, ...] = (f"{axis.capitalize()} motion", *errors)
    caption = f"Mean absolute tracking error in {axis}, phase by phase. {METHOD}{_noise_said(errors, axis)}"
    if paper and any((axis, phase) in paper.values for phase in PHASES):
        published = [cells.fixed(scale * paper.values.get((axis, p), math.nan), places) for p in PHASES]
        published += [MISSING] * (len(rows) - len(published))
        rows = tuple((*ours, value) for ours, value in zip(rows, published, strict=True))
        columns = (*columns, paper.label)
        caption += f" {paper.label}: {paper.source}."
    return Table(columns, rows, caption)


def _noise_said(errors: Mapping[str, TrackingErrors], axis: str) -> str:
    scale, unit = error_unit(DOFS.index(axis))
    noises = {name: axis_errors.noise for name, run in errors.items() if (axis_errors := run.axis(axis))}
    said = [
        f"{name} {fixed(scale * noise, DECIMALS[unit])}"
        for name, noise in noises.items()
        if math.isfinite(noise)
    ]
    return f" Noise of the sensor that is left in it, {unit} rms: {', '.join(said)}." if said else ""


def _speed_table(axis: str, errors: Mapping[str, TrackingErrors]) -> Table:
    runs = [run.axis(axis) for run in errors.values()]
    scale, unit = error_unit(DOFS.index(axis))
    held = [{s.speed: s for s in run.speeds} if run else {} for run in runs]
    speeds = sorted({speed for of_run in held for speed in of_run})
    rows = [
        (
            cells.fixed(scale * speed, DECIMALS[unit] - 1),
            *(_with_error(of_run.get(speed), scale, DECIMALS[unit]) for of_run in held),
        )
        for speed in speeds
    ]
    caption = (
        f"How much faster (+) or slower (-) than asked the vehicle went on average in {axis} while it held a speed, "
        f"{unit}, ± one standard error of that mean over the runs at this speed, not half of a 95 % interval."
    )
    return Table((f"{axis.capitalize()} speed, {unit}", *errors), tuple(rows), caption)


def _with_error(at: SteadyError | None, scale: float, decimals: int) -> Cell:
    if at is None:
        return MISSING
    error = cells.fixed(scale * at.error, decimals, style=cells.Style.SIGNED)
    spread = cells.fixed(scale * at.standard_error, decimals)
    return error if spread == MISSING else cells.joined(cells.Form.SPREAD, error, spread)


def _curves(dof: int, mode: str, dive: Dive, lever_m: Vector3 = (0.0, 0.0, 0.0)) -> Figure | None:
    """Reference and measured speed, their error, PID and feed-forward; None for an axis that the reference rests in.

    `lever_m`: position of the DVL's transducer in body axes.
    """
    if dive.nu_ref is None or not (np.abs(dive.nu_ref.value[:, dof]) > LEAST_SPEED).any():
        return None
    return Figure(
        f"tracking {DOFS[dof]} {mode}",
        f"{mode}, {DOFS[dof]}: speed as asked for and as measured; the error, below {CUTOFF_HZ:g} Hz; wrench of PID "
        "and of feed-forward.",
        stack(_panels(dof, dive, dive.nu_ref, lever_m)),
    )


def _panels(dof: int, dive: Dive, reference: Signal, lever_m: Vector3) -> list[Panel]:
    speed, wrench = TITLES[dof]
    start_s, measured = dive.span_s[0], measured_speed(dive, dof, lever_m)
    speeds = [signal_line(reference, dof, start_s, "reference", REFERENCE)]
    if measured is not None:
        speeds.insert(0, signal_line(measured, 0, start_s, "measured"))
    sources = (("PID", 3, dive.tau_pid), ("feed-forward", 2, dive.tau_ff))
    wrenches = [
        signal_line(s, dof, start_s, word, style)
        for word, style, s in sources
        if s is not None and np.nan_to_num(s.value[:, dof]).any()
    ]
    panels = [time_panel(speed, dive, speeds)]
    if error := error_line(dof, dive, lever_m):
        panels.append(time_panel(_error_title(dof), dive, [error], 1.3))
    return [*panels, time_panel(wrench, dive, wrenches)] if wrenches else panels


def error_line(dof: int, dive: Dive, lever_m: Vector3) -> Line | None:
    """Measured minus reference speed below CUTOFF_HZ, over the time from the dive's start, NaN where either is silent;
    None if one is missing."""
    measured, reference = measured_speed(dive, dof, lever_m), dive.nu_ref
    if measured is None or reference is None:
        return None
    begun_s = max(measured.time_s[0], reference.time_s[0])
    ended_s = min(measured.time_s[-1], reference.time_s[-1])
    rate_hz = measured.rate_hz
    time_s = np.arange(begun_s, ended_s, 1.0 / rate_hz) if rate_hz else np.zeros(0)
    if len(time_s) < LEAST_SAMPLES or rate_hz <= 2 * CUTOFF_HZ:
        return None
    error = low_pass(measured.at(time_s)[:, 0] - reference.at(time_s)[:, dof], rate_hz, CUTOFF_HZ)
    known = np.isfinite(known_at(measured, 0, time_s)) & np.isfinite(known_at(reference, dof, time_s))
    return Line(time_s - dive.span_s[0], np.where(known, error, np.nan))


def tracking_section(
    errors: Mapping[str, TrackingErrors], dives: Mapping[str, Dive], paper: Reference | None = None
) -> Section:
    """How runs in different modes followed their references; both mappings are by the mode in words, in order.

    `paper`: published errors, as a further column.
    """
    drawn = tuple(
        figure
        for mode, dive in dives.items()
        for dof in TRACKED_DOFS
        if (figure := _curves(dof, mode, dive)) is not None
    )
    overlaid = tuple(trace for dof in TRACKED_DOFS for trace in _overlaid(dof, dives, (0.0, 0.0, 0.0)))
    words = (
        "The phases follow the reference: speeding up, steady, slowing down. Delay is how much later the measured "
        "speed looks most like the reference."
    )
    tables = _error_tables(errors, _moved(errors), paper)
    return Section("Tracking", words if tables else "", tables, traces=overlaid, filed=drawn)
