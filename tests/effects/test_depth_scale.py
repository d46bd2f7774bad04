"""The gain of the depth sensor: what it adds to a reading, and that the depth at the beginning tells nothing of it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identify.diagnose.innovations import reading_error
from identify.effects.course import Course
from identify.effects.sensors import DEPTH_SCALE
from identify.estimators.innovations import POSITION, VELOCITY


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
    )
    act = DEPTH_SCALE.act(sinking, np.array([2.0]))
    sunk = 0.2 * (axis.time_s - time_s[0])
    off = reading_error(SimpleNamespace(axis=axis), act, sinking)
    assert off == pytest.approx(sunk * np.array([1, 0, 1, 0]))
    axis.dof = 4
    assert reading_error(SimpleNamespace(axis=axis), act, sinking) is None
