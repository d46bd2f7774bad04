"""Readings in time order, and what the other axes add to them: exact answers for motions that are known."""

from pathlib import Path

import closed_loop
import numpy as np
import pytest

from bridge.vehicle.config import Configuration, Device, Mounting, Sensors, Vehicle, VehicleFile
from identify.dive import Dive, Signal
from identify.estimators.axes import LONGEST_STEP_S, build_axes
from identify.estimators.motion import Motion
from identify.estimators.places import at_origin, places_of
from identify.estimators.readings import MOST_HZ, PITCH, ROLL, averaged
from identify.ingest.rotation import attitude_at, quaternions_from_euler

TIME_S = np.arange(0.0, 40.0, 0.02)
LEVER_M = (0.1, 0.3, -0.2)


def vehicle_file():
    shape = Configuration(20.0, (0.3, 0.5, 0.6), (), centre_of_gravity_below_buoyancy_m=0.03)
    sensors = Sensors(dvl=Device("a50", mounting=Mounting(position_m=LEVER_M)))
    return VehicleFile(Path("still.yaml"), Vehicle("still", {"only": shape}, sensors=sensors), None, "0" * 64)


def recorded(**signals):
    return Dive("known motion", Path("known.tlog"), "1" * 64, **signals)


def test_a_dive_of_turns_gives_velocities_at_the_origin_and_not_at_the_sensor():
    rate = np.column_stack([0.05 * np.sin(TIME_S), 0.04 * np.cos(0.7 * TIME_S), 0.3 * np.sin(0.5 * TIME_S)])
    nu = np.column_stack([0.4 * np.sin(0.3 * TIME_S), 0.1 * np.cos(0.4 * TIME_S), 0.02 * np.sin(TIME_S)])
    at_sensor = Signal(TIME_S, nu + np.cross(rate, LEVER_M))
    dive = recorded(velocity=at_sensor, gyro=Signal(TIME_S, rate))
    velocity, motion = at_origin(dive, TIME_S, np.array(LEVER_M))
    np.testing.assert_allclose(velocity.value[50:-50], nu[50:-50], atol=1e-4)
    np.testing.assert_allclose(motion.nu[50:-50, :3], nu[50:-50], atol=2e-4)


def test_a_roll_that_comes_of_turning_while_pitched_is_no_roll_rate():
    """Pitched by 0.2 rad and turning at 0.3 rad/s about body z, the roll angle runs on though p is 0."""
    pitch, turning = 0.2, 0.3
    roll_rate = turning * np.tan(pitch)
    roll = roll_rate * TIME_S[:200]
    still = np.zeros_like(roll)
    attitude = Signal(TIME_S[:200], quaternions_from_euler(roll, still + pitch, still))
    nu = np.zeros((200, 6))
    nu[:, 5] = turning / np.cos(roll)
    motion = Motion(TIME_S[:200], nu)
    places = places_of(
        recorded(attitude=attitude), vehicle_file(), motion, attitude_at(attitude, TIME_S[:200])
    )
    assert np.ptp(roll) > 0.2
    np.testing.assert_allclose(places[ROLL].reading.value[:, 0], 0.0, atol=1e-6)
    lost = places[PITCH].carried + np.cumsum(nu[:, 5] * np.sin(roll)) * 0.02
    np.testing.assert_allclose(lost, 0.0, atol=1e-3)


def test_depth_is_left_with_what_heave_velocity_adds_to_it():
    angle, surge = -0.1, 0.5
    level = np.zeros_like(TIME_S)
    attitude = Signal(TIME_S, quaternions_from_euler(level, level + angle, level))
    sunk = -np.sin(angle) * surge * TIME_S + 0.05 * np.cos(angle) * TIME_S
    nu = np.zeros((len(TIME_S), 6))
    nu[:, 0], nu[:, 2] = surge, 0.05
    dive = recorded(depth=Signal(TIME_S, sunk[:, None]), attitude=attitude)
    places = places_of(dive, vehicle_file(), Motion(TIME_S, nu), attitude.value)
    np.testing.assert_allclose(places[2].reading.value[:, 0], 0.05 * TIME_S, atol=1e-9)


def test_the_mean_over_an_interval_is_exact_for_what_is_straight_and_zero_where_there_is_none():
    motion = Motion(TIME_S, np.zeros((len(TIME_S), 6)))
    start, end = np.array([1.0, 2.01, 5.0]), np.array([1.5, 2.03, 5.0])
    found = motion.mean_between(3.0 * TIME_S, start, end)
    np.testing.assert_allclose(found[:2], 1.5 * (start + end)[:2], rtol=1e-3)
    assert found[2] == 0.0


def test_long_steps_are_divided_and_the_forces_reach_the_last_event():
    built = build_axes(
        closed_loop.dive(np.random.default_rng(1), seconds=30.0), closed_loop.vehicle_file(), "only"
    )
    (axis,) = built.axes
    assert axis.step_s.max() <= LONGEST_STEP_S + 1e-9
    assert np.isnan(axis.reading).sum() == np.isfinite(axis.reading).sum() - 1
    named = np.where(axis.step >= 0, axis.different_s[axis.step], 0.0)
    np.testing.assert_array_equal(named, axis.step_s)
    assert built.motion.time_s[-1] >= axis.time_s[-1]


def test_fast_readings_become_means_of_equal_lengths_of_time_and_slow_ones_stay():
    fast = Signal(np.arange(4000) / (4 * MOST_HZ), np.arange(4000.0)[:, None])
    mean, count = averaged(fast)
    assert set(count[1:-1]) == {4.0}
    np.testing.assert_allclose(mean.value[:, 0], 4 * MOST_HZ * mean.time_s)
    slow = Signal(np.arange(100) / MOST_HZ, np.zeros((100, 1)))
    assert averaged(slow)[0] is slow


def test_a_gap_is_no_part_of_a_mean():
    time_s = np.concatenate([np.arange(400), np.arange(4000, 4400)]) / (4 * MOST_HZ)
    mean, _ = averaged(Signal(time_s, time_s[:, None]))
    inside = (mean.time_s > time_s[399]) & (mean.time_s < time_s[400])
    assert not inside.any()


@pytest.mark.parametrize("dof", range(3))
def test_an_axis_that_no_thruster_pushes_is_said_to_be_one(dof):
    dive = closed_loop.dive(np.random.default_rng(2), seconds=30.0)
    dive.velocity.value[:] += 0.004 * np.random.default_rng(3).standard_normal(dive.velocity.value.shape)
    built = build_axes(dive, closed_loop.vehicle_file(), "only")
    assert dof in {axis.dof for axis in built.axes}
    assert (dof in built.unpushed) is (dof > 0)
