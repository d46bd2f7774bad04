"""The figures of a report, from arrays to a `Figure` each. Times are seconds from `start_s`, a boot time."""

from collections.abc import Mapping, Sequence

import numpy as np

from bridge.vehicle.config import Water
from identify.dive import Array, Dive, Signal
from identify.identification import Estimate
from identify.report import plot
from identify.report.axes import Axis, close_axis, extent, named_axis, nice_step, roomy_axis
from identify.report.decimate import broken_at_gaps
from identify.report.page import Figure
from identify.report.plot import Line, Mark, Panel
from identify.report.text import fixed, significant, unit

TIME_TITLE = "time, s"
GAP_PERIODS = 5.0
REST_US = 1500.0
OUTLIER_MEDIANS, OUTLIER_PERCENT = 4.0, 25.0


def time_axis(dive: Dive) -> Axis:
    """The dive's own span, from zero."""
    return close_axis(TIME_TITLE, 0.0, dive.duration_s, at_least=5)


def signal_line(signal: Signal, column: int, start_s: float, label: str = "", style: int = 0) -> Line:
    """One column against time, broken where the signal falls silent."""
    silence_s = max(GAP_PERIODS / signal.rate_hz, 0.5) if signal.rate_hz else 1.0
    time_s, value = broken_at_gaps(signal, column, silence_s)
    return Line(time_s - start_s, value, label, style)


def time_panel(title: str, x: Axis, lines: Sequence[Line], height_px: int = 150) -> Panel:
    """Lines over time with a y axis that holds them all."""
    return Panel(
        x,
        roomy_axis(title, [line.y for line in lines], 2 if height_px < 120 else 3),
        tuple(lines),
        height_px=height_px,
    )


def intervals(estimates: Sequence[Estimate], truth: Mapping[str, float] | None) -> Figure | None:
    """A dot and its 95 % interval a parameter, in per cent from the truth, or from the value without one.

    Only an interval that would dwarf the others ends in an arrow at the edge, with the number where it does end. None
    where there is no interval.
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
    lines: list[Line] = []
    marks: list[Mark] = []
    for row, (low, value, high) in enumerate(spans):
        inside = truth is None or low <= 0 <= high
        lines.append(
            Line(np.clip([low, high], -edge, edge), np.full(2, float(row)), style=0 if inside else 1)
        )
        if low < -edge:
            marks.append(Mark(-edge, row, "left", f"{fixed(low, 0)} %"))
        if high > edge:
            marks.append(Mark(edge, row, "right", f"+{fixed(high, 0)} %"))
        if abs(value) < edge:
            marks.append(Mark(value, row, "disc" if inside else "diamond"))
    title = "% from its own value" if truth is None else "% from the truth"
    x = close_axis(title, -edge, edge)
    panel = Panel(x, named_axis(names), tuple(lines), tuple(marks), height_px=34 * len(names) + 10)
    arrows = any(mark.shape in ("left", "right") for mark in marks)
    goes_on = " An arrow marks an interval that goes on, to where its number says." if arrows else ""
    if truth is None:
        return Figure(f"95 % intervals, each relative to its own value.{goes_on}", plot.render(panel))
    words = plot.mark_legend([("disc", "interval holds the truth"), ("diamond", "it does not")])
    caption = f"Estimates and their 95 % intervals, relative to the truth.{goes_on}"
    return Figure(caption, words + plot.render(panel))


def _edge(reach: Array) -> float:
    """Where a plot of intervals that reach so far, in per cent, ends: beyond all but the outliers."""
    much = OUTLIER_MEDIANS * float(np.median(reach))
    outliers = reach > max(much, OUTLIER_PERCENT)
    furthest = float(reach[~outliers].max())
    return max(1.08 * (max(furthest, much) if outliers.any() else furthest), 1e-6)


def speeds(dive: Dive, x: Axis) -> Figure | None:
    """Velocity and yaw rate over time, with what measured them; None where nothing did."""
    start_s = dive.span_s[0]
    panels: list[Panel] = []
    sources: list[str] = []
    if dive.velocity is not None and len(dive.velocity):
        lines = [signal_line(dive.velocity, column, start_s) for column in range(3)]
        titles = ("surge u, m/s", "sway v, m/s", "heave w, m/s")
        panels += [time_panel(title, x, [line], 110) for title, line in zip(titles, lines, strict=True)]
        place = "from an autopilot's own filter" if dive.velocity_is_filtered else "at the DVL's transducer"
        sources.append(f"velocity {place}")
    gyros = (("the fibre-optic gyro", dive.fog), ("the IMU", dive.gyro))
    for name, signal in [(name, gyro) for name, gyro in gyros if gyro is not None and len(gyro)][:1]:
        line = signal_line(signal, signal.value.shape[1] - 1, start_s)
        panels.append(time_panel("yaw rate r, rad/s", x, [line], 110))
        sources.append(f"yaw rate of {name}")
    if not panels:
        return None
    return Figure(f"Speeds in body axes: {', '.join(sources)}.", plot.stack(panels))


def depth(dive: Dive, water: Water) -> tuple[Signal, str] | None:
    """Depth in m, and where it comes from: the recording's own word, or pressure and the vehicle's water."""
    if dive.depth is not None and len(dive.depth):
        return dive.depth, "Depth as the recording states it."
    if dive.pressure is None or not len(dive.pressure):
        return None
    above_pa = dive.pressure.value - 100 * water.surface_pressure_hpa
    told = (
        f"Depth from pressure, with {significant(water.surface_pressure_hpa, 6)} hPa at the surface and "
        f"{significant(water.density_kg_m3, 4)} kg/m³."
    )
    return Signal(dive.pressure.time_s, above_pa / (water.density_kg_m3 * water.gravity_m_s2)), told


def depth_panel(signal: Signal, x: Axis, start_s: float) -> Panel:
    """Depth over time, growing downwards."""
    line = signal_line(signal, 0, start_s)
    return Panel(x, roomy_axis("depth, m", [line.y]).reversed(), (line,), height_px=120)


def thrusters(pwm: Signal, x: Axis, start_s: float) -> Figure:
    """The command of each thruster, in the order of the vehicle's file, all on one scale."""
    lines = [signal_line(pwm, i, start_s) for i in range(pwm.value.shape[1])]
    low, high = extent([line.y for line in lines])
    reach = max(1.1 * (high - REST_US), 1.1 * (REST_US - low), 50.0)
    step = nice_step(0.0, reach, 2)
    ticks = tuple((REST_US + k * step, fixed(REST_US + k * step, 0)) for k in (-1, 0, 1))
    panels = [
        Panel(x, Axis(f"thruster {i}, µs", REST_US - reach, REST_US + reach, ticks), (line,), height_px=72)
        for i, line in enumerate(lines, start=1)
    ]
    return Figure("Thruster commands, pulse width in microseconds; 1500 is at rest.", plot.stack(panels))


def training(curves: Mapping[str, Array], units: Mapping[str, str]) -> Figure:
    """A parameter's value against the epoch, one plot each, as in Figs 7 and 9 of the source paper."""
    panels = []
    for name, values in curves.items():
        title = f"{name}, {unit(units[name])}; last {significant(float(values[-1]), 4)}"
        epochs = np.arange(1, len(values) + 1, dtype=np.float64)
        x = close_axis("epoch", 1.0, float(len(values)))
        panels.append(Panel(x, roomy_axis(title, [values]), (Line(epochs, values),), height_px=170))
    return Figure(
        "Each parameter while it was trained; its last value stands above its curve.",
        plot.side_by_side(panels),
    )
