"""The path of a dive over the ground, by dead reckoning."""

from typing import TYPE_CHECKING

import numpy as np

from identify.dive import Array, Dive, Signal
from identify.report.page import Figure
from identify.report.plot import DISC, SQUARE, STYLES, Panel, entitle, stack
from identify.report.text import count, significant

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HEIGHT_IN = 4.0
LABEL_SHARE = 0.15
"""Start and end closer than this share of the path's extent share an entry in the legend."""


def track(dive: Dive) -> Figure | None:
    """Path over the ground by dead reckoning, north up; None without velocity or attitude."""
    if dive.velocity is None or dive.attitude is None or len(dive.velocity) < 2 or not len(dive.attitude):
        return None
    east, north = dead_reckon(dive.velocity, dive.attitude)
    if not np.isfinite(east).all():
        return None
    reach = max(float(np.ptp(east)), float(np.ptp(north)), 1.0)
    apart = max(abs(east[-1] - east[0]), abs(north[-1] - north[0])) > LABEL_SHARE * reach
    length = float(np.hypot(np.diff(east), np.diff(north)).sum())
    unlocked = int((~np.isfinite(dive.velocity.value[:, 0])).sum())

    def draw(box: "Axes") -> None:
        box.plot(east, north, **STYLES[0])
        box.plot([east[0]], [north[0]], label="start" if apart else "start and end", **DISC)
        box.plot([east[-1]], [north[-1]], label="end" if apart else None, **SQUARE)
        box.margins(0.08)
        box.set_aspect("equal", adjustable="datalim")
        entitle(box, "north, m", "east, m")

    subject = "the vehicle" if dive.velocity_is_filtered else "the DVL's transducer"
    caption = (
        f"Path of {subject}, {significant(length)} m, dead-reckoned from velocity and attitude: "
        f"north is up, scales are equal. {count(unlocked)} of {count(len(dive.velocity))} velocities lacked "
        "bottom lock and were bridged."
    )
    return Figure(f"path {dive.name}", caption, stack([Panel(draw, HEIGHT_IN)]))


def dead_reckon(velocity: Signal, attitude: Signal) -> tuple[Array, Array]:
    """East and north in m at each velocity's time: trapezoidal rule on the velocity turned by the attitude."""
    body = velocity.at(velocity.time_s)
    w, x, y, z = attitude.held_at(np.maximum(velocity.time_s, attitude.time_s[0])).T
    u, v, down = body.T
    rate_n = (1 - 2 * (y * y + z * z)) * u + 2 * (x * y - w * z) * v + 2 * (x * z + w * y) * down
    rate_e = 2 * (x * y + w * z) * u + (1 - 2 * (x * x + z * z)) * v + 2 * (y * z - w * x) * down
    step_s = np.diff(velocity.time_s)
    east = np.concatenate(([0.0], np.cumsum((rate_e[1:] + rate_e[:-1]) / 2 * step_s)))
    north = np.concatenate(([0.0], np.cumsum((rate_n[1:] + rate_n[:-1]) / 2 * step_s)))
    return east, north
