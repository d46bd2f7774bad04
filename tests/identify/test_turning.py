"""A gyro whose scale or sign heading contradicts is doubted; honest ones, biased ones and resting vehicles are not."""

from dataclasses import replace
from functools import cache

import fitted
import numpy as np
import pytest
from turned_dives import turned

from bench.missions.mission import draw_one
from identify.answer import answered
from identify.checks.heading import LARGEST_OFF, turning, turning_doubts
from identify.dive import Signal
from identify.identification import Outcome

TIME_S = np.arange(0.0, 200.0, 0.05)


@cache
def mission(seed, kind=None):
    return draw_one(seed, seconds=120.0, kind=kind).dive


def of_roll_pitch_and_heading(roll, pitch, yaw, fog=1.0, imu=1.0):
    """A dive with rates of turn as exact means over their intervals would be, each times a scale."""
    dive = turned(TIME_S, roll, pitch, yaw)
    rates = dive.gyro.value
    return replace(
        dive,
        gyro=Signal(TIME_S, rates * [1.0, 1.0, imu]),
        fog=Signal(TIME_S, fog * rates[:, 2:]),
    )


def turns(**scales):
    """Many times round, and back and forth, rolled and pitched by a quarter of a radian meanwhile."""
    heading = 9.0 * np.sin(0.07 * TIME_S) + 0.4 * np.sin(1.1 * TIME_S)
    return of_roll_pitch_and_heading(
        0.25 * np.sin(0.9 * TIME_S), 0.25 * np.cos(0.5 * TIME_S), heading, **scales
    )


def with_rates(dive, scale=1.0, bias_rad_s=0.0):
    """The dive with another rate of turn in yaw of all its gyros."""
    gyro = dive.gyro.value.copy()
    gyro[:, 2] = scale * gyro[:, 2] + bias_rad_s
    fog = None if dive.fog is None else Signal(dive.fog.time_s, scale * dive.fog.value + bias_rad_s)
    return replace(dive, gyro=Signal(dive.gyro.time_s, gyro), fog=fog)


def said_by(doubts):
    (doubt,) = doubts
    assert doubt.about == ("I_r", "D_r", "M_u", "M_v", "M_w")
    assert doubt.outcome is Outcome.DISAGREES
    return doubt.sentence


@pytest.mark.parametrize("scale", [0.5, 1.2, -1.0, 57.3])
def test_heading_tells_the_scale_of_a_gyro_through_roll_and_pitch(scale):
    dive = turns(fog=scale)
    found = turning(dive, dive.fog)
    assert found.least == pytest.approx(1.0 / scale, rel=1e-3)
    assert found.most == pytest.approx(1.0 / scale, rel=1e-3)


def test_a_spoilt_fog_is_named_where_the_other_gyro_agrees_with_heading():
    told = said_by(turning_doubts(turns(fog=0.5)))
    assert told.startswith(
        "Heading turns by 2 times what the fibre-optic gyro says, and the IMU's gyro agrees with heading: the scale, "
        "unit or sign of the fibre-optic gyro is not as taken, and I_r and D_r are as far off, and by less M_u"
    )


def test_a_scale_a_little_off_is_told_to_the_hundredth():
    told = said_by(turning_doubts(turns(fog=0.94, imu=0.94)))
    assert told.startswith("Heading turns by 1.06 times what the fibre-optic gyro says, and the IMU's")


def test_gyros_that_agree_with_each_other_leave_open_which_is_wrong():
    told = said_by(turning_doubts(turns(fog=0.5, imu=0.5)))
    assert "and the IMU's gyro contradicts heading too: the scale, unit or sign of one of them" in told
    assert "check the gyro's unit and the compass" in told


def test_the_only_gyro_is_named():
    told = said_by(turning_doubts(replace(turns(imu=1.25), fog=None)))
    assert told.startswith(
        "Heading turns by 0.8 times what the IMU's gyro says: the scale, unit or sign of one of"
    )


@pytest.mark.parametrize(("off", "doubted"), [(0.8 * LARGEST_OFF, False), (1.3 * LARGEST_OFF, True)])
def test_a_scale_that_a_healthy_gyro_has_is_none_to_doubt(off, doubted):
    assert bool(turning_doubts(turns(fog=1.0 / (1.0 + off)))) is doubted


@pytest.mark.parametrize("seed", [100_301, 100_302, 100_303])
@pytest.mark.parametrize("kind", ["lawnmower", "spin", "together", "rocking", "depth steps"])
def test_an_honest_dive_is_not_doubted(seed, kind):
    assert turning_doubts(mission(seed, kind)) == ()


@pytest.mark.parametrize("scale", [0.5, 1.2])
@pytest.mark.parametrize("seed", [100_301, 100_304])
def test_a_dive_whose_gyros_read_another_scale_is_doubted(seed, scale):
    assert "Heading turns by" in said_by(turning_doubts(with_rates(mission(seed, "together"), scale)))


def test_a_gyros_bias_is_not_taken_for_a_scale():
    for dive in (turns(), mission(100_301, "together")):
        assert turning_doubts(with_rates(dive, bias_rad_s=0.05)) == ()
    level = np.zeros(len(TIME_S))
    round_and_round = of_roll_pitch_and_heading(level, level, 0.2 * TIME_S + 3.0 * np.sin(0.1 * TIME_S))
    biased = with_rates(round_and_round, bias_rad_s=-0.1)
    assert turning(biased, biased.fog).least == pytest.approx(1.0, abs=1e-3)


def test_a_late_gyro_is_not_taken_for_a_scale():
    dive = mission(100_301, "together")
    late = Signal(dive.gyro.time_s + 0.1, dive.gyro.value)
    assert turning_doubts(replace(dive, gyro=late, fog=None)) == ()


def test_quick_turning_to_and_fro_makes_no_doubt():
    level = np.zeros(len(TIME_S))
    quick = of_roll_pitch_and_heading(level, level, np.sin(2.0 * TIME_S) + 2.0 * np.sin(0.1 * TIME_S))
    assert turning_doubts(quick) == ()
    noisy = quick.attitude.value + 0.02 * np.random.default_rng(100_305).standard_normal((len(TIME_S), 4))
    assert turning_doubts(replace(quick, attitude=Signal(TIME_S, noisy))) == ()


def test_a_heading_that_is_kept_tells_nothing():
    level = np.zeros(len(TIME_S))
    kept = of_roll_pitch_and_heading(level, level, 0.05 * np.sin(0.3 * TIME_S), fog=0.5)
    assert turning(kept, kept.fog) is None
    assert turning_doubts(kept) == ()


def test_steady_turning_can_not_be_told_from_a_bias():
    level = np.zeros(len(TIME_S))
    steady = of_roll_pitch_and_heading(level, level, 0.3 * TIME_S, fog=0.5)
    assert turning(steady, steady.fog) is None


def test_without_attitude_or_gyro_or_for_a_short_dive_nothing_is_told():
    dive = turns(fog=0.5)
    assert turning_doubts(replace(dive, attitude=None)) == ()
    assert turning_doubts(replace(dive, gyro=None, fog=None)) == ()
    assert turning_doubts(dive.between(0.0, 45.0)) == ()


def test_a_hole_in_the_readings_is_left_out():
    dive = turns(fog=0.5)
    kept = (TIME_S < 63.0) | (TIME_S > 87.0)
    value = dive.attitude.value.copy()
    value[3] = np.nan
    holed = replace(dive, fog=Signal(TIME_S[kept], dive.fog.value[kept]), attitude=Signal(TIME_S, value))
    assert turning(holed, holed.fog).least == pytest.approx(2.0, rel=1e-3)


def test_the_answer_of_any_method_ends_in_the_doubt():
    found = answered(
        fitted.fit({"I_r": 32.0, "D_r": 30.0}, 1e-4 * np.eye(2)), turns(fog=0.5), fitted.vehicle_file()
    )
    assert found.outcome is Outcome.DISAGREES
    assert any("Heading turns by 2 times" in told for told in found.sentences)
