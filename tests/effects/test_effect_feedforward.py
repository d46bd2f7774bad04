"""What the feed-forward on board makes up for is what the library's effects take away."""

from dataclasses import replace

import numpy as np
import pytest

from bridge.vehicle.feedforward import hull_wrench
from bridge.vehicle.references import Reference
from bridge.vehicle.thruster_losses import Losses
from identify.effects import actuators, hydrodynamics, rigid_body, supply
from identify.effects.course import Course
from identify.effects.effect import Effect

ONES = np.ones(8)
WEAK = np.array([1.0, 1.0, 0.7, 1.0, 1.0, 1.0, 1.0, 1.0])


def test_the_hull_is_made_up_for_as_its_effects_are_planted(rich_course: Course) -> None:
    course = rich_course
    hull = {"X_uu": 6.0, "Y_vv": 3.0, "N_rr": 0.5, "Y_r": 4.0, "N_v": -3.0, "Y_uv": 20.0, "N_uv": 8.0}
    mass_kg = course.configuration.dry_mass_kg
    hull |= {"S_x": 0.02 * mass_kg, "S_y": -0.01 * mass_kg, "N_munk": 0.3 * (course.mass[1] - course.mass[0])}
    planted: tuple[tuple[Effect, tuple[float, ...]], ...] = (
        (hydrodynamics.QUADRATIC_DRAG, (6.0, 3.0, 0.0, 0.0, 0.0, 0.5)),
        (hydrodynamics.COUPLED_DAMPING, (4.0, -3.0)),
        (hydrodynamics.CROSS_FLOW_LIFT, (20.0, 8.0)),
        (hydrodynamics.MUNK_MOMENT_IN_YAW, (1.3,)),
        (rigid_body.CG_OFFSET, (0.02, -0.01)),
    )
    taken = np.zeros_like(course.nu)
    for effect, values in planted:
        wrench = effect.act(course, np.array(values)).wrench
        assert wrench is not None
        taken += wrench
    assert np.abs(taken[:, [0, 1, 5]]).max() > 1.0
    for nu, nu_dot, lost in zip(course.nu, course.nu_dot, taken, strict=True):
        made = np.array(hull_wrench(hull, Reference(tuple(nu), tuple(nu_dot), 0.0, 0.0)))
        np.testing.assert_allclose((made + lost)[[0, 1, 5]], 0.0, atol=1e-12)


@pytest.mark.parametrize(
    ("effect", "values", "losses"),
    [
        (actuators.THRUST_GAIN, 0.8, Losses(0.8 * ONES)),
        (actuators.REVERSE_THRUST_LOSS, 0.7, Losses(ONES, astern=0.7)),
        (actuators.DEAD_ZONE, 2.0, Losses(ONES, least_n=2.0)),
        (actuators.DEAD_ZONE_SHIFTED, 2.0, Losses(ONES, start_n=2.0)),
        (actuators.weak(3), 0.7, Losses(WEAK)),
        (supply.LOAD_SAG, 0.02, Losses(ONES, resistance_ohm=0.02)),
    ],
    ids=lambda given: getattr(given, "label", ""),
)
def test_thrusters_lose_on_board_what_they_lose_in_the_library(
    rich_course: Course, effect: Effect, values: float, losses: Losses
) -> None:
    course = replace(rich_course, lag_s=0.0)
    wrench = effect.act(course, np.array([values])).wrench
    given = np.array([losses.given(asked) for asked in course.asked_n])
    assert wrench is not None
    np.testing.assert_allclose(course.wrench_of(given - course.asked_n), wrench, atol=1e-9)


def test_a_sag_of_the_rate_of_the_voltage_is_thrust_that_goes_as_its_square(rich_course: Course) -> None:
    since_s = rich_course.since_s
    voltage_v = 16.0 - 0.1 * since_s
    begun_v, rate = supply.voltage_law(voltage_v, since_s)
    fall = rate * supply.fall_by_voltage(voltage_v, since_s)
    assert begun_v == 16.0
    assert fall[0] == 0.0
    assert fall[-1] == pytest.approx(1 - ((16.0 - 0.1 * since_s[-1]) / 16.0) ** 2, abs=0.15)
    assert np.isnan(supply.voltage_law(np.full_like(since_s, np.nan), since_s)).all()
