"""Figures of a report, each from arrays to a `Figure`: signals, intervals, the path by dead reckoning, innovations.

Times are seconds from the start of the dive.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import BY_NAME, HEAVE, SURGE, SWAY, YAW
from bridge.vehicle.config import Water
from identify.dive import Dive, Signal
from identify.identification import Estimate
from identify.ingest.rotation import to_earth
from identify.report.page import Figure
from identify.report.plot import (
    DIAMOND,
    DISC,
    LIGHT,
    SQUARE,
    STYLES,
    Line,
    Panel,
    entitle,
    lines_panel,
    side_by_side,
    stack,
)
from identify.report.traces import Traces
from identify.words import count, fixed, significant, speed_unit, unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes

TIME_TITLE = "time, s"
SPEEDS = (
    (SURGE, "surge, m/s", 1.0),
    (SWAY, "sway, m/s", 1.0),
    (HEAVE, "heave, m/s", 1.0),
    (YAW, "yaw, deg/s", float(np.degrees(1.0))),
)
GAP_PERIODS = 5.0
OUTLIER_MEDIANS, OUTLIER_PERCENT = 4.0, 25.0

HEIGHT_IN = 4.0
LABEL_SHARE = 0.15
"""Start and end closer than this share of the path's extent share an entry in the legend."""

LAGS = 40
LEAST_REACH = 0.2
"""Least extent of the autocorrelation's axis, so that noise is not magnified."""


def signal_line(signal: Signal, column: int, start_s: float, label: str = "", style: int = 0) -> Line:
    """A column against time, broken at silences of the signal."""
    silence_s = max(GAP_PERIODS / signal.rate_hz, 0.5) if signal.rate_hz else 1.0
    time_s, value = broken_at_gaps(signal, column, silence_s)
    return Line(time_s - start_s, value, label, style)


def broken_at_gaps(signal: Signal, column: int, longer_than_s: float) -> tuple[Array, Array]:
    """Times and a column, with a NaN inserted into each silence longer than `longer_than_s`."""
    time_s, value = signal.time_s, signal.value[:, column]
    after = np.flatnonzero(np.diff(time_s) > longer_than_s) + 1
    return np.insert(time_s, after, time_s[after - 1]), np.insert(value, after, np.nan)


def known_at(signal: Signal | None, column: int, time_s: Array) -> Array:
    """A column at these times, linearly between its readings; NaN outside of its span and in its silences."""
    if signal is None or not len(signal):
        return np.full(len(time_s), np.nan)
    line = signal_line(signal, column, 0.0)
    return np.interp(time_s, line.x, line.y, np.nan, np.nan)


def error_unit(dof: int) -> tuple[float, str]:
    """The unit in which an error of a velocity is shown, behind how many of it are 1 m/s or rad/s."""
    return speed_unit("m/s" if dof < 3 else "rad/s")


def time_panel(title: str, dive: Dive, lines: Sequence[Line], height_in: float = 1.7) -> Panel:
    """Lines over the dive's own span, from zero."""
    start_s, end_s = dive.span_s
    return lines_panel(title, TIME_TITLE, lines, (0.0, end_s - start_s), height_in=height_in)


def intervals(dive: str, estimates: Sequence[Estimate], truth: Mapping[str, float] | None) -> Figure | None:
    """A dot and a 95 % interval given the thrust for each parameter, in per cent from the truth, or from the value
    without a truth.

    An interval far longer than the others ends in an arrow at the edge, with its end as a number. None without
    intervals.
    """
    names, spans = [], []
    for e in estimates:
        base = e.value if truth is None else truth.get(e.name, 0.0)
        if e.identifiable and base and np.isfinite([e.value, e.low95, e.high95]).all():
            names.append(e.symbol)
            spans.append([100 * (v - base) / abs(base) for v in (e.low95, e.value, e.high95)])
    if not names:
        return None
    edge = _edge(np.abs(np.array(spans)).max(axis=1))

    def draw(box: "Axes") -> None:
        for row, (low, value, high) in enumerate(spans):
            inside = truth is None or low <= 0 <= high
            box.plot(np.clip([low, high], -edge, edge), [row, row], **STYLES[0 if inside else 1])
            for end, side in ((low, -1), (high, 1)):
                if abs(end) > edge and end * side > 0:
                    _arrow(box, side * edge, row, end)
            if abs(value) < edge:
                box.plot([value], [row], **(DISC if inside else DIAMOND))
        if truth is not None:
            box.plot([], [], label="interval holds the truth", **DISC)
            box.plot([], [], label="it does not", **DIAMOND)
        box.set_xlim(-edge, edge)
        box.set_ylim(len(names) - 0.4, -0.6)
        box.set_yticks(range(len(names)), names)
        box.axvline(0.0, color=LIGHT["rule"], linewidth=0.8, zorder=1)
        box.set_xlabel("% from its own value" if truth is None else "% from the truth")

    goes_on = (
        " An arrow marks an interval that goes on, to where its number says."
        if np.abs(spans).max() > edge
        else ""
    )
    about = "each relative to its own value" if truth is None else "relative to the truth"
    return Figure(
        f"intervals {dive}",
        f"Estimates and their 95 % intervals given the thrust, {about}.{goes_on}",
        stack([Panel(draw, 0.27 * len(names) + 0.5)]),
    )


def _arrow(box: "Axes", x: float, row: int, end: float) -> None:
    """Mark at the edge of the box that an interval goes on as far as `end`."""
    right = x > 0
    box.plot([x], [row], marker=">" if right else "<", color=LIGHT["ink"], clip_on=False, zorder=3)
    percentage = f"{'+' if right else ''}{fixed(end, 0)} %"
    placement = {"xytext": (-6 if right else 6, 3), "textcoords": "offset points", "size": "small"}
    box.annotate(percentage, (x, row), ha="right" if right else "left", **placement)


def _edge(reach: Array) -> float:
    """Edge of a plot of intervals that extend to `reach` per cent: beyond all but the outliers."""
    much = OUTLIER_MEDIANS * float(np.median(reach))
    outliers = reach > max(much, OUTLIER_PERCENT)
    furthest = float(reach[~outliers].max())
    return max(1.08 * (max(furthest, much) if outliers.any() else furthest), 1e-6)


def speeds(dive: Dive) -> Figure | None:
    """Velocity and yaw rate over time, with the sensor of each; None without readings."""
    start_s = dive.span_s[0]
    panels: list[Panel] = []
    sources: list[str] = []
    if dive.velocity is not None and len(dive.velocity):
        lines = [signal_line(dive.velocity, column, start_s) for column in range(3)]
        titles = ("surge u, m/s", "sway v, m/s", "heave w, m/s")
        panels += [time_panel(title, dive, [line], 1.2) for title, line in zip(titles, lines, strict=True)]
        place = "from an autopilot's own filter" if dive.velocity_is_filtered else "at the DVL's transducer"
        sources.append(f"velocity {place}")
    if (yaw_rate := dive.yaw_rate) is not None:
        panels.append(time_panel("yaw rate r, rad/s", dive, [signal_line(yaw_rate, 0, start_s)], 1.2))
        sources.append(f"yaw rate of {'the fibre-optic gyro' if yaw_rate is dive.fog else 'the IMU'}")
    if not panels:
        return None
    return Figure(f"speeds {dive.name}", f"Speeds in body axes: {', '.join(sources)}.", stack(panels))


def zoomed_speeds(dive: Dive) -> tuple[Traces, ...]:
    """The same as curves to zoom, each speed with its reference where the vehicle says one; () without readings."""
    measured_by = [signal for signal in (dive.velocity, dive.yaw_rate) if signal is not None and len(signal)]
    time_s = np.unique(np.concatenate([signal.time_s for signal in measured_by] or [np.zeros(0)]))
    if len(time_s) < 2:
        return ()
    panels: list[tuple[str, Array]] = []
    for dof, title, scale in SPEEDS:
        signal, column = (dive.velocity, dof) if dof < YAW else (dive.yaw_rate, 0)
        curves = scale * np.array([known_at(signal, column, time_s), known_at(dive.nu_ref, dof, time_s)])
        if np.isfinite(curves[0]).any():
            panels.append((title, curves))
    if not panels:
        return ()
    caption = (
        "Speeds in body axes. The buttons stretch time and height; stretched time can be moved sideways."
    )
    return (
        Traces(
            f"speeds {dive.name}",
            caption,
            ("measured", "reference"),
            time_s - dive.span_s[0],
            np.zeros(len(time_s), dtype=np.intp),
            tuple(panels),
            ("curve0", "reference"),
        ),
    )


def depth(dive: Dive, water: Water) -> Figure | None:
    """Depth over time, growing downwards: the recording's own, or from pressure; None without either."""
    signal = dive.depth_by(water)
    if signal is None or not len(signal):
        return None
    caption = (
        "Depth as the recording states it."
        if dive.depth is not None
        else f"Depth from pressure, with {significant(water.surface_pressure_hpa, 6)} hPa at the surface and "
        f"{significant(water.density_kg_m3, 4)} kg/m³."
    )
    line = signal_line(signal, 0, dive.span_s[0])

    def draw(box: "Axes") -> None:
        time_panel("depth, m", dive, [line]).draw(box)
        box.invert_yaxis()

    return Figure(f"depth {dive.name}", caption, stack([Panel(draw, 1.4)]))


def thrusters(dive: Dive, rest_us: float) -> Figure | None:
    """Command of each thruster, in the order of the vehicle's file, all on the same scale about that of rest; None
    without commands."""
    pwm = dive.pwm
    if pwm is None or not len(pwm):
        return None
    lines = [signal_line(pwm, i, dive.span_s[0]) for i in range(pwm.value.shape[1])]
    off = np.abs(pwm.value[np.isfinite(pwm.value)] - rest_us)
    reach = max(1.1 * float(off.max(initial=0.0)), 50.0)

    def panel(number: int, line: Line) -> Panel:
        def draw(box: "Axes") -> None:
            time_panel(f"thruster {number}, µs", dive, [line]).draw(box)
            box.set_ylim(rest_us - reach, rest_us + reach)
            box.axhline(rest_us, color=LIGHT["rule"], linewidth=0.8, zorder=1)

        return Panel(draw, 0.85)

    return Figure(
        f"thrusters {dive.name}",
        f"Thruster commands, pulse width in microseconds; by the vehicle file they rest at {fixed(rest_us, 0)}.",
        stack([panel(number, line) for number, line in enumerate(lines, start=1)]),
    )


def training(curves: Mapping[str, Array]) -> Figure:
    panels = []
    for name, values in curves.items():
        of = unit(BY_NAME[name].unit if name in BY_NAME else "1")
        title = f"{name}, {of}; last {significant(float(values[-1]), 4)}"
        epochs = np.arange(1, len(values) + 1, dtype=np.float64)
        panels.append(lines_panel(title, "epoch", [Line(epochs, values)]))
    return Figure(
        "training",
        "Each parameter while it was trained; its last value stands above its curve.",
        side_by_side(panels),
    )


def track(dive: Dive) -> Figure | None:
    """Path over the ground by dead reckoning, north up; of several runs, each from its own start. None without velocity
    or attitude."""
    if dive.velocity is None or dive.attitude is None or len(dive.velocity) < 2 or not len(dive.attitude):
        return None
    cuts = np.searchsorted(dive.velocity.time_s, dive.breaks_s)
    runs = zip(np.split(dive.velocity.time_s, cuts), np.split(dive.velocity.value, cuts), strict=True)
    paths = [dead_reckon(Signal(*run), dive.attitude) for run in runs if len(run[0])]
    east, north = (np.concatenate(ways) for ways in zip(*paths, strict=True))
    if not np.isfinite(east).all():
        return None
    reach = max(float(np.ptp(east)), float(np.ptp(north)), 1.0)
    apart = max(abs(east[-1] - east[0]), abs(north[-1] - north[0])) > LABEL_SHARE * reach
    length = sum(float(np.hypot(*map(np.diff, path)).sum()) for path in paths)
    unlocked = int((~np.isfinite(dive.velocity.value[:, 0])).sum())

    def draw(box: "Axes") -> None:
        for path in paths:
            box.plot(*path, **STYLES[0])
        box.plot([east[0]], [north[0]], label="start" if apart else "start and end", **DISC)
        box.plot([east[-1]], [north[-1]], label="end" if apart else None, **SQUARE)
        box.margins(0.08)
        box.set_aspect("equal", adjustable="datalim")
        entitle(box, "north, m", "east, m")

    of_each = ", each run from its own start" if len(paths) > 1 else ""
    subject = "the vehicle" if dive.velocity_is_filtered else "the DVL's transducer"
    caption = (
        f"Path of {subject}, {significant(length)} m, dead-reckoned from velocity and attitude{of_each}: "
        f"north is up, scales are equal. {count(unlocked)} of {count(len(dive.velocity))} velocities lacked "
        "bottom lock and were bridged."
    )
    return Figure(f"path {dive.name}", caption, stack([Panel(draw, HEIGHT_IN)]))


def dead_reckon(velocity: Signal, attitude: Signal) -> tuple[Array, Array]:
    """East and north in m at each velocity's time: trapezoidal rule on the velocity turned by the attitude."""
    turned = attitude.held_at(np.maximum(velocity.time_s, attitude.time_s[0]))
    rate_n, rate_e, _ = to_earth(turned, velocity.at(velocity.time_s)).T
    step_s = np.diff(velocity.time_s)
    east = np.concatenate(([0.0], np.cumsum((rate_e[1:] + rate_e[:-1]) / 2 * step_s)))
    north = np.concatenate(([0.0], np.cumsum((rate_n[1:] + rate_n[:-1]) / 2 * step_s)))
    return east, north


def innovations(dive: str, name: str, normalised: Signal) -> Figure:
    """Normalised innovations of a degree of freedom over time, and their autocorrelation."""
    line, value = signal_line(normalised, 0, float(normalised.time_s[0])), normalised.value[:, 0]
    end_s = float(normalised.time_s[-1] - normalised.time_s[0])
    rho = autocorrelation(value, LAGS)
    lags = np.arange(1.0, len(rho) + 1)
    limit = 1.96 / float(np.sqrt(max(int(np.isfinite(value).sum()), 1)))
    panels = (
        lines_panel(f"{name}: normalised innovation", TIME_TITLE, [line, *_band(1.96, end_s)], (0.0, end_s)),
        lines_panel(
            f"{name}: autocorrelation",
            "lag, samples",
            [Line(lags, rho), *_band(limit, float(max(len(rho), 1)))],
            (0.0, float(max(len(rho), 1))),
            (-LEAST_REACH, LEAST_REACH),
        ),
    )
    return Figure(
        f"innovations {name} {dive}",
        f"{name}: what the filter did not foresee, over what it expected. White noise crosses the dashed "
        "lines in one sample of twenty.",
        side_by_side(panels),
    )


def _band(bound: float, end: float) -> tuple[Line, Line]:
    """Lines from 0 to `end` at the limits that white noise keeps 95 % of the time."""
    ends = np.array([0.0, end])
    return (
        Line(ends, np.full(2, bound), "95 % limits of white noise", 1),
        Line(ends, np.full(2, -bound), style=1),
    )


def autocorrelation(value: Array, lags: int) -> Array:
    """Correlation at lags 1 to `lags` (fewer for a short series); pairs with a NaN are left out."""
    known = np.isfinite(value)
    if known.sum() < 3:
        return np.zeros(0)
    centred = np.where(known, value - value[known].mean(), 0.0)
    power = float((centred**2).sum()) / int(known.sum())
    if power == 0.0:
        return np.zeros(0)
    out = []
    for lag in range(1, min(lags, len(value) - 1) + 1):
        pairs = int((known[lag:] & known[:-lag]).sum())
        out.append(float((centred[lag:] * centred[:-lag]).sum()) / (pairs * power) if pairs else np.nan)
    return np.array(out)
