"""Attitude and gyro that contradict each other are doubted."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import fitted
import numpy as np
import pytest
from fakes.shared import shared
from soak import rest_in_soak

from bench.missions.mission import draw_one
from identify.checks.sensors.heading import turning, turning_doubts
from identify.checks.sensors.levelling import levelling, levelling_doubts
from identify.dive import Dive, Signal
from identify.doubt import Outcome
from identify.estimators.answer import answered
from identify.ingest.open import read_dive
from identify.ingest.rotation import quaternions_from_euler

TIME_S = np.arange(0.0, 100.0, 0.01)
DEGREE = np.pi / 180
ABOUT = ("M_w", "I_p", "I_q", "D_w", "D_p", "D_q")


def turned(time_s, roll, pitch, yaw):
    """A dive of these Euler angles (n,) in rad, zyx; body rates by their kinematics (Fossen 2011, eq. 2.28)."""
    p_dot, q_dot, r_dot = np.gradient(np.stack([roll, pitch, yaw]), time_s, axis=1)
    rates = [
        p_dot - r_dot * np.sin(pitch),
        q_dot * np.cos(roll) + r_dot * np.sin(roll) * np.cos(pitch),
        r_dot * np.cos(roll) * np.cos(pitch) - q_dot * np.sin(roll),
    ]
    return Dive(
        "turned",
        Path("turned.tlog"),
        "0" * 64,
        attitude=Signal(time_s, quaternions_from_euler(roll, pitch, yaw)),
        gyro=Signal(time_s, np.column_stack(rates)),
    )


@cache
def mission(seed, kind=None):
    return draw_one(seed, seconds=120.0, kind=kind).dive


def level(roll_rad=0.5 * DEGREE, pitch_rad=0.5 * DEGREE, offset_rad=0.0):
    """A dive that rolls and pitches by so little, each at its own paces, and turns; rates by its kinematics."""
    roll = roll_rad * (np.sin(1.9 * TIME_S) + np.sin(0.37 * TIME_S))
    pitch = pitch_rad * (np.cos(1.3 * TIME_S) + np.sin(0.51 * TIME_S)) + offset_rad
    heading = 2.0 * np.sin(0.1 * TIME_S)
    return turned(TIME_S, roll, pitch, heading)


def with_gyro(dive, to, bias_rad_s=0.0):
    """The dive with rates of turn (n, 3) times a matrix."""
    return replace(
        dive, gyro=Signal(dive.gyro.time_s, dive.gyro.value @ np.asarray(to, float).T + bias_rad_s)
    )


def mirrored(dive, *parts):
    """The dive with these parts of its attitude's quaternions the other way round: 1 for roll, 2 for pitch."""
    value = dive.attitude.value.copy()
    value[:, parts] *= -1
    return replace(dive, attitude=Signal(dive.attitude.time_s, value))


def later(dive, by_s):
    return replace(dive, attitude=Signal(dive.attitude.time_s + by_s, dive.attitude.value))


def with_noise(dive, attitude_rad, gyro_rad_s):
    rng = np.random.default_rng(100_311)
    values = dive.attitude.value, dive.gyro.value
    attitude, gyro = (
        value + std * rng.standard_normal(value.shape)
        for value, std in zip(values, (attitude_rad / 2, gyro_rad_s), strict=True)
    )
    return replace(dive, attitude=Signal(TIME_S, attitude), gyro=Signal(TIME_S, gyro))


def said_by(doubts):
    (doubt,) = doubts
    assert doubt.about == ABOUT
    assert doubt.outcome is Outcome.DISAGREES
    return doubt.sentence


SWAPPED = [[0, 1, 0], [1, 0, 0], [0, 0, 1]]


def test_roll_and_pitch_follow_the_gyro_through_turning_and_a_tilted_attitude():
    levels = levelling(level(offset_rad=5 * DEGREE))
    assert levels.late_s == 0.0
    for angle in (levels.roll, levels.pitch):
        assert (angle.scale.least, angle.scale.most) == pytest.approx((1.0, 1.0), abs=2e-3)
        assert angle.share == pytest.approx(0.0, abs=2e-3)
    assert levelling_doubts(level(offset_rad=5 * DEGREE)) == ()


def test_a_mirrored_attitude_is_told_with_the_sign_of_each_angle():
    sentence = said_by(levelling_doubts(mirrored(level(), 1, 2)))
    assert sentence.startswith(
        "By the attitude roll turns by -1 times what the gyro says and pitch turns by -1 times what the gyro says: "
        "the sign, axes or scale of the attitude or of the gyro are not as taken, and M_w, I_p"
    )


def test_swapped_axes_are_told():
    levels = levelling(with_gyro(level(), SWAPPED))
    assert (levels.roll.share, levels.pitch.share) == pytest.approx((1.0, 1.0), abs=0.03)
    sentence = said_by(levelling_doubts(with_gyro(level(), SWAPPED)))
    assert "roll follows the gyro's rate in pitch (by +1.0 of it at least)" in sentence
    assert "pitch follows the gyro's rate in roll (by +1.0 of it at least)" in sentence


@pytest.mark.parametrize("late_s", rest_in_soak([0.3, -0.4, 0.5], keep=2))
def test_a_late_attitude_or_gyro_is_told_by_how_much_and_raises_no_other_doubt(late_s):
    assert levelling(later(level(), late_s)).late_s == pytest.approx(late_s)
    sentence = said_by(levelling_doubts(later(level(), late_s)))
    late = "The attitude is" if late_s > 0 else "The gyro's rates in roll and pitch are"
    assert sentence.startswith(f"{late} stamped some {1000 * abs(late_s):.0f} ms late, by ")


@pytest.mark.parametrize(("scale", "doubted"), [(1.16, False), (1.26, True)])
def test_a_scale_that_a_healthy_sensor_has_is_none_to_doubt(scale, doubted):
    assert bool(levelling_doubts(with_gyro(level(), np.diag([1 / scale, 1 / scale, 1])))) is doubted


@pytest.mark.parametrize(("share", "doubted"), [(0.14, False), (0.28, True)])
def test_a_mounting_turned_by_a_little_is_none_to_doubt(share, doubted):
    c = np.sqrt(1 - share**2)
    turned = [[c, -share, 0], [share, c, 0], [0, 0, 1]]
    assert bool(levelling_doubts(with_gyro(level(), turned))) is doubted


def test_a_bias_and_a_stamp_by_a_tenth_of_a_second_are_none_to_doubt():
    assert levelling_doubts(with_gyro(level(), np.eye(3), bias_rad_s=0.05)) == ()
    for late_s in (-0.1, 0.1):
        assert levelling_doubts(later(level(roll_rad=0.1 * DEGREE), late_s)) == ()


def test_where_noise_hides_how_it_turned_nothing_is_told():
    still = level(1e-3 * DEGREE, 1e-3 * DEGREE)
    for wrong in (still, mirrored(still, 1, 2), with_gyro(still, SWAPPED), later(still, 0.5)):
        assert levelling_doubts(with_noise(wrong, 2e-3, 2e-3)) == ()


@pytest.mark.parametrize("seed", rest_in_soak(range(100_321, 100_341), keep=2))
def test_a_scale_that_rests_on_rates_of_noise_alone_is_not_doubted(seed):
    still = level(0.01 * DEGREE, 0.01 * DEGREE)
    rng = np.random.default_rng(seed)
    loud = Signal(TIME_S, still.gyro.value + 0.005 * rng.standard_normal(still.gyro.value.shape))
    assert levelling_doubts(replace(still, gyro=loud)) == ()


def test_a_single_jolt_that_was_read_too_seldom_tells_nothing():
    # It has nearly all of the motion, and what four readings a second miss of it is no noise of the other windows.
    after_s = TIME_S - 1.2
    rang = np.exp(-np.maximum(after_s, 0.0)) * (after_s >= 0.0)
    roll = 0.5 * rang * np.sin(2.5 * after_s) + 1e-4 * np.sin(1.9 * TIME_S)
    pitch = 0.1 * rang * np.sin(2.5 * after_s + 1.5) + 1e-4 * np.cos(1.3 * TIME_S)
    dive = turned(TIME_S, roll, pitch, np.zeros_like(TIME_S))
    seldom = {
        name: Signal(TIME_S[::25], getattr(dive, name).value[::25].copy()) for name in ("attitude", "gyro")
    }
    assert levelling_doubts(replace(dive, **seldom)) == ()


def test_without_attitude_or_gyro_or_for_a_short_dive_nothing_is_told():
    dive = mirrored(level(), 1, 2)
    assert levelling_doubts(replace(dive, attitude=None)) == ()
    assert levelling_doubts(replace(dive, gyro=None)) == ()
    assert levelling_doubts(dive.between(0.0, 11.0)) == ()


def test_a_hole_in_the_readings_and_a_vehicle_on_its_nose_are_left_out():
    dive = level()
    kept = (TIME_S < 43.0) | (TIME_S > 47.0)
    steep = np.where((TIME_S > 60.0) & (TIME_S < 65.0), 0.48 * np.pi, 0.0)
    value = quaternions_from_euler(*np.zeros((1, len(TIME_S))), steep, np.zeros(len(TIME_S)))
    upended = np.where((steep > 0)[:, None], value, dive.attitude.value)
    holed = replace(dive, gyro=Signal(TIME_S[kept], dive.gyro.value[kept]), attitude=Signal(TIME_S, upended))
    levels = levelling(holed)
    assert levels.roll.scale.least == pytest.approx(1.0, abs=5e-3)
    assert levelling_doubts(holed) == ()


@pytest.mark.parametrize("seed", rest_in_soak([100_301, 100_302, 100_303]))
@pytest.mark.parametrize(
    "kind", rest_in_soak(["spin", "rocking", "lawnmower", "together", "depth steps"], keep=2)
)
def test_an_honest_dive_is_not_doubted_and_a_spoilt_one_is(seed, kind):
    dive = mission(seed, kind)
    assert levelling_doubts(dive) == turning_doubts(dive) == ()
    assert "turns by -" in said_by(levelling_doubts(mirrored(dive, 1, 2)))
    assert "follows the gyro's rate in" in said_by(levelling_doubts(with_gyro(dive, SWAPPED)))
    assert levelling(later(dive, 0.5)).late_s == pytest.approx(0.5, abs=0.11)
    assert "The attitude is stamped some " in said_by(levelling_doubts(later(dive, 0.5)))


def test_a_dive_made_elsewhere_that_is_held_level_is_doubted_where_it_was_spoilt():
    dive = read_dive(shared("sealed", "open_1", "dive.tlog.gz"))
    assert levelling_doubts(dive) == ()
    assert "roll turns by -1" in said_by(levelling_doubts(mirrored(dive, 1, 2)))
    assert "roll turns by -1" in said_by(levelling_doubts(with_gyro(dive, np.diag([-1, -1, 1]))))
    assert "some 500 ms late" in said_by(levelling_doubts(later(dive, 0.5)))
    assert "gyro's rate in pitch" in said_by(levelling_doubts(with_gyro(dive, SWAPPED)))


def test_an_autopilot_at_rest_whose_gyros_warm_is_not_doubted():
    dive = read_dive(shared("data", "ardusub_sitl", "still.tlog.gz"))
    assert levelling(dive).roll.scale.least == pytest.approx(1.0, abs=0.05)
    assert levelling_doubts(dive) == ()


def test_the_answer_of_any_method_ends_in_the_doubt():
    fit = fitted.fit({"M_w": 87.0, "D_w": 104.0}, 1e-4 * np.eye(2))
    answer = answered(fit, mirrored(level(), 1, 2), fitted.vehicle_file())
    assert answer.outcome is Outcome.DISAGREES
    assert any("roll turns by -1 times" in sentence for sentence in answer.sentences)


TURNS_S = np.arange(0.0, 200.0, 0.05)


def of_roll_pitch_and_heading(roll, pitch, yaw, fog=1.0, imu=1.0):
    """A dive with rates of turn as exact means over their intervals would be, each times a scale."""
    dive = turned(TURNS_S, roll, pitch, yaw)
    rates = dive.gyro.value
    return replace(
        dive,
        gyro=Signal(TURNS_S, rates * [1.0, 1.0, imu]),
        fog=Signal(TURNS_S, fog * rates[:, 2:]),
    )


def turns(**scales):
    """Many times round, and back and forth, rolled and pitched by a quarter of a radian meanwhile."""
    heading = 9.0 * np.sin(0.07 * TURNS_S) + 0.4 * np.sin(1.1 * TURNS_S)
    return of_roll_pitch_and_heading(
        0.25 * np.sin(0.9 * TURNS_S), 0.25 * np.cos(0.5 * TURNS_S), heading, **scales
    )


def with_rates(dive, scale=1.0, bias_rad_s=0.0):
    """The dive with another rate of turn in yaw of all its gyros."""
    gyro = dive.gyro.value.copy()
    gyro[:, 2] = scale * gyro[:, 2] + bias_rad_s
    fog = None if dive.fog is None else Signal(dive.fog.time_s, scale * dive.fog.value + bias_rad_s)
    return replace(dive, gyro=Signal(dive.gyro.time_s, gyro), fog=fog)


def doubt_of_turns(doubts):
    (doubt,) = doubts
    assert doubt.about == ("I_r", "D_r", "M_u", "M_v", "M_w")
    assert doubt.outcome is Outcome.DISAGREES
    return doubt.sentence


@pytest.mark.parametrize("scale", [0.5, 1.2, -1.0, 57.3])
def test_heading_tells_the_scale_of_a_gyro_through_roll_and_pitch(scale):
    dive = turns(fog=scale)
    slope = turning(dive, dive.fog)
    assert slope.least == pytest.approx(1.0 / scale, rel=1e-3)
    assert slope.most == pytest.approx(1.0 / scale, rel=1e-3)


def test_a_spoilt_fog_is_named_where_the_other_gyro_agrees_with_heading():
    sentence = doubt_of_turns(turning_doubts(turns(fog=0.5)))
    assert sentence.startswith(
        "Heading turns by 2 times what the fibre-optic gyro says, and the IMU's gyro agrees with heading: the scale, "
        "unit or sign of the fibre-optic gyro is not as taken, and I_r and D_r are as far off, and by less M_u"
    )


def test_the_only_gyro_is_named():
    sentence = doubt_of_turns(turning_doubts(replace(turns(imu=1.25), fog=None)))
    assert sentence.startswith(
        "Heading turns by 0.8 times what the IMU's gyro says: the scale, unit or sign of one of"
    )


@pytest.mark.parametrize(("off", "doubted"), [(0.04, False), (0.065, True)])
def test_a_scale_that_a_healthy_gyro_has_is_none_to_doubt(off, doubted):
    assert bool(turning_doubts(turns(fog=1.0 / (1.0 + off)))) is doubted


def test_a_gyros_bias_is_not_taken_for_a_scale():
    for dive in (turns(), mission(100_301, "together")):
        assert turning_doubts(with_rates(dive, bias_rad_s=0.05)) == ()
    level = np.zeros(len(TURNS_S))
    round_and_round = of_roll_pitch_and_heading(level, level, 0.2 * TURNS_S + 3.0 * np.sin(0.1 * TURNS_S))
    biased = with_rates(round_and_round, bias_rad_s=-0.1)
    assert turning(biased, biased.fog).least == pytest.approx(1.0, abs=1e-3)


def test_a_late_gyro_is_not_taken_for_a_scale():
    dive = mission(100_301, "together")
    late = Signal(dive.gyro.time_s + 0.1, dive.gyro.value)
    assert turning_doubts(replace(dive, gyro=late, fog=None)) == ()


def test_quick_turning_to_and_fro_makes_no_doubt():
    level = np.zeros(len(TURNS_S))
    quick = of_roll_pitch_and_heading(level, level, np.sin(2.0 * TURNS_S) + 2.0 * np.sin(0.1 * TURNS_S))
    assert turning_doubts(quick) == ()
    noisy = quick.attitude.value + 0.02 * np.random.default_rng(100_305).standard_normal((len(TURNS_S), 4))
    assert turning_doubts(replace(quick, attitude=Signal(TURNS_S, noisy))) == ()


def test_a_heading_that_is_kept_tells_nothing():
    level = np.zeros(len(TURNS_S))
    kept = of_roll_pitch_and_heading(level, level, 0.05 * np.sin(0.3 * TURNS_S), fog=0.5)
    assert turning(kept, kept.fog) is None
    assert turning_doubts(kept) == ()


def test_steady_turning_can_not_be_told_from_a_bias():
    level = np.zeros(len(TURNS_S))
    steady = of_roll_pitch_and_heading(level, level, 0.3 * TURNS_S, fog=0.5)
    assert turning(steady, steady.fog) is None


def test_without_attitude_or_gyro_or_for_a_short_dive_no_scale_is_doubted():
    dive = turns(fog=0.5)
    assert turning_doubts(replace(dive, attitude=None)) == ()
    assert turning_doubts(replace(dive, gyro=None, fog=None)) == ()
    assert turning_doubts(dive.between(0.0, 45.0)) == ()


def test_a_hole_in_the_readings_is_left_out():
    dive = turns(fog=0.5)
    kept = (TURNS_S < 63.0) | (TURNS_S > 87.0)
    value = dive.attitude.value.copy()
    value[3] = np.nan
    holed = replace(dive, fog=Signal(TURNS_S[kept], dive.fog.value[kept]), attitude=Signal(TURNS_S, value))
    assert turning(holed, holed.fog).least == pytest.approx(2.0, rel=1e-3)


def test_the_answer_of_any_method_ends_in_the_doubt_of_the_gyro():
    answer = answered(
        fitted.fit({"I_r": 32.0, "D_r": 30.0}, 1e-4 * np.eye(2)), turns(fog=0.5), fitted.vehicle_file()
    )
    assert answer.outcome is Outcome.DISAGREES
    assert any("Heading turns by 2 times" in sentence for sentence in answer.sentences)
