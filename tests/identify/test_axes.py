"""Signals on one grid, axes with exact answers, and the wrench through curve, lag and geometry."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import closed_loop
import numpy as np
import pytest
from fakes.shared import shared
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.arrays import Array
from bridge.errors import FitError
from bridge.vehicle.coefficients import YAW
from bridge.vehicle.config import (
    Configuration,
    Device,
    Mounting,
    Sensors,
    ThrustCurve,
    Thruster,
    Vehicle,
    VehicleFile,
    load_vehicle,
)
from bridge.vehicle.dynamics import coriolis
from identify.align import aligned, low_pass
from identify.dive import Dive, Signal
from identify.estimators.axes import events
from identify.estimators.axes.build import build_axes
from identify.estimators.axes.motion import Motion
from identify.estimators.axes.readings import PITCH, ROLL, at_origin, averaged, poses_of
from identify.ingest.open import read_dive
from identify.ingest.rotation import attitude_at, quaternions_from_euler
from identify.thrust.wrench import wrench
from identify.thrust.wrench_history import halfway_between

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
    poses = poses_of(recorded(attitude=attitude), vehicle_file(), motion, attitude_at(attitude, TIME_S[:200]))
    assert np.ptp(roll) > 0.2
    np.testing.assert_allclose(poses[ROLL].reading.value[:, 0], 0.0, atol=1e-6)
    lost = poses[PITCH].carried + np.cumsum(nu[:, 5] * np.sin(roll)) * 0.02
    np.testing.assert_allclose(lost, 0.0, atol=1e-3)


def test_depth_is_left_with_what_heave_velocity_adds_to_it():
    angle, surge = -0.1, 0.5
    level = np.zeros_like(TIME_S)
    attitude = Signal(TIME_S, quaternions_from_euler(level, level + angle, level))
    sunk = -np.sin(angle) * surge * TIME_S + 0.05 * np.cos(angle) * TIME_S
    nu = np.zeros((len(TIME_S), 6))
    nu[:, 0], nu[:, 2] = surge, 0.05
    dive = recorded(depth=Signal(TIME_S, sunk[:, None]), attitude=attitude)
    poses = poses_of(dive, vehicle_file(), Motion(TIME_S, nu), attitude.value)
    np.testing.assert_allclose(poses[2].reading.value[:, 0], 0.05 * TIME_S, atol=1e-9)


def test_the_mean_over_an_interval_is_exact_for_what_is_straight_and_zero_where_there_is_none():
    motion = Motion(TIME_S, np.zeros((len(TIME_S), 6)))
    start, end = np.array([1.0, 2.01, 5.0]), np.array([1.5, 2.03, 5.0])
    mean = motion.mean_between(3.0 * TIME_S, start, end)
    np.testing.assert_allclose(mean[:2], 1.5 * (start + end)[:2], rtol=1e-3)
    assert mean[2] == 0.0


def test_long_steps_are_divided_and_the_forces_reach_the_last_event():
    built = build_axes(
        closed_loop.dive(np.random.default_rng(1), seconds=30.0), closed_loop.vehicle_file(), "only"
    )
    (axis,) = built.axes
    assert axis.step_s.max() <= 0.05 + 1e-9
    assert np.isnan(axis.reading).sum() == np.isfinite(axis.reading).sum() - 1
    named = np.where(axis.step >= 0, axis.different_s[axis.step], 0.0)
    np.testing.assert_array_equal(named, axis.step_s)
    assert built.motion.time_s[-1] >= axis.time_s[-1]


def test_thrust_by_stamps_that_are_trusted_less_may_come_earlier_or_later():
    dive, file = closed_loop.dive(np.random.default_rng(1), seconds=30.0), closed_loop.vehicle_file()
    (plain,) = build_axes(dive, file, "only").axes
    (axis,) = build_axes(replace(dive, stamped_s=2.5e-3), file, "only").axes
    (timing,) = axis.timing
    later = replace(dive, pwm=None, tau_cmd=Signal(dive.tau_cmd.time_s + 2e-3, dive.tau_cmd.value))
    (moved,) = build_axes(later, file, "only").axes
    assert (plain.timing, timing.spread) == ((), 2.5e-3)
    _, here, there = np.intersect1d(plain.time_s, moved.time_s, return_indices=True)
    by_2_ms = (moved.force[there] - plain.force[here]).mean(axis=1)[5:-5]
    by_1_s = timing.force[here][5:-5]
    assert by_1_s @ by_2_ms / (by_1_s @ by_1_s) == pytest.approx(2e-3, rel=0.4)


def test_thrust_by_stamps_that_are_trusted_less_answers_no_reading_before_its_time():
    """Thrust 40 ms early knew the noise of a gyro that a controller answers, and was taken for thrust 230 ms late."""
    dive, file = closed_loop.dive(np.random.default_rng(1), seconds=30.0), closed_loop.vehicle_file()
    at_s = float(dive.tau_cmd.time_s.mean())
    other = np.where(dive.tau_cmd.time_s[:, None] < at_s, dive.tau_cmd.value, dive.tau_cmd.value + 5.0)
    whole, changed = (
        build_axes(replace(dive, stamped_s=0.1, pwm=None, tau_cmd=command), file, "only").axes[0]
        for command in (dive.tau_cmd, Signal(dive.tau_cmd.time_s, other))
    )
    before = whole.time_s <= at_s
    assert before.any()
    np.testing.assert_array_equal(changed.timing[0].force[before], whole.timing[0].force[before])
    assert np.abs(changed.timing[0].force[~before] - whole.timing[0].force[~before]).max() > 5.0


def test_fast_readings_become_means_of_equal_lengths_of_time_and_slow_ones_stay():
    fast = Signal(np.arange(4000) / (400.0), np.arange(4000.0)[:, None])
    mean, count = averaged(fast)
    assert set(count[1:-1]) == {4.0}
    np.testing.assert_allclose(mean.value[:, 0], 400.0 * mean.time_s)
    slow = Signal(np.arange(100) / 100.0, np.zeros((100, 1)))
    assert averaged(slow)[0] is slow


def test_a_gap_is_no_part_of_a_mean():
    time_s = np.concatenate([np.arange(400), np.arange(4000, 4400)]) / (400.0)
    mean, _ = averaged(Signal(time_s, time_s[:, None]))
    inside = (mean.time_s > time_s[399]) & (mean.time_s < time_s[400])
    assert not inside.any()


@pytest.mark.parametrize("dof", [0, 2])
def test_an_axis_that_no_thruster_pushes_is_said_to_be_one(dof):
    dive = closed_loop.dive(np.random.default_rng(2), seconds=30.0)
    dive.velocity.value[:] += 0.004 * np.random.default_rng(3).standard_normal(dive.velocity.value.shape)
    built = build_axes(dive, closed_loop.vehicle_file(), "only")
    assert dof in {axis.dof for axis in built.axes}
    assert (dof in built.unpushed) is (dof > 0)


def test_the_coriolis_forces_of_any_masses_are_those_of_unit_masses_times_them():
    rng = np.random.default_rng(3)
    motion, mass = Motion(0.1 * np.arange(50), rng.normal(size=(50, 6))), rng.uniform(1.0, 40.0, 6)
    whole = np.stack(coriolis(mass.tolist(), tuple(motion.nu.T)))
    np.testing.assert_allclose(np.einsum("dkm,k->dm", motion.coriolis, mass), whole, rtol=1e-12, atol=1e-12)


RATE_HZ = 10.0


def sampled(rate_hz, *columns, seconds=40.0):
    """Each column a function of time, or a constant."""
    time_s = np.arange(int(seconds * rate_hz)) / rate_hz
    values = [column(time_s) if callable(column) else np.full(len(time_s), column) for column in columns]
    return Signal(time_s, np.column_stack(values))


def surge(time_s):
    value: Array = 0.3 * np.sin(2 * np.pi * 0.1 * time_s)
    return value


def dive(**signals):
    still = {"tau_cmd": sampled(20.0, *[1.0] * 6), "gyro": sampled(25.0, 0.0, 0.0, 0.0)}
    return recorded(**{**still, **signals})


def test_a_slow_sine_passes_without_delay_and_with_its_derivative():
    grid = aligned(
        dive(velocity=sampled(7.0, surge, 0.0, 0.0)), vehicle_file(), "only", RATE_HZ, cutoff_hz=1.0
    )
    inner = slice(30, -30)
    assert grid.nu[inner, 0] == pytest.approx(surge(grid.time_s[inner]), abs=2e-3)
    slope = 0.3 * 2 * np.pi * 0.1 * np.cos(2 * np.pi * 0.1 * grid.time_s)
    assert grid.nu_dot[inner, 0] == pytest.approx(slope[inner], abs=3e-3)
    assert grid.tau[:, 0] == pytest.approx(1.0)


def test_the_gain_at_the_cut_off_is_a_half_and_above_nyquist_nothing_happens():
    time_s = np.arange(2000) / RATE_HZ
    wave = np.sin(2 * np.pi * 1.0 * time_s)[:, None]
    filtered = low_pass(wave, RATE_HZ, 1.0)
    assert filtered[500:1500, 0] == pytest.approx(0.5 * wave[500:1500, 0], abs=1e-3)
    assert low_pass(wave, RATE_HZ, 5.0) is wave


def test_a_fog_mean_counts_at_the_time_that_it_carries():
    """It is dated at the middle of its interval, so that of a steadily rising rate it is the rate itself."""
    rising = dive(fog=sampled(5.0, lambda t: 0.01 * t))
    grid = aligned(rising, vehicle_file(), "only", cutoff_hz=RATE_HZ)
    assert grid.nu[5:-5, 5] == pytest.approx(0.01 * grid.time_s[5:-5], abs=1e-9)


def test_where_bottom_lock_was_lost_the_grid_says_so():
    velocity = sampled(10.0, 0.1, 0.0, 0.0)
    velocity.value[100:150] = np.nan
    grid = aligned(dive(velocity=velocity), vehicle_file(), "only")
    lost = (grid.time_s > 10.2) & (grid.time_s < 14.7)
    assert not grid.valid[lost].any()
    assert grid.valid[(grid.time_s < 9.9) | (grid.time_s > 15.0)].all()


def test_what_is_not_measured_is_zero_and_named():
    grid = aligned(dive(), vehicle_file(), "only")
    assert grid.has.tolist() == [False] * 3 + [True] * 3
    assert not grid.nu.any()
    assert grid.attitude[0].tolist() == [1.0, 0.0, 0.0, 0.0]


def test_commands_too_rare_to_know_the_force_between_them_are_refused():
    rare = dive(velocity=sampled(10.0, 0.1, 0.0, 0.0), tau_cmd=sampled(2.0, *[1.0] * 6))
    with pytest.raises(FitError, match=r"commands come at 2\.0 Hz"):
        aligned(rare, vehicle_file(), "only")


def stepping():
    """At 5 Hz the log shows a stick that rests, steps from 0 to 10 N at 20 s, and rests."""
    push = sampled(5.0, lambda t: np.where(t < 20.0, 0.0, 10.0), *[0.0] * 5)
    return dive(velocity=sampled(10.0, surge, 0.0, 0.0), tau_cmd=push)


def test_slow_samples_hide_force_where_the_commands_change_and_none_while_they_rest():
    forces = wrench(stepping(), vehicle_file(), "only").along(0)
    assert forces.sampled_s == pytest.approx(0.2)
    # A step of 10 N at an unknown time within 0.2 s: a twelfth of its square in each of 199 intervals, on average.
    assert forces.hidden[0] ** 2 == pytest.approx(10.0**2 * 0.2 / 12.0 / 199.0)
    start_s = np.array([5.0, 19.8, 30.0])
    assert forces.hidden_power_between(start_s, start_s + 0.2)[:, 0] == pytest.approx([0.0, 199.0, 0.0])
    assert forces.hidden_power_between(np.array([0.0]), np.array([39.8]))[0, 0] == pytest.approx(1.0)


def test_slow_samples_that_step_halfway_give_the_same_impulse_in_the_end():
    axis = build_axes(stepping(), vehicle_file(), "only").axes[0]
    assert axis.stepped is not None
    beside = np.abs(axis.time_s - 19.9) > 0.3
    np.testing.assert_allclose(axis.stepped[beside], 0.0, atol=0.01)
    assert np.max(np.abs(axis.stepped)) > 1.0
    assert axis.stepped @ axis.step_s == pytest.approx(0.0, abs=1e-3)
    samples = Signal(np.array([0.0, 1.0, 3.0]), np.array([[2.0], [4.0], [8.0]]))
    assert halfway_between(samples).time_s.tolist() == [0.0, 0.5, 2.0]


def test_an_axis_is_not_judged_where_an_autopilot_may_level_it_between_two_slow_samples():
    def missing(rate_hz, moment_nm):
        push = sampled(rate_hz, surge, 0.0, 0.0, lambda t: moment_nm * np.sin(9.0 * t), 0.0, 0.0)
        rolling = sampled(25.0, lambda t: 0.1 * np.sin(9.0 * t), 0.0, 0.0)
        return build_axes(dive(tau_cmd=push, gyro=rolling), vehicle_file(), "only").missing.get(ROLL, "")

    said = missing(10.0, 0.01)
    assert said.startswith("hardly any thrust went into roll")
    assert "commands that are known every 0.1 s hide its answers; push there" in said
    assert missing(50.0, 0.01) == missing(10.0, 0.0) == ""


def test_small_thrusters_turn_a_small_vehicle_whatever_limit_its_file_leaves():
    """Two of 6 N at most, 0.1 m aside, make a moment that is small beside the 40 N that a file has by default."""
    aside = tuple(Thruster((1.0, 0.0, 0.0), (0.0, y, 0.0)) for y in (-0.1, 0.1))
    shape = Configuration(5.0, (0.05, 0.06, 0.07), aside)
    curve = ThrustCurve(kind="quadratic", max_n=6.0)
    file = VehicleFile(Path("a.yaml"), Vehicle("a", {"only": shape}, thrust_curve=curve), None, "0" * 64)
    pwm = sampled(10.0, *(lambda t, side=side: 1600.0 + side * 10.0 * np.sin(t) for side in (1.0, -1.0)))
    turning = recorded(pwm=pwm, gyro=sampled(25.0, 0.0, 0.0, lambda t: 0.1 * np.sin(t)))
    assert YAW in [axis.dof for axis in build_axes(turning, file, "only").axes]


def test_the_steps_of_an_axis_know_where_the_log_hides_most():
    axis = build_axes(stepping(), vehicle_file(), "only").axes[0]
    some = axis.step >= 0
    np.testing.assert_allclose(axis.different_s[axis.step[some]], axis.step_s[some])
    times = axis.white_times[axis.step[some]]
    changes = (axis.time_s[some] > 19.9) & (axis.time_s[some] < 20.0)
    at_rest = np.abs(axis.time_s[some] - 20.0) > 1.0
    assert np.ptp(times[at_rest]) == 0.0
    assert times[changes].min() > 40.0 * times[at_rest].max()


def test_quick_commands_hide_the_same_all_the_time():
    axis = build_axes(dive(velocity=sampled(10.0, surge, 0.0, 0.0)), vehicle_file(), "only").axes[0]
    assert (axis.white_times == 1.0).all()


LAG_S = 0.2
QUADRATIC = ThrustCurve(kind="quadratic", max_n=40.0, span_us=400.0, lag_s=LAG_S)
TWIN = (Thruster((1.0, 0.0, 0.0), (0.0, -0.5, 0.0)), Thruster((1.0, 0.0, 0.0), (0.0, 0.5, 0.0)))


def thruster_vehicle(curve=QUADRATIC, thrusters=TWIN):
    shape = Configuration(dry_mass_kg=10.0, inertia_kgm2=(1.0, 1.0, 1.0), thrusters=thrusters)
    return VehicleFile(Path("twin.yaml"), Vehicle("twin", {"twin": shape}, thrust_curve=curve), None, "0")


def pwm(time_s, *rows):
    return Signal(np.array(time_s), np.array(rows, np.float64))


STEP = pwm([0.0, 1.0, 2.0], (1500.0, 1500.0), (1700.0, 1700.0), (1500.0, 1700.0))


def history():
    return wrench(recorded(pwm=STEP), thruster_vehicle(), "twin")


def test_a_step_answers_with_the_exponential_of_the_lag():
    # Each thruster gives 40 * 0.5^2 = 10 N at 1700 us.
    at = history().at(np.array([0.5, 1.0, 1.2, 1.9]))
    assert at[:, 0] == pytest.approx([0.0, 0.0, 20 * (1 - np.exp(-1)), 20 * (1 - np.exp(-4.5))])
    assert np.abs(at[:, 1:]).max() == 0.0


def test_one_component_alone_is_that_of_all():
    start_s, end_s = np.array([0.3, 1.1, 1.9]), np.array([1.4, 1.1, 2.6])
    whole, yaw = history(), history().along(5)
    assert np.array_equal(yaw.at(end_s), whole.at(end_s)[:, [5]])
    assert np.array_equal(yaw.halves_between(start_s, end_s), whole.halves_between(start_s, end_s)[:, :, [5]])
    assert yaw.hidden == pytest.approx(whole.hidden[[5]])


def test_one_thruster_alone_turns_the_vehicle():
    # At y = 0.5 a push of 10 N forward turns to port: N = -y X.
    late = history().at(np.array([10.0]))[0]
    assert late == pytest.approx([10, 0, 0, 0, 0, -5], abs=1e-12)


def test_two_halves_carry_the_area_and_the_first_moment_of_the_wrench():
    start_s, end_s = 0.9, 1.5
    early, late = history().halves_between(np.array([start_s]), np.array([end_s]))[0]
    fine_s = start_s + (np.arange(600_000) + 0.5) * 1e-6
    wrench_n = history().at(fine_s)
    mean = history().mean_between(np.array([start_s]), np.array([end_s]))[0]
    assert 0.5 * (early + late) == pytest.approx(wrench_n.mean(axis=0), abs=1e-6)
    assert mean == pytest.approx(wrench_n.mean(axis=0), abs=1e-6)
    moment = (wrench_n * (end_s - fine_s)[:, None]).mean(axis=0) * 0.6
    assert (3 * early + late) * 0.36 / 8 == pytest.approx(moment, abs=1e-6)


def slow(time_s, asked):
    state = [asked[0]]
    for k, step in enumerate(np.diff(time_s)):
        state.append(asked[k] + (state[-1] - asked[k]) * np.exp(-step / LAG_S))
    return np.array(state)


@settings(max_examples=30)
@given(st.lists(st.tuples(st.floats(0.001, 3.0), st.floats(1100, 1900)), min_size=2, max_size=60))
def test_the_scan_equals_the_step_by_step_recursion(commands):
    time_s = np.cumsum([step for step, _ in commands])
    signal = Signal(time_s, np.array([[us, us] for _, us in commands]))
    ours = wrench(recorded(pwm=signal), thruster_vehicle(), "twin")
    assert ours.state == pytest.approx(slow(ours.time_s, ours.asked), abs=1e-9)


def test_tau_cmd_stands_in_for_missing_pwm_and_says_so():
    tau = Signal(np.array([0.0, 1.0]), np.array([[0.0] * 6, [1, 2, 3, 4, 5, 6]]))
    ours = wrench(recorded(tau_cmd=tau), thruster_vehicle(), "twin")
    assert ours.source == "tau_cmd"
    assert ours.at(np.array([20.0]))[0] == pytest.approx([1, 2, 3, 4, 5, 6])
    assert any("TAU_CMD" in note for note in ours.notes)


def test_pwm_of_too_few_outputs_is_not_guessed_at():
    tau = Signal(np.array([0.0]), np.zeros((1, 6)))
    ours = wrench(recorded(tau_cmd=tau, pwm=pwm([0.0], (1600.0,))), thruster_vehicle(), "twin")
    assert ours.source == "tau_cmd"
    assert any("1 thruster outputs" in note for note in ours.notes)


def test_both_sources_are_compared():
    tau = Signal(STEP.time_s, np.array([[0.0] * 6, [22, 0, 0, 0, 0, 0], [10, 0, 0, 0, 0, -5]]))
    ours = wrench(recorded(pwm=STEP, tau_cmd=tau), thruster_vehicle(), "twin")
    assert ours.source == "pwm"
    (note,) = ours.notes
    assert note.startswith("In surge the wrench from PWM differs from TAU_CMD by 1.2 N rms of 14 N; ")


def test_pulses_that_follow_a_command_over_a_link_are_compared_when_they_are_there():
    time_s = np.arange(0.0, 20.0, 0.05)
    ahead = np.sign(np.sin(time_s))
    late = Signal(time_s + 0.03, np.column_stack([1500.0 + 200.0 * ahead] * 2))

    def notes(force_n):
        commanded = Signal(time_s, np.outer(force_n * ahead, np.eye(6)[0]))
        return wrench(recorded(pwm=late, tau_cmd=commanded), thruster_vehicle(), "twin").notes

    assert notes(20.0) == ()
    (note,) = notes(24.0)
    assert note.startswith(
        "In surge the wrench from PWM differs from TAU_CMD by 4 N rms of 24 N, 30 ms after it; "
    )


def test_a_thruster_without_a_pulse_is_at_rest():
    ours = wrench(recorded(pwm=pwm([0.0], (0.0, 1700.0))), thruster_vehicle(), "twin")
    assert ours.at(np.array([1.0]))[0, 0] == pytest.approx(10.0)
    assert any("without a pulse" in note for note in ours.notes)


def test_commands_of_which_one_is_unknown_at_any_time_tell_no_wrench():
    gap = pwm([0.0, 1.0, 2.0, 3.0], (1500.0, np.nan), (np.nan, 1700.0), (np.nan, 1600.0), (1700.0, np.nan))
    with pytest.raises(FitError, match="neither thruster commands that fit the vehicle nor wrenches"):
        wrench(recorded(pwm=gap), thruster_vehicle(), "twin")


def test_commands_of_fewer_thrusters_than_the_vehicle_has_are_refused_with_both_numbers():
    alone = pwm([0.0, 1.0], (1500.0,), (1700.0,))
    with pytest.raises(
        FitError, match=r"has commands of 1 thrusters, and the vehicle file has 2 in configuration 'twin'"
    ):
        wrench(recorded(pwm=alone), thruster_vehicle(), "twin")


def test_nothing_at_all_is_refused():
    with pytest.raises(FitError, match="neither thruster commands"):
        wrench(recorded(), thruster_vehicle(), "twin")


def test_replaying_the_commands_of_the_real_firmware_gives_its_motion():
    """ArduSub's own simulator has no added mass and purely quadratic drag; its source says how much."""
    flown = read_dive(shared("data", "ardusub_sitl", "still.tlog.gz"))
    step_s = 0.0025
    time_s = np.arange(50.0, 500.0, step_s)
    file = load_vehicle("ardusub_vectored")
    tau = wrench(flown, file, "vectored").mean_between(time_s, time_s + step_s)
    u = v = r = 0.0
    replayed = []
    for x, y, n in tau[:, [0, 1, 5]].tolist():
        replayed.append((u, v, r))
        u_dot = (x - 48.285 * u * abs(u)) / 10.5 + v * r
        v_dot = (y - 62.08 * v * abs(v)) / 10.5 - u * r
        r_dot = (n - 7.0757 * r * abs(r)) / 0.26808
        u, v, r = u + step_s * u_dot, v + step_s * v_dot, r + step_s * r_dot
    measured = np.column_stack((flown.velocity.at(time_s)[:, :2], flown.gyro.at(time_s)[:, 2]))
    rms = np.sqrt(np.mean((np.array(replayed) - measured) ** 2, axis=0))
    assert (rms < np.array([0.04, 0.04, 0.03])).all()
    assert (measured.std(axis=0) > 0.2).all()
    # Its pulses are samples at 50 Hz: taken to hold from their own times, they turn the body 9 ms late.
    quickening = np.gradient(measured[:, 2], step_s)
    late_s = np.sum((measured[:, 2] - np.array(replayed)[:, 2]) * quickening) / np.sum(quickening**2)
    assert abs(late_s) < 2e-3


def test_times_are_coarse_only_where_many_steps_differ():
    """A quarter of a millisecond was a force to a quiet gyro; two clocks among each other have thousands of steps."""
    even_s, drifting_s = 0.008 * np.arange(9000) + 1.3e-4, 0.05003 * np.arange(1400)
    alone, both = (
        [SimpleNamespace(time_s=time_s) for time_s in clocks] for clocks in ([even_s], [even_s, drifting_s])
    )
    assert events._in_ticks(even_s, events._tick_s(alone)) == pytest.approx(even_s, abs=1e-9)
    assert events._tick_s(both) > 1e-4
