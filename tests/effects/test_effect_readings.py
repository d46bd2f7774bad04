"""What sensors read: a steady leg, a turn, a tilt."""

from collections.abc import Callable

import numpy as np
import pytest

from bridge.vehicle.config import GRAVITY_M_S2
from identify.effects import sensors
from identify.effects.course import Course
from identify.effects.effect import ARRAYS

Made = Callable[..., Course]


def test_a_dvl_reads_more_by_its_scale_and_its_bias(course: Made) -> None:
    ahead = course(nu=[0.5, 0.1, 0, 0, 0, 0.2])
    scaled = sensors.DVL_SCALE.act(ahead, np.array([1.02])).velocity
    assert scaled[-1] == pytest.approx([0.01, 0.002, 0])
    biased = sensors.DVL_BIAS.act(ahead, np.array([0.1, 0.2, 0.3])).velocity
    assert biased[0] == pytest.approx([0.1, 0.2, 0.3])


def test_a_turned_dvl_reads_going_ahead_as_going_aside(course: Made) -> None:
    found = sensors.DVL_MISALIGNMENT.act(course(nu=[0.5, 0, 0.1, 0, 0, 0]), np.array([0.1])).velocity
    assert found[-1] == pytest.approx([0.5 * (np.cos(0.1) - 1), 0.5 * np.sin(0.1), 0])


def test_a_dvl_off_the_middle_reads_the_turn(course: Made) -> None:
    omega, arm = np.array([0.1, -0.2, 0.3]), np.array([0.4, 0.1, -0.2])
    found = sensors.DVL_LEVER_ARM.act(course(nu=[1, 1, 1, *omega]), arm).velocity
    assert found[-1] == pytest.approx(np.cross(omega, arm))


def test_a_late_dvl_reads_what_the_speed_was(course: Made) -> None:
    nu = np.zeros((400, 6))
    nu[:, 0] = 0.2 * 0.05 * np.arange(400)
    found = sensors.DVL_DELAY.act(course(nu=nu, nu_dot=[0.2, 0, 0, 0, 0, 0]), np.array([0.15])).velocity
    assert found[-1] == pytest.approx([-0.03, 0, 0])
    assert found[0] == pytest.approx([0, 0, 0])


def test_a_gyro_reads_its_bias_about_z(course: Made) -> None:
    found = sensors.GYRO_BIAS.act(course(), np.array([0.002])).gyro
    assert found[7] == pytest.approx([0, 0, 0.002])


def test_gravity_leaks_into_a_tilted_accelerometer_at_rest(course: Made) -> None:
    found = sensors.IMU_GRAVITY_LEAK.act(course(), np.array([0.01, 0.02])).specific_force
    assert found[-1] == pytest.approx([0.02 * GRAVITY_M_S2, -0.01 * GRAVITY_M_S2, 0])


def test_a_tilted_accelerometer_reads_the_turned_force_to_first_order(rich_course: Course) -> None:
    small = np.array([1e-6, -2e-6])
    found = sensors.IMU_GRAVITY_LEAK.act(rich_course, small).specific_force
    nu, rate = rich_course.nu[-1], rich_course.nu_dot[-1]
    force = rate[:3] + np.cross(nu[3:], nu[:3]) - GRAVITY_M_S2 * rich_course.world[2][-1]
    roll, pitch = small
    turn = np.array([[1, 0, pitch], [0, 1, -roll], [-pitch, roll, 1]])
    assert found[-1] == pytest.approx(turn.T @ force - force, rel=1e-4)


def test_a_wrong_log_shows_nowhere_along_a_course(rich_course: Course) -> None:
    act = sensors.WRONG_FEEDBACK_LOG.act(rich_course, np.zeros(0))
    assert all(getattr(act, name) is None for name in ARRAYS)
    assert sensors.WRONG_FEEDBACK_LOG.told(np.zeros(0)) == {}
