"""The path on a report: all of it, whatever the number of samples."""

import re
from pathlib import Path

import numpy as np
import pytest

from identify.dive import Dive, Signal
from identify.report.track import track


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
    closed, part = track(circling(2400)), circling(2400).between(0.0, 60.0)
    assert closed is not None
    assert ">start and end<" in closed.svg
    assert ">end<" not in closed.svg
    apart = track(part)
    assert apart is not None
    assert ">start<" in apart.svg
    assert ">end<" in apart.svg


@pytest.mark.parametrize("samples", [500, 2399, 9729, 11999, 40_000])
def test_a_circle_is_drawn_round(samples):
    drawn = track(circling(samples))
    assert drawn is not None
    found = re.search(r'<path class="line solid" d="M(\S+ \S+)l0 0([^"]*)"', drawn.svg)
    assert found is not None
    steps = np.array(re.findall(r"-?\d+", found.group(2)), dtype=int).reshape(-1, 2)
    around = np.hypot(*steps.T).sum()
    across = np.ptp(np.cumsum(steps, axis=0), axis=0).max()
    assert np.hypot(*steps.T).max() < 0.1 * across
    assert around > 3.9 * across
