"""Causes that were put in by hand are found by name, with their size, and nothing else is."""

from dataclasses import replace

import numpy as np
import pytest

from bench.missions.mission import draw_one
from bridge.effects.actuators import DEAD_ZONE
from bridge.effects.effect import Act
from bridge.effects.environment import STEADY_CURRENT
from bridge.effects.hydrodynamics import COUPLED_DAMPING, QUADRATIC_DRAG
from identify.diagnose.cause import Cause
from identify.diagnose.generic import left_over
from identify.diagnose.ground import ground_of
from identify.diagnose.nominal import nominal_of, refitted
from identify.diagnose.search import LEAST_SHARE, explain, least

LIBRARY = (COUPLED_DAMPING, STEADY_CURRENT, DEAD_ZONE, QUADRATIC_DRAG)


def left_of(now):
    ground = ground_of(now, LIBRARY)
    return left_over(ground, ground.fitted(()))


def quiet(_share, _words):
    pass


@pytest.fixture(scope="module")
def nominal():
    mission = draw_one(100_300, seconds=120.0)
    return nominal_of(mission.dive, mission.file, mission.configuration)


def test_a_dive_that_obeys_the_nominal_model_has_no_cause(nominal):
    assert explain(nominal, LIBRARY, quiet).causes == ()


def test_a_drag_of_which_the_model_is_told_the_opposite_is_found_with_its_size(nominal):
    """A model that takes a drag for a push: to it the vehicle has that drag more."""
    size = (
        0.3
        * nominal.course.damping[0]
        / np.abs(nominal.course.nu[:, 0]).max()
        * np.array([5.0, 0, 0, 0, 0, 0])
    )
    opposed = refitted(nominal, [QUADRATIC_DRAG.act(nominal.course, -size)])
    spoilt = replace(opposed, acts=(), course=nominal.course)
    found = explain(spoilt, LIBRARY, quiet)
    (cause,) = found.causes
    assert cause.effect is QUADRATIC_DRAG
    assert cause.values[0] == pytest.approx(size[0], rel=0.15)
    assert found.now.course.mass[0] == pytest.approx(nominal.course.mass[0], rel=0.02)


def test_a_cause_whose_size_ends_at_nothing_is_gone(nominal):
    ground = ground_of(nominal, LIBRARY)
    (left,) = ground.fitted([Cause(QUADRATIC_DRAG, np.array([0.0, 0, 0, 0, 0, 1e-6]))]).causes or (None,)
    assert left is None or left.values[5] > 0
    assert ground.fitted([Cause(DEAD_ZONE, DEAD_ZONE.none())]).causes == ()


def test_the_form_of_a_cause_asks_more_of_a_further_one_only_where_both_show(nominal):
    ground = ground_of(nominal, LIBRARY)
    drag, turning, slowing = (
        Cause(QUADRATIC_DRAG, size * np.eye(6)[dof]) for size, dof in ((5000, 0), (500, 5), (2000, 0))
    )
    fit = replace(ground.fitted(()), causes=(drag,), felt=1e9)
    itself = ground.met(fit, drag)
    assert ground.met(fit, slowing) == pytest.approx(itself)
    assert ground.met(fit, turning) < 0.05 * itself
    assert least(ground, replace(fit, felt=0.5 * itself), drag) == pytest.approx(LEAST_SHARE * 0.5 * itself)
    assert least(ground, fit, turning) < least(ground, fit, drag)


def test_a_force_of_no_effect_in_the_library_is_told_in_its_degree_of_freedom(nominal):
    """A push that goes with the square of the speed, whichever way: no drag is even."""
    wrench = np.zeros_like(nominal.course.nu)
    wrench[:, 2] = 300.0 * nominal.course.nu[:, 2] ** 2
    spoilt = replace(refitted(nominal, [Act(wrench=wrench)]), acts=())
    found = left_of(spoilt)
    assert found.shapes[0].dof == 2
    assert found.gains[0] > 5 * max(left_of(nominal).gains, default=1.0)
