import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.vehicle.references import DoubleS, Reference, Trail

PROFILES = st.builds(DoubleS, st.floats(-1, 1), st.floats(-1, 1), st.floats(0.5, 20), st.floats(0.05, 0.5))


@given(PROFILES)
@settings(max_examples=40)
def test_a_double_s_starts_and_ends_at_its_values_with_no_slope(profile: DoubleS) -> None:
    assert profile.at(0.0) == (profile.start, 0.0, 0.0)
    value, slope, integral = profile.at(profile.duration_s)
    assert (value, slope) == (profile.end, 0.0)
    assert integral == pytest.approx(0.5 * (profile.start + profile.end) * profile.duration_s)


@given(PROFILES)
@settings(max_examples=40)
def test_slope_and_integral_of_a_double_s_belong_to_its_value(profile: DoubleS) -> None:
    time_s = np.linspace(0, 1.3 * profile.duration_s, 4001)
    value, slope, integral = np.array([profile.at(t) for t in time_s]).T
    step = time_s[1]
    summed = np.concatenate([[0.0], np.cumsum((slope[1:] + slope[:-1]) / 2 * step)])
    np.testing.assert_allclose(profile.start + summed, value, atol=1e-3)
    summed = np.concatenate([[0.0], np.cumsum((value[1:] + value[:-1]) / 2 * step)])
    np.testing.assert_allclose(summed, integral, atol=1e-4)


@given(PROFILES)
@settings(max_examples=40)
def test_a_double_s_keeps_its_limits_of_slope_and_jerk(profile: DoubleS) -> None:
    time_s = np.linspace(0, profile.duration_s, 2001)
    slope = np.array([profile.at(t)[1] for t in time_s])
    assert np.abs(slope).max() <= abs(profile.peak_rate) * (1 + 1e-9)
    assert np.abs(np.diff(slope) / time_s[1]).max() <= profile.peak_jerk * (1 + 1e-6) + 1e-9


def test_a_double_s_of_five_seconds_has_the_figures_worked_out_by_hand() -> None:
    profile = DoubleS(0.0, 0.4, 5.0)
    assert profile.at(2.5) == pytest.approx((0.2, 0.4 / 3.75, 0.4 * 5 * (4 / 3) * (1 / 8 - 1 / 16 + 1 / 96)))
    assert profile.peak_jerk == pytest.approx(0.4 / 3.75 / 1.25)


@pytest.mark.parametrize(("duration_s", "ramp"), [(0.0, 0.25), (-1.0, 0.25), (5.0, 0.0), (5.0, 0.6)])
def test_a_double_s_without_time_or_with_too_long_a_ramp_is_refused(duration_s: float, ramp: float) -> None:
    with pytest.raises(ValueError, match="double-S"):
        DoubleS(0.0, 1.0, duration_s, ramp)


def wanted(u: float, heading_rad: float = 0.0) -> Reference:
    return Reference((u, 0, 0, 0, 0, 0), (0.0,) * 6, heading_rad, 2 * u)


def trail(*kept: tuple[float, Reference]) -> Trail:
    of_late = Trail(1.0)
    for time_s, reference in kept:
        of_late.add(time_s, reference)
    return of_late


def test_a_trail_tells_what_was_wanted_between_two_ticks() -> None:
    then = trail((0.0, wanted(0.0)), (0.1, wanted(0.2)), (0.2, wanted(0.6))).at(0.125)
    assert (then.nu[0], then.depth_m) == pytest.approx((0.3, 0.6))


@pytest.mark.parametrize(("time_s", "u"), [(-5.0, 0.1), (0.2, 0.3), (9.0, 0.3), (math.nan, 0.3)])
def test_beyond_its_ends_a_trail_holds_and_it_takes_no_time_for_the_latest(time_s: float, u: float) -> None:
    assert trail((0.0, wanted(0.1)), (0.2, wanted(0.3))).at(time_s).nu[0] == u


def test_a_trail_keeps_no_more_than_its_span() -> None:
    long = trail(*((0.1 * i, wanted(float(i))) for i in range(50)))
    assert long.at(0.0).nu[0] == 39.0


def test_a_clock_that_begins_again_begins_a_new_trail() -> None:
    assert trail((7.0, wanted(0.7)), (1.0, wanted(0.1))).at(0.0).nu[0] == 0.1


def test_a_heading_unwrapped_anew_has_not_turned_in_between() -> None:
    of_late = trail((0.0, wanted(0.0, 3.1)), (0.1, wanted(0.0, 3.2 - math.tau)))
    assert of_late.at(0.05).heading_rad == pytest.approx(3.15)
