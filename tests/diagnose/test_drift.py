"""A model flown beside a recording: exact where its equations are linear."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from bridge.vehicle.dynamics import coriolis
from identify.diagnose.gap import drift
from identify.diagnose.gap.drift import drawn, drifts, floors_of, ran_away
from identify.diagnose.gap.simulation import Simulation, between, off_by, simulation_of
from identify.estimators.filter.state import VELOCITY
from identify.estimators.filter.transitions import transitions
from identify.estimators.likelihood.axis import DISTURBANCE, TIME_CONSTANT

STEP_S = 0.04


def still(seconds=10.0, **changes):
    n = round(seconds / STEP_S)
    plain = Simulation(
        STEP_S * np.arange(n),
        (0, 1, 2, 3, 4, 5),
        np.array([100.0, 100.0, 100.0, 10.0, 10.0, 10.0]),
        np.array([50.0, 60.0, 70.0, 5.0, 5.0, 5.0]),
        np.zeros(6),
        np.zeros((n, 6)),
        np.zeros((n, 6)),
        np.zeros((n, 6)),
        np.zeros((n, 6, 6)),
    )
    return replace(plain, **changes)


def test_a_steady_push_is_steady_where_two_sensors_are_read_at_one_instant():
    end_s = np.repeat(np.arange(1.0, 20.0), 2)
    step_s = np.diff(end_s, prepend=0.0)
    force = np.where(step_s > 0, 3.0, 0.0)
    np.testing.assert_array_equal(between(np.arange(1.0, 19.0, 0.1), end_s, step_s, force), np.full(180, 3.0))


@pytest.mark.parametrize(
    ("step_s", "count", "starts"), [(0.25, 20, [0, 4, 8, 12]), (2.0, 5, [0, 1, 2, 3, 4]), (0.25, 3, [])]
)
def test_a_flight_starts_each_second_that_another_follows(step_s, count, starts):
    model = SimpleNamespace(time_s=step_s * np.arange(count), step_s=step_s)
    assert drift._starts(model).tolist() == starts


def test_a_model_that_runs_away_has_a_drift_that_numbers_hold_and_is_told_so():
    slope = np.zeros((750, 6, 6))
    slope[:, 0, 0] = 3000.0
    lacking = np.zeros((750, 6))
    lacking[:, 0] = 1.0
    plain, wild = (
        drifts(still(30.0, lacking=lacking, slope=by), np.full((3, 6), 0.01)) for by in (0.0 * slope, slope)
    )
    assert all(horizon.ran_away == 0.0 and np.isfinite(horizon.total) for horizon in plain)
    assert wild[2].ran_away == 1.0
    assert wild[2].by_axis[0] == pytest.approx(1000.0)
    assert ran_away(plain, plain) == ()
    assert ran_away(plain, wild) == (
        "Flown for 1 s, the model with the causes in runs away from the recording in 100.0 % of the flights, which "
        "end there: how large its drift is says little.",
    )


@pytest.mark.parametrize(("seconds", "dives"), [(240.0, 10), (1200.0, 4)])
def test_a_floor_is_the_rms_of_forty_minutes_of_drawn_dives_and_of_four_dives_at_least(
    monkeypatch, seconds, dives
):
    """Forces of 1 N and 7 N by turns, 5 N rms, against a linear drag."""
    model, made = still(seconds), []

    def force_in_turn(*_):
        made.append(7.0 if len(made) % 2 else 1.0)
        force = np.zeros_like(model.nu)
        force[:, 0] = made[-1]
        return force, np.zeros_like(model.nu)

    monkeypatch.setattr(drift, "drawn", force_in_turn)
    floors = floors_of(None, model, np.random.default_rng(0))
    assert len(made) == dives
    horizon_s = np.array([1.0, 5.0, 20.0])
    assert floors[:, 0] == pytest.approx(5.0 / 50.0 * (1 - np.exp(-50.0 / 100.0 * horizon_s)), rel=1e-3)


def test_the_disturbance_that_is_drawn_has_the_fitted_strength_and_memory(nominal):
    force = np.concatenate([drawn(nominal, np.random.default_rng(seed))[0] for seed in range(8)])
    for problem, position in zip(nominal.joint.problems, nominal.joint.slices, strict=True):
        theta, dof = nominal.theta[position], problem.axis.dof
        sigma, memory_s = np.exp(theta[DISTURBANCE]), np.exp(theta[TIME_CONSTANT])
        assert np.std(force[:, dof]) == pytest.approx(sigma, rel=0.25)
        together = np.mean(force[1:, dof] * force[:-1, dof]) / np.mean(force[:, dof] ** 2)
        assert together == pytest.approx(np.exp(-STEP_S / memory_s), abs=0.05)


def test_the_noise_of_a_drawn_step_has_the_covariance_that_the_filters_take_it_to_have():
    """A unit of each of its four random numbers in turn: the columns of a root of that covariance."""
    sea, white = np.array([3.0]), np.array([0.5])
    table = transitions(np.array([0.05]), 100.0, np.array([50.0]), 20.0, sea, 1.6, 0.3, white, 0.0, 1.0, 0.0)
    columns = []
    for k in range(4):
        normal = np.zeros((2, 5))
        normal[1, k] = 1.0
        true, position, pushed, _ = drift._coloured_motion(
            table,
            np.array([-1, 0]),
            np.full(2, np.nan),
            np.full(2, VELOCITY),
            np.ones(2),
            3.0,
            4.3,
            False,
            normal,
        )
        columns.append((true[1], position[1], pushed[1]))
    root = np.array(columns).T
    nu, nu_x, nu_d, x, x_d, off = table[0, 11:17]
    expected = np.array([[nu, nu_x, nu_d], [nu_x, x, x_d], [nu_d, x_d, off]])
    np.testing.assert_allclose(root @ root.T, expected, rtol=1e-6, atol=1e-12)


def test_a_model_without_a_gap_drifts_by_its_floor_and_one_with_a_force_too_much_by_more(nominal):
    model = simulation_of(nominal, nominal.theta, nominal.motion.nu)
    floors = floors_of(nominal, model, np.random.default_rng(0))
    plain = drifts(model, floors)
    assert [horizon.horizon_s for horizon in plain] == [1.0, 5.0, 20.0]
    for calm in plain:
        assert calm.total == pytest.approx(1.0, abs=0.25)
    wrench = np.zeros_like(model.nu)
    wrench[:, 0] = 4.0 * np.sqrt(np.mean(model.nu[:, 0] ** 2)) * model.damping[0]
    pushed = drifts(model.less(-wrench), floors)
    for calm, other in zip(plain, pushed, strict=True):
        assert other.by_axis[0] > 2 * calm.by_axis[0]


MASS = np.array([20.0, 30.0, 40.0, 0.5, 0.6, 0.7])
DAMPING = np.array([10.0, 15.0, 20.0, 0.3, 0.4, 0.5])
STIFFNESS = np.array([0.0, 0.0, 0.0, 2.0, 2.0, 0.0])
FLIGHT_STEP_S, COUNT = 0.04, 60


def along(rng):
    lacking, nu = rng.normal(size=(COUNT, 6)), 0.3 * rng.normal(size=(COUNT, 6))
    return lacking, nu, 0.1 * rng.normal(size=(COUNT, 6, 6))


def flown(starts, steps, lacking, nu, slope, fitted=range(6), errors=0.0):
    return off_by(
        np.array(starts), np.array(steps), lacking, nu, slope, MASS, DAMPING, STIFFNESS, np.array(fitted),
        errors + np.zeros((COUNT, 6)), FLIGHT_STEP_S, np.full(COUNT, COUNT),
    )  # fmt: skip


def flown_in_plain_words(start, steps, lacking, nu, slope, free, error):
    def rate(i, off, angle):
        change = np.subtract(coriolis(MASS, nu[i] + off), coriolis(MASS, nu[i]))
        return free * (-lacking[i] - change - DAMPING * off + slope[i] @ off - STIFFNESS * angle) / MASS

    off, angle = error.copy(), np.zeros(6)
    for i in range(start, start + steps):
        first, guess = rate(i, off, angle), off + FLIGHT_STEP_S * rate(i, off, angle)
        second = rate(i + 1, guess, angle + FLIGHT_STEP_S * off)
        off, angle = off + 0.5 * FLIGHT_STEP_S * (first + second), angle + 0.5 * FLIGHT_STEP_S * (off + guess)
    return off


def test_it_is_off_by_what_the_equation_of_motion_says_also_where_forces_change_with_velocity():
    lacking, nu, slope = along(np.random.default_rng(100_001))
    for bent in (0.0 * slope, slope):
        off = flown([3, 20, COUNT - 10], [5, 30], lacking, nu, bent)
        # The recording ends before the last window does.
        assert np.isfinite(off[2, 0]).all()
        assert np.isnan(off[2, 1]).all()
        for w, start in enumerate((3, 20)):
            for h, steps in enumerate((5, 30)):
                expected = flown_in_plain_words(start, steps, lacking, nu, bent, np.ones(6), np.zeros(6))
                np.testing.assert_allclose(off[w, h], expected, rtol=1e-9)


def test_an_axis_that_is_not_fitted_follows_what_was_recorded_and_errors_count_at_both_ends():
    rng = np.random.default_rng(100_002)
    lacking, nu, slope = along(rng)
    errors, fitted = 0.05 * rng.normal(size=(COUNT, 6)), np.array([0, 2, 5])
    free = np.isin(np.arange(6), fitted).astype(np.float64)
    off = flown([4], [25], lacking, nu, slope, fitted, errors)[0, 0]
    in_plain_words = flown_in_plain_words(4, 25, lacking, nu, slope, free, free * errors[4])
    np.testing.assert_allclose(off[fitted], (in_plain_words - errors[29])[fitted], rtol=1e-9)
    assert np.isnan(off[[1, 3, 4]]).all()


def test_a_flight_that_runs_away_ends_there_and_others_go_on():
    lacking, nu, slope = along(np.random.default_rng(100_004))
    slope[:30, 0, 0] = 3000.0
    off = flown([0, 30], [2, 25], lacking, nu, slope)
    assert abs(off[0, 0, 0]) < 10.0
    assert abs(off[0, 1, 0]) == 10.0
    assert (np.abs(off[0, 1]) <= [10.0, 10.0, 10.0, 20.0, 20.0, 20.0]).all()
    expected = flown_in_plain_words(30, 25, lacking, nu, slope, np.ones(6), np.zeros(6))
    np.testing.assert_allclose(off[1, 1], expected, rtol=1e-9)
