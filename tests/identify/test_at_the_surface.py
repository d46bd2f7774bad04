"""A vehicle that never left the surface is identified, with a warning that it was never under."""

from dataclasses import replace

import fitted
import numpy as np
import pytest

from identify.checks.fit.at_the_surface import draught_m
from identify.dive import Signal
from identify.doubt import Outcome
from identify.estimators.answer import answered

TIME_S = np.arange(0.0, 120.0, 0.1)


def doubts_of(depth_m, **keys):
    made = fitted.fit({"M_u": 100.0, "D_u": 50.0}, 1e-4 * np.eye(2))
    dive = replace(fitted.dive(), depth=Signal(TIME_S, np.asarray(depth_m, dtype=float)[:, None]), **keys)
    return answered(made, dive, fitted.vehicle_file())


def test_a_hull_is_as_high_as_a_cube_of_its_water():
    assert draught_m(72.0, 998.2) == pytest.approx(0.416, abs=5e-4)


@pytest.mark.parametrize("zero_m", [-0.1, 0.0, 0.2])
def test_a_vehicle_that_stays_at_the_surface_is_identified_with_a_warning(zero_m):
    answer = doubts_of(zero_m + 0.1 * np.sin(TIME_S))
    (doubt,) = answer.doubts
    assert doubt.problem == "The vehicle hardly left the surface: its depth stays within 0.42 m of zero"
    assert "dive a metre or more deep" in doubt.remedy
    assert doubt.about == ("M_u", "D_u")
    assert answer.outcome is Outcome.CONVERGED
    assert answer.values() == {"M_u": 100.0, "D_u": 50.0}


def test_a_dive_that_begins_and_ends_at_the_surface_is_none_that_stayed_there():
    assert doubts_of(np.where((TIME_S > 50.0) & (TIME_S < 70.0), 2.0, 0.0)).doubts == ()


def test_a_dive_at_half_the_depth_of_a_tank_of_a_metre_is_under_water():
    assert doubts_of(np.full(len(TIME_S), 0.5)).doubts == ()


def test_depths_that_are_all_unknown_tell_nothing():
    assert doubts_of(np.full(len(TIME_S), np.nan)).doubts == ()
