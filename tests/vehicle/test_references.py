import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.vehicle.references import DoubleS

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
