"""What counts as a dive's length: thruster commands and readings of motion at the same time."""

from dataclasses import replace

import closed_loop
import numpy as np
import pytest

from bridge.errors import FitError
from identify.dive import Signal
from identify.estimators.refusals import common_s, lasting, long_enough, too_short
from identify.estimators.table import METHODS, estimator

VOLTAGE = Signal(np.array([0.0, 417.0]), np.full((2, 1), 16.0))


def dive(seconds=30.0):
    return replace(closed_loop.dive(np.random.default_rng(7), seconds=seconds), voltage=VOLTAGE)


@pytest.mark.parametrize("method", METHODS)
def test_a_battery_that_goes_on_makes_a_short_dive_no_longer(method):
    with pytest.raises(
        FitError, match=r"are both in it for 15 s of 417 s, but identification needs at least 20 s"
    ):
        estimator(method)(dive(15.0), closed_loop.vehicle_file(), "only", lambda *_: None)


def test_commands_and_velocity_that_hardly_meet_are_a_short_dive():
    whole = dive(60.0)
    parted = replace(
        whole,
        velocity=whole.velocity.between(0.0, 35.0),
        gyro=None,
        tau_cmd=whole.tau_cmd.between(25.0, 60.0),
    )
    assert common_s(parted, 0) == pytest.approx(9.9)
    with pytest.raises(FitError, match="are both in it for 10 s"):
        lasting(parted)


def test_twenty_seconds_to_the_nearest_are_enough():
    bare = replace(dive(20.0), voltage=None)
    assert 19.5 < bare.duration_s < 20.0
    long_enough(bare)
    lasting(bare)
    assert too_short(dive(20.0), 0) == ""


def test_an_axis_that_was_read_for_a_shorter_time_than_the_others_is_left_out_alone():
    whole = dive(60.0)
    time_s = whole.velocity.time_s
    spoilt = np.where((time_s < 15.0)[:, None], whole.velocity.value, np.nan)
    gyro = Signal(time_s, np.random.default_rng(8).normal(size=(len(time_s), 3)))
    parted = replace(whole, velocity=Signal(time_s, spoilt), gyro=gyro)
    lasting(parted)
    assert too_short(parted, 0) == (
        "thruster commands and the velocity in surge were both recorded for 15 s, but at least 20 s are needed"
    )
    assert too_short(parted, 5) == ""
    found = estimator("likelihood")(parted, closed_loop.vehicle_file(), "only", lambda *_: None)
    assert found["M_u"].reason == too_short(parted, 0)


def test_what_holds_no_command_or_no_reading_is_for_others_to_refuse():
    without = replace(dive(60.0), tau_cmd=None, pwm=None)
    lasting(without)
    assert np.isnan(common_s(without, 0))
