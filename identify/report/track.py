"""The path of a dive over the ground, by dead reckoning."""

import math

import numpy as np

from identify.dive import Array, Dive, Signal
from identify.report import plot
from identify.report.axes import Axis, extent, nice_step, ticks_between
from identify.report.page import Figure
from identify.report.plot import Line, Mark, Panel
from identify.report.text import count, significant

TRACK_POINTS = 2000
LABEL_SHARE = 0.15
"""Start and end nearer than this share of the picture have one label, for two would overprint."""


def track(dive: Dive) -> Figure | None:
    """The path over the ground by dead reckoning, north up; None without velocity or attitude."""
    if dive.velocity is None or dive.attitude is None or len(dive.velocity) < 2 or not len(dive.attitude):
        return None
    east, north = dead_reckon(dive.velocity, dive.attitude)
    if not np.isfinite(east).all():
        return None
    x, y = true_scale_axes(east, north)
    aspect = (x.high - x.low) / (y.high - y.low)
    apart = max(abs(east[-1] - east[0]) / (x.high - x.low), abs(north[-1] - north[0]) / (y.high - y.low))
    words = ("start", "end") if apart > LABEL_SHARE else ("start and end", "")
    marks = (Mark(east[0], north[0], "disc", words[0]), Mark(east[-1], north[-1], "square", words[1]))
    length = float(np.hypot(np.diff(east), np.diff(north)).sum())
    unlocked = int((~np.isfinite(dive.velocity.value[:, 0])).sum())
    every = math.ceil(len(east) / TRACK_POINTS)
    keep = np.append(np.arange(0, len(east) - 1, every), len(east) - 1)
    panel = Panel(x, y, (Line(east[keep], north[keep]),), marks, aspect=aspect)
    what = "the vehicle" if dive.velocity_is_filtered else "the DVL's transducer"
    caption = (
        f"Path of {what}, {significant(length)} m, dead-reckoned from velocity and attitude: "
        f"north is up, scales are equal. {count(unlocked)} of {count(len(dive.velocity))} velocities lacked "
        "bottom lock and were bridged."
    )
    return Figure(caption, plot.render(panel))


def dead_reckon(velocity: Signal, attitude: Signal) -> tuple[Array, Array]:
    """East and north in m at each velocity's time: trapezoidal rule on velocity turned by attitude."""
    body = velocity.at(velocity.time_s)
    w, x, y, z = attitude.held_at(np.maximum(velocity.time_s, attitude.time_s[0])).T
    u, v, down = body.T
    rate_n = (1 - 2 * (y * y + z * z)) * u + 2 * (x * y - w * z) * v + 2 * (x * z + w * y) * down
    rate_e = 2 * (x * y + w * z) * u + (1 - 2 * (x * x + z * z)) * v + 2 * (y * z - w * x) * down
    step_s = np.diff(velocity.time_s)
    east = np.concatenate(([0.0], np.cumsum((rate_e[1:] + rate_e[:-1]) / 2 * step_s)))
    north = np.concatenate(([0.0], np.cumsum((rate_n[1:] + rate_n[:-1]) / 2 * step_s)))
    return east, north


def true_scale_axes(east: Array, north: Array) -> tuple[Axis, Axis]:
    """Axes with the same ticks, padded so that width over height lies between 0.8 and 2.5."""
    (e0, e1), (n0, n1) = extent([east]), extent([north])
    air = 0.08 * max(e1 - e0, n1 - n0, 1.0)
    width, height = e1 - e0 + 2 * air, n1 - n0 + 2 * air
    spare_e, spare_n = max(0.8 * height - width, 0.0) / 2, max(width / 2.5 - height, 0.0) / 2
    e0, e1, n0, n1 = e0 - air - spare_e, e1 + air + spare_e, n0 - air - spare_n, n1 + air + spare_n
    step = nice_step(0.0, max(e1 - e0, n1 - n0), 4)
    return (
        Axis("east, m", e0, e1, ticks_between(e0, e1, step)),
        Axis("north, m", n0, n1, ticks_between(n0, n1, step)),
    )
