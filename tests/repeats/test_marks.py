"""The marks of a single run, exact for a run made by the vehicle file's formula."""

from dataclasses import replace

import numpy as np
import pytest

from bridge.errors import FitError
from identify.dive import Signal
from identify.repeats.marks import run_of, usual_from, usual_of


def run_of_made(made, **changes):
    return run_of(made.but(**changes).dive(), made.file, "quadrotor")


def test_a_run_shows_its_depth_at_rest_its_sinking_its_lean_and_how_it_begins_to_turn(sound):
    run = run_of_made(sound, reads_m=0.04, moment_nm=(0.2, -0.1, 0.05))
    righting = 8.0 * 9.80665 * 0.03
    assert run.rest_depth_m == pytest.approx(0.04)
    assert run.thrust_n == pytest.approx([2.5] * 4)
    assert run.sinking_m_s == pytest.approx((10.0 - 9.0) / 5.0)
    assert run.leans == pytest.approx([0.2 / righting, -0.1 / righting], rel=1e-3)
    assert run.turning_nm == pytest.approx(0.05, rel=1e-6)


def test_it_turns_by_the_series_of_the_same_formula_where_nothing_slows_it(sound):
    shape = sound.shape
    free = replace(shape, model={**shape.model, "D_r": 0.0})
    slow = replace(shape, model={**shape.model, "D_r": 1e-9})
    turns = [
        run_of(
            sound.but(moment_nm=(0.0, 0.0, 0.05)).dive(),
            replace(
                sound.file, vehicle=replace(sound.file.vehicle, configurations={"quadrotor": configuration})
            ),
            "quadrotor",
        ).turning_nm
        for configuration in (free, slow)
    ]
    assert turns[0] == pytest.approx(turns[1], rel=1e-6)
    # Without its damping the file asks for less moment to turn as far.
    assert 0.02 < turns[0] < 0.05


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"rest_s": 0.0}, "begin with its thrusters at rest"),
        ({"pulse_us": 1100.0}, "begin with its thrusters at rest"),
        ({"push_s": 4.0}, "pushes for 4.0 s, and has to for 5 s"),
    ],
)
def test_a_run_that_does_not_go_from_rest_into_a_push_is_refused(sound, changes, words):
    with pytest.raises(FitError, match=words):
        run_of_made(sound, **changes)


def test_a_run_without_depth_is_refused(sound):
    with pytest.raises(FitError, match="commands of its thrusters, depth and attitude"):
        run_of(replace(sound.dive(), depth=None), sound.file, "quadrotor")


def test_a_run_with_an_output_too_few_for_the_thrusters_of_the_file_is_refused(sound):
    dive = sound.dive()
    fewer = replace(dive, pwm=Signal(dive.pwm.time_s, dive.pwm.value[:, :2]))
    for lacking in (fewer, replace(dive, pwm=dive.pwm.between(-2.0, -1.0))):
        with pytest.raises(FitError, match="commands of its thrusters, depth and attitude"):
            run_of(lacking, sound.file, "quadrotor")


def test_a_run_whose_commands_were_heard_no_more_while_it_pushed_is_refused(sound):
    pwm = sound.dive().pwm
    heard = (pwm.time_s < 3.0) | (pwm.time_s == pwm.time_s[-1])
    gap = replace(sound.dive(), pwm=Signal(pwm.time_s[heard], pwm.value[heard]))
    with pytest.raises(FitError, match="have to be heard during the push"):
        run_of(gap, sound.file, "quadrotor")


@pytest.mark.parametrize("name", ["depth", "attitude", "voltage"])
def test_a_reading_that_is_no_number_changes_no_mark(sound, name):
    made = sound.but(moment_nm=(0.2, -0.1, 0.05))
    dive = made.dive()
    value = getattr(dive, name).value.copy()
    value[100] = np.nan
    gap = replace(dive, **{name: Signal(getattr(dive, name).time_s, value)})
    whole, run = (run_of(each, sound.file, "quadrotor") for each in (dive, gap))
    assert run.sinking_m_s == pytest.approx(whole.sinking_m_s)
    assert run.leans == pytest.approx(whole.leans)
    assert run.turning_nm == pytest.approx(whole.turning_nm)
    assert run.voltage_v == 12.0


def usual_of_made(sound):
    return usual_of([run_of(dive, sound.file, "quadrotor") for dive in sound.dives(20, 1)], sound.shape)


def test_what_the_model_lacks_is_the_buoyancy_and_the_moments(sound):
    run = run_of_made(sound, reads_m=0.04, moment_nm=(0.2, -0.1, 0.05), buoyancy_n=9.5)
    (marks,) = usual_of_made(sound).marks_of([run], sound.shape)
    assert marks == pytest.approx([0.04, -9.5, 0.2, -0.1, 0.05], rel=1e-3)


def test_thrust_goes_by_the_square_of_the_voltage(sound):
    runs = [run_of_made(sound, voltage_v=voltage) for voltage in (12.0, 11.4)]
    marks = usual_of_made(sound).marks_of(runs, sound.shape)
    assert marks[0] == pytest.approx(marks[1], rel=1e-6)


def test_thrust_goes_by_the_voltage_though_a_battery_was_not_heard_in_one_accepted_run(sound):
    first, *others = sound.dives(21, 1)
    runs = [run_of(dive, sound.file, "quadrotor") for dive in (replace(first, voltage=None), *others)]
    usual = usual_of(runs, sound.shape)
    assert usual.voltage_v == 12.0
    marks = usual.marks_of([run_of_made(sound, voltage_v=voltage) for voltage in (12.0, 11.4)], sound.shape)
    assert marks[0] == pytest.approx(marks[1], rel=1e-6)


def test_runs_that_are_alike_to_the_last_digit_tell_no_scatter(sound):
    with pytest.raises(FitError, match="do not differ in all that they show"):
        usual_of([run_of_made(sound)] * 20, sound.shape)


def test_nineteen_runs_are_too_few_to_tell_how_far_runs_scatter(sound):
    with pytest.raises(FitError, match="19 runs are too few"):
        usual_of([run_of_made(sound)] * 19, sound.shape)


def test_accepted_runs_come_back_from_plain_data_as_they_were(sound):
    usual = usual_of_made(sound)
    back = usual_from(usual.to_json())
    assert back.to_json() == usual.to_json()
    assert back.scatter == pytest.approx(usual.scatter)
