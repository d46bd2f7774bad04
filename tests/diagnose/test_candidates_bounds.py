"""Where a parameter of a cause may end, and what that says."""

import numpy as np
import pytest

from bridge.vehicle.config import load_vehicle
from identify.diagnose.candidates import Cause
from identify.effects.hydrodynamics import QUADRATIC_DRAG
from identify.effects.library import library

HOVERING = load_vehicle("ruvifist:hovering").vehicle.configurations["hovering"]
WEAK = next(effect for effect in library(HOVERING, 0.05) if effect.name == "weak_thruster")


@pytest.mark.parametrize(("gain", "at_bound"), [(0.0, False), (0.4, False), (2.0, True)])
def test_a_thruster_may_give_nothing_but_not_all_that_a_bound_lets_it(gain: float, at_bound: bool) -> None:
    assert Cause(WEAK, np.array([gain])).at_bound is at_bound


def test_a_drag_that_is_not_there_in_some_degrees_of_freedom_is_at_no_bound() -> None:
    assert not Cause(QUADRATIC_DRAG, np.array([20.0, 0.0, 0.0, 0.0, 0.0, 1.0])).at_bound
