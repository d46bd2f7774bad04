"""Thrusters whose lag is that of their shafts' speed are no cause, and a dead zone stays one."""

from dataclasses import replace

import numpy as np
import pytest
from fakes.planted import quiet
from soak import rows_rest_in_soak

from identify.diagnose.causes.shafts import of_likelier_lag
from identify.diagnose.filters.nominal import refitted
from identify.effects.actuators import COMMAND_DELAY, DEAD_ZONE, THRUST_CURVE, thruster_lag
from identify.effects.course import lagged, shaft_lagged
from identify.effects.effect import before_the_shaft

LAG_S, WIDTH_N = 0.5, 1.5
LIBRARY = (DEAD_ZONE, THRUST_CURVE, COMMAND_DELAY, *thruster_lag(LAG_S))


def test_the_thrust_of_a_shaft_that_lags_rises_by_the_square_of_its_speed():
    asked = np.array([[0.0], *[[16.0]] * 4])
    share = 1.0 - np.exp(-np.arange(4) / 5.0)
    assert shaft_lagged(asked, 0.02, 0.1)[1:, 0] == pytest.approx(16.0 * share**2)
    assert shaft_lagged(-asked, 0.02, 0.1) == pytest.approx(-shaft_lagged(asked, 0.02, 0.1))


@pytest.mark.parametrize(
    ("follow", "width_n", "by_shaft", "names"),
    rows_rest_in_soak(
        [
            (lagged, WIDTH_N, False, ["dead_zone"]),
            (shaft_lagged, WIDTH_N, True, ["dead_zone"]),
            (lagged, 0.0, False, []),
            (shaft_lagged, 0.0, True, []),
        ],
        keep=2,
    ),
)
def test_the_lag_is_taken_for_that_of_the_shafts_where_the_motion_says_so(
    nominal, follow, width_n, by_shaft, names
):
    """The dive's thrust is `follow` of what is asked beyond a dead zone: its model is told the opposite of that."""
    course = replace(nominal.course, lag_s=LAG_S)
    asked_n = np.where(np.abs(course.asked_n) < width_n, 0.0, course.asked_n)
    more_n = follow(asked_n, course.step_s, LAG_S) - course.thrust_n
    opposed = refitted(replace(nominal, course=course), [before_the_shaft(course, -more_n)])
    search = of_likelier_lag(replace(opposed, acts=(), course=course), LIBRARY, 0.0, quiet)
    assert search.nominal.course.by_shaft is by_shaft
    assert [cause.effect.name for cause in search.explanation.causes] == names
    for cause in search.explanation.causes:
        assert cause.values[0] == pytest.approx(WIDTH_N, rel=0.02)


@pytest.mark.parametrize(("uncertain_share", "by_shaft"), [(0.5, True), (2.0, False)])
def test_the_lag_of_the_shafts_must_do_better_by_the_share_of_its_gain_that_the_commands_leave_uncertain(
    nominal, uncertain_share, by_shaft
):
    course = replace(nominal.course, lag_s=LAG_S)
    more_n = shaft_lagged(course.asked_n, course.step_s, LAG_S) - course.thrust_n
    opposed = refitted(replace(nominal, course=course), [before_the_shaft(course, -more_n)])
    search = of_likelier_lag(replace(opposed, acts=(), course=course), LIBRARY, uncertain_share, quiet)
    assert search.nominal.course.by_shaft is by_shaft
