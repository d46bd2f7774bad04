"""Readings, thrusters or masses that can hardly be this vehicle's are doubted; those of honest dives are not."""

from dataclasses import replace
from functools import cache

import fitted
import numpy as np
import pytest
from fakes.planted import quiet
from soak import rest_in_soak

from bench.missions.mission import draw_one
from identify.checks.actuation.controller import unchecked
from identify.checks.fit.hardly_this_vehicle import crossed, crossed_doubts
from identify.checks.fit.unread_speeds import unread_doubts
from identify.checks.sensors.descent import descent, descent_doubts
from identify.dive import Signal
from identify.doubt import Outcome
from identify.estimators.answer import answered
from identify.estimators.axes.build import build_axes
from identify.estimators.identifiability import with_bounds
from identify.estimators.likelihood.fit import fit_axes
from identify.estimators.table import estimator

SEED = 100_011


@cache
def mission():
    return draw_one(SEED, seconds=60.0)


@cache
def longer():
    """Of a length that goes through depths enough."""
    return draw_one(SEED, seconds=180.0)


def with_velocity(dive, to):
    """The dive with velocities (n, 3) times a matrix, in what the controller says that it used too."""
    velocity, fed = dive.velocity, dive.nu_fb.value.copy()
    fed[:, :3] = fed[:, :3] @ to.T
    return replace(
        dive,
        velocity=Signal(velocity.time_s, velocity.value @ to.T),
        nu_fb=Signal(dive.nu_fb.time_s, fed),
    )


def turned(degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


SWAPPED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def crossing(dive):
    """By (axis, other), the share of the other's thrust."""
    dived = mission()
    shape = dived.file.vehicle.configurations[dived.configuration]
    fit = fit_axes(build_axes(dive, dived.file, dived.configuration), shape, quiet)
    return crossed(fit.joint, fit.theta)


def test_an_honest_dive_answers_to_its_own_thrust_alone():
    responses = crossing(mission().dive)
    assert set(responses) == {(0, 1), (1, 0)}
    assert max(abs(response.score) for response in responses.values()) < 3.0
    assert crossed_doubts(responses) == ()


@pytest.mark.parametrize("degrees", [-15.0, 15.0])
def test_a_dvl_turned_off_its_axes_answers_to_the_other_axis_with_the_sign_of_the_turn(degrees):
    responses = crossing(with_velocity(mission().dive, turned(degrees)))
    assert np.sign(responses[1, 0].size) == np.sign(degrees) == -np.sign(responses[0, 1].size)
    assert abs(responses[1, 0].size) > 0.1
    (doubt,) = crossed_doubts(responses)
    assert doubt.outcome is Outcome.DISAGREES
    assert doubt.about == ("M_u", "M_v", "D_u", "D_v")
    assert "check the DVL's mounting and the order of the thrusters" in doubt.sentence


@pytest.mark.parametrize("method", rest_in_soak(["likelihood", "pinn"]))
def test_swapped_axes_of_the_dvl_make_data_and_model_disagree_without_any_word_of_the_controller(method):
    dived = mission()
    dive = replace(with_velocity(dived.dive, SWAPPED), nu_fb=None, tau_pid=None, tau_cmd=None, nu_ref=None)
    answer = estimator(method)(dive, dived.file, dived.configuration, quiet)
    assert answer.outcome is not Outcome.CONVERGED
    assert any("answers to the thrust in" in doubt.sentence for doubt in answer.doubts)


@pytest.mark.parametrize(("times_dry", "doubted"), [(1.05, False), (3.5, False), (4.8, True)])
def test_a_mass_that_no_water_could_make_up_is_doubted_and_the_heaviest_hull_is_not(times_dry, doubted):
    values = {"M_w": 72.0 * times_dry, "D_w": 90.0}
    answer = answered(fitted.fit(values, 1e-4 * np.eye(2)), fitted.dive(), fitted.vehicle_file())
    doubts = [doubt for doubt in answer.doubts if "times the vehicle file's dry mass" in doubt.sentence]
    assert bool(doubts) is doubted
    assert (answer.outcome is Outcome.DISAGREES) is doubted


def test_a_mass_that_the_dive_hardly_knows_is_not_called_too_large():
    values = {"M_u": 72.0 * 4.8, "D_u": 90.0}
    answer = answered(fitted.fit(values, 0.04 * np.eye(2)), fitted.dive(), fitted.vehicle_file())
    assert answer.outcome is Outcome.CONVERGED


@pytest.mark.parametrize(("share", "strange"), [(1.0, False), (1.1, False), (1.4, True), (0.7, True)])
def test_thrusters_that_come_to_another_wrench_than_was_commanded_are_another_vehicles(share, strange):
    dived = mission()
    commanded = Signal(dived.dive.tau_cmd.time_s, share * dived.dive.tau_cmd.value)
    sentence = build_axes(replace(dived.dive, tau_cmd=commanded), dived.file, dived.configuration).strange
    assert ("the vehicle file's thrusters are not this vehicle's" in sentence) is strange


@pytest.mark.parametrize(
    ("times", "mode", "strange"), [(1.4, 0, True), (1.4, 3, False), (2.2, 3, True), (0.7, 3, True)]
)
def test_what_a_vehicle_makes_up_for_while_its_feed_forward_acts_is_no_other_vehicle(times, mode, strange):
    dived = mission()
    time_s, asked = dived.dive.tau_cmd.time_s, dived.dive.tau_cmd.value
    acting = Signal(time_s, np.full((len(time_s), 1), float(mode)))
    dive = replace(dived.dive, tau_cmd=Signal(time_s, asked / times), ff_mode=acting)
    sentence = build_axes(dive, dived.file, dived.configuration).strange
    assert ("the vehicle file's thrusters are not this vehicle's" in sentence) is strange


@pytest.mark.parametrize(
    ("share", "strange"), [(0.149, False), (-0.149, False), (0.151, True), (-0.151, True)]
)
def test_thrust_that_may_lie_in_the_dead_band_tells_nothing_of_the_thrusters(share, strange):
    dived = mission()
    commanded = dived.dive.tau_cmd.value.copy()
    commanded[:, 5] = share * dived.file.vehicle.configurations[dived.configuration].thruster_limit_n
    pushed = replace(dived.dive, tau_cmd=Signal(dived.dive.tau_cmd.time_s, commanded))
    sentence = build_axes(pushed, dived.file, dived.configuration).strange
    assert sentence.startswith("in yaw its thruster commands come to a wrench ") is strange


def test_a_few_commands_tell_nothing_of_the_thrusters():
    dived = mission()
    time_s, tau = dived.dive.tau_cmd.time_s, dived.dive.tau_cmd.value
    large = np.argsort(np.abs(tau[:, 0]))[::-1]
    for count, strange in ((19, False), (20, True)):
        commanded = np.zeros_like(tau)
        commanded[large[:count], 0] = -tau[large[:count], 0]
        dive = replace(dived.dive, tau_cmd=Signal(time_s, commanded))
        assert bool(build_axes(dive, dived.file, dived.configuration).strange) is strange


def test_a_dive_without_a_gyro_is_doubted_where_turning_at_speed_pushes():
    dived = mission()
    assert unread_doubts(build_axes(dived.dive, dived.file, dived.configuration)) == ()
    blind = replace(dived.dive, gyro=None, fog=None, attitude=None)
    (doubt,) = unread_doubts(build_axes(blind, dived.file, dived.configuration))
    assert doubt.about == ("M_u", "M_v", "M_w", "D_u", "D_v", "D_w")
    assert doubt.sentence.startswith(
        "No rate of turn was recorded in roll, pitch and yaw: the forces that turning"
    )
    assert doubt.outcome is Outcome.DISAGREES


def test_speed_ahead_alone_is_pushed_along_no_axis_that_was_read():
    """What turning makes of speed ahead is in sway and heave."""
    dived = mission()
    ahead = replace(with_velocity(dived.dive, np.diag([1.0, 0.0, 0.0])), gyro=None, fog=None)
    ahead = replace(ahead, attitude=None, depth=None, pressure=None)
    assert unread_doubts(build_axes(ahead, dived.file, dived.configuration)) == ()


@pytest.mark.parametrize("scale", [0.5, 3.28, -1.0])
def test_depth_contradicts_a_downward_velocity_of_another_scale_or_sign(scale):
    dived = longer()
    dive = with_velocity(dived.dive, np.diag([scale] * 3))
    slope = descent(dive, dived.file.vehicle.water)
    assert slope.contradicts(0.1)
    assert slope.least == pytest.approx(1.0 / scale, rel=0.1)
    (doubt,) = descent_doubts(dive, dived.file.vehicle.water)
    assert doubt.about == ("M_u", "M_v", "M_w", "D_u", "D_v", "D_w")
    assert doubt.outcome is Outcome.DISAGREES


@pytest.mark.parametrize("scale", [1.0, 1.05])
def test_depth_does_not_contradict_the_velocity_of_a_healthy_dvl(scale):
    dived = longer()
    slope = descent(with_velocity(dived.dive, np.diag([scale] * 3)), dived.file.vehicle.water)
    assert not slope.contradicts(0.1)
    assert slope.least <= slope.most


def test_a_vehicle_that_keeps_its_depth_tells_nothing_of_the_dvls_scale():
    dived = longer()
    rng = np.random.default_rng(SEED)
    level = with_velocity(dived.dive, np.diag([1.0, 1.0, 0.0]))
    level.velocity.value[:, 2] = 0.01 * rng.standard_normal(len(level.velocity))
    still = Signal(level.velocity.time_s, 5.0 + 0.01 * rng.standard_normal((len(level.velocity), 1)))
    upright = Signal(level.velocity.time_s, np.tile([1.0, 0.0, 0.0, 0.0], (len(level.velocity), 1)))
    kept = replace(level, depth=still, pressure=None, attitude=upright)
    assert descent(kept, dived.file.vehicle.water) is None


def test_quick_heave_is_no_doubt_of_the_dvls_scale():
    """Down and up again within the second over which depth is averaged at a window's edge."""
    dived = longer()
    time_s = np.arange(0.0, 120.0, 0.1)
    heave = 0.3 * np.sign(np.sin(2 * np.pi * time_s / 4.1))
    depth = 5.0 + np.cumsum(heave) * 0.1
    level = np.column_stack([0 * heave, 0 * heave, heave])
    upright = np.tile([1.0, 0.0, 0.0, 0.0], (len(time_s), 1))
    quick = replace(
        dived.dive,
        velocity=Signal(time_s, level),
        depth=Signal(time_s, depth[:, None]),
        pressure=None,
        attitude=Signal(time_s, upright),
    )
    slope = descent(quick, dived.file.vehicle.water)
    assert slope.least == pytest.approx(1.0, abs=0.03)
    assert slope.most == pytest.approx(1.0, abs=0.03)


def test_a_recording_without_the_controllers_own_signals_says_that_it_can_not_be_checked():
    dive = mission().dive
    assert unchecked(dive) == ()
    (bare,) = unchecked(replace(dive, nu_fb=None, tau_pid=None))
    assert bare.startswith(
        "NU_FB and TAU_PID are not recorded: it can't be checked whether the controller used the "
    )
    (half,) = unchecked(replace(dive, nu_ref=None))
    assert half.startswith(
        "NU_REF is not recorded: it can't be checked whether the controller used recorded readings"
    )
    assert unchecked(replace(dive, velocity=None, nu_fb=None)) == ()


@pytest.mark.parametrize(("mass_kg", "identified"), [(32_900.0, False), (0.52, False), (90.0, True)])
def test_a_mass_out_of_all_reason_tells_neither_itself_nor_the_damping_of_its_axis(mass_kg, identified):
    values = {"M_u": mass_kg, "D_u": 40.0, "M_v": 100.0, "D_v": 60.0}
    answer = answered(fitted.fit(values, 1e-4 * np.eye(4)), fitted.dive(), fitted.vehicle_file())
    assert set(answer.values()) == {"M_v", "D_v"} | ({"M_u", "D_u"} if identified else set())
    if not identified:
        assert answer.outcome is Outcome.DISAGREES
        for name in ("M_u", "D_u"):
            assert "the rigid body's own is 72" in answer[name].reason


@pytest.mark.parametrize(("inertia", "identified"), [(0.9, False), (11.0, True), (110.0, False)])
def test_an_inertia_out_of_all_reason_is_doubted_and_tells_nothing(inertia, identified):
    answer = answered(
        fitted.fit({"I_r": inertia, "D_r": 4.0}, 1e-4 * np.eye(2)), fitted.dive(), fitted.vehicle_file()
    )
    assert set(answer.values()) == ({"I_r", "D_r"} if identified else set())
    assert bool(answer.doubts) is not identified


def test_an_interval_of_a_mass_that_spans_a_factor_of_five_is_no_statement():
    made = fitted.fit({"M_u": 100.0, "D_u": 40.0}, 1e-4 * np.eye(2))
    for high, identified in ((240.0, True), (260.0, False)):
        wide = replace(made, parameters=(replace(made["M_u"], low95=50.0, high95=high), *made.parameters[1:]))
        answer = with_bounds(wide, fitted.shape())
        assert answer["M_u"].identifiable is identified
        assert answer["D_u"].identifiable is identified
    assert "from 50 to 260" in answer["D_u"].reason
