"""Thruster commands as recordings state them: pulses, shares of full thrust, newtons; and thrusters of other forms."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from built_recordings import of_table

from bridge.errors import FitError, LogError
from bridge.vehicle.config import Configuration, ThrustCurve, Thruster, Vehicle, VehicleFile
from identify.diagnose.filters.slow_samples import with_later_commands
from identify.dive import Dive, Signal
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
