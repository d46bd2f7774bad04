"""The slow offset of an ArduPilot's gyro is told by its attitude, and taken off."""

import numpy as np
import pytest

from identify.dive import Signal
from identify.ingest.gyro_offset import WINDOW_S, without_offset
from identify.ingest.rotation import quaternions_from_euler

TIME_S = np.arange(0.0, 120.0, 0.04)
ANGLE_S = np.arange(0.0, 120.0, 0.1)


def heading(time_s):
    return 0.4 * np.sin(0.5 * time_s) + 0.01 * np.sin(6.0 * time_s)


def turning(time_s):
    rate = 0.2 * np.cos(0.5 * time_s) + 0.06 * np.cos(6.0 * time_s)
    return np.column_stack([np.zeros((len(time_s), 2)), rate])


def attitude(time_s, heading_rad):
    still = np.zeros(len(time_s))
    return Signal(time_s, quaternions_from_euler(still, still, heading_rad))


ATTITUDE = attitude(ANGLE_S, heading(ANGLE_S))


def drifting(time_s):
    """4e-3 rad/s within 120 s, from an offset at the start on."""
    return np.array([1e-3, 0.0, -2e-3]) + 4e-3 / 120.0 * time_s[:, None]


def test_an_offset_that_drifts_is_taken_off_and_the_turning_stays():
    rates = Signal(TIME_S, turning(TIME_S) + drifting(TIME_S))
    left = without_offset(rates, ATTITUDE).value - turning(TIME_S)
    inner = np.abs(TIME_S - 60.0) < 60.0 - WINDOW_S / 2
    assert np.abs(left[inner]).max() < 1e-4
    assert np.abs(left).max() < 0.5 * WINDOW_S * 4e-3 / 120.0
    assert np.abs(drifting(TIME_S)).max() > 4e-3


def test_rates_without_an_offset_stay_as_they_are():
    rates = Signal(TIME_S, turning(TIME_S))
    np.testing.assert_allclose(without_offset(rates, ATTITUDE).value, rates.value, atol=1e-4)


def test_a_heading_that_is_set_anew_a_gap_and_rates_that_are_no_numbers_are_no_offset():
    anew = attitude(ANGLE_S, heading(ANGLE_S) + 0.1 * (ANGLE_S > 40.0))
    kept = np.abs(TIME_S - 70.0) > 3.0
    value = turning(TIME_S) + 1e-3
    value[1000:1010] = np.nan
    value[1000] = np.inf
    out = without_offset(Signal(TIME_S[kept], value[kept]), anew).value
    known = np.isfinite(out).all(axis=1)
    assert np.count_nonzero(~known) == 10
    np.testing.assert_allclose(out[known], turning(TIME_S[kept])[known], atol=2e-4)


@pytest.mark.parametrize(
    ("rates_s", "angles_s"),
    [(TIME_S[::2], ANGLE_S), (TIME_S, ANGLE_S[:150]), (TIME_S, ANGLE_S[::10]), (TIME_S, ANGLE_S[:1])],
)
def test_rates_that_come_too_seldom_or_attitudes_that_are_too_few_tell_no_offset(rates_s, angles_s):
    rates = Signal(rates_s, turning(rates_s) + 1e-3)
    assert without_offset(rates, attitude(angles_s, heading(angles_s))) is rates
    assert without_offset(rates, None) is rates
