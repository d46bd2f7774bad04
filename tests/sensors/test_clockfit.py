import numpy as np
import pytest

from bridge.sensors.clockfit import ClockFit


def fit_times(clock: ClockFit, counts: np.ndarray, arrivals: np.ndarray) -> np.ndarray:
    return np.array([clock.time_of(int(c), float(a)) for c, a in zip(counts, arrivals, strict=True)])


def test_exact_arrivals_of_a_nominal_clock_come_back_unchanged():
    counts = np.arange(0, 10_000, 50)
    times = fit_times(ClockFit(1e-3, tolerance=0.03), counts, 5.0 + counts * 1e-3)
    np.testing.assert_allclose(times, 5.0 + counts * 1e-3, atol=1e-12)


def test_a_slow_clock_is_learnt_within_a_second_and_never_shifts_a_time_by_half_a_millisecond():
    counts = np.arange(0, 20_000, 50)
    truth = 5.0 + counts / 989.0
    clock = ClockFit(1e-3, tolerance=0.03)
    times = fit_times(clock, counts, truth)
    assert np.max(np.abs(times - truth)) < 0.5e-3
    np.testing.assert_allclose(times[truth > 6.0], truth[truth > 6.0], atol=1e-5)
    assert clock.period_s == pytest.approx(1 / 989.0, rel=1e-5)


def test_jitter_of_the_arrivals_is_taken_out():
    rng = np.random.default_rng(1)
    counts = np.arange(0, 120_000, 50)
    truth = counts / 989.0
    late = rng.exponential(1e-3, counts.size)
    times = fit_times(ClockFit(1e-3, tolerance=0.03), counts, truth + late)
    error = (times - truth)[truth > 10.0] - late.mean()
    assert np.std(error) < 0.15e-3
    assert np.all(np.diff(times) > 0)


@pytest.mark.parametrize("jump_s", [-3.0, 0.2, 40.0])
def test_a_gap_starts_anew_at_once_and_keeps_the_period(jump_s):
    counts = np.arange(0, 20_000, 50)
    arrivals = counts / 989.0 + np.where(counts > 10_000, jump_s, 0.0)
    clock = ClockFit(1e-3, tolerance=0.03)
    times = fit_times(clock, counts, arrivals)
    assert clock.restarts == 1
    np.testing.assert_allclose(times[counts > 5_000], arrivals[counts > 5_000], atol=1e-5)


def test_a_counter_that_starts_over_is_followed():
    clock = ClockFit(1e-4, tolerance=1e-3)
    clock.time_of(1_000_000, 1.0)
    assert clock.time_of(0, 1.01) == 1.01
    assert clock.time_of(100, 1.02) == pytest.approx(1.02)


def test_absurd_counts_and_silence_of_days_do_no_harm():
    clock = ClockFit(1e-3, tolerance=0.03)
    clock.time_of(0, 0.0)
    assert clock.time_of(10**12, 1.0) == 1.0
    for _ in range(3):
        clock.time_of(10**12, 1.0)
    slow = ClockFit(1.0, tolerance=0.0)
    slow.time_of(0, 0.0)
    assert slow.time_of(10**6, 1e6) == pytest.approx(1e6)
