"""The compiled flight beside a recorded motion is the equation of motion of `bridge.vehicle.dynamics`, step by step."""

import numpy as np

from bridge.vehicle.dynamics import coriolis
from identify.diagnose.simulation import RUN_AWAY, off_by

MASS = np.array([20.0, 30.0, 40.0, 0.5, 0.6, 0.7])
DAMPING = np.array([10.0, 15.0, 20.0, 0.3, 0.4, 0.5])
STIFFNESS = np.array([0.0, 0.0, 0.0, 2.0, 2.0, 0.0])
STEP_S, COUNT = 0.04, 60


def along(rng):
    lacking, nu = rng.normal(size=(COUNT, 6)), 0.3 * rng.normal(size=(COUNT, 6))
    return lacking, nu, 0.1 * rng.normal(size=(COUNT, 6, 6))


def flown_in_plain_words(start, steps, lacking, nu, slope, free, error):
    def rate(i, d, a):
        change = np.subtract(coriolis(MASS, nu[i] + d), coriolis(MASS, nu[i]))
        return free * (-lacking[i] - change - DAMPING * d + slope[i] @ d - STIFFNESS * a) / MASS

    d, a = error.copy(), np.zeros(6)
    for i in range(start, start + steps):
        first, guess = rate(i, d, a), d + STEP_S * rate(i, d, a)
        second = rate(i + 1, guess, a + STEP_S * d)
        d, a = d + 0.5 * STEP_S * (first + second), a + 0.5 * STEP_S * (d + guess)
    return d


def test_it_is_off_by_what_the_equation_of_motion_says_also_where_forces_change_with_velocity():
    lacking, nu, slope = along(np.random.default_rng(100_001))
    for bent in (0.0 * slope, slope):
        off = off_by(
            np.array([3, 20]), np.array([5, 30]), lacking, nu, bent, MASS, DAMPING, STIFFNESS, np.arange(6),
            np.zeros((COUNT, 6)), STEP_S,
        )  # fmt: skip
        for w, start in enumerate((3, 20)):
            for h, steps in enumerate((5, 30)):
                expected = flown_in_plain_words(start, steps, lacking, nu, bent, np.ones(6), np.zeros(6))
                np.testing.assert_allclose(off[w, h], expected, rtol=1e-9)


def test_an_axis_that_is_not_fitted_follows_what_was_recorded_and_errors_count_at_both_ends():
    rng = np.random.default_rng(100_002)
    lacking, nu, slope = along(rng)
    errors, fitted = 0.05 * rng.normal(size=(COUNT, 6)), np.array([0, 2, 5])
    free = np.isin(np.arange(6), fitted).astype(np.float64)
    off = off_by(
        np.array([4]), np.array([25]), lacking, nu, slope, MASS, DAMPING, STIFFNESS, fitted, errors, STEP_S
    )[0, 0]
    d = flown_in_plain_words(4, 25, lacking, nu, slope, free, free * errors[4])
    np.testing.assert_allclose(off[fitted], (d - errors[29])[fitted], rtol=1e-9)
    assert np.isnan(off[[1, 3, 4]]).all()


def test_a_window_that_the_recording_ends_before_has_no_value():
    lacking, nu, slope = along(np.random.default_rng(100_003))
    off = off_by(
        np.array([COUNT - 10]), np.array([5, 30]), lacking, nu, slope, MASS, DAMPING, STIFFNESS, np.arange(6),
        np.zeros((COUNT, 6)), STEP_S,
    )  # fmt: skip
    assert np.isfinite(off[0, 0]).all()
    assert np.isnan(off[0, 1]).all()


def test_a_flight_that_runs_away_ends_there_and_others_go_on():
    lacking, nu, slope = along(np.random.default_rng(100_004))
    slope[:30, 0, 0] = 3000.0
    off = off_by(
        np.array([0, 30]), np.array([2, 25]), lacking, nu, slope, MASS, DAMPING, STIFFNESS, np.arange(6),
        np.zeros((COUNT, 6)), STEP_S,
    )  # fmt: skip
    assert abs(off[0, 0, 0]) < RUN_AWAY[0]
    assert abs(off[0, 1, 0]) == RUN_AWAY[0]
    assert (np.abs(off[0, 1]) <= RUN_AWAY).all()
    expected = flown_in_plain_words(30, 25, lacking, nu, slope, np.ones(6), np.zeros(6))
    np.testing.assert_allclose(off[1, 1], expected, rtol=1e-9)
