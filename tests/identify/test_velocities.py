"""Velocities from an autopilot and from surface fixes: each in its own axes, over its own time."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from built_recordings import NAN, recording, write
from pymavlink.dialects.v20 import ardupilotmega as mav

from identify.dive import Dive, Signal
from identify.gnss_fixes import check_fixes
from identify.ingest.open import read_dive
from identify.ingest.rotation import quaternions_from_euler, to_body, to_earth

SURGE, SWAY, SINK, RATE = 0.5, -0.1, 0.05, 0.8
EVERY_S = 0.2
TIMES_S = 5.0 + 0.1 * np.arange(200)


def heading(time_s):
    return 0.3 + RATE * time_s


def north_east_down(time_s):
    """Velocity of the circle."""
    cos, sin = np.cos(heading(time_s)), np.sin(heading(time_s))
    return np.array([SURGE * cos - SWAY * sin, SURGE * sin + SWAY * cos, SINK])


def place(time_s):
    """Its integral."""
    cos, sin = np.cos(heading(time_s)), np.sin(heading(time_s))
    return np.array([(SURGE * sin + SWAY * cos) / RATE, (SWAY * sin - SURGE * cos) / RATE, SINK * time_s])


def in_body_at(time_s, vector):
    cos, sin = np.cos(heading(time_s)), np.sin(heading(time_s))
    return [cos * vector[0] + sin * vector[1], cos * vector[1] - sin * vector[0], vector[2]]


def attitude(t):
    wrapped = float(np.remainder(heading(t) + np.pi, 2 * np.pi) - np.pi)
    return mav.MAVLink_attitude_message(round(t * 1e3), 0, 0, wrapped, 0, 0, RATE)


def read(tmp_path, message_at, late_s=0.0, system=255):
    stamped = [(t, 1, 1, attitude(t)) for t in TIMES_S]
    stamped += [(t + late_s, system, 0 if system == 255 else 1, message_at(t)) for t in TIMES_S[2:-2]]
    return read_dive(write(tmp_path / "circle.tlog", recording(sorted(stamped, key=lambda entry: entry[0]))))


def odometry(t, velocity, frame=20, child=12, quaternion=(1.0, 0.0, 0.0, 0.0), kind=0):
    none = [NAN] * 21
    return mav.MAVLink_odometry_message(
        round(t * 1e6), frame, child, NAN, NAN, NAN, list(quaternion), *velocity, NAN, NAN, NAN, none, none, 0, kind, 90
    )  # fmt: skip


def position_delta(t, stated=True, turned=True):
    moved = (
        in_body_at(t, place(t) - place(t - EVERY_S)) if turned else np.array([SURGE, SWAY, SINK]) * EVERY_S
    )
    return mav.MAVLink_vision_position_delta_message(
        round(t * 1e6) if stated else 0, round(EVERY_S * 1e6), [0.0, 0.0, RATE * EVERY_S], [*map(float, moved)], 100
    )  # fmt: skip


def test_a_position_delta_is_the_mean_velocity_over_its_own_time_in_the_axes_of_its_middle(tmp_path):
    dive = read(tmp_path, position_delta)
    chord = np.sinc(RATE * EVERY_S / 2 / np.pi)
    assert dive.velocity.value == pytest.approx(
        np.tile([SURGE * chord, SWAY * chord, SINK], (196, 1)), abs=1e-6
    )
    assert dive.velocity.time_s == pytest.approx(TIMES_S[2:-2] - EVERY_S / 2, abs=1e-5)
    assert not dive.velocity_is_filtered


def test_a_position_delta_of_a_driver_that_states_no_time_was_never_turned(tmp_path):
    dive = read(tmp_path, lambda t: position_delta(t, stated=False, turned=False))
    assert dive.velocity.value == pytest.approx(np.tile([SURGE, SWAY, SINK], (196, 1)), abs=1e-6)
    assert dive.velocity.time_s == pytest.approx(TIMES_S[2:-2] - EVERY_S / 2, abs=1e-3)


def test_position_deltas_that_arrive_at_once_after_a_stall_are_in_order_of_their_middles(tmp_path):
    def message_at(t):
        seconds = EVERY_S * (3.0 if round(10 * t) % 3 == 0 else 1.0)
        moved = [float(v) * seconds for v in (SURGE, SWAY, SINK)]
        return mav.MAVLink_vision_position_delta_message(0, round(seconds * 1e6), [0.0] * 3, moved, 100)

    dive = read(tmp_path, message_at)
    assert len(dive.velocity) == 196
    assert (np.diff(dive.velocity.time_s) > 0).all()
    assert dive.velocity.value == pytest.approx(np.tile([SURGE, SWAY, SINK], (196, 1)), abs=1e-6)


def test_a_driver_on_the_vehicles_clock_is_dated_by_its_own_stamps_and_another_by_arrival(tmp_path):
    dated = read(tmp_path, position_delta, late_s=0.08)
    assert dated.velocity.time_s == pytest.approx(TIMES_S[2:-2] - EVERY_S / 2, abs=1e-5)
    other = read(tmp_path, lambda t: position_delta(t + 3600.0), late_s=0.08)
    assert other.velocity.time_s == pytest.approx(TIMES_S[2:-2] + 0.08 - EVERY_S / 2, abs=1e-3)


def test_a_vision_speed_is_north_east_down(tmp_path):
    def message_at(t):
        return mav.MAVLink_vision_speed_estimate_message(round(t * 1e6), *map(float, north_east_down(t)))

    dive = read(tmp_path, message_at, late_s=0.08)
    assert dive.velocity.value == pytest.approx(np.tile([SURGE, SWAY, SINK], (196, 1)), abs=1e-4)
    assert dive.velocity.time_s == pytest.approx(TIMES_S[2:-2], abs=1e-5)
    assert not dive.velocity_is_filtered


@pytest.mark.parametrize("child", [8, 9, 12])
def test_an_odometry_whose_child_is_the_body_has_body_axes_whatever_frame_its_pose_is_in(tmp_path, child):
    dive = read(tmp_path, lambda t: odometry(t, (SURGE, SWAY, SINK), frame=1, child=child), system=1)
    assert dive.velocity.value == pytest.approx(np.tile([SURGE, SWAY, SINK], (196, 1)), abs=1e-6)


def test_an_odometry_in_the_frame_of_its_pose_is_turned_by_its_own_attitude(tmp_path):
    """A local frame that is turned off north by 1 rad, as LOCAL_FRD may be."""

    def message_at(t):
        off = heading(t) - 1.0
        velocity = [SURGE * np.cos(off) - SWAY * np.sin(off), SURGE * np.sin(off) + SWAY * np.cos(off), SINK]
        pose = quaternions_from_euler(np.zeros(1), np.zeros(1), np.array([off]))[0]
        return odometry(t, [*map(float, velocity)], 20, 20, [*map(float, pose)])

    dive = read(tmp_path, message_at, system=1)
    assert dive.velocity.value == pytest.approx(np.tile([SURGE, SWAY, SINK], (196, 1)), abs=1e-6)


@pytest.mark.parametrize("child", [1, 4, 7])
def test_an_odometry_in_axes_of_the_earth_without_an_attitude_is_turned_by_the_recorded_one(tmp_path, child):
    def message_at(t):
        n, e, d = map(float, north_east_down(t))
        return odometry(t, (e, n, -d) if child == 4 else (n, e, d), 20, child, [NAN] * 4)

    dive = read(tmp_path, message_at, system=1)
    assert dive.velocity.value == pytest.approx(np.tile([SURGE, SWAY, SINK], (196, 1)), abs=1e-4)


def test_an_odometry_of_axes_that_nobody_knows_is_left_for_the_next_best_and_told(tmp_path):
    def message_at(t):
        return odometry(t, (SURGE, SWAY, SINK), frame=20, child=13)

    dive = read(tmp_path, message_at, system=1)
    assert dive.velocity is None
    assert "The velocity of ODOMETRY in child_frame_id 13 was not read." in dive.notes


@pytest.mark.parametrize("other", [1, 13])
def test_beside_an_odometry_in_body_axes_one_in_others_is_told_once_and_spoils_nothing(tmp_path, other):
    """The other comes from a filter that fuses accelerations."""

    def message_at(t):
        if round(10 * t) % 4 == 0:
            return odometry(t, (9.0, 9.0, 9.0), frame=20, child=other, kind=8)
        return odometry(t, (SURGE, SWAY, SINK))

    dive = read(tmp_path, message_at, system=1)
    assert dive.velocity.value == pytest.approx(np.tile([SURGE, SWAY, SINK], (147, 1)), abs=1e-6)
    told = f"The velocity of ODOMETRY in child_frame_id {other} was not read; that in child_frame_id 12 was."
    assert [note for note in dive.notes if "ODOMETRY" in note] == [told]


def test_where_the_filters_odometry_is_read_another_beside_it_makes_it_no_sensors(tmp_path):
    def message_at(t):
        is_other = round(10 * t) % 4 == 0
        return odometry(t, (SURGE, SWAY, SINK), child=13 if is_other else 12, kind=0 if is_other else 8)

    assert read(tmp_path, message_at, system=1).velocity_is_filtered


def test_an_odometry_in_body_axes_alone_needs_no_note(tmp_path):
    dive = read(tmp_path, lambda t: odometry(t, (SURGE, SWAY, SINK)), system=1)
    assert not [note for note in dive.notes if "ODOMETRY" in note]


@pytest.mark.parametrize(("kind", "filtered"), [(0, False), (2, False), (3, True), (8, True)])
def test_an_odometry_of_an_estimator_that_fuses_accelerations_is_a_filters(tmp_path, kind, filtered):
    dive = read(tmp_path, lambda t: odometry(t, (SURGE, SWAY, SINK), kind=kind), system=1)
    assert dive.velocity_is_filtered is filtered


def test_turning_to_the_earth_undoes_turning_to_the_body():
    rng = np.random.default_rng(1)
    attitudes, vectors = rng.standard_normal((50, 4)), rng.standard_normal((50, 3))
    attitudes /= np.linalg.norm(attitudes, axis=1, keepdims=True)
    assert to_body(attitudes, to_earth(attitudes, vectors)) == pytest.approx(vectors)


def test_the_yaw_rate_is_the_fibre_optic_gyros_where_it_reads_and_else_the_imus():
    imu = Signal(np.arange(3.0), np.tile([0.1, 0.2, 0.3], (3, 1)))
    both = Dive("both", Path("both.tlog"), "0", gyro=imu, fog=Signal(np.arange(2.0), np.full((2, 1), 0.35)))
    assert both.yaw_rate is both.fog
    for fog in (None, Signal(np.zeros(0), np.zeros((0, 1)))):
        assert replace(both, fog=fog).yaw_rate.value.tolist() == [[0.3]] * 3
    assert Dive("none", Path("none.tlog"), "0").yaw_rate is None


SPEED, SECONDS = 0.5, 400.0


def dive(
    scale=1.0, heading_error=0.0, heading=0.7, seconds=SECONDS, surfacings=((0.0, 10.0), (390.0, 400.0))
):
    """A run at constant speed and heading; the DVL reads `scale` times too little, the compass errs."""
    time_s = np.arange(0.0, seconds, 0.1)
    velocity = np.tile([SPEED / scale, 0.0, 0.0], (len(time_s), 1))
    compass = heading - heading_error
    attitude = np.tile([math.cos(compass / 2), 0.0, 0.0, math.sin(compass / 2)], (len(time_s), 1))
    fixes = np.concatenate([np.arange(*span) for span in surfacings])
    north, east = SPEED * fixes * math.cos(heading), SPEED * fixes * math.sin(heading)
    latitude = 44.0 + np.degrees(north / 6_371_000.0)
    longitude = 11.0 + np.degrees(east / 6_371_000.0 / math.cos(math.radians(44.0)))
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
    check = check_fixes(dive())
    assert check.scale == pytest.approx(1.0, abs=1e-3)
    assert check.heading_rad == pytest.approx(0.0, abs=1e-3)
    assert check.distance_m == pytest.approx(195.0, abs=0.5)


def test_a_dvl_that_reads_two_per_cent_too_little_and_a_compass_three_degrees_off_are_found():
    check = check_fixes(dive(scale=1.02, heading_error=math.radians(3.0)))
    assert check.scale == pytest.approx(1.02, abs=1e-3)
    assert math.degrees(check.heading_rad) == pytest.approx(3.0, abs=0.02)
    assert "1.020" in check.sentence
    assert "+3.0" in check.sentence


def test_the_uncertainty_is_that_of_the_fixes_over_the_distance():
    check = check_fixes(dive())
    assert check.scale_std == pytest.approx(0.5 * math.sqrt(2) / 195.0, rel=1e-2)


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
