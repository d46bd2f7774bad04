"""Other forms of a cause: other sizes of it, also where it is absent at infinity."""

import numpy as np
import pytest

from bench.missions.mission import draw_one
from bridge.effects.actuators import DEAD_ZONE, SATURATION
from identify.diagnose.candidates import OTHER_SIZES, Cause, other_forms
from identify.diagnose.nominal import nominal_of


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
