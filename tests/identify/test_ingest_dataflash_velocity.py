"""A `.BIN`'s steps of a DVL and its barometers: which time is theirs, and which of them is in the water."""

from pathlib import Path

import numpy as np
import pytest
from autopilot_log import FORMATS, dataflash

from identify.dive import Signal
from identify.ingest.mavlink import step_velocity
from identify.ingest.open import read_dive

STEP_S = 0.1
END_S = np.arange(1.0, 121.0, STEP_S)
IMU_S = np.arange(0.0, 122.0, 0.04)


def course(time_s):
    """Distance made good ahead, m, in steps of thrust that are some seconds long."""
    return 0.3 * np.sin(0.9 * time_s) + 0.1 * np.sin(2.3 * time_s + 1.0)


def speed(time_s):
    return 0.27 * np.cos(0.9 * time_s) + 0.23 * np.cos(2.3 * time_s + 1.0)


def acceleration(time_s):
    return -0.243 * np.sin(0.9 * time_s) - 0.529 * np.sin(2.3 * time_s + 1.0)


def steps(ways):
    moved = np.column_stack([ways, np.zeros_like(ways), np.zeros_like(ways)])
    noise = np.random.default_rng(3).normal(0.0, 4e-3 * STEP_S, moved.shape)
    return Signal(END_S, np.column_stack([np.full(len(END_S), STEP_S), moved + noise]))


def beside(level=1.0):
    """Gyro, specific force with a bias, and attitude of a hull that is upright."""
    still = np.zeros((len(IMU_S), 3))
    force = np.column_stack([level * acceleration(IMU_S) + 0.05, 0 * IMU_S, 0 * IMU_S - 9.80665])
    upright = np.tile([1.0, 0.0, 0.0, 0.0], (len(IMU_S), 1))
    return Signal(IMU_S, still), Signal(IMU_S, force), Signal(IMU_S, upright)


def test_the_way_that_was_made_is_dated_at_the_middle_of_its_step():
    made = step_velocity.dated(steps(course(END_S) - course(END_S - STEP_S)), *beside())
    assert made.time_s == pytest.approx(END_S - STEP_S / 2)
    assert made.value[:, 0] == pytest.approx(speed(made.time_s), abs=0.03)


def test_a_last_velocity_sent_as_a_step_is_dated_at_its_end():
    made = step_velocity.dated(steps(STEP_S * speed(END_S)), *beside())
    assert made.time_s == pytest.approx(END_S)
    assert made.value[:, 0] == pytest.approx(speed(END_S), abs=0.03)


@pytest.mark.parametrize("lacking", [0, 1, 2])
def test_where_nothing_tells_it_is_the_middle(lacking):
    known = list(beside())
    known[lacking] = None
    made = step_velocity.dated(steps(STEP_S * speed(END_S)), *known)
    assert made.time_s == pytest.approx(END_S - STEP_S / 2)


def test_a_long_step_that_is_sent_right_behind_a_short_one_leaves_the_times_in_order():
    sent = steps(STEP_S * speed(END_S))
    sent.value[50] *= 5.0
    made = step_velocity.dated(sent, None, None, None)
    assert len(made) == len(END_S)
    assert (np.diff(made.time_s) >= 0).all()
    assert np.abs(np.diff(made.value[:, 0])).max() < 0.3


def read(folder: Path, depth_m, pressures_pa):
    """Ten records a second of depth by the autopilot, upwards, and of two barometers."""
    records = []
    for k, deep in enumerate(depth_m):
        us = 2_000_000 + 100_000 * k
        records += [("ATT", us, 0, 0, 0), ("CTUN", us, -deep)]
        records += [("BARO", us, instance, pressure[k]) for instance, pressure in enumerate(pressures_pa)]
    path = folder / "dive.BIN"
    path.write_bytes(dataflash(FORMATS, records))
    return read_dive(path)


def test_the_barometer_in_the_water_tells_the_depth(tmp_path):
    depth = 3.0 + 2.0 * np.sin(np.arange(300) / 20)
    hull = 99_000 + 30 * np.cos(np.arange(300) / 50)
    water = 101_325 + 1024 * 9.80665 * depth
    dive = read(tmp_path, 0.98 * depth, [hull, water])
    assert dive.depth is None
    assert dive.pressure.value[:, 0] == pytest.approx(water)


def test_where_both_are_in_the_hull_the_depth_is_the_autopilots(tmp_path):
    depth = 3.0 + 2.0 * np.sin(np.arange(300) / 20)
    hull = 99_000 + 30 * np.cos(np.arange(300) / 50)
    dive = read(tmp_path, depth, [hull, hull + 5 * depth])
    assert dive.pressure is None
    assert dive.depth.value[:, 0] == pytest.approx(depth)


def test_steps_that_last_no_time_are_no_velocity():
    none = steps(STEP_S * speed(END_S))
    none.value[:, 0] = 0.0
    assert step_velocity.dated(none, *beside()) is None


@pytest.mark.parametrize("which", [0, 1, 2])
def test_a_sensor_that_reads_no_number_tells_nothing(which):
    known = list(beside())
    known[which].value[:, 1] = np.nan
    made = step_velocity.dated(steps(STEP_S * speed(END_S)), *known)
    assert made.time_s == pytest.approx(END_S - STEP_S / 2)


@pytest.mark.parametrize("first", [0, 1, 2, 3])
def test_slow_motion_is_dated_at_the_middle_wherever_the_accelerometer_begins(first):
    """A reading more in one of the two would count for more than all that the motion tells."""
    still = steps(0.001 * STEP_S * speed(END_S))
    gyro, force, attitude = beside(0.001)
    later = 0.93 + 0.04 * first
    made = step_velocity.dated(still, gyro, force.between(later, 130.0), attitude)
    assert made.time_s == pytest.approx(END_S - STEP_S / 2)
