"""The library of effects: under the names of the answer's schema, and made of lags, delays and directions."""

import json
from collections.abc import Callable

import numpy as np
import pytest
from fakes.shared import shared
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from bridge.vehicle.config import load_vehicle
from identify.effects.course import Course, delayed, lagged, thrust_of
from identify.effects.effect import ARRAYS, Act, Effect
from identify.effects.library import library

HOVERING = load_vehicle("ruvifist:hovering").vehicle.configurations["hovering"]
LIBRARY = library(HOVERING, 0.05)
PARAMETERS = {
    "quadratic_drag": ["X_uu", "Y_vv", "Z_ww", "K_pp", "M_qq", "N_rr"],
    "steady_current": ["north", "east"],
    "varying_current": ["amplitude", "period"],
    "waves": ["force_amplitude", "period"],
    "free_surface": ["mass_change"],
    "bottom_or_wall": ["mass_change"],
    "cg_offset": ["x", "y"],
    "pitch_roll_coupling": ["height"],
    "net_buoyancy": ["force"],
    "entrained_water": ["mass"],
    "thrust_gain": ["gain"],
    "thrust_curve": ["low_end_loss"],
    "reverse_thrust_loss": ["gain"],
    "dead_zone": ["half_width"],
    "saturation": ["limit"],
    "inflow_loss": ["slope"],
    "hull_interaction": ["loss"],
    "weak_thruster": ["thruster", "gain"],
    "thruster_misalignment": ["thruster", "angle"],
    "thruster_lag": ["time_constant"],
    "command_delay": ["delay"],
    "dvl_delay": ["delay"],
    "battery_sag": ["rate"],
    "load_sag": ["resistance"],
    "fouling": ["rate"],
    "added_payload": ["mass"],
    "tether": ["stiffness", "north", "east"],
    "dvl_scale": ["scale"],
    "depth_scale": ["scale"],
    "dvl_bias": ["x", "y", "z"],
    "dvl_misalignment": ["yaw"],
    "dvl_lever_arm": ["x", "y", "z"],
    "imu_gravity_leak": ["roll", "pitch"],
    "gyro_bias": ["z"],
    "munk_moment": ["gain"],
    "cross_flow_lift": ["Y_uv", "N_uv"],
    "coupled_damping": ["Y_r", "N_v"],
    "drag_asymmetry": ["ratio"],
    "propeller_torque": ["K", "N"],
    "thrust_bias": ["X", "Y", "Z", "N"],
    "wrong_feedback_log": [],
}
BEFORE_THE_SHAFT = {
    "dead_zone", "saturation", "thruster_lag", "command_delay", "battery_sag", "load_sag",
}  # fmt: skip

every_effect = pytest.mark.parametrize("effect", LIBRARY, ids=lambda e: e.label)


def parts(act: Act) -> dict[str, np.ndarray]:
    return {name: value for name in ARRAYS if (value := getattr(act, name)) is not None}


def test_the_names_and_parameters_are_those_of_the_shared_schema() -> None:
    schema = json.loads(shared("answers.schema.3.json").read_text())
    assert set(schema["properties"]["effects"]["items"]["properties"]["name"]["enum"]) == set(PARAMETERS)
    # The form names the gain of a depth sensor, but gives it no parameters.
    named = schema["$defs"]["parameters_of_each_effect"]
    assert {"depth_scale": ["scale"]} | named == PARAMETERS


def test_a_depth_that_seems_too_large_is_told_as_what_the_sea_does_to_a_file_of_fresh_water_too() -> None:
    (effect,) = (each for each in LIBRARY if each.name == "depth_scale")
    assert "the sea" in effect.sentence
    assert f"{1025.0 / 998.2:.3f}" in effect.sentence


def test_no_two_effects_go_by_one_label() -> None:
    labels = [effect.label for effect in LIBRARY]
    assert len(set(labels)) == len(labels)


def test_each_name_is_told_with_all_its_parameters_by_one_of_its_forms() -> None:
    fullest: dict[str, list[str]] = {}
    for effect in LIBRARY:
        names = list(effect.answer_parameters(effect.start()))
        fullest[effect.name] = max(names, fullest.get(effect.name, []), key=len)
    assert fullest == PARAMETERS


@every_effect
def test_every_effect_says_what_it_is_and_tells_its_parameters_in_units(effect: Effect) -> None:
    parameters = effect.answer_parameters(effect.start())
    assert set(parameters) <= set(PARAMETERS[effect.name])
    assert all(np.isfinite(value) and unit for value, unit in parameters.values())
    assert len(effect.sentence) > 15
    assert not effect.sentence.endswith(".")
    assert effect.separation.every
    assert all(len(way) > 8 for way in effect.separation.every)


@every_effect
def test_bounds_hold_what_is_absent_what_shows_and_every_size_that_is_tried(effect: Effect) -> None:
    assert effect.sizes == (1.0,) or not effect.linear
    for p in effect.parameters:
        assert p.unit
        assert p.low <= p.none <= p.high
        assert p.start != p.none
        for size in (1.0, *effect.sizes):
            at = p.none + size * (p.start - p.none) if np.isfinite(p.none) else p.start / size
            assert p.low < at < p.high


@every_effect
def test_at_none_it_adds_nothing_and_at_start_something_finite_of_the_right_shape(
    effect: Effect, rich_course: Course
) -> None:
    assert not any(np.any(value) for value in parts(effect.act(rich_course, effect.none())).values())
    act = effect.act(rich_course, effect.start())
    result = parts(act)
    count, thrusters = rich_course.asked_n.shape
    wide = {"wrench": 6, "shaft_n": thrusters, "depth": 1} | dict.fromkeys(
        ("velocity", "gyro", "attitude", "specific_force", "water"), 3
    )
    assert bool(result) == bool(effect.parameters)
    for name, value in result.items():
        assert np.isfinite(value).all()
        assert np.any(value)
        assert value.shape == ((6,) if name in ("mass", "damping", "quadratic") else (count, wide[name]))
    if set(result) & {"mass", "damping"}:
        assert effect.refit_absorbs
        assert set(result) <= {"mass", "damping", "quadratic", "wrench"}
        assert effect.feedforward == "nominal"
    # Shaft speeds show what happens before the shaft and nothing else.
    assert (act.shaft_n is not None) == (effect.name in BEFORE_THE_SHAFT)
    if act.shaft_n is not None:
        assert act.wrench == pytest.approx(rich_course.wrench_of(act.shaft_n), abs=1e-12)


@pytest.mark.parametrize("effect", [e for e in LIBRARY if e.linear and e.parameters], ids=lambda e: e.label)
@settings(max_examples=5, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_a_linear_effect_adds_in_proportion(effect: Effect, data: st.DataObject, rich_course: Course) -> None:
    size = st.floats(-3.0, 3.0)
    first, second = (np.array([data.draw(size) for _ in effect.parameters]) for _ in range(2))
    by_first, by_second, both = (
        parts(effect.act(rich_course, effect.none() + by)) for by in (first, second, first - 2 * second)
    )
    for name, value in both.items():
        assert np.allclose(value, by_first[name] - 2 * by_second[name], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("effect", [e for e in LIBRARY if not e.linear], ids=lambda e: e.label)
def test_an_effect_that_is_not_linear_does_not_add_in_proportion(effect: Effect, rich_course: Course) -> None:
    none = np.where(np.isinf(effect.none()), 25.0, effect.none())
    step = effect.start() - none
    once, twice = (parts(effect.act(rich_course, none + by)) for by in (step, 2 * step))
    assert any(not np.allclose(twice[name], 2 * value, rtol=1e-6, atol=1e-12) for name, value in once.items())


def test_the_feed_forward_makes_up_for_these_and_for_no_others() -> None:
    groups: dict[str, set[str]] = {}
    for effect in LIBRARY:
        groups.setdefault(effect.feedforward, set()).add(effect.name)
    groups.pop("")
    assert groups == {
        "nominal": {"added_payload", "entrained_water", "fouling"},
        "quadratic_drag": {"quadratic_drag"},
        "coupling": {"coupled_damping", "cross_flow_lift", "munk_moment", "cg_offset"},
        "thruster_gain": {"thrust_gain", "weak_thruster"},
        "reverse_loss": {"reverse_thrust_loss"},
        "dead_zone": {"dead_zone"},
        "voltage": {"battery_sag", "load_sag"},
    }


def test_a_vehicle_without_thrusters_still_has_a_library() -> None:
    bare = type(HOVERING)(dry_mass_kg=10.0, inertia_kgm2=(1.0, 1.0, 1.0), thrusters=())
    assert {e.name for e in library(bare, 0.0)} == set(PARAMETERS) - {
        "weak_thruster",
        "thruster_misalignment",
    }


Made = Callable[..., Course]


def step_by_step(asked: np.ndarray, step_s: float, lag_s: float) -> np.ndarray:
    keep = np.exp(-step_s / lag_s)
    out = asked.copy()
    for i in range(1, len(asked)):
        out[i] = asked[i - 1] + keep * (out[i - 1] - asked[i - 1])
    return out


@settings(max_examples=25)
@given(
    st.integers(1, 9000),
    st.integers(1, 8),
    st.floats(1e-4, 50.0),
    st.integers(0, 2**31),
)
def test_a_lag_by_blocks_is_the_lag_step_by_step(count: int, width: int, lag_s: float, seed: int) -> None:
    asked = np.random.default_rng(seed).normal(0.0, 20.0, (count, width))
    assert np.allclose(lagged(asked, 0.02, lag_s), step_by_step(asked, 0.02, lag_s), rtol=0.0, atol=1e-12)


def test_without_a_lag_comes_what_is_asked_for() -> None:
    asked = np.random.default_rng(100002).normal(size=(50, 3))
    assert np.array_equal(lagged(asked, 0.02, 0.0), asked)


@pytest.mark.parametrize("lag_s", [0.0, 0.1])
def test_thrust_comes_a_lag_after_the_step_of_its_demand_and_no_half_step_before(lag_s: float) -> None:
    asked, at_s = np.zeros((400, 1)), 0.02 * np.arange(400)
    asked[200:] = 10.0
    grown = np.diff(thrust_of(asked, 0.02, lag_s)[:, 0])
    middle_s = 0.5 * (at_s[1:] + at_s[:-1])
    assert np.average(middle_s, weights=grown) == pytest.approx(200 * 0.02 + lag_s, abs=1e-3)


@pytest.mark.parametrize("delay_s", [0.0, 0.05, 0.12, -0.07, 100.0, -100.0])
def test_a_delay_reads_what_was_there_before(delay_s: float) -> None:
    time_s = 0.05 * np.arange(100)
    values = np.column_stack([np.sin(time_s), time_s])
    late = delayed(values, 0.05, delay_s)
    for reading, column in zip(late.T, values.T, strict=True):
        assert reading == pytest.approx(np.interp(time_s - delay_s, time_s, column), abs=1e-12)


def test_north_and_down_are_seen_as_a_tilted_vehicle_sees_them(course: Made) -> None:
    ahead = course(euler=[0.0, 0.0, np.pi / 2])
    assert ahead.in_body(0.0, 2.0)[0] == pytest.approx([2.0, 0.0, 0.0], abs=1e-15)
    assert ahead.in_body(1.0, 0.0)[0] == pytest.approx([0.0, -1.0, 0.0], abs=1e-15)
    rolled = course(euler=[0.3, 0.0, 0.0])
    assert rolled.world[2][0] == pytest.approx([0.0, np.sin(0.3), np.cos(0.3)])


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(euler=st.tuples(*[st.floats(-1.5, 1.5)] * 3))
def test_the_world_is_a_right_handed_frame(course: Made, euler: tuple[float, float, float]) -> None:
    cos, sin = np.cos(euler), np.sin(euler)
    roll = np.array([[1, 0, 0], [0, cos[0], -sin[0]], [0, sin[0], cos[0]]])
    pitch = np.array([[cos[1], 0, sin[1]], [0, 1, 0], [-sin[1], 0, cos[1]]])
    yaw = np.array([[cos[2], -sin[2], 0], [sin[2], cos[2], 0], [0, 0, 1]])
    world = course(euler=euler, count=2).world
    assert np.allclose(np.stack([axis[0] for axis in world]), yaw @ pitch @ roll, atol=1e-12)
