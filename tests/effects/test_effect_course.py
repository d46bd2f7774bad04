"""What effects are made of: lags, delays, directions."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from identify.effects.course import Course, delayed, lagged

Made = Callable[..., Course]


def step_by_step(asked: np.ndarray, step_s: float, lag_s: float) -> np.ndarray:
    keep = np.exp(-step_s / lag_s)
    out = asked.copy()
    for i in range(1, len(asked)):
        out[i] = asked[i - 1] + keep * (out[i - 1] - asked[i - 1])
    return out


@settings(max_examples=25, deadline=None)
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


def test_a_step_is_left_by_a_third_after_one_time_constant() -> None:
    asked = np.ones((101, 1))
    asked[0] = 0.0
    assert lagged(asked, 0.01, 1.0)[-1, 0] == pytest.approx(1.0 - np.exp(-0.99), abs=1e-12)


@pytest.mark.parametrize("delay_s", [0.0, 0.05, 0.12, -0.07, 100.0, -100.0])
def test_a_delay_reads_what_was_there_before(delay_s: float) -> None:
    time_s = 0.05 * np.arange(100)
    values = np.column_stack([np.sin(time_s), time_s])
    late = delayed(values, 0.05, delay_s)
    for found, column in zip(late.T, values.T, strict=True):
        assert found == pytest.approx(np.interp(time_s - delay_s, time_s, column), abs=1e-12)


def test_north_and_down_are_seen_as_a_tilted_vehicle_sees_them(course: Made) -> None:
    ahead = course(euler=[0.0, 0.0, np.pi / 2])
    assert ahead.in_body(0.0, 2.0)[0] == pytest.approx([2.0, 0.0, 0.0], abs=1e-15)
    assert ahead.in_body(1.0, 0.0)[0] == pytest.approx([0.0, -1.0, 0.0], abs=1e-15)
    rolled = course(euler=[0.3, 0.0, 0.0])
    assert rolled.world[2][0] == pytest.approx([0.0, np.sin(0.3), np.cos(0.3)])


@settings(max_examples=20, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(euler=st.tuples(*[st.floats(-1.5, 1.5)] * 3))
def test_the_world_is_a_right_handed_frame(course: Made, euler: tuple[float, float, float]) -> None:
    cos, sin = np.cos(euler), np.sin(euler)
    roll = np.array([[1, 0, 0], [0, cos[0], -sin[0]], [0, sin[0], cos[0]]])
    pitch = np.array([[cos[1], 0, sin[1]], [0, 1, 0], [-sin[1], 0, cos[1]]])
    yaw = np.array([[cos[2], -sin[2], 0], [sin[2], cos[2], 0], [0, 0, 1]])
    world = course(euler=euler, count=2).world
    assert np.allclose(np.stack([axis[0] for axis in world]), yaw @ pitch @ roll, atol=1e-12)
