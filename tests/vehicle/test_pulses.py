"""Thrusts to pulse widths, and what is left of the dead zone."""

import numpy as np
import pytest

from bridge.vehicle.config import load_vehicle
from bridge.vehicle.pulses import Pulses
from bridge.vehicle.thrusters import thrust_curve

FILE = load_vehicle("ruvifist")
CURVE = thrust_curve(FILE.vehicle.thrust_curve, FILE.path.parent)


def test_beyond_the_straight_part_the_pulse_widths_give_the_very_thrust() -> None:
    wanted = np.array([-30.0, -2.0, 2.0, 12.5])
    np.testing.assert_allclose(CURVE.thrust(Pulses(CURVE, 1.9)(wanted)), wanted, atol=1e-9)


def test_the_straight_part_runs_through_neutral_and_meets_the_curve_on_both_sides() -> None:
    pulses = Pulses(CURVE, 2.0)
    ahead, astern = CURVE.pwm([2.0, -2.0])
    assert pulses(np.array([0.0])) == pytest.approx([1500.0])
    assert pulses(np.array([1.0, -1.0])) == pytest.approx([(1500 + ahead) / 2, (1500 + astern) / 2])
    assert pulses(np.array([1.999999, -1.999999])) == pytest.approx([ahead, astern], abs=1e-3)


def test_without_a_straight_part_the_smallest_thrust_jumps_over_the_dead_zone() -> None:
    assert np.all(np.abs(Pulses(CURVE, 0.0)(np.array([1e-6, -1e-6])) - 1500.0) > 25.0)


def test_each_thruster_may_have_its_own_straight_part() -> None:
    near, far = Pulses(CURVE, np.array([0.0, 3.0]))(np.array([1.0, 1.0]))
    assert near == pytest.approx(CURVE.pwm(1.0))
    assert far == pytest.approx(1500 + (CURVE.pwm(3.0) - 1500) / 3)
