"""The paper's figures drawn from our dives: training curves, control action and speed, headings."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from bench.reproduce.dives import REST_S, Campaign
from bench.reproduce.measures import heading, span
from bridge.vehicle.coefficients import BY_NAME, DOFS
from bridge.vehicle.mode import Mode
from identify.dive import Dive, Signal
from identify.report.figures import TIME_TITLE, signal_line, time_panel
from identify.report.page import Figure
from identify.report.plot import Line, Panel, lines_panel, side_by_side, stack
from identify.words import significant, unit

SPEEDS = {0: "surge speed u, m/s", 1: "sway speed v, m/s"}
WRENCHES = {0: "surge force X, N", 1: "sway force Y, N", 5: "yaw moment N, N m"}


def training(campaign: Campaign, name: str, caption: str) -> Figure:
    curves = campaign.curves
    epochs = np.arange(len(curves.values), dtype=np.float64)
    ends = epochs[[0, -1]]
    panels = []
    for parameter, values in zip(curves.names, curves.values.T, strict=True):
        lines = (
            Line(epochs, values, "trained"),
            Line(ends, np.full(2, campaign.closed[parameter]), "least of the loss", 1),
            Line(ends, np.full(2, campaign.truth[parameter]), "simulated vehicle", 2),
        )
        title = f"{parameter}, {unit(BY_NAME[parameter].unit)}; last {significant(float(values[-1]), 4)}"
        panels.append(lines_panel(title, "epoch", lines))
    return Figure(name, caption, side_by_side(panels))


def surge_or_sway(dive: Dive, dof: int, name: str, caption: str) -> Figure:
    """Control action above, speed below, around the motion in surge or sway (`dof` 0 or 1)."""
    part = dive.between(*around(dive, dof))
    return Figure(name, caption, stack([*_control(part, dof), _speed(part, dof)]))


def phases_apart(dive: Dive, transient_s: float, name: str, caption: str) -> Figure:
    begun_s, ended_s = span(dive, 0)
    middle_s = begun_s + transient_s
    panels = []
    for start_s, end_s in ((begun_s - 1.0, middle_s), (middle_s, ended_s - transient_s)):
        lines = _speed_lines(dive.between(start_s, end_s), 0, begun_s)
        panels.append(lines_panel(SPEEDS[0], TIME_TITLE, lines, (start_s - begun_s, end_s - begun_s)))
    return Figure(name, caption, side_by_side(panels))


def turning(dive: Dive, name: str, caption: str) -> Figure:
    start_s = dive.span_s[0]
    measured, wanted = (_degrees(signal) for signal in heading(dive))
    lines = [
        signal_line(measured, 0, start_s, "measured"),
        signal_line(wanted, 0, start_s, "reference", 1),
    ]
    return Figure(name, caption, stack([*_control(dive, 5), time_panel("heading, °", dive, lines)]))


def heading_errors(dives: Mapping[str, Dive], name: str, caption: str) -> Figure:
    lines = []
    for style, (label, dive) in enumerate(dives.items()):
        measured, wanted = heading(dive)
        behind = _degrees(Signal(wanted.time_s, wanted.value - measured.at(wanted.time_s)))
        lines.append(signal_line(behind, 0, dive.span_s[0], label, style))
    panel = lines_panel("heading behind its reference, °", TIME_TITLE, lines, height_in=2.4)
    return Figure(name, caption, stack([panel]))


def around(dive: Dive, dof: int) -> tuple[float, float]:
    """Interval in s from the rest before the motion of degree of freedom `dof` to the rest after it."""
    begun_s, ended_s = span(dive, dof)
    return begun_s - 0.5 * REST_S, ended_s + 0.75 * REST_S


def steered_by_pid(dive: Dive) -> bool:
    """Whether the feed-forward was only computed and not applied, so that the PID did all the work."""
    if dive.ff_mode is None or not len(dive.ff_mode):
        return False
    return not Mode(int(np.median(dive.ff_mode.value[:, 0]))).applies_feedforward


def _control(dive: Dive, dof: int) -> list[Panel]:
    """PID and feed-forward; when the PID steers, also their difference."""
    start_s = dive.span_s[0]
    sources = (("PID", 3, dive.tau_pid), ("feed-forward", 2, dive.tau_ff))
    lines = [signal_line(s, dof, start_s, word, style) for word, style, s in sources if s is not None]
    actions = [time_panel(WRENCHES[dof], dive, lines)]
    return [*actions, _difference(dive, dof)] if steered_by_pid(dive) else actions


def _difference(dive: Dive, dof: int) -> Panel:
    assert dive.tau_pid is not None
    assert dive.tau_ff is not None
    apart = dive.tau_pid.value - dive.tau_ff.held_at(dive.tau_pid.time_s)
    line = signal_line(Signal(dive.tau_pid.time_s, apart), dof, dive.span_s[0])
    return time_panel(f"PID less feed-forward in {DOFS[dof]}, {'N' if dof < 3 else 'N m'}", dive, [line])


def _speed(dive: Dive, dof: int) -> Panel:
    return time_panel(SPEEDS[dof], dive, _speed_lines(dive, dof, dive.span_s[0]))


def _speed_lines(dive: Dive, dof: int, start_s: float) -> list[Line]:
    sources: Sequence[tuple[str, int, Signal | None]] = (
        ("measured", 0, dive.velocity),
        ("reference", 1, dive.nu_ref),
    )
    return [signal_line(s, dof, start_s, word, style) for word, style, s in sources if s is not None]


def _degrees(signal: Signal) -> Signal:
    return Signal(signal.time_s, signal.value * (180.0 / math.pi))
