"""The page of `seatrial validate`: how dives flown in several modes of the feed-forward followed their references."""

import math
from collections.abc import Mapping

import numpy as np

from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import Vector3, VehicleFile
from identify.dive import Dive
from identify.glance.criteria import MARKS, Raising
from identify.report import tracking
from identify.report.figures import TIME_TITLE
from identify.report.grouped import Group, grouped
from identify.report.page import Figure, Report, Section, Table
from identify.report.plot import STYLES, Line, lines_panel, stack
from identify.report.text import fixed
from identify.validate import AXES, LEAST_SPEED, PHASES, TrackingErrors

ALIKE = 0.05
"""Modes whose errors differ by a smaller share are not told apart in a sentence."""


def validation_report(
    file: VehicleFile,
    dives: Mapping[str, Dive],
    errors: Mapping[str, TrackingErrors],
    judged: Mapping[str, Raising | None],
    lever_m: Vector3,
) -> Report:
    """The verdict: which mode errs least, by how much. All mappings are by what each dive is called, in order."""
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
    told: dict[str, list[str]] = {}
    for dof in AXES:
        found = {label: axis for label, run in errors.items() if (axis := run.axis(DOFS[dof])) is not None}
        known = {label: axis.overall for label, axis in found.items() if math.isfinite(axis.overall)}
        if known:
            best = min(known, key=known.__getitem__)
            told.setdefault(best, []).append(
                f"in {DOFS[dof]} by {fixed(known[best], 4)} {found[best].unit} on average{_less(best, known)}"
            )
    if not told:
        return "No dive has a reference that moves and a measured speed beside it: nothing to compare."
    least = " least" if len(errors) > 1 else ""
    return " ".join(f"'{best}' errs{least}: {', '.join(axes)}." for best, axes in told.items())


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
    """Go or no-go, dive by dive."""
    told = tuple((one.go, f"{label}: {one.sentence}") for label, one in judged.items() if one is not None)
    return Section("May the feed-forward be raised?", judged=told) if told else None


def _criteria(judged: Mapping[str, Raising | None]) -> Section | None:
    """What go or no-go rests on, each criterion a line."""
    tables = tuple(
        Table(
            ("Criterion", "Passed", "Figure and limit"),
            tuple((one.what, MARKS[one.passed], one.words) for one in raised.criteria),
            f"{label}: what was looked at.",
        )
        for label, raised in judged.items()
        if raised is not None
    )
    return Section("What go and no-go rest on", "", tables) if tables else None


def _axis(
    dof: int, dives: Mapping[str, Dive], errors: Mapping[str, TrackingErrors], lever_m: Vector3
) -> Section:
    """One axis: the errors side by side, then each dive's curves, then the numbers as in Table 5."""
    axis = DOFS[dof]
    of_axis = {label: run for label, run in errors.items() if run.axis(axis) is not None}
    curves = (tracking.curves(label, dive, lever_m).get(dof) for label, dive in dives.items())
    compared = _compared(dof, dives, lever_m) if len(of_axis) > 1 else None
    drawn = (_by_phase(axis, of_axis), compared, *curves)
    alone = {
        label: TrackingErrors(run.dive, tuple(one for one in run.axes if one.axis == axis))
        for label, run in of_axis.items()
    }
    return Section(
        axis.capitalize(),
        "",
        tracking.error_tables(alone),
        tuple(figure for figure in drawn if figure is not None),
    )


def _by_phase(axis: str, errors: Mapping[str, TrackingErrors]) -> Figure:
    """The errors of Table 5 as bars, a group a phase."""
    found = {label: run.axis(axis) for label, run in errors.items()}
    unit = next(one.unit for one in found.values() if one)
    groups = [
        Group(label, tuple(one.phase(phase) if one else math.nan for phase in PHASES))
        for label, one in found.items()
    ]
    return Figure(
        f"errors in {axis} by phase",
        f"Mean absolute tracking error in {axis} by phase of the motion, as Table 5 of the source paper has it.",
        stack([grouped(f"error in {axis}, {unit}", PHASES, groups)]),
    )


def _compared(dof: int, dives: Mapping[str, Dive], lever_m: Vector3) -> Figure | None:
    """The errors of all dives over one another, each from where its reference begins to move."""
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
