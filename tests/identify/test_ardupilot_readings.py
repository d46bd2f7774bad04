"""What an ArduPilot did to readings before they were logged: resets, filters, age, and steps of a DVL."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from autopilot_log import FORMATS, LATE_S, Turning, dataflash, logged
from built_recordings import Stamped, array, attitude, heartbeat, recording, servos, write
from pymavlink.dialects.v20 import ardupilotmega as mav

from identify.dive import Dive, Signal
from identify.ingest.mavlink import step_velocity
from identify.ingest.mavlink.heading_resets import without_heading_resets
from identify.ingest.mavlink.held_pressure import OLDEST_S, age_s, dated
from identify.ingest.mavlink.low_pass import delay_s, undone
from identify.ingest.open import read_dive
from identify.ingest.rotation import euler_angles, quaternions_from_euler

TIME_S = np.arange(0.0, 30.0, 0.1)
GYRO_S = np.arange(0.0, 30.0, 0.04)
ROLL, PITCH = 0.2, -0.1
DEG = np.pi / 180


def heading(time_s):
    return 0.3 * np.sin(0.5 * time_s)


def dive(steps=()):
    """A vehicle that turns slowly, rolled and pitched; `steps`: time and size of each reset, s and rad."""
    rng = np.random.default_rng(4)
    psi = heading(TIME_S) + 1e-4 * rng.normal(size=len(TIME_S))
    for at_s, by in steps:
        psi = psi + by * (at_s <= TIME_S)
    held = np.full(len(TIME_S), 1.0)
    # Body rates of a turn about the world's down axis (Fossen 2011, eq. 2.28).
    turning = 0.15 * np.cos(0.5 * GYRO_S)
    down = np.array([-np.sin(PITCH), np.sin(ROLL) * np.cos(PITCH), np.cos(ROLL) * np.cos(PITCH)])
    return Dive(
        "turns",
        Path("turns.BIN"),
        "1" * 64,
        attitude=Signal(TIME_S, quaternions_from_euler(ROLL * held, PITCH * held, psi)),
        gyro=Signal(GYRO_S, turning[:, None] * down),
    )


def test_a_dive_whose_heading_only_turns_is_left_as_it_is():
    turning = dive()
    assert without_heading_resets(turning) is turning


def test_headings_before_a_reset_are_turned_by_it_and_roll_and_pitch_stay():
    mended = without_heading_resets(dive([(10.0, -0.02), (20.0, 0.05)]))
    roll, pitch, psi = euler_angles(mended.attitude.value)
    np.testing.assert_allclose(psi, heading(TIME_S) + 0.03, atol=1.5e-3)
    np.testing.assert_allclose(roll, ROLL, atol=1e-9)
    np.testing.assert_allclose(pitch, PITCH, atol=1e-9)
    (note,) = mended.notes
    assert "-1.1 deg at 10 s" in note
    assert "+2.9 deg at 20 s" in note


def test_a_correction_within_a_second_is_taken_off_as_a_whole():
    """1.5 deg in half a second: 0.3 deg from each attitude to the next."""
    moves = dive([(15.0 + 0.1 * k, 1.5 * DEG / 5) for k in range(5)])
    mended = without_heading_resets(moves)
    _, _, psi = euler_angles(mended.attitude.value)
    away = (TIME_S < 14.0) | (TIME_S > 16.5)
    np.testing.assert_allclose(psi[away], heading(TIME_S[away]) + 1.5 * DEG, atol=3e-3)
    (note,) = mended.notes
    assert "by +1.5 deg at 15 s" in note


def test_a_gyro_that_reads_every_turn_too_small_is_no_correction():
    """By 5 %: in half of its turns the heading runs away from it by more than 0.3 deg within a second."""
    turning = dive()
    weak = replace(turning, gyro=Signal(GYRO_S, 0.95 * turning.gyro.value))
    assert without_heading_resets(weak) is weak


def test_a_last_window_that_ends_a_hair_beyond_the_last_attitude_is_looked_at_all_the_same():
    """By the rounding of sums."""
    time_s = 1.844 + np.arange(46) / 3.0
    begins_s = np.arange(time_s[0], time_s[-1] - 1.0, 0.25)
    assert begins_s[-1] + 1.0 > time_s[-1]
    still, level = np.zeros((len(GYRO_S), 3)), 0.0 * time_s
    gyro = Signal(GYRO_S, still)
    attitude = Signal(time_s, quaternions_from_euler(level, level, 1e-4 * np.sin(time_s)))
    at_rest = Dive("still", Path("still.tlog"), "1" * 64, attitude=attitude, gyro=gyro)
    assert without_heading_resets(at_rest) is at_rest


def test_a_heading_that_wanders_for_long_is_left_as_it_is():
    wanders = dive([(10.0 + 0.1 * k, 0.2 * DEG) for k in range(100)])
    assert without_heading_resets(wanders) is wanders


def turned_at(at_s, rate_rad_s, gyro_every, reset=0.0):
    """Turns at a rate between times, with the attitude at 10 Hz and a gyro every so many ms; `reset` at 15 s."""
    fine_s = np.arange(0.0, 30.0, 0.001)
    rate = np.interp(fine_s, at_s, rate_rad_s)
    turned = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * 0.001)])
    turned += reset * (fine_s >= 15.0)
    read, gyro = np.arange(0, len(fine_s), 100), np.arange(0, len(fine_s), gyro_every)
    level, none = np.zeros(len(read)), np.zeros(len(gyro))
    return Dive(
        "hard", Path("hard.tlog"), "1" * 64,
        attitude=Signal(fine_s[read], quaternions_from_euler(level, level, turned[read])),
        gyro=Signal(fine_s[gyro], np.column_stack((none, none, rate[gyro]))),
    )  # fmt: skip


def test_a_turn_that_begins_hard_between_two_slow_samples_is_no_reset():
    """Half a turn a second, begun within a tenth of a second in the middle between readings at 10 Hz."""
    hard = turned_at([0.0, 20.02, 20.09, 23.0, 23.1, 30.0], [0.0, 0.0, 2.8, 2.8, 0.0, 0.0], gyro_every=100)
    assert without_heading_resets(hard) is hard


def test_a_twitch_between_two_attitudes_that_a_fast_gyro_saw_is_no_reset_and_hides_none():
    """0.08 s at 1 rad/s."""
    twitch = ([0.0, 20.01, 20.02, 20.08, 20.09, 30.0], [0.0, 0.0, 1.0, 1.0, 0.0, 0.0])
    turned = turned_at(*twitch, gyro_every=10)
    assert without_heading_resets(turned) is turned
    beside = turned_at([0.0, 14.91, 14.92, 14.98, 14.99, 30.0], twitch[1], gyro_every=10, reset=0.05)
    (note,) = without_heading_resets(beside).notes
    assert "by +2.9 deg at 15 s" in note


@pytest.mark.parametrize("lacking", ["gyro", "attitude"])
def test_without_a_gyro_or_an_attitude_nothing_is_said_of_resets(lacking):
    bare = replace(dive([(10.0, 0.05)]), **{lacking: None})
    assert without_heading_resets(bare) is bare


def test_a_gap_between_two_headings_is_no_reset():
    whole = dive([(12.0, 0.5)])
    kept = (TIME_S < 10.0) | (TIME_S > 14.0)
    gap = replace(whole, attitude=Signal(TIME_S[kept], whole.attitude.value[kept]))
    assert without_heading_resets(gap) is gap


def test_a_heading_that_passes_from_pi_to_minus_pi_is_no_reset():
    past = replace(
        dive(),
        attitude=Signal(TIME_S, quaternions_from_euler(0 * TIME_S, 0 * TIME_S, np.pi - 0.1 + 0.1 * TIME_S)),
    )
    turning = replace(past, gyro=Signal(GYRO_S, np.column_stack([0 * GYRO_S, 0 * GYRO_S, 0.1 + 0 * GYRO_S])))
    assert without_heading_resets(turning) is turning


def test_a_stamp_that_stumbles_in_a_fast_turn_is_no_reset():
    """As in a bag without header times, whose log gets a reading some milliseconds sooner or later than usual."""
    time_s = np.arange(0.0, 30.0, 0.02)
    read_s = time_s.copy()
    read_s[[310, 620, 941]] += 0.012
    psi = np.sin(2.0 * read_s) + 1e-5 * np.random.default_rng(5).normal(size=len(time_s))
    turning = np.column_stack([0.0 * GYRO_S, 0.0 * GYRO_S, 2.0 * np.cos(2.0 * GYRO_S)])
    level = 0.0 * time_s
    attitude = Signal(time_s, quaternions_from_euler(level, level, psi))
    fast = Dive("turns", Path("turns.bag"), "1" * 64, attitude=attitude, gyro=Signal(GYRO_S, turning))
    assert without_heading_resets(fast) is fast


PA_PER_M = 10_050.0
PITCH_RAD = 0.3
AT_REST = np.array([np.cos(PITCH_RAD / 2), 0.0, np.sin(PITCH_RAD / 2), 0.0])


def down_m_s(time_s):
    return 0.2 * np.sin(2 * np.pi * time_s / 4.0)


def depth_m(time_s):
    return 8.0 - 0.2 * 4.0 / (2 * np.pi) * np.cos(2 * np.pi * time_s / 4.0)


def pitched(size=1.0):
    """A DVL's velocity and the attitude of a vehicle, its bow up, that rises and sinks as it goes ahead and astern."""
    time_s = np.arange(0.0, 120.0, 0.1)
    down = size * down_m_s(time_s)
    velocity = np.column_stack([-np.sin(PITCH_RAD) * down, 0.0 * down, np.cos(PITCH_RAD) * down])
    noise = np.random.default_rng(1).normal(0.0, 0.004, velocity.shape)
    attitude_s = np.arange(0.0, 120.0, 0.02)
    return Signal(time_s, velocity + noise), Signal(attitude_s, np.tile(AT_REST, (len(attitude_s), 1)))


def pressure(late_s):
    time_s = np.arange(1.03, 119.0, 0.1)
    noise = np.random.default_rng(2).normal(0.0, 20.0, len(time_s))
    return Signal(time_s, (101_325.0 + PA_PER_M * depth_m(time_s - late_s) + noise)[:, None])


@pytest.mark.parametrize("late_s", [0.03, 0.085, 0.12])
def test_the_age_is_that_at_which_the_depth_goes_with_the_dvl(late_s):
    assert age_s(pressure(late_s), *pitched()) == pytest.approx(late_s, abs=0.003)


def test_spikes_and_a_gap_of_the_dvl_do_not_bend_it():
    spiky, (velocity, attitude_of) = pressure(0.03), pitched()
    spiky.value[100::200] += 5_000.0
    heard = (velocity.time_s < 40.0) | (velocity.time_s > 55.0)
    gappy = Signal(velocity.time_s[heard], velocity.value[heard])
    assert age_s(spiky, gappy, attitude_of) == pytest.approx(0.03, abs=0.003)


def test_an_attitude_that_is_never_known_leaves_the_usual_age():
    velocity, attitude_of = pitched()
    unknown = Signal(attitude_of.time_s, np.full_like(attitude_of.value, np.nan))
    made = dated(pressure(0.03), velocity, unknown)
    assert made.time_s == pytest.approx(pressure(0.03).time_s - 0.085)


def test_a_depth_that_tells_nothing_leaves_the_usual_age():
    velocity, attitude_of = pitched(size=0.0)
    level = Signal(pressure(0.0).time_s, np.full((len(pressure(0.0).time_s), 1), 180_000.0))
    assert age_s(level, velocity, attitude_of) == 0.085
    short = Signal(velocity.time_s[:20], velocity.value[:20])
    assert age_s(pressure(0.03), short, attitude_of) == 0.085


@pytest.mark.parametrize(("late_s", "age"), [(-0.2, 0.0), (0.4, OLDEST_S)])
def test_a_dvl_that_is_late_or_early_itself_bends_it_no_further_than_a_pressure_may_be_old(late_s, age):
    assert age_s(pressure(late_s), *pitched()) == age


def test_a_recording_with_a_dvl_has_its_ardusubs_pressure_at_the_age_that_this_shows(tmp_path):
    stamped: list[Stamped] = []
    for k in range(300):
        t = k / 10
        moved = [0.0, 0.0, 0.1 * float(down_m_s(np.array(t)))]
        hpa = 1000.0 + 1e-2 * PA_PER_M * float(depth_m(np.array(t - 0.03)))
        stamped += [
            (t, 1, 1, attitude(t, 0.0)),
            (t, 1, 1, servos(round(t * 1e6), [1500, 1600])),
            (t, 1, 1, mav.MAVLink_scaled_pressure2_message(100 * k, hpa, 0, 2000)),
            (
                t,
                1,
                191,
                mav.MAVLink_vision_position_delta_message(int(t * 1e6), 100_000, [0] * 3, moved, 100),
            ),
            (t, 1, 191, array(t, "TAU_CMD", (1.0,))),
        ]
        if k % 10 == 0:
            stamped.append((t, 1, 1, heartbeat(autopilot=3)))
    dive = read_dive(write(tmp_path / "a.tlog", recording(stamped)))
    assert not dive.velocity_is_filtered
    assert dive.pressure.time_s[50] == pytest.approx(5.0 - 0.03, abs=0.004)


def butterworth(corner_hz, rate_rad_s):
    """Delay of a Butterworth filter of second order at a rate: the fall of its phase."""

    def phase(rate):
        s = 1j * rate / (2 * math.pi * corner_hz)
        return np.angle(1.0 / (s * s + math.sqrt(2) * s + 1.0))

    return -(phase(rate_rad_s * 1.001) - phase(rate_rad_s * 0.999)) / (0.002 * rate_rad_s)


def test_the_delay_is_that_of_a_butterworth_filter_for_all_that_a_vehicle_does():
    assert delay_s(20.0) == pytest.approx(butterworth(20.0, 2 * math.pi * 1.0), rel=0.01)
    assert delay_s(0.0) == 0.0


@pytest.mark.parametrize(("turn_hz", "left"), [(1.0, 0.002), (5.0, 0.006), (10.0, 0.01)])
def test_of_quick_turns_nothing_but_the_delay_is_left(turn_hz, left):
    """At 10 Hz a filter of 20 Hz turns the phase by 0.05 rad more than its delay, and takes 3 % away."""
    time_s, corner_hz = np.arange(0.0, 4.0, 0.02), 20.0
    s = 1j * turn_hz / corner_hz
    turning = np.exp(2j * np.pi * turn_hz * time_s)
    behind = Signal(time_s, (turning / (s * s + math.sqrt(2) * s + 1.0)).real[:, None].repeat(3, 1))
    delayed = (turning * np.exp(-2j * np.pi * turn_hz * delay_s(corner_hz))).real
    inner = slice(2, -2)
    off = undone(behind, corner_hz).value[inner] - delayed[inner, None]
    assert np.sqrt(2) * off.std() < left
    if turn_hz == 10.0:
        assert np.sqrt(2) * (behind.value[inner, 0] - delayed[inner]).std() > 0.05


def test_a_rate_beside_a_lost_message_stays_and_so_do_rates_that_come_too_seldom():
    time_s = np.delete(np.arange(0.0, 2.0, 0.02), 50)
    rates = Signal(time_s, np.sin(60.0 * time_s)[:, None])
    off = np.flatnonzero(undone(rates, 20.0).value[:, 0] == rates.value[:, 0])
    assert off.tolist() == [0, 1, 48, 49, 50, 51, 97, 98]
    seldom = Signal(time_s[::2], rates.value[::2])
    assert undone(seldom, 20.0) is seldom


@pytest.mark.parametrize(("stated", "late_s"), [(20.0, LATE_S), (10.0, 2 * LATE_S), (0.0, 0.0)])
def test_a_dataflash_log_is_dated_by_the_corner_it_states(tmp_path, stated, late_s):
    logged(
        tmp_path / "1.BIN",
        Turning(),
        lambda boot_s: boot_s,
        seconds=20.0,
        parameters={"INS_GYRO_FILTER": stated},
    )
    dive = read_dive(tmp_path / "1.BIN")
    assert dive.pwm.time_s[0] - dive.gyro.time_s[0] == pytest.approx(late_s, abs=1e-6)


@pytest.mark.parametrize(("autopilot", "late_s"), [(mav.MAV_AUTOPILOT_ARDUPILOTMEGA, 2 * LATE_S), (12, 0.0)])
def test_a_tlog_is_dated_by_what_the_autopilot_itself_says_and_only_ardupilots(tmp_path, autopilot, late_s):
    """A companion of the same system may state a parameter of that name for itself."""
    stamped = []
    for k in range(400):
        messages = [
            mav.MAVLink_attitude_message(20 * k, 0.0, 0.0, 0.0, 0.0, 0.0, math.sin(k)),
            servos(20_000 * k, [1500 + k % 7] * 8),
        ]
        if k % 50 == 0:
            corner = mav.MAVLink_param_value_message(b"INS_GYRO_FILTER", 10.0, 9, 1356, 7)
            messages += [heartbeat(autopilot=autopilot), corner]
        stamped += [(k / 50, 1, 1, message) for message in messages]
    stamped.append((8.0, 1, 191, mav.MAVLink_param_value_message(b"INS_GYRO_FILTER", 80.0, 9, 3, 1)))
    dive = read_dive(write(tmp_path / "t.tlog", recording(stamped)))
    np.testing.assert_allclose(dive.attitude.time_s - dive.gyro.time_s, late_s, atol=1e-6)


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
