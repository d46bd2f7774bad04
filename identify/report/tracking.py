"""How a vehicle followed its reference: errors as in Table 5 of the source paper, curves as in its Figs 10 to 17."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import Vector3
from identify.dive import Dive, Signal
from identify.filters import low_pass
from identify.report.figures import signal_line, time_panel
from identify.report.page import Figure, Table
from identify.report.plot import Line, Panel, stack
from identify.validate import (
    AXES,
    CUTOFF_HZ,
    LEAST_SPEED,
    METHOD,
    PHASES,
    AxisErrors,
    SteadyError,
    TrackingErrors,
)
from identify.words import MISSING, fixed

TITLES = {
    0: ("surge speed u, m/s", "surge force X, N"),
    1: ("sway speed v, m/s", "sway force Y, N"),
    5: ("yaw rate r, rad/s", "yaw moment N, N m"),
}

LEAST_SAMPLES = 20
"""With fewer samples, no error curve is drawn."""


@dataclass(frozen=True)
class Reference:
    """Published errors of others, by axis and phase, in the units of the runs that they are compared with.

    `label` heads their column, `source` says where they come from: `Vangi et al., Table 5`.
    """

    label: str
    source: str
    values: Mapping[tuple[str, str], float]


def error_tables(errors: Mapping[str, TrackingErrors], paper: Reference | None = None) -> tuple[Table, ...]:
    """Tables for each axis that any run moved along: errors by phase, then by held speed, the runs side by side."""
    moved = [dof for dof in AXES if any(run.axis(DOFS[dof]) for run in errors.values())]
    by_phase = [_error_table(DOFS[dof], "N" if dof < 3 else "N m", errors, paper) for dof in moved]
    by_speed = [_speed_table(DOFS[dof], errors) for dof in moved]
    return (*by_phase, *(table for table in by_speed if table.rows))


def _error_table(
    axis: str, wrench_unit: str, errors: Mapping[str, TrackingErrors], paper: Reference | None
) -> Table:
    runs = [run.axis(axis) for run in errors.values()]
    unit = next(run.unit for run in runs if run)
    published = (
        {phase: v for (published_axis, phase), v in paper.values.items() if published_axis == axis}
        if paper
        else {}
    )

    def row(name: str, decimals: int, value: Callable[[AxisErrors], float]) -> tuple[str, ...]:
        return name, *(MISSING if run is None else fixed(value(run), decimals) for run in runs)

    rows: tuple[tuple[str, ...], ...] = (
        *(row(f"{phase}, {unit}", 4, partial(AxisErrors.phase, name=phase)) for phase in PHASES),
        row(f"Acceleration, delay taken out, {unit}", 4, lambda run: run.acceleration_less_delay),
        row("Delay, ms", 0, lambda run: 1000 * run.delay_s),
        row(f"Steady |PID|, {wrench_unit}", 2, lambda run: run.pid_magnitude),
        row(f"Steady |PID − feed-forward|, {wrench_unit}", 2, lambda run: run.pid_minus_ff),
    )
    columns: tuple[str, ...] = (f"{axis.capitalize()} motion", *errors)
    caption = (
        f"Mean absolute tracking error in {axis}, phase by phase. {METHOD}{_noise_said(errors, axis, unit)}"
    )
    if paper and published:
        paper_cells = [fixed(published.get(phase, math.nan), 4) for phase in PHASES]
        paper_cells += [MISSING] * (len(rows) - len(paper_cells))
        rows = tuple((*cells, value) for cells, value in zip(rows, paper_cells, strict=True))
        columns = (*columns, paper.label)
        caption += f" {paper.label}: {paper.source}."
    return Table(columns, rows, caption)


def _noise_said(errors: Mapping[str, TrackingErrors], axis: str, unit: str) -> str:
    noises = {name: axis_errors.noise for name, run in errors.items() if (axis_errors := run.axis(axis))}
    said = [f"{name} {fixed(noise, 4)}" for name, noise in noises.items() if math.isfinite(noise)]
    return f" Noise of the sensor that is left in it, {unit} rms: {', '.join(said)}." if said else ""


def _speed_table(axis: str, errors: Mapping[str, TrackingErrors]) -> Table:
    """Error of the mean speed, by the held speed."""
    runs = [run.axis(axis) for run in errors.values()]
    unit = next(run.unit for run in runs if run)
    held = [{s.speed: s for s in run.speeds} if run else {} for run in runs]
    speeds = sorted({speed for of_run in held for speed in of_run})
    rows = [(f"{speed:.2f}", *(_with_error(of_run.get(speed)) for of_run in held)) for speed in speeds]
    caption = (
        f"How much faster (+) or slower (-) than asked the vehicle went on average in {axis} while it held a speed, "
        f"{unit}, with the standard error of that mean over the runs at this speed."
    )
    return Table((f"{axis.capitalize()} speed, {unit}", *errors), tuple(rows), caption)


def _with_error(at: SteadyError | None) -> str:
    if at is None:
        return MISSING
    spread = f" ± {at.standard_error:.4f}" if math.isfinite(at.standard_error) else ""
    return f"{at.error:+.4f}{spread}".replace("-", "−")


def curves(mode: str, dive: Dive, lever_m: Vector3 = (0.0, 0.0, 0.0)) -> dict[int, Figure]:
    """For each axis that the reference moves along: reference and measured speed, their error, PID and feed-forward.

    `lever_m`: position of the DVL's transducer in body axes.
    """
    if dive.nu_ref is None:
        return {}
    return {
        dof: Figure(
            f"tracking {DOFS[dof]} {mode}",
            f"{mode}, {DOFS[dof]}: speed as asked for and as measured; the error, below {CUTOFF_HZ:g} Hz; wrench of "
            "PID and of feed-forward.",
            stack(_panels(dof, dive, dive.nu_ref, lever_m)),
        )
        for dof in AXES
        if (np.abs(dive.nu_ref.value[:, dof]) > LEAST_SPEED).any()
    }


def _panels(dof: int, dive: Dive, reference: Signal, lever_m: Vector3) -> list[Panel]:
    speed, wrench = TITLES[dof]
    start_s, measured = dive.span_s[0], _measured(dof, dive, lever_m)
    speeds = [signal_line(reference, dof, start_s, "reference", 1)]
    if measured is not None:
        speeds.insert(0, signal_line(measured, 0, start_s, "measured"))
    sources = (("PID", 3, dive.tau_pid), ("feed-forward", 2, dive.tau_ff))
    wrenches = [
        signal_line(s, dof, start_s, word, style) for word, style, s in sources if s is not None and len(s)
    ]
    panels = [time_panel(speed, dive, speeds)]
    if error := error_line(dof, dive, lever_m):
        panels.append(
            time_panel(f"error in {DOFS[dof]}, {'m/s' if dof < 3 else 'rad/s'}", dive, [error], 1.3)
        )
    return [*panels, time_panel(wrench, dive, wrenches)] if wrenches else panels


def error_line(dof: int, dive: Dive, lever_m: Vector3, label: str = "", style: int = 0) -> Line | None:
    """Measured minus reference speed below CUTOFF_HZ, over the time from the dive's start; None if one is missing."""
    measured, reference = _measured(dof, dive, lever_m), dive.nu_ref
    if measured is None or reference is None:
        return None
    begun_s = max(measured.time_s[0], reference.time_s[0])
    ended_s = min(measured.time_s[-1], reference.time_s[-1])
    rate_hz = measured.rate_hz
    time_s = np.arange(begun_s, ended_s, 1.0 / rate_hz) if rate_hz else np.zeros(0)
    if len(time_s) < LEAST_SAMPLES or rate_hz <= 2 * CUTOFF_HZ:
        return None
    error = measured.at(time_s)[:, 0] - reference.at(time_s)[:, dof]
    return Line(time_s - dive.span_s[0], low_pass(error, rate_hz, CUTOFF_HZ), label, style)


def _measured(dof: int, dive: Dive, lever_m: Vector3) -> Signal | None:
    """Measured speed of an axis, (n, 1): DVL moved to the origin; in yaw the fibre-optic gyro, else the IMU's gyro."""
    if dof >= 3:
        for source, column in ((dive.fog, 0), (dive.gyro, dof - 3)):
            if source is not None and len(source):
                return Signal(source.time_s, source.value[:, column : column + 1])
        return None
    if dive.velocity is None or not len(dive.velocity):
        return None
    time_s, value = dive.velocity.time_s, dive.velocity.value
    if dive.gyro is not None and len(dive.gyro) and any(lever_m):
        value = value - np.cross(dive.gyro.at(time_s), lever_m)
    return Signal(time_s, value[:, dof : dof + 1])
