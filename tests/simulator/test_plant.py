"""The simulated body against exact answers, compiled or step by step."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.errors import ConfigError
from bridge.simulator.plant import Plant, derivative
from bridge.simulator.truth import Truth, load_truth
from bridge.vehicle.config import CONFIGS, Configuration, ThrustCurve, Thruster, load_vehicle
from bridge.vehicle.dynamics import acceleration, restoring
from bridge.vehicle.thrusters import thrust_curve

FILE = load_vehicle("ruvifist")
CURVE = thrust_curve(ThrustCurve(), CONFIGS)
MODEL = {"M_u": 100.0, "M_v": 110.0, "M_w": 130.0, "I_p": 5.0, "I_q": 15.0, "I_r": 16.0,
         "D_u": 50.0, "D_v": 55.0, "D_w": 95.0, "D_p": 18.0, "D_q": 26.0, "D_r": 26.0}  # fmt: skip
STILL_WATER = Truth(MODEL, 0.0, 0.0)
PUSH = Configuration(72.0, (1.0, 1.0, 1.0), (Thruster((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),))
SPIN = replace(
    PUSH, thrusters=(Thruster((0.0, 1.0, 0.0), (0.5, 0, 0)), Thruster((0.0, -1.0, 0.0), (-0.5, 0, 0)))
)


def plant(shape=PUSH, truth=STILL_WATER, lag_s=0.0, rate_hz=200.0, seed=0):
    return Plant(shape, CURVE, lag_s, truth, np.random.default_rng(seed), depth_m=5.0, rate_hz=rate_hz)


def pwm(thrust_n):
    return float(CURVE.pwm(thrust_n))


def test_a_constant_thrust_ends_in_thrust_over_damping():
    body = plant()
    body.advance((pwm(20.0),), 60.0)
    assert body.state[7] == pytest.approx(20.0 / 50.0, rel=1e-9)


def test_a_step_of_thrust_is_answered_with_the_time_constant_mass_over_damping():
    stretch = plant().advance((pwm(20.0),), 10.0)
    np.testing.assert_allclose(stretch.nu[:, 0], 0.4 * (1 - np.exp(-stretch.time_s / 2.0)), atol=1e-9)
    np.testing.assert_allclose(stretch.state[-1, 0], 0.4 * (10 - 2 * (1 - math.exp(-5))), atol=1e-9)


def test_the_thruster_lag_is_first_order():
    stretch = plant(lag_s=0.5).advance((pwm(20.0),), 10.0)
    t = stretch.time_s
    np.testing.assert_allclose(
        stretch.nu[:, 0], 0.4 * (1 - (2.0 * np.exp(-t / 2.0) - 0.5 * np.exp(-t / 0.5)) / 1.5), atol=1e-8
    )
    assert stretch.thrust_n[0] == pytest.approx(20.0 * (1 - math.exp(-20.0)))


def test_a_couple_turns_the_body_by_moment_over_damping():
    body = plant(SPIN)
    body.advance((pwm(2.0), pwm(2.0)), 30.0)
    assert body.state[12] == pytest.approx(2.0 / 26.0, rel=1e-6)


def test_without_damping_and_thrust_the_kinetic_energy_is_kept_through_all_coupling():
    free = Truth({name: value if name[0] in "MI" else 0.0 for name, value in MODEL.items()}, 0.0, 0.0)
    body = plant(truth=free)
    body._state[7:] = 0.4, 0.3, -0.2, 0.5, -0.4, 0.6
    mass = np.array(free.mass)
    before = 0.5 * np.sum(mass * body.state[7:] ** 2)
    stretch = body.advance((1500.0,), 20.0)
    np.testing.assert_allclose(0.5 * (mass * stretch.nu**2).sum(axis=1), before, rtol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(stretch.state[:, 3:7], axis=1), 1.0, atol=1e-12)


def test_a_rolled_body_swings_at_the_frequency_of_arm_times_weight_over_inertia():
    undamped = Truth({**MODEL, "D_p": 0.0}, 0.0, 0.0)
    body = plant(replace(PUSH, centre_of_gravity_below_buoyancy_m=0.05), undamped)
    body._state[3:7] = math.cos(0.005), math.sin(0.005), 0.0, 0.0
    stretch = body.advance((1500.0,), 5.0)
    swing = 0.01 * np.cos(math.sqrt(0.05 * 72.0 * 9.80665 / 5.0) * stretch.time_s)
    np.testing.assert_allclose(2 * stretch.state[:, 4], swing, atol=1e-5)


def test_net_buoyancy_carries_an_idle_body_up_to_the_surface_and_holds_it_there():
    body = Plant(
        replace(PUSH, net_buoyancy_n=2.0), CURVE, 0.0, STILL_WATER, np.random.default_rng(0), depth_m=0.1
    )
    body.advance((1500.0,), 60.0)
    stiffness = 72.0 * 9.80665 / 0.3
    assert body.state[2] == pytest.approx(-2.0 / stiffness, rel=1e-3)


def test_halving_the_step_changes_nothing_that_a_sensor_could_see():
    shape = FILE.vehicle.configurations["hovering"]
    truth = load_truth(FILE, "hovering").calm()
    ends = []
    for rate_hz in (200.0, 400.0):
        body = plant(shape, truth, lag_s=0.05, rate_hz=rate_hz)
        for tick in range(400):
            body.advance(tuple(1500 + 150 * math.sin(0.1 * tick + i) for i in range(8)), 0.05)
        ends.append(body.state)
    assert np.abs(ends[0][7:]).max() > 0.05
    np.testing.assert_allclose(ends[0], ends[1], atol=2e-8)


def test_the_disturbance_is_stationary_with_the_deviation_and_time_constant_asked_for():
    heavy = {name: 1e5 if name[0] in "MI" else 0.0 for name in MODEL}
    force = []
    for seed in range(4):
        stretch = plant(truth=Truth(heavy, 0.35, 0.06), seed=seed).advance((1500.0,), 1500.0)
        force.append(stretch.nu_dot[::50, 0] * 1e5)
    drawn = np.array(force)
    assert drawn.std() == pytest.approx(0.35, rel=0.05)
    together = np.mean(drawn[:, 6:] * drawn[:, :-6]) / drawn.var()
    assert together == pytest.approx(math.exp(-1.5 / 1.5), abs=0.05)


@pytest.mark.parametrize("duration_s", [0.0, 0.003, 0.0525])
def test_a_duration_that_is_no_whole_number_of_steps_is_refused(duration_s):
    with pytest.raises(ValueError, match="whole number"):
        plant().advance((1500.0,), duration_s)


def test_quadratic_drag_a_dead_zone_and_a_weak_thruster_set_the_steady_speed():
    body = plant(truth=replace(STILL_WATER, effects={"X_uu": 100.0, "T1_gain": 0.5, "T_start": 2.0}))
    stretch = body.advance((pwm(20.0),), 60.0)
    assert stretch.thrust_n[0] == pytest.approx(0.5 * (20.0 - 2.0))
    assert stretch.turned_n[0] == pytest.approx(20.0 - 2.0)
    u = body.state[7]
    assert 50.0 * u + 100.0 * u * u == pytest.approx(9.0, rel=1e-9)


def test_an_effect_that_the_vehicle_can_not_have_is_not_simulated():
    with pytest.raises(ConfigError, match=r"T1_gain 0\.1 out of bounds"):
        plant(truth=replace(STILL_WATER, effects={"T1_gain": 0.1}))


def test_the_shaft_of_a_weak_thruster_lags_as_its_thrust_does():
    weak = plant(truth=replace(STILL_WATER, effects={"T1_gain": 0.5}), lag_s=0.5)
    for _ in range(3):
        stretch = weak.advance((pwm(20.0),), 0.25)
        assert stretch.turned_n[0] == pytest.approx(2.0 * stretch.thrust_n[0])
    sound = plant(lag_s=0.5).advance((pwm(20.0),), 0.75)
    np.testing.assert_array_equal(sound.turned_n, sound.thrust_n)


small = st.floats(-2, 2)
positive = st.floats(0.5, 200)


@given(
    nu=st.tuples(*[small] * 6),
    tau=st.tuples(*[st.floats(-100, 100)] * 6),
    mass=st.tuples(*[positive] * 6),
    damping=st.tuples(*[positive] * 6),
    quadratic=st.tuples(*[st.floats(0, 50)] * 6),
    turn=st.tuples(*[st.floats(0.1, 1)] * 4),
    net_up=small,
)
@settings(max_examples=100)
def test_the_compiled_kernel_is_the_dynamics_of_the_vehicle(nu, tau, mass, damping, quadratic, turn, net_up):
    attitude = np.array(turn) / np.linalg.norm(turn)
    body = Configuration(
        72.0,
        (1.0, 1.0, 1.0),
        (Thruster((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),),
        centre_of_gravity_below_buoyancy_m=0.05,
        net_buoyancy_n=net_up,
    )
    out = np.empty(13)
    state = np.concatenate([[0.0, 0.0, 5.0], attitude, nu])
    linear, squared = np.array(damping), np.array(quadratic)
    arm = 0.05 * 72.0 * 9.80665
    derivative(state, np.array(tau), np.array(mass), linear, squared, arm, net_up, 2000.0, out)
    wanted = acceleration(
        mass, tuple(linear + squared * np.abs(nu)), nu, tau, restoring(body, tuple(attitude))
    )
    np.testing.assert_allclose(out[7:], wanted, rtol=1e-9, atol=1e-9)


@given(turn=st.tuples(*[st.floats(0.1, 1)] * 4), nu=st.tuples(*[small] * 6))
@settings(max_examples=50)
def test_position_and_attitude_follow_the_rotation_matrix_of_the_attitude(turn, nu):
    attitude, ahead = np.array(turn) / np.linalg.norm(turn), 1e-6
    out = np.empty(13)
    state = np.concatenate([[0.0, 0.0, 5.0], attitude, nu])
    derivative(state, np.zeros(6), np.ones(6), np.ones(6), np.zeros(6), 0.0, 0.0, 0.0, out)
    np.testing.assert_allclose(out[:3], matrix_of(attitude) @ nu[:3], atol=1e-9)
    p, q, r = nu[3:]
    skew = np.array([[0, -r, q], [r, 0, -p], [-q, p, 0]])
    numeric = (matrix_of(attitude + ahead * out[3:7]) - matrix_of(attitude - ahead * out[3:7])) / (2 * ahead)
    np.testing.assert_allclose(numeric, matrix_of(attitude) @ skew, atol=1e-6)


def matrix_of(quaternion):
    """Body to earth by Rodrigues' formula, from the quaternion's scalar and vector part."""
    scalar, vector = quaternion[0], quaternion[1:]
    cross = np.cross(vector, np.eye(3)).T
    return np.eye(3) + 2 * scalar * cross + 2 * cross @ cross
