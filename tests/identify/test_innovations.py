"""The innovations of the compiled filter, and their score, against plain dense formulas."""

from dataclasses import replace

import numpy as np
import pytest
from fitted import gaussian
from scipy.linalg import expm

from bench.missions.mission import draw_one
from identify.estimators.axes import build_axes
from identify.estimators.information import STEP, gradient_and_information
from identify.estimators.innovations import (
    INCREMENT,
    POSITION,
    VELOCITY,
    innovations,
    smoothed_velocity,
    transitions,
)
from identify.estimators.likelihood_axis import MASS, likelihood_of, rigid_mass
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.scoring import score, weigh

STEPS_S = np.array([0.01, 0.04, 0.05, 0.1])
MODEL = {
    "mass": 5.2,
    "damping": 18.0,
    "stiffness": 35.0,
    "sigma": 0.06,
    "time_constant": 1.5,
    "white_force": 0.02,
    "slow_error": 0.015,
    "slow_error_s": 1.2,
    "smoothing_s": 0.12,
}
INITIAL = np.array([0.01, 0.02, 0.01, 0.01])


def braked(dampings, share=1.0):
    own = {"damping": np.array(dampings), "sigma": share * MODEL["sigma"]}
    return transitions(STEPS_S, *(MODEL | own).values())


def table_of(share=1.0):
    """The transitions, with a disturbance `share` as large."""
    return braked([MODEL["damping"]], share)


def test_each_step_has_a_row_of_its_own_for_each_damping():
    dampings = [18.0, 25.0, 60.0]
    table = braked(dampings)
    for k, damping in enumerate(dampings):
        np.testing.assert_array_equal(table[k :: len(dampings)], braked([damping]))


class Events:
    """Readings drawn at random: it matters not what a filter is fed to compare two of them."""

    def __init__(self, states, n=300, missing=0.1, seed=1):
        rng = np.random.default_rng(seed)
        self.step = rng.integers(-1, len(STEPS_S), n)
        self.force = rng.normal(0, 5, (n, 2))
        self.state = rng.choice(states, n)
        self.reading = np.where(rng.random(n) < missing, np.nan, rng.normal(0, 0.1, n))
        self.variance = np.where(self.state == VELOCITY, 1e-4, 1e-5)
        self.table = table_of()

    def run(
        self, force=None, reading=None, gate_sigma=np.inf, table=None, variance=None, sigma=MODEL["sigma"]
    ):
        return innovations(
            self.table if table is None else table,
            self.step,
            self.force if force is None else force,
            self.reading if reading is None else reading,
            self.state,
            self.variance if variance is None else variance,
            sigma,
            MODEL["slow_error"],
            INITIAL[None],
            gate_sigma,
        )


def moved(x, p, h, force):
    """Mean and covariance after half a step and the other, by Van Loan's exponential."""
    a = np.array(
        [
            [-MODEL["damping"] / MODEL["mass"], -MODEL["stiffness"] / MODEL["mass"], 1 / MODEL["mass"], 0],
            [1, 0, 0, 0],
            [0, 0, -1 / MODEL["time_constant"], 0],
            [0, 0, 0, -1 / MODEL["slow_error_s"]],
        ]
    )
    # The place is that of what the velocity is the filtered one of.
    a[1] += MODEL["smoothing_s"] * a[0]
    b = np.array([1.0, MODEL["smoothing_s"], 0.0, 0.0]) / MODEL["mass"]
    q = MODEL["white_force"] ** 2 * np.outer(b, b)
    q[2, 2] = 2 * MODEL["sigma"] ** 2 / MODEL["time_constant"]
    q[3, 3] = 2 * MODEL["slow_error"] ** 2 / MODEL["slow_error_s"]
    whole = np.eye(4)
    for half in force:
        big = expm(np.block([[-a, q], [np.zeros((4, 4)), a.T]]) * h / 2)
        phi = big[4:, 4:].T
        driven = expm(np.block([[a, b[:, None]], [np.zeros((1, 5))]]) * h / 2)[:4, 4]
        x, p, whole = phi @ x + driven * half, phi @ p @ phi.T + phi @ big[:4, 4:], phi @ whole
    return x, p, whole


def dense(events):
    """Innovations, variances, and the Rauch-Tung-Striebel smoother's velocities, one event after another."""
    x = np.array([INITIAL[0], INITIAL[1], 0.0, 0.0])
    p = np.diag([INITIAL[2], INITIAL[3], MODEL["sigma"] ** 2, MODEL["slow_error"] ** 2])
    errors, spreads, kept = [], [], []
    reset = np.eye(4)
    for i, step in enumerate(events.step):
        phi = np.eye(4)
        if step >= 0:
            x, p, phi = moved(x, p, STEPS_S[step], events.force[i])
        before = x, p, phi @ reset
        row = np.eye(4)[min(events.state[i], 1)]
        row[3] = float(events.state[i] == VELOCITY)
        s, e = row @ p @ row + events.variance[i], events.reading[i] - row @ x
        if np.isfinite(e):
            gain = p @ row / s
            x, p = x + gain * e, p - np.outer(gain, row @ p)
        kept.append((*before, x, p))
        reset = np.diag([1.0, float(events.state[i] != INCREMENT), 1.0, 1.0])
        x, p = reset @ x, reset @ p @ reset
        errors.append(e)
        spreads.append(s if np.isfinite(e) else np.nan)
    smooth = [kept[-1][3]]
    for (*_, x, p), (predicted, spread, phi, *_) in zip(kept[-2::-1], kept[:0:-1], strict=True):
        smooth.append(x + p @ phi.T @ np.linalg.pinv(spread, rcond=1e-12) @ (smooth[-1] - predicted))
    return np.array(errors), np.array(spreads), np.array(smooth)[::-1, 0]


@pytest.mark.parametrize("states", [(VELOCITY, POSITION), (VELOCITY, INCREMENT)])
def test_the_compiled_filter_equals_a_dense_one(states):
    events = Events(states)
    e, s, _ = events.run()
    expected_e, expected_s, _ = dense(events)
    np.testing.assert_allclose(s, expected_s, rtol=2e-6)
    np.testing.assert_allclose(e, expected_e, atol=2e-6)


@pytest.mark.parametrize("states", [(VELOCITY, POSITION), (VELOCITY, INCREMENT)])
def test_the_smoothed_velocity_is_that_of_a_dense_smoother(states):
    events = Events(states)
    found = smoothed_velocity(
        events.table,
        events.step,
        events.force,
        events.reading,
        events.state,
        events.variance,
        MODEL["sigma"],
        MODEL["slow_error"],
        INITIAL[None],
    )
    np.testing.assert_allclose(found, dense(events)[2], atol=5e-6)


@pytest.mark.parametrize("states", [(VELOCITY, POSITION), (VELOCITY, INCREMENT)])
def test_gradient_and_information_are_those_of_what_forces_noise_and_disturbance_add_to_the_innovations(
    states,
):
    events = Events(states)
    added = np.random.default_rng(2).normal(0, 1, (len(events.step), 2))
    noise, further = np.sqrt(events.variance), np.array([1.0, 1.0, 1.0 + STEP])
    gradient, information = gradient_and_information(
        np.array([table_of(scale) for scale in (1.0, 1.0 + STEP, 1.0)]),
        events.step,
        events.force,
        added,
        events.reading,
        events.state,
        further[:, None] ** 2,
        np.zeros(len(events.step), np.int64),
        noise,
        MODEL["sigma"] * np.array([1.0, 1.0 + STEP, 1.0]),
        np.full(3, MODEL["slow_error"]),
        INITIAL,
    )
    e, s, _ = events.run()
    read = np.isfinite(e)

    def under(**changed):
        moved_e, moved_s, _ = events.run(**changed)
        return (moved_e - e)[read], (moved_s - s)[read]

    apart = [
        under(table=table_of(1.0 + STEP), sigma=MODEL["sigma"] * (1.0 + STEP)),
        under(variance=events.variance * (1.0 + STEP) ** 2),
    ]
    pushes = [under(force=events.force + column[:, None]) for column in added.T]
    de = np.array([*(one / STEP for one, _ in apart), *(one for one, _ in pushes)])
    ds = np.array([*(one / STEP for _, one in apart), *(one for _, one in pushes)])
    expected, curvature = weigh(e[read], s[read], de, ds)
    size = np.sqrt(np.diag(curvature))
    np.testing.assert_allclose(gradient / size, expected / size, atol=1e-7)
    np.testing.assert_allclose(
        information / np.outer(size, size), curvature / np.outer(size, size), atol=1e-7
    )


def test_a_reading_beyond_the_gate_comes_back_at_the_gate_and_changes_nothing_after_it():
    events = Events((VELOCITY,), n=3, missing=0.0)
    wild, missing = np.array([0.001, 9.0, 0.001]), np.array([0.001, np.nan, 0.001])
    e, s, gain = events.run(reading=wild, gate_sigma=6.0)
    e_missing, _, _ = events.run(reading=missing, gate_sigma=6.0)
    assert e[1] == 6.0 * np.sqrt(s[1])
    assert not gain[1].any()
    assert np.isnan(e_missing[1])
    assert e[2] == e_missing[2]


HEAVE = 2


def problems():
    drawn = draw_one(100007, seconds=40.0, kind="together")
    shape = drawn.drawn.configuration
    masses = np.array([1.4 * rigid_mass(shape, dof) for dof in range(6)])
    axes = build_axes(drawn.dive, drawn.file, drawn.configuration).axes
    return tuple(likelihood_of(axis, shape, masses, ()) for axis in axes)


def assert_score_is_the_slope(joint):
    """Masses move the Coriolis forces of the other axes: the differences over all innovations see that as well."""
    gradient, information = joint.score(joint.prior_mean)
    slope, curvature = score(joint, joint.prior_mean)
    size = np.sqrt(np.diag(curvature))
    np.testing.assert_allclose(gradient / size, slope / size, atol=2e-4)
    np.testing.assert_allclose(
        information / np.outer(size, size), curvature / np.outer(size, size), atol=2e-5
    )


def test_the_likelihood_alone_is_that_of_all_innovations_and_of_a_mass_told_by_other_axes():
    axes = problems()
    reading = axes[0].reading.copy()
    reading[::7] = np.nan
    joint = JointLikelihood((replace(axes[0], reading=reading, word=(1.1, 30.0)), *axes[1:]))
    expected = gaussian(*joint.innovations(joint.prior_mean))
    assert joint.log_likelihood(joint.prior_mean) == pytest.approx(expected, rel=1e-10)


def test_a_state_that_has_run_away_has_no_likelihood():
    one, *_ = problems()
    away = replace(one, axis=replace(one.axis, initial=np.array([[np.inf, 0.0, 1.0, 1.0]])))
    assert away.log_likelihood(away.prior_mean) == -np.inf


def test_the_score_of_all_axes_is_the_slope_of_their_likelihood():
    assert_score_is_the_slope(JointLikelihood(problems()))


def test_the_score_with_a_mass_apart_is_the_slope_of_the_likelihood():
    axes = problems()
    heave = [problem.axis.dof for problem in axes].index(HEAVE)
    prior = np.array([[axes[heave].prior_mean[MASS] + 0.1, axes[heave].prior_precision[MASS]]])
    joint = JointLikelihood(axes, (HEAVE,), prior)
    assert_score_is_the_slope(joint)
    _, information = joint.score(joint.prior_mean)
    assert information[joint.places[heave].start + MASS, -1] == 0.0
