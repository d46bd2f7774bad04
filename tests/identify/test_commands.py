"""Thruster commands: as recordings state them, and whether they hold or are samples of a faster loop."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from built_recordings import of_table
from test_judged import FILE, MASS, SECONDS, YAW, commanded, moved

from bridge.errors import FitError, LogError
from bridge.vehicle.config import Configuration, ThrustCurve, Thruster, Vehicle, VehicleFile
from identify.diagnose.accepted_before import library_with_changes
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.filters.slow_samples import with_later_commands
from identify.diagnose.holding import (
    beyond_step,
    judged_loop,
    not_quicker,
    slow_loop,
    with_holding_unknown,
    with_known_holding,
    within_step_note,
)
from identify.diagnose.nominal_fit import fitted_nominal
from identify.diagnose.result import Finding, Value
from identify.dive import Dive, Signal
from identify.effects.actuators import COMMAND_DELAY, DEAD_ZONE, thruster_lag
from identify.estimators.likelihood.answer import estimate
from identify.estimators.timing.lateness import by_lateness
from identify.ingest.commands import unknown_between
from identify.thrust.wrench import asked_thrusts, tells_thrusters, wrench

AHEAD = Thruster((1.0, 0.0, 0.0), (0.0, 0.2, 0.0))
UP = Thruster((0.0, 0.0, -1.0), (0.0, 0.0, 0.0))
TWO_WAY = ThrustCurve(kind="quadratic", max_n=40.0)
ONE_WAY = ThrustCurve(kind="quadratic", max_n=40.0, neutral_us=1100.0, span_us=800.0, one_way=True)
ROWS = "t,a,b\n0,{0},{1}\n1,{2},{3}\n2,{0},{1}\n"
MAP = "time: {column: t}\npwm: {columns: [a, b], unit: %s}\n"


def vehicle_file(curve=TWO_WAY):
    shape = Configuration(20.0, (1.0, 1.0, 1.0), (AHEAD, UP))
    return VehicleFile(Path("v.yaml"), Vehicle("v", {"only": shape}, thrust_curve=curve), None, "0" * 64)


def dive_of(tmp_path, cells, unit, file):
    return of_table(tmp_path, ROWS.format(*cells), MAP % unit, file)


@pytest.mark.parametrize(
    ("cells", "unit"),
    [
        ((1700.0, 1500.0, 1500.0, 1300.0), "us"),
        ((0.5, 0.0, 0.0, -0.5), '"1"'),
        ((10.0, 0.0, 0.0, -10.0), "N"),
    ],
)
def test_the_same_thrust_is_the_same_wrench_however_it_is_stated(tmp_path, cells, unit):
    file = vehicle_file()
    dive = dive_of(tmp_path, cells, unit, file)
    np.testing.assert_allclose(
        asked_thrusts(dive, file, "only").value, [[10, 0], [0, -10], [10, 0]], atol=1e-12
    )
    forces = wrench(dive, file, "only")
    np.testing.assert_allclose(forces.asked[:2, [0, 2, 5]], [[10, 0, -2], [0, 10, 0]], atol=1e-12)
    assert forces.notes == ()
    assert tells_thrusters(dive, file.vehicle.configurations["only"])


def test_shaft_speeds_alone_give_the_thrust_and_it_is_said(tmp_path):
    file = vehicle_file(replace(TWO_WAY, forward_n_s2=0.1, reverse_n_s2=0.08, lag_s=0.2))
    columns = "time: {column: t}\nrpm: {columns: [a, b], unit: rpm}\n"
    dive = of_table(tmp_path, ROWS.format(600, 0, 0, -600), columns, file)
    np.testing.assert_allclose(wrench(dive, file, "only").asked[:2, [0, 2, 5]], [[10, 0, -2], [0, 8, 0]])
    assert dive.notes[0] == (
        "No thruster command is recorded: the thrust is that of the shafts' speeds, by forward_n_s2 and reverse_n_s2 "
        "of the vehicle file's thrust_curve; check these, and lag_s: 0, as a measured speed has no lag of 0.2 s."
    )


def test_kilogrammes_of_force_become_newtons_and_need_no_thrust_curve(tmp_path):
    dive = dive_of(tmp_path, (1.0, 0.0, 0.0, -1.0), "kgf", None)
    assert dive.pwm is None
    assert dive.thrust_cmd.value[0].tolist() == [9.80665, 0.0]
    assert not any("nothing can be identified" in note for note in dive.notes)


def test_full_command_of_a_thruster_that_pushes_one_way_is_its_longest_pulse(tmp_path):
    dive = dive_of(tmp_path, (1.0, 0.25, 0.0, -0.5), '"1"', vehicle_file(ONE_WAY))
    np.testing.assert_allclose(dive.pwm.value[:2], [[1900.0, 1300.0], [1100.0, 1100.0]])
    assert dive.effort is None


def test_normalised_commands_wait_for_a_vehicle(tmp_path):
    dive = dive_of(tmp_path, (0.5, 0.0, 0.0, -0.5), '"1"', None)
    assert dive.pwm is None
    assert dive.effort.value[0].tolist() == [0.5, 0.0]


def test_commands_in_per_cent_are_not_taken_for_normalised_ones(tmp_path):
    with pytest.raises(LogError, match=r"reach 80, and they lie within -1 to 1"):
        dive_of(tmp_path, (50.0, 0.0, 0.0, -80.0), '"1"', vehicle_file())


def pulsed(*pulses_us):
    time_s = np.arange(float(len(pulses_us)))
    return Dive("d", Path("d.csv"), "0" * 64, pwm=Signal(time_s, np.column_stack([pulses_us, pulses_us])))


def test_a_curve_that_gives_no_thrust_at_any_recorded_pulse_is_refused_with_both_ranges():
    file = vehicle_file(replace(ONE_WAY, neutral_us=1500.0, span_us=400.0))
    with pytest.raises(FitError, match=r"between 1100 and 1480 us, and the curve goes from 1500 to 1900 us"):
        wrench(pulsed(1100.0, 1300.0, 1480.0), file, "only")


@pytest.mark.parametrize("pulses_us", [(1500.0, 1500.0), (1490.0, 1520.0), (0.0, 0.0), (1100.0, 1600.0)])
def test_thrusters_at_rest_or_with_some_thrust_are_no_such_curve(pulses_us):
    curve = replace(ONE_WAY, neutral_us=1500.0, span_us=400.0, dead_band_us=30.0)
    assert np.isfinite(wrench(pulsed(*pulses_us), vehicle_file(curve), "only").asked).all()


def test_pulses_that_change_below_the_neutral_of_one_way_thrusters_are_told():
    file = vehicle_file(replace(ONE_WAY, neutral_us=1500.0, span_us=400.0))
    (said,) = wrench(pulsed(1100.0, 1300.0, 1480.0, 1900.0), file, "only").notes
    assert said == (
        "50 % of the pulses lie far below the vehicle file's neutral_us of 1500, and change there between 1100 and "
        "1300 us: its one-way thrusters are taken to give no thrust at these. Check neutral_us."
    )
    assert wrench(pulsed(1100.0, 1100.0, 1480.0, 1900.0), file, "only").notes == ()
    assert wrench(pulsed(1100.0, 1300.0, 1480.0, 1900.0), vehicle_file(ONE_WAY), "only").notes == ()


def test_a_command_in_newtons_that_is_missing_holds_for_a_moment(tmp_path):
    dive = of_table(tmp_path, "t,a,b\n0,10,0\n0.1,10,nan\n0.2,20,0\n", MAP % "N", vehicle_file())
    assert dive.thrust_cmd.value[:, 1].tolist() == [0.0, 0.0, 0.0]
    assert any("no number in output 2" in note for note in dive.notes)


def test_later_commands_are_later_in_newtons_too():
    dive = Dive("d", Path("d.csv"), "0" * 64, thrust_cmd=Signal(np.arange(3.0), np.ones((3, 2))))
    assert with_later_commands(dive, 0.25).thrust_cmd.time_s.tolist() == [0.25, 1.25, 2.25]


@pytest.mark.parametrize(("neutral_us", "left"), [(1100.0, 600), (1500.0, 301)])
def test_a_vehicle_that_rests_at_another_pulse_is_not_taken_for_one_that_pushes(tmp_path, neutral_us, left):
    u, v, w = np.random.default_rng(0).normal(size=(3, 600))
    for axis in (u, v, w):
        axis[200:500] = axis[200]
    rows = [f"{k / 10},{u[k]},{v[k]},{w[k]},1100,1100" for k in range(600)]
    columns = MAP % "us" + "velocity: {columns: [u, v, w], unit: m/s}\n"
    file = vehicle_file(replace(ONE_WAY, neutral_us=neutral_us))
    assert len(of_table(tmp_path, "\n".join(["t,u,v,w,a,b", *rows, ""]), columns, file).velocity) == left


def logged(loop_s, log_s, delay_s=0.0, noise=1e-3):
    """A dive whose commands change every `loop_s`, and of which those every `log_s` were recorded."""
    rng = np.random.default_rng(3)
    time_s = loop_s * np.arange(int((SECONDS - 1.0) / loop_s))
    knots_s = np.arange(0.0, SECONDS, 0.35)
    force = 4.0 * np.interp(time_s, knots_s, rng.uniform(-1.0, 1.0, len(knots_s)))
    at_s, speed, _ = (part[::5] for part in moved(YAW, time_s, force))
    rates = np.column_stack([0.0 * at_s, 0.0 * at_s, speed + noise * rng.normal(size=len(speed))])
    gyro = Signal(at_s + delay_s, rates)
    every = round(log_s / loop_s)
    return Dive(
        "log", Path("log.csv"), "1" * 64, tau_cmd=commanded(YAW, time_s[::every], force[::every]), gyro=gyro
    )


@pytest.mark.parametrize(
    ("loop_s", "log_s", "hold"),
    [(0.01, 0.05, False), (0.05, 0.05, None), (0.1, 0.1, True), (0.01, 0.1, None)],
    ids=["a fast loop at 20 Hz", "a loop of 20 Hz", "a loop of 10 Hz", "a fast loop at 10 Hz"],
)
def test_thrust_tells_a_loop_s_commands_from_samples_of_a_faster_one(loop_s, log_s, hold):
    dive = logged(loop_s, log_s)
    assert with_known_holding(dive, fitted_nominal(dive, FILE, "only")).commands_hold is hold


@pytest.mark.parametrize("loop_s", [0.01, 0.05], ids=["a fast loop at 20 Hz", "a loop of 20 Hz"])
def test_identification_takes_early_thrust_for_that_of_samples_and_for_no_wrong_clock(loop_s):
    answer = estimate(logged(loop_s, 0.05), FILE, "only", lambda *_: None)
    inertia = answer.parameters[YAW]
    assert inertia.identifiable
    assert inertia.value == pytest.approx(MASS[YAW], abs=0.01)
    assert not any("thrust acts at another time" in doubt.sentence for doubt in answer.doubts)
    assert (answer.notes[0].startswith("Thruster commands are taken for samples")) is (loop_s == 0.01)


def test_of_samples_of_a_faster_loop_no_thruster_seems_quicker_than_the_file_says_and_any_may_be_slower():
    lag, delay, dead = not_quicker((thruster_lag(0.2)[0], COMMAND_DELAY, DEAD_ZONE))
    within = [Cause(lag, np.array([value])).within_bounds for value in (0.1, 0.199, 0.2, 0.3)]
    assert within == [False, False, True, True]
    assert Cause(delay, np.array([0.1])).within_bounds
    assert dead is DEAD_ZONE


def test_a_quicker_thruster_is_told_by_samples_where_thrust_is_early_as_a_whole():
    loop = judged_loop(logged(0.01, 0.05), FILE, "only")
    assert loop.dive.commands_hold is False
    quicker = Cause(thruster_lag(0.2)[0], np.array([0.1]))
    for late_s, is_told in ((-0.01, False), (-0.02, True)):
        nominal = replace(loop.nominal, late_samples_s=late_s)
        (able,) = replace(loop, nominal=nominal).able([quicker.effect])
        assert replace(quicker, effect=able).within_bounds is is_told


def test_thrust_later_than_a_faster_loop_makes_it_and_no_later_than_slow_samples_do_is_of_commands_that_hold():
    """By 0.3 to 0.75 of the step between two commands."""
    dive = logged(0.1, 0.1)
    now = fitted_nominal(dive, FILE, "only")
    for late_s, hold in ((0.029, None), (0.031, True), (0.0749, True), (0.0751, None)):
        assert with_known_holding(dive, replace(now, late_samples_s=late_s)).commands_hold is hold


@pytest.mark.parametrize(("hold", "taken_up"), [(None, True), (False, False)])
def test_what_is_known_to_be_sampled_is_not_late_by_its_sampling(hold, taken_up):
    """Thrust 45 ms late: of commands that may hold for 0.1 s it is no wonder, of samples it is the thrusters'."""
    dive = replace(logged(0.01, 0.1, 0.045), commands_hold=hold)
    assert (fitted_nominal(dive, FILE, "only").late_samples_s > 0.03) is taken_up


def test_the_loop_is_known_where_pulses_and_the_controller_s_wrench_are_recorded():
    dive = logged(0.1, 0.1)
    both = replace(dive, pwm=Signal(dive.tau_cmd.time_s, np.full((len(dive.tau_cmd), 6), 1500.0)))
    assert with_known_holding(both, fitted_nominal(dive, FILE, "only")) is both


def test_the_force_before_a_run_s_first_step_is_no_change():
    force = np.array([[0.0, 0.0], [-15.0, -15.0], [-15.0, -15.0]])
    np.testing.assert_array_equal(by_lateness(force, np.array([0.0, 0.025, 0.025])), 0.0)


def test_ten_commands_a_second_are_those_of_a_controller_that_logs_its_own_wrench():
    dive = logged(0.1, 0.1)
    assert unknown_between(dive, dive.tau_cmd)
    assert not unknown_between(replace(dive, tau_pid=dive.tau_cmd), dive.tau_cmd)
    seldom = Signal(dive.tau_cmd.time_s[::5], dive.tau_cmd.value[::5])
    assert unknown_between(replace(dive, tau_pid=dive.tau_cmd), seldom)


@pytest.mark.parametrize(("hold", "more_s"), [(None, 0.1 / np.sqrt(12.0)), (True, 0.0), (False, 0.01)])
def test_a_delay_is_known_to_the_step_between_two_commands_where_nobody_says_that_they_hold(hold, more_s):
    """And to a tenth of it where they are samples of pulses."""
    dive = logged(0.1, 0.1)
    pulses = Signal(dive.tau_cmd.time_s, np.full((len(dive.tau_cmd), 6), 1500.0))
    dive = replace(dive, commands_hold=hold, pwm=pulses, tau_cmd=None)
    causes = [Cause(DEAD_ZONE, np.array([1.0])), Cause(COMMAND_DELAY, np.array([0.3]))]
    wider = with_holding_unknown(np.diag([4.0, 1e-4]), causes, dive)
    assert np.diag(wider) == pytest.approx([4.0, 1e-4 + more_s**2], rel=1e-6)


@pytest.mark.parametrize(
    ("loop_s", "delay_s", "noise", "hold", "most_s", "words"),
    [
        (0.1, 0.3, 1e-3, True, 0.01, "taken to hold"),
        (0.02, 0.15, 1e-3, False, 0.035, "samples of a faster loop"),
        (0.1, 0.3, 1e-2, None, 0.06, "does not tell whether each thruster command holds"),
    ],
    ids=["a loop of 10 Hz", "a fast loop", "a loop of 10 Hz in noise"],
)
def test_a_delay_in_slow_commands_is_without_their_step_where_thrust_tells_it_and_else_covers_it(
    loop_s, delay_s, noise, hold, most_s, words
):
    dive = logged(loop_s, 0.1, delay_s, noise)
    now = fitted_nominal(dive, FILE, "only")
    assert with_known_holding(dive, now) is dive
    slow = slow_loop(dive, now, FILE, "only")
    assert slow.dive.commands_hold is hold
    assert words in slow.dive.notes[-1]
    delay, dead = Cause(COMMAND_DELAY, np.array([0.3])), Cause(DEAD_ZONE, np.array([1.0]))
    value = Value(0.3, "s", 0.29, 0.31)
    findings = [Finding(cause, (), {}, 0.9, {"delay": value}, 50.0) for cause in (delay, dead)]
    less, same = replace(slow, nominal=replace(slow.nominal, late_samples_s=0.02)).without_step(findings)
    assert [less.parameters["delay"].low95, less.parameters["delay"].high95] == pytest.approx(
        [0.31 - most_s, 0.33]
    )
    assert less.parameters["delay"].value == pytest.approx(0.32 - most_s / 2)
    assert same.parameters["delay"] == value
    (change,) = library_with_changes((COMMAND_DELAY,), (delay,))
    sooner = {"delay": Value(-0.1, "s", -0.12, -0.08)}
    changed = Finding(Cause(change, np.array([-0.1])), (), {}, 0.9, sooner, 50.0)
    assert slow.without_step((changed,)) == (changed,)


@pytest.mark.parametrize(
    ("hold", "late_s", "is_cause"),
    [(None, 0.06, False), (None, 0.12, True), (True, 0.06, True), (False, 0.06, False), (False, 0.12, True)],
)
def test_a_late_thrust_is_no_cause_where_the_step_between_two_commands_may_be_it(hold, late_s, is_cause):
    dive = logged(0.05, 0.05)
    pulses = Signal(dive.tau_cmd.time_s, np.full((len(dive.tau_cmd), 6), 1500.0))
    dive = replace(dive, commands_hold=hold, pwm=pulses, tau_cmd=None)
    (lag, _), dead = thruster_lag(0.05), Cause(DEAD_ZONE, np.array([1.0]))
    told = Value(late_s, "s", 0.04 if late_s < 0.1 else 0.1, late_s + 0.02)
    late = Finding(Cause(lag, np.array([late_s])), (), {}, 0.9, {"time_constant": told}, 50.0)
    other = Finding(dead, (), {}, 0.9, {"half_width": Value(1.0, "N", 0.0, 2.0)}, 50.0)
    causes, within = beyond_step((late, other), dive)
    assert causes[-1] is other
    assert (late in [*causes[:-1]], [*within]) == (is_cause, [] if is_cause else [late])
    notes = within_step_note(within, dive)
    assert len(notes) == len(within)
    assert all("Thruster lag is no cause: with 0.06" in note for note in notes)
    assert all(("`commands_hold`" in note) is (hold is None) for note in notes)


def test_commands_without_a_delay_or_at_twenty_a_second_are_of_no_slow_loop():
    for dive in (logged(0.1, 0.1), logged(0.05, 0.05, 0.3)):
        assert slow_loop(dive, fitted_nominal(dive, FILE, "only"), FILE, "only") is None
