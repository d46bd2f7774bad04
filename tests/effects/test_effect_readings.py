"""Readings of sensors: a steady leg, a turn, a tilt; the gain of the depth sensor as the vehicle sinks."""

from collections.abc import Callable
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bridge.vehicle.config import GRAVITY_M_S2
from identify.diagnose.filters.innovations import reading_error
from identify.effects import sensors
from identify.effects.course import Course
from identify.effects.effect import ARRAYS, Act, Effect
from identify.effects.sensors import DEPTH_SCALE
from identify.estimators.filter.state import POSITION, VELOCITY

Made = Callable[..., Course]


@pytest.mark.parametrize(
    ("effect", "nu", "values", "array", "expected"),
    [
        (sensors.DVL_SCALE, [0.5, 0.1, 0, 0, 0, 0.2], (1.02,), "velocity", [0.01, 0.002, 0]),
        (sensors.DVL_BIAS, [0.5, 0.1, 0, 0, 0, 0.2], (0.1, 0.2, 0.3), "velocity", [0.1, 0.2, 0.3]),
        # Turned, it reads going ahead as going aside; off the middle, it reads the turn.
        (sensors.DVL_MISALIGNMENT, [0.5, 0, 0.1, 0, 0, 0], (0.1,), "velocity",
         [0.5 * (np.cos(0.1) - 1), 0.5 * np.sin(0.1), 0]),
        (sensors.DVL_LEVER_ARM, [1, 1, 1, 0.1, -0.2, 0.3], (0.4, 0.1, -0.2), "velocity",
         np.cross([0.1, -0.2, 0.3], [0.4, 0.1, -0.2])),
        (sensors.GYRO_BIAS, 0.0, (0.002,), "gyro", [0, 0, 0.002]),
        (sensors.GYRO_SCALE, [0, 0, 0, 0.1, 0.2, 0.3], (1.02,), "gyro", [0, 0, 0.006]),
        (sensors.IMU_GRAVITY_LEAK, 0.0, (0.01, 0.02), "specific_force",
         [0.02 * GRAVITY_M_S2, -0.01 * GRAVITY_M_S2, 0]),
    ],
    ids=lambda given: getattr(given, "label", ""),
)  # fmt: skip
def test_a_sensor_reads_more_as_its_law_says(
    course: Made, effect: Effect, nu: Any, values: tuple[float, ...], array: str, expected: Any
) -> None:
    result = getattr(effect.act(course(nu=nu), np.array(values)), array)
    assert result[-1] == pytest.approx(np.array(expected))


def test_a_late_dvl_reads_what_the_speed_was(course: Made) -> None:
    nu = np.zeros((400, 6))
    nu[:, 0] = 0.2 * 0.05 * np.arange(400)
    result = sensors.DVL_DELAY.act(course(nu=nu, nu_dot=[0.2, 0, 0, 0, 0, 0]), np.array([0.15])).velocity
    assert result[-1] == pytest.approx([-0.03, 0, 0])
    assert result[0] == pytest.approx([0, 0, 0])


@pytest.mark.parametrize("delay_s", [0.15, -0.15])
def test_a_late_dvl_reads_no_speed_of_another_run(course: Made, delay_s: float) -> None:
    """Two runs at steady speeds, 2 m/s apart: between them the course is made up."""
    rate = np.zeros((400, 6))
    rate[180:220, 0] = 1.0
    one = course(nu_dot=rate)
    runs = replace(one, runs_s=((one.time_s[0], one.time_s[180]), (one.time_s[220], one.time_s[-1])))
    assert sensors.DVL_DELAY.act(one, np.array([delay_s])).velocity.any()
    assert not sensors.DVL_DELAY.act(runs, np.array([delay_s])).velocity.any()


def test_a_tilted_accelerometer_reads_the_turned_force_to_first_order(rich_course: Course) -> None:
    small = np.array([1e-6, -2e-6])
    result = sensors.IMU_GRAVITY_LEAK.act(rich_course, small).specific_force
    nu, rate = rich_course.nu[-1], rich_course.nu_dot[-1]
    force = rate[:3] + np.cross(nu[3:], nu[:3]) - GRAVITY_M_S2 * rich_course.world[2][-1]
    roll, pitch = small
    turn = np.array([[1, 0, pitch], [0, 1, -roll], [-pitch, roll, 1]])
    assert result[-1] == pytest.approx(turn.T @ force - force, rel=1e-4)


def test_a_wrong_log_shows_nowhere_along_a_course(rich_course: Course) -> None:
    act = sensors.WRONG_FEEDBACK_LOG.act(rich_course, np.zeros(0))
    assert all(getattr(act, name) is None for name in ARRAYS)
    assert sensors.WRONG_FEEDBACK_LOG.answer_parameters(np.zeros(0)) == {}


@pytest.fixture
def sinking(rich_course: Course) -> Course:
    """Sinks at 0.2 m/s, level."""
    still = np.zeros_like(rich_course.nu)
    still[:, 2] = 0.2
    return replace(rich_course, nu=still, nu_dot=0.0 * still, euler=0.0 * rich_course.euler)


def test_a_sensor_that_reads_a_quarter_too_much_adds_a_quarter_of_the_way_down(sinking: Course) -> None:
    act = DEPTH_SCALE.act(sinking, np.array([1.25]))
    assert np.diff(act.depth[:, 0]) == pytest.approx(0.25 * 0.2 * sinking.step_s)


def test_a_vehicle_on_its_side_sinks_by_its_sway(sinking: Course) -> None:
    rolled = np.tile([np.pi / 2, 0.0, 0.0], (len(sinking.time_s), 1))
    sway = np.roll(sinking.nu, -1, axis=1)
    act = DEPTH_SCALE.act(replace(sinking, nu=sway, euler=rolled), np.array([2.0]))
    assert act.depth[-1, 0] == pytest.approx(0.2 * sinking.step_s * len(sinking.time_s))


def test_it_falsifies_readings_of_depth_alone_and_only_as_the_depth_changes(sinking: Course) -> None:
    time_s = sinking.time_s
    axis = SimpleNamespace(
        dof=2,
        time_s=time_s[100:104],
        state_read=np.array([POSITION, VELOCITY, POSITION, VELOCITY]),
        runs=(slice(0, 4),),
    )
    act = DEPTH_SCALE.act(sinking, np.array([2.0]))
    sunk = 0.2 * (axis.time_s - axis.time_s[0])
    off = reading_error(SimpleNamespace(axis=axis), act, sinking)
    assert off == pytest.approx(sunk * np.array([1, 0, 1, 0]))
    axis.dof = 4
    assert reading_error(SimpleNamespace(axis=axis), act, sinking) is None


def test_each_run_begins_at_the_depth_that_is_first_read_there_whatever_the_gain(sinking: Course) -> None:
    time_s = sinking.time_s
    read_s = np.concatenate([time_s[10:13], time_s[300:303]])
    axis = SimpleNamespace(
        dof=2,
        time_s=read_s,
        shown_s=read_s,
        state_read=np.array([POSITION, POSITION, POSITION, VELOCITY, POSITION, POSITION]),
        runs=(slice(0, 3), slice(3, 6)),
    )
    step = 0.2 * sinking.step_s
    for act in (DEPTH_SCALE.act(sinking, np.array([2.0])), Act(water=sinking.nu[:, :3])):
        off = reading_error(SimpleNamespace(axis=axis), act, sinking) * (axis.state_read == POSITION)
        assert off == pytest.approx(step * np.array([0.0, 1.0, 2.0, 0.0, 0.0, 1.0]))
