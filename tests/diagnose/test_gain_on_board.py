"""What the feed-forward would gain: errors die out by all that brakes the vehicle, not by its linear damping alone."""

import numpy as np
import pytest

from bench.missions.mission import draw_one
from identify.diagnose.candidates import Cause
from identify.diagnose.findings import braking_of, feedforward_gain_by
from identify.diagnose.gap import Missing
from identify.diagnose.nominal import nominal_of
from identify.diagnose.simulation import EACH
from identify.effects.hydrodynamics import QUADRATIC_DRAG

X_UU = 40.0


@pytest.fixture(scope="module")
def nominal():
    mission = draw_one(100_302, seconds=120.0)
    return nominal_of(mission.dive, mission.file, mission.configuration)


def test_a_quadratic_drag_brakes_by_twice_itself_times_the_speed(nominal):
    course = nominal.course
    braking = braking_of([Cause(QUADRATIC_DRAG, np.array([X_UU, 0, 0, 0, 0, 0]))], nominal)
    fast = np.abs(course.nu[::EACH, 0]) > 0.05
    expected = course.damping[0] + 2 * X_UU * np.abs(course.nu[::EACH, 0])
    np.testing.assert_allclose(braking[fast, 0], expected[fast], rtol=1e-6)
    np.testing.assert_allclose(braking[:, 1], course.damping[1])


def test_a_force_that_lasts_makes_an_error_of_what_it_is_over_what_brakes(nominal):
    count = len(nominal.course.time_s[::EACH])
    wrench = np.zeros((count, 6))
    wrench[:, 0] = 50.0
    missing = Missing(nominal.course.time_s[::EACH], wrench, np.zeros((count, 6)), wrench)
    braking = np.full((count, 6), 500.0)
    gain = feedforward_gain_by(np.zeros((count, 6)), missing, nominal, braking)
    assert gain.before_m_s == pytest.approx(np.hypot(50.0 / 500.0, gain.after_m_s), rel=0.02)
    assert gain.after_m_s < 0.02
