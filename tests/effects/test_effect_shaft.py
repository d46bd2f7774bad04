"""Thrust by shaft speed, and what it shows of an effect before the shaft."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from bridge.vehicle.config import ThrustCurve
from bridge.vehicle.thrusters import shaft_speed
from identify.effects.actuators import SATURATION
from identify.effects.course import Course
from identify.effects.shaft import seen_by_shaft, thrust_by_shaft

CURVE = ThrustCurve()


def test_thrust_comes_back_from_its_shaft_speed() -> None:
    thrust = np.array([[-30.0, -0.1, 0.0, 0.1, 45.0]])
    assert thrust_by_shaft(CURVE, 60 * shaft_speed(CURVE, thrust)) == pytest.approx(thrust)


def test_shafts_show_what_a_saturation_takes_and_nothing_where_they_are_not_recorded(
    course: Callable[..., Course],
) -> None:
    asked = course(asked_n=[30.0, -30.0, 5.0, 0, 0, 0, 0, 0])
    act = SATURATION.act(asked, np.array([12.0]))
    assert act.shaft_n is not None
    rpm = 60 * shaft_speed(CURVE, asked.thrust_n + act.shaft_n)
    rpm[:, 7] = np.nan
    seen = seen_by_shaft(replace(asked, rpm=rpm), CURVE)
    assert seen[:, :7] == pytest.approx(act.shaft_n[:, :7])
    assert np.isnan(seen[:, 7]).all()
