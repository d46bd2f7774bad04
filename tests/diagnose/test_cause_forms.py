"""Other forms of a cause: other sizes of it, also where it is absent at infinity."""

import numpy as np
import pytest

from bench.missions.mission import draw_one
from identify.diagnose.candidates import OTHER_SIZES, Cause, other_forms
from identify.diagnose.nominal import nominal_of
from identify.effects.actuators import DEAD_ZONE, SATURATION
from identify.effects.hydrodynamics import COUPLED_DAMPING, QUADRATIC_DRAG
from identify.effects.rigid_body import CG_OFFSET_IN_SPACE


@pytest.fixture(scope="module")
def course():
    mission = draw_one(100_300, seconds=60.0)
    return nominal_of(mission.dive, mission.file, mission.configuration).course


@pytest.mark.parametrize("effect", [SATURATION, DEAD_ZONE], ids=lambda effect: effect.name)
@pytest.mark.parametrize("share", [0.2, 1.0])
def test_other_sizes_of_a_limit_are_shares_of_itself_and_no_number_gets_lost(course, effect, share):
    values = share * effect.start()
    acts = list(other_forms(course, Cause(effect, values)))
    for size, act in zip(OTHER_SIZES, acts, strict=False):
        np.testing.assert_array_equal(act.wrench, effect.act(course, size * values).wrench)
    assert all(np.isfinite(act.wrench).all() for act in acts)


def test_a_limit_that_is_at_infinity_is_absent_in_every_form(course):
    for act in other_forms(course, Cause(SATURATION, SATURATION.none())):
        assert np.isfinite(act.wrench).all()
        assert not act.wrench.any()


def test_drag_that_grows_is_no_form_of_a_quadratic_one_and_growth_one_of_any_other_cause(course):
    growing = (course.since_s / course.since_s[-1] - 0.5)[:, None]
    for effect, grows in ((QUADRATIC_DRAG, False), (COUPLED_DAMPING, True)):
        cause = Cause(effect, effect.start())
        own = growing * cause.act(course).wrench
        forms = [act.wrench for act in other_forms(course, cause)]
        assert any(np.allclose(form, own) for form in forms) == grows


def test_a_centre_of_mass_has_a_form_of_the_acceleration_that_vertical_thrust_makes(course):
    cause = Cause(CG_OFFSET_IN_SPACE, np.array([0.05, 0.0]))
    heave = course.wrench_of(course.thrust_n)[:, 2] / course.mass[2]
    # M = x m w_dot (Fossen 2011, eq. 3.60).
    expected = course.configuration.dry_mass_kg * 0.05 * heave
    forms = [act.wrench for act in other_forms(course, cause)]
    assert heave.any()
    assert any(np.allclose(form[:, 4], expected) and not form[:, [0, 1, 2, 3]].any() for form in forms)
