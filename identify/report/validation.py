"""Page of `seatrial validate`: how dives in several modes of the feed-forward followed their references."""

import math
from collections.abc import Mapping

import numpy as np

from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import Vector3
from identify.dive import Dive
from identify.glance.criteria import MARKS, Raising
from identify.report import tracking
from identify.report.figures import TIME_TITLE
from identify.report.page import Figure, Report, Section, Table
from identify.report.plot import STYLES, Group, Line, grouped, lines_panel, stack
from identify.run.validate import Validation
from identify.validate import AXES, LEAST_SPEED, PHASES, TrackingErrors
from identify.words import fixed

ALIKE = 0.05
"""Modes whose errors differ by a smaller share are called alike in a sentence."""


def validation_report(validation: Validation) -> Report:
    """Build the page. The verdict says which mode errs least, and by how much."""
    runs = validation.runs
    dives = {run.label: run.dive for run in runs}
    errors = {run.label: run.errors for run in runs}
    judged = {run.label: run.raising for run in runs}
    file, lever_m = validation.file, validation.lever_m
    moved = [dof for dof in AXES if any(run.axis(DOFS[dof]) for run in errors.values())]
    axes = [_axis(dof, dives, errors, lever_m) for dof in moved]
    sections = [_raising(judged), *axes, _criteria(judged), _notes(dives)]
    return Report(
        f"{file.vehicle.name}: how the reference was followed",
        "; ".join(f"{label}: {dive.name}" for label, dive in dives.items()),
        verdict(errors),
        tuple(section for section in sections if section is not None),
    )


def verdict(errors: Mapping[str, TrackingErrors]) -> str:
    """Which mode errs least, axis by axis, by its mean absolute error over all phases, and by how much."""
    axes_by_mode: dict[str, list[str]] = {}
    for dof in AXES:
        axis_errors = {
            label: axis for label, run in errors.items() if (axis := run.axis(DOFS[dof])) is not None
        }
        known = {label: axis.overall for label, axis in axis_errors.items() if math.isfinite(axis.overall)}
        if known:
            best = min(known, key=known.__getitem__)
            axes_by_mode.setdefault(best, []).append(
                f"in {DOFS[dof]} by {fixed(known[best], 4)} {axis_errors[best].unit} on average{_less(best, known)}"
            )
    if not axes_by_mode:
        return "No dive has a reference that moves and a measured speed beside it: nothing to compare."
    least = " least" if len(errors) > 1 else ""
    return " ".join(f"'{best}' errs{least}: {', '.join(axes)}." for best, axes in axes_by_mode.items())


def _less(best: str, errors: Mapping[str, float]) -> str:
    """How much less than the others, in brackets."""
    words = []
    for label, error in errors.items():
        share = 1 - errors[best] / error if error > 0 else 0.0
        if label != best:
            words.append(
                f"{fixed(100 * share, 0)} % less than '{label}'" if share >= ALIKE else f"like '{label}'"
            )
    return f" ({', '.join(words)})" if words else ""


def _raising(judged: Mapping[str, Raising | None]) -> Section | None:
    """Go or no-go for each dive."""
    judgements = tuple(
        (raising.go, f"{label}: {raising.sentence}")
        for label, raising in judged.items()
        if raising is not None
    )
    return Section("May the feed-forward be raised?", judged=judgements) if judgements else None


def _criteria(judged: Mapping[str, Raising | None]) -> Section | None:
    """Criteria of go or no-go, one per row, with a table for each dive."""
    tables = tuple(
        Table(
            ("Criterion", "Passed", "Figure and limit"),
            tuple(
                (criterion.what, MARKS[criterion.passed], criterion.words) for criterion in raised.criteria
            ),
            f"{label}: what was looked at.",
        )
        for label, raised in judged.items()
        if raised is not None
    )
    return Section("What go and no-go rest on", "", tables) if tables else None


def _axis(
    dof: int, dives: Mapping[str, Dive], errors: Mapping[str, TrackingErrors], lever_m: Vector3
) -> Section:
    """Section of an axis: errors side by side, then each dive's curves, then the numbers as in Table 5."""
    axis = DOFS[dof]
    of_axis = {label: run for label, run in errors.items() if run.axis(axis) is not None}
    curves = (tracking.curves(label, dive, lever_m).get(dof) for label, dive in dives.items())
    compared = _compared(dof, dives, lever_m) if len(of_axis) > 1 else None
    drawn = (_by_phase(axis, of_axis), compared, *curves)
    alone = {
        label: TrackingErrors(run.dive, tuple(run_axis for run_axis in run.axes if run_axis.axis == axis))
        for label, run in of_axis.items()
    }
    return Section(
        axis.capitalize(),
        "",
        tracking.error_tables(alone),
        tuple(figure for figure in drawn if figure is not None),
    )


def _by_phase(axis: str, errors: Mapping[str, TrackingErrors]) -> Figure:
    """Errors of Table 5 as bars: a group for each phase."""
    axis_errors = {label: run.axis(axis) for label, run in errors.items()}
    unit = next(axis_error.unit for axis_error in axis_errors.values() if axis_error)
    groups = [
        Group(label, tuple(axis_error.phase(phase) if axis_error else math.nan for phase in PHASES))
        for label, axis_error in axis_errors.items()
    ]
    return Figure(
        f"errors in {axis} by phase",
        f"Mean absolute tracking error in {axis} by phase of the motion, as Table 5 of the source paper has it.",
        stack([grouped(f"error in {axis}, {unit}", PHASES, groups)]),
    )


def _compared(dof: int, dives: Mapping[str, Dive], lever_m: Vector3) -> Figure | None:
    """Errors of all dives over one another, each from the start of its reference's motion."""
    lines = []
    for style, (label, dive) in enumerate(dives.items()):
        begun_s = _begun_s(dof, dive)
        line = tracking.error_line(dof, dive, lever_m, label, style % len(STYLES))
        if line is not None and begun_s is not None:
            x = line.x + dive.span_s[0] - begun_s
            lines.append(Line(x[x >= 0], line.y[x >= 0], label, line.style))
    if not lines:
        return None
    axis = DOFS[dof]
    title = f"error in {axis}, {'m/s' if dof < 3 else 'rad/s'}"
    return Figure(
        f"errors in {axis} of all dives",
        f"The error in {axis} of each dive, from where its reference first moves.",
        stack([lines_panel(title, TIME_TITLE, lines, holds=(0.0,), height_in=2.2)]),
    )


def _begun_s(dof: int, dive: Dive) -> float | None:
    """Boot time at which the reference of an axis first moves."""
    if dive.nu_ref is None:
        return None
    moving = np.flatnonzero(np.abs(dive.nu_ref.value[:, dof]) > LEAST_SPEED)
    return float(dive.nu_ref.time_s[moving[0]]) if len(moving) else None


def _notes(dives: Mapping[str, Dive]) -> Section | None:
    notes = [f"{label}: {note}" for label, dive in dives.items() for note in dive.notes]
    return Section("Notes of the recordings", "\n\n".join(notes)) if notes else None
