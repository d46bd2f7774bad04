"""Clocks of sensors, and the way they are mounted."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from bridge.attitude import quaternion_of, rotation_matrix
from bridge.sensors.mounting import mounting_matrix, to_body
from bridge.sensors.samples import DvlSample, FogBlock, ImuSample
from bridge.sensors.streams import ClockFit
from bridge.vehicle.config import Mounting

LABEL_UP = Mounting(rotation_deg=(180.0, 0.0, 0.0))
WAYFINDER = Mounting(rotation_deg=(180.0, 0.0, 135.0))
ENU_TO_NED = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
EAST, NORTH, UP = np.eye(3)


def imu(axes_in_enu=None, **fields):
    """A sample whose device axes x y z are the rows of `axes_in_enu`."""
    attitude = None if axes_in_enu is None else quaternion_of(np.asarray(axes_in_enu).T)
    values = {"specific_force": (0.0, 0.0, 9.81), "rate": (0.0, 0.0, 0.0), "attitude": attitude, **fields}
    return ImuSample(time_s=1.0, **values)


def roll_pitch_yaw_deg(attitude):
    w, x, y, z = attitude
    return Rotation.from_quat([x, y, z, w]).as_euler("ZYX", degrees=True)[::-1]


def test_the_wayfinders_usual_mount_is_teledynes_matrix():
    h = math.sqrt(0.5)
    np.testing.assert_allclose(mounting_matrix(WAYFINDER), [[-h, h, 0], [h, h, 0], [0, 0, -1]], atol=1e-15)


def test_a_dvl_that_moves_along_its_own_diagonal_moves_the_vehicle_forward():
    h = math.sqrt(0.5)
    sample = to_body(DvlSample(1.0, (-h * 0.4, h * 0.4, 0.0), 0.01, 2.5), WAYFINDER)
    assert sample.velocity == pytest.approx((0.4, 0.0, 0.0))
    assert (sample.time_s, sample.sigma, sample.altitude_m) == (1.0, 0.01, 2.5)


def test_a_level_imu_at_rest_reads_gravity_upwards_in_frd():
    sample = to_body(imu(rate=(0.1, 0.2, 0.3)), LABEL_UP)
    assert sample.specific_force == (0.0, 0.0, -9.81)
    assert sample.rate == (0.1, -0.2, -0.3)


LIFTED = math.cos(0.2) * NORTH + math.sin(0.2) * UP, math.cos(0.2) * UP - math.sin(0.2) * NORTH
PORT_UP = -math.cos(0.3) * EAST + math.sin(0.3) * UP, math.cos(0.3) * UP + math.sin(0.3) * EAST


@pytest.mark.parametrize(
    ("axes", "roll_pitch_yaw"),
    [
        ([NORTH, -EAST, UP], (0, 0, 0)),
        ([EAST, NORTH, UP], (0, 0, 90)),
        ([LIFTED[0], -EAST, LIFTED[1]], (0, math.degrees(0.2), 0)),
        ([NORTH, *PORT_UP], (math.degrees(0.3), 0, 0)),
    ],
    ids=["level and north", "nose east", "nose up", "right side down"],
)
def test_an_attitude_is_that_of_the_body_from_north_east_and_down(axes, roll_pitch_yaw):
    sample = to_body(imu(axes), LABEL_UP)
    np.testing.assert_allclose(roll_pitch_yaw_deg(sample.attitude), roll_pitch_yaw, atol=1e-9)


angles = st.floats(-180, 180)


@settings(max_examples=100)
@given(angles, st.floats(-89, 89), angles, st.tuples(angles, angles, angles))
def test_any_attitude_comes_out_under_any_mounting(roll, pitch, yaw, rotation_deg):
    mounting = Mounting(rotation_deg=rotation_deg)
    body_to_ned = Rotation.from_euler("ZYX", [yaw, pitch, roll], degrees=True).as_matrix()
    device_to_enu = ENU_TO_NED @ body_to_ned @ np.array(mounting_matrix(mounting))
    w, x, y, z = to_body(imu(device_to_enu.T), mounting).attitude
    np.testing.assert_allclose(Rotation.from_quat([x, y, z, w]).as_matrix(), body_to_ned, atol=1e-9)
    assert w >= 0
    assert math.hypot(w, x, y, z) == pytest.approx(1.0)


@settings(max_examples=100)
@given(st.tuples(angles, angles, angles))
def test_the_rotation_is_roll_then_pitch_then_yaw(rotation_deg):
    roll, pitch, yaw = rotation_deg
    expected = Rotation.from_euler("ZYX", [yaw, pitch, roll], degrees=True).as_matrix()
    np.testing.assert_allclose(rotation_matrix(rotation_deg), expected, atol=1e-12)
    w, x, y, z = quaternion_of(expected)
    np.testing.assert_allclose(Rotation.from_quat([x, y, z, w]).as_matrix(), expected, atol=1e-9)


def test_signs_act_on_device_axes_before_the_rotation():
    mounting = Mounting(rotation_deg=(0.0, 0.0, 90.0), signs=(-1.0, 1.0, 1.0))
    sample = to_body(DvlSample(1.0, (1.0, 2.0, 3.0), 0.0, 1.0), mounting)
    assert sample.velocity == (-2.0, -1.0, 3.0)


def test_a_mirrored_mounting_turns_vectors_and_leaves_the_attitude_out():
    sample = to_body(imu([NORTH, -EAST, UP], rate=(0.1, 0.2, 0.3)), Mounting(signs=(1.0, 1.0, -1.0)))
    assert sample.rate == (0.1, 0.2, -0.3)
    assert sample.attitude is None


@pytest.mark.parametrize(
    ("mounting", "sense"),
    [
        (Mounting(), 1),
        (Mounting(signs=(1.0, 1.0, -1.0)), -1),
        (Mounting(rotation_deg=(180.0, 0.0, 0.0)), -1),
        (Mounting(rotation_deg=(0.0, 0.0, 70.0)), 1),
        (Mounting(rotation_deg=(180.0, 0.0, 0.0), signs=(1.0, 1.0, -1.0)), 1),
    ],
)
def test_the_sense_of_a_gyro_is_that_of_its_axis(mounting, sense):
    block = FogBlock(np.arange(3.0), np.array([0.1, -0.2, 0.3]), np.array([True, False, True]))
    turned = to_body(block, mounting)
    np.testing.assert_array_equal(turned.rate, sense * block.rate)
    np.testing.assert_array_equal(turned.valid, block.valid)
    np.testing.assert_array_equal(turned.time_s, block.time_s)


def fit_times(clock, counts, arrivals):
    return np.array([clock.time_of(int(c), float(a)) for c, a in zip(counts, arrivals, strict=True)])


def test_exact_arrivals_of_a_nominal_clock_come_back_unchanged():
    counts = np.arange(0, 10_000, 50)
    times = fit_times(ClockFit(1e-3, tolerance=0.03), counts, 5.0 + counts * 1e-3)
    np.testing.assert_allclose(times, 5.0 + counts * 1e-3, atol=1e-12)


def test_a_slow_clock_is_learnt_within_a_second_and_never_shifts_a_time_by_half_a_millisecond():
    counts = np.arange(0, 20_000, 50)
    truth = 5.0 + counts / 989.0
    clock = ClockFit(1e-3, tolerance=0.03)
    times = fit_times(clock, counts, truth)
    assert np.max(np.abs(times - truth)) < 0.5e-3
    np.testing.assert_allclose(times[truth > 6.0], truth[truth > 6.0], atol=1e-5)
    assert clock.period_s == pytest.approx(1 / 989.0, rel=1e-5)


def test_jitter_of_the_arrivals_is_taken_out():
    rng = np.random.default_rng(1)
    counts = np.arange(0, 120_000, 50)
    truth = counts / 989.0
    late = rng.exponential(1e-3, counts.size)
    times = fit_times(ClockFit(1e-3, tolerance=0.03), counts, truth + late)
    error = (times - truth)[truth > 10.0] - late.mean()
    assert np.std(error) < 0.15e-3
    assert np.all(np.diff(times) > 0)


@pytest.mark.parametrize("jump_s", [-3.0, 0.2, 40.0])
def test_a_gap_starts_anew_at_once_and_keeps_the_period(jump_s):
    counts = np.arange(0, 20_000, 50)
    arrivals = counts / 989.0 + np.where(counts > 10_000, jump_s, 0.0)
    clock = ClockFit(1e-3, tolerance=0.03)
    times = fit_times(clock, counts, arrivals)
    np.testing.assert_allclose(times[counts > 5_000], arrivals[counts > 5_000], atol=1e-5)


@pytest.mark.parametrize("jump_s", [-3.0, 0.2, 40.0])
def test_a_counter_that_was_set_is_followed_after_the_patience_with_it(jump_s):
    truth = np.arange(0.0, 30.0, 0.01)
    arrivals = truth + np.where(truth > 20.0, jump_s, 0.0)
    times = fit_times(ClockFit(1e-4, 1e-3, patience_s=0.25), np.arange(truth.size) * 100, arrivals)
    late = truth > 20.0 + 0.26
    np.testing.assert_allclose(times[late], arrivals[late], atol=1e-5)


def test_a_counter_that_starts_over_is_followed():
    clock = ClockFit(1e-4, tolerance=1e-3)
    clock.time_of(1_000_000, 1.0)
    assert clock.time_of(0, 1.01) == 1.01
    assert clock.time_of(100, 1.02) == pytest.approx(1.02)


def test_absurd_counts_and_silence_of_days_do_no_harm():
    clock = ClockFit(1e-3, tolerance=0.03)
    clock.time_of(0, 0.0)
    assert clock.time_of(10**12, 1.0) == 1.0
    for _ in range(3):
        clock.time_of(10**12, 1.0)
    slow = ClockFit(1.0, tolerance=0.0)
    slow.time_of(0, 0.0)
    assert slow.time_of(10**6, 1e6) == pytest.approx(1e6)
