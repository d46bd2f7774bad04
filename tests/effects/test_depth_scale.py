"""The gain of the depth sensor: what it adds to a reading, and that the depth at the beginning tells nothing of it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from identify.diagnose.innovations import reading_error
from identify.effects.course import Course
from identify.effects.sensors import DEPTH_SCALE
from identify.estimators.innovations import POSITION, VELOCITY


def deep(course: Course, depth_m: np.ndarray) -> Course:
    return replace(course, depth_m=depth_m)


def test_a_sensor_that_reads_a_quarter_too_much_is_off_by_a_fifth_of_what_it_reads(
    rich_course: Course,
) -> None:
    true_m = np.linspace(1.0, 3.0, len(rich_course.time_s))
    act = DEPTH_SCALE.act(deep(rich_course, 1.25 * true_m), np.array([1.25]))
    assert act.depth == pytest.approx(0.25 * true_m)


def test_without_a_depth_it_does_nothing(rich_course: Course) -> None:
    act = DEPTH_SCALE.act(deep(rich_course, np.full(len(rich_course.time_s), np.nan)), np.array([1.25]))
    assert act.depth is None


def test_it_falsifies_readings_of_depth_alone_and_only_as_the_depth_changes(rich_course: Course) -> None:
    time_s = rich_course.time_s
    sinking = deep(rich_course, 5.0 + 0.2 * (time_s - time_s[0]))
    axis = SimpleNamespace(
        dof=2,
        time_s=time_s[100:104],
        state_read=np.array([POSITION, VELOCITY, POSITION, VELOCITY]),
    )
    off = reading_error(SimpleNamespace(axis=axis), DEPTH_SCALE.act(sinking, np.array([2.0])), sinking)
    sunk = 0.2 * (axis.time_s - time_s[0])
    assert off == pytest.approx(0.5 * sunk * np.array([1, 0, 1, 0]))
    axis.dof = 4
    assert (
        reading_error(SimpleNamespace(axis=axis), DEPTH_SCALE.act(sinking, np.array([2.0])), sinking) is None
    )
