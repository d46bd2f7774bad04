"""The compiled filter against a plain dense Kalman filter written with scipy's matrix exponential."""

import numpy as np
import pytest
from scipy.linalg import expm

from identify.estimators.innovations import INCREMENT, POSITION, VELOCITY, innovations


def dense(step_s, force, reading, state, variance, mass, damping, stiffness, sigma, time_constant, initial):
    """Innovations and variances by Van Loan's exponential, one event after another."""
    a = np.array([[-damping / mass, -stiffness / mass, 1 / mass], [1, 0, 0], [0, 0, -1 / time_constant]])
    b = np.array([1 / mass, 0.0, 0.0])
    q = np.zeros((3, 3))
    q[2, 2] = 2 * sigma**2 / time_constant
    x, p = np.array([initial[0], initial[1], 0.0]), np.diag([initial[2], initial[3], sigma**2])
    errors, spreads = [], []
    for i, h in enumerate(step_s):
        for half in force[i] if h > 0 else ():
            big = expm(np.block([[-a, q], [np.zeros((3, 3)), a.T]]) * h / 2)
            phi = big[3:, 3:].T
            noise = phi @ big[:3, 3:]
            driven = expm(np.block([[a, b[:, None]], [np.zeros((1, 4))]]) * h / 2)[:3, 3]
            x, p = phi @ x + driven * half, phi @ p @ phi.T + noise
        row = np.eye(3)[min(state[i], 1)]
        s = row @ p @ row + variance[i]
        e = reading[i] - row @ x
        gain = p @ row / s
        x, p = x + gain * e, p - np.outer(gain, row @ p)
        if state[i] == INCREMENT:
            x[1], p[1], p[:, 1] = 0.0, 0.0, 0.0
        errors.append(e)
        spreads.append(s)
    return np.array(errors), np.array(spreads)


def events(rng, states, n=300):
    step_s = rng.choice([0.0, 0.01, 0.04, 0.05, 0.1], n)
    force = rng.normal(0, 5, (n, 2))
    state = rng.choice(states, n)
    reading = rng.normal(0, 0.1, n)
    variance = np.where(state == VELOCITY, 1e-4, 1e-5)
    return step_s, force, reading, state, variance


@pytest.mark.parametrize("states", [(VELOCITY, POSITION), (VELOCITY, INCREMENT)])
def test_the_compiled_filter_equals_a_dense_one(states):
    data = events(np.random.default_rng(1), states)
    model = (5.2, 18.0, 35.0, 0.06, 1.5)
    initial = np.array([0.01, 0.02, 0.01, 0.01])
    e, s = innovations(*data, *model, initial, np.inf)
    expected_e, expected_s = dense(*data, *model, initial)
    np.testing.assert_allclose(s, expected_s, rtol=2e-6)
    np.testing.assert_allclose(e, expected_e, atol=2e-6)


def test_a_long_gap_is_crossed_as_exactly_as_short_steps():
    one = np.array([0.0, 2.0]), np.array([[0.0, 0.0], [3.0, -1.0]])
    reading, state, variance = np.zeros(2), np.zeros(2, dtype=np.int64), np.full(2, 1e-4)
    model, initial = (20.0, 10.0, 0.0, 0.3, 1.5), np.array([0.1, 0.0, 0.01, 0.01])
    e, s = innovations(*one, reading, state, variance, *model, initial, np.inf)
    expected_e, expected_s = dense(*one, reading, state, variance, *model, initial)
    np.testing.assert_allclose(e, expected_e, rtol=1e-7)
    np.testing.assert_allclose(s, expected_s, rtol=1e-6)


def test_a_reading_beyond_the_gate_comes_back_at_the_gate_and_changes_nothing_after_it():
    step_s, force = np.full(3, 0.1), np.zeros((3, 2))
    state, variance = np.zeros(3, dtype=np.int64), np.full(3, 1e-4)
    model, initial = (20.0, 10.0, 0.0, 0.3, 1.5), np.array([0.0, 0.0, 1e-4, 1e-4])
    wild = np.array([0.001, 9.0, 0.001])
    e, s = innovations(step_s, force, wild, state, variance, *model, initial, 6.0)
    missing = np.array([0.001, np.nan, 0.001])
    e_missing, _ = innovations(step_s, force, missing, state, variance, *model, initial, 6.0)
    assert e[1] == 6.0 * np.sqrt(s[1])
    assert np.isnan(e_missing[1])
    assert e[2] == e_missing[2]
