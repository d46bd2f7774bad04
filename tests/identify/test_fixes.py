"""Surface fixes against dead reckoning: exact answers for a straight run between two surfacings."""

import math
from pathlib import Path

import numpy as np
import pytest

from identify.dive import Dive, Signal
from identify.fixes import EARTH_RADIUS_M, LEAST_FIX_STD_M, check_fixes

SPEED, SECONDS = 0.5, 400.0


def dive(
    scale=1.0, heading_error=0.0, heading=0.7, seconds=SECONDS, surfacings=((0.0, 10.0), (390.0, 400.0))
):
    """A run at constant speed and heading; the DVL reads `scale` times too little, the compass errs."""
    time_s = np.arange(0.0, seconds, 0.1)
    velocity = np.tile([SPEED / scale, 0.0, 0.0], (len(time_s), 1))
    told = heading - heading_error
    attitude = np.tile([math.cos(told / 2), 0.0, 0.0, math.sin(told / 2)], (len(time_s), 1))
    fixes = np.concatenate([np.arange(*span) for span in surfacings])
    north, east = SPEED * fixes * math.cos(heading), SPEED * fixes * math.sin(heading)
    latitude = 44.0 + np.degrees(north / EARTH_RADIUS_M)
    longitude = 11.0 + np.degrees(east / EARTH_RADIUS_M / math.cos(math.radians(44.0)))
    gnss = np.column_stack([latitude, longitude, np.zeros((len(fixes), 2))])
    return Dive(
        "run",
        Path("run.tlog"),
        "0",
        velocity=Signal(time_s, velocity),
        attitude=Signal(time_s, attitude),
        gnss=Signal(fixes, gnss),
    )


def test_a_perfect_dive_has_scale_one_and_no_turn():
    found = check_fixes(dive())
    assert found.scale == pytest.approx(1.0, abs=1e-3)
    assert found.heading_rad == pytest.approx(0.0, abs=1e-3)
    assert found.distance_m == pytest.approx(195.0, abs=0.5)


def test_a_dvl_that_reads_two_per_cent_too_little_and_a_compass_three_degrees_off_are_found():
    found = check_fixes(dive(scale=1.02, heading_error=math.radians(3.0)))
    assert found.scale == pytest.approx(1.02, abs=1e-3)
    assert math.degrees(found.heading_rad) == pytest.approx(3.0, abs=0.02)
    assert "1.020" in found.sentence
    assert "+3.0" in found.sentence


def test_the_uncertainty_is_that_of_the_fixes_over_the_distance():
    found = check_fixes(dive())
    assert found.scale_std == pytest.approx(LEAST_FIX_STD_M * math.sqrt(2) / 195.0, rel=1e-2)


def test_surfacings_too_near_each_other_check_nothing_and_say_so():
    circle = dive(seconds=40.0, surfacings=((0.0, 10.0), (20.5, 24.0)))
    nearer = circle.gnss.value.copy()
    nearer[:, :2] = nearer[0, :2]
    still = Dive("still", circle.source, "0", velocity=Signal(circle.velocity.time_s, 0.01 * circle.velocity.value),
                 attitude=circle.attitude, gnss=Signal(circle.gnss.time_s, nearer))  # fmt: skip
    assert "too near" in check_fixes(still).sentence


def test_one_surfacing_or_no_fix_at_all_is_no_check():
    assert check_fixes(dive(surfacings=((0.0, 10.0),))) is None
    assert check_fixes(Dive("none", Path("none.tlog"), "0")) is None
