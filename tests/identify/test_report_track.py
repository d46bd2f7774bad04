"""The path on a report: all of it, whatever the number of samples."""

import re
from pathlib import Path

import numpy as np
import pytest
from drawn_paths import strokes

from identify.dive import Dive, Signal
from identify.report.figures import track
from identify.report.picture import WIDE_IN, inline


def circling(samples: int) -> Dive:
    """Two rounds of a circle, at 10 Hz."""
    time_s = np.arange(samples) / 10.0
    heading = 4 * np.pi * np.arange(samples) / samples
    attitude = np.column_stack((np.cos(heading / 2), np.zeros((samples, 2)), np.sin(heading / 2)))
    velocity = np.tile([0.4, 0.0, 0.0], (samples, 1))
    return Dive(
        "circle", Path("c.tlog"), "", velocity=Signal(time_s, velocity), attitude=Signal(time_s, attitude)
    )


def test_start_and_end_have_one_label_where_two_would_overprint():
    closed, part = track(circling(2400)), track(circling(2400).between(0.0, 60.0))
    assert closed is not None
    assert part is not None
    assert closed.draw(WIDE_IN).axes[0].get_legend_handles_labels()[1] == ["start and end"]
    assert part.draw(WIDE_IN).axes[0].get_legend_handles_labels()[1] == ["start", "end"]


@pytest.mark.parametrize("samples", [500, 2399, 9729, 40_000])
def test_a_circle_is_drawn_whole_and_round(samples):
    drawn = track(circling(samples))
    assert drawn is not None
    svg = inline(drawn.draw, "path", "k").partition('<svg class="column-picture"')[0]
    path = max(re.findall(r'<path d="([^"]*)"', svg), key=len)
    (points,) = strokes(path)
    wide, high = np.ptp(points, axis=0)
    assert wide == pytest.approx(high, rel=0.01)
    around = np.hypot(*np.diff(points, axis=0).T).sum()
    assert around == pytest.approx(2 * np.pi * wide, rel=0.02)
