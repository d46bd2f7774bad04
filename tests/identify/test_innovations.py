"""The innovations of the compiled filter, and their score, against plain dense formulas."""

from dataclasses import replace

import numpy as np
import pytest
from fitted import gaussian, weigh
from scipy.linalg import expm

from bench.missions.mission import draw_one
from identify.estimators.axes.build import build_axes
from identify.estimators.filter.information import STEP, gradient_and_information
from identify.estimators.filter.innovations import innovations, smoothed_velocity
from identify.estimators.filter.state import INCREMENT, POSITION, VELOCITY
from identify.estimators.filter.transitions import transitions
from identify.estimators.likelihood.axis import DISTURBANCE, FASTEST_S, MASS
from identify.estimators.likelihood.joint import JointLikelihood
from identify.estimators.likelihood.priors import likelihood_of
from identify.estimators.likelihood.scoring import slopes

STEPS_S = np.array([0.01, 0.04, 0.05, 0.1])
COLOURED = {
    "mass": 5.2,
    "damping": 18.0,
    "stiffness": 35.0,
    "sigma": 0.06,
    "time_constant": 1.5,
    "rise_s": 0.0,
    "white_force": 0.02,
    "slow_error": 0.015,
    "slow_error_s": 1.2,
    "smoothing_s": 0.12,
}
"""A disturbance of first order, and a velocity with a coloured error."""

SECOND = COLOURED | {"rise_s": 0.3, "slow_error": 0.0, "smoothing_s": 0.0}
"""A disturbance of second order, and a velocity without such an error."""

MODELS = pytest.mark.parametrize("model", [COLOURED, SECOND], ids=["coloured readings", "second order"])
INITIAL = np.array([0.01, 0.02, 0.01, 0.01])


def braked(model, dampings, share=1.0):
    white = np.full(len(STEPS_S), model["white_force"])
    sigma = np.full(len(STEPS_S), share * model["sigma"])
    changed = {"damping": np.array(dampings), "sigma": sigma, "white_force": white}
    return transitions(STEPS_S, *(model | changed).values())


def table_of(model, share=1.0):
    """The transitions, with a disturbance `share` as large."""
    return braked(model, [model["damping"]], share)


def fourth(model):
    """Standard deviation of the fourth state, and whether it is an error of the readings."""
    if model["rise_s"] > 0:
        return model["sigma"] / np.sqrt(model["rise_s"] * model["time_constant"]), False
    return model["slow_error"], True


def test_each_step_has_a_row_of_its_own_for_each_damping():
    dampings = [18.0, 25.0, 60.0]
    table = braked(COLOURED, dampings)
    for k, damping in enumerate(dampings):
        np.testing.assert_array_equal(table[k :: len(dampings)], braked(COLOURED, [damping]))


@pytest.mark.parametrize("rise_s", [FASTEST_S, 0.05, 0.375])
def test_a_disturbance_of_second_order_keeps_its_spread_and_has_the_time_scale_that_it_is_given(rise_s):
    """The transition of d and its slope over 0.05 s: the noise of a step makes up for what the step forgets, and the
    correlation with what came before integrates to the time constant."""
    model = SECOND | {"rise_s": rise_s}
    row = table_of(model)[2]
    moved = np.array([[row[6], row[21]], [row[22], row[17]]])
    noise = np.array([[row[16], row[25]], [row[25], row[18]]])
    spread = np.diag([model["sigma"], fourth(model)[0]]) ** 2
    size = np.sqrt(np.diag(spread))
    np.testing.assert_allclose(
        (moved @ spread @ moved.T + noise) / np.outer(size, size), np.eye(2), atol=0.02
    )
    lags = [np.linalg.matrix_power(moved, k)[0, 0] for k in range(1000)]
    assert STEPS_S[2] * (sum(lags) - 0.5) == pytest.approx(model["time_constant"], rel=2e-3)


class Events:
    """Readings drawn at random: it matters not what a filter is fed to compare two of them."""

    def __init__(self, states, n=300, missing=0.1, seed=1, model=COLOURED):
        self.model = model
        rng = np.random.default_rng(seed)
        self.step = rng.integers(-1, len(STEPS_S), n)
        self.force = rng.normal(0, 5, (n, 2))
        self.state = rng.choice(states, n)
        self.reading = np.where(rng.random(n) < missing, np.nan, rng.normal(0, 0.1, n))
        self.variance = np.where(self.state == VELOCITY, 1e-4, 1e-5)
        self.table = table_of(model)

    def run(self, force=None, reading=None, gate_sigma=np.inf, table=None, variance=None, share=1.0):
        slow, coloured = fourth(self.model)
        return innovations(
            self.table if table is None else table,
            self.step,
            self.force if force is None else force,
            self.reading if reading is None else reading,
            self.state,
            self.variance if variance is None else variance,
            share * self.model["sigma"],
            slow if coloured else share * slow,
            coloured,
            INITIAL[None],
            gate_sigma,
        )


def moved(model, x, p, h, force):
    """Mean and covariance after half a step and the other, by Van Loan's exponential."""
    a = np.zeros((4, 4))
    a[0, :3] = -model["damping"] / model["mass"], -model["stiffness"] / model["mass"], 1 / model["mass"]
    a[1, 0] = 1
    # The place is that of what the velocity is the filtered one of.
    a[1] += model["smoothing_s"] * a[0]
    b = np.array([1.0, model["smoothing_s"], 0.0, 0.0]) / model["mass"]
    q = model["white_force"] ** 2 * np.outer(b, b)
    rise_s, memory_s = model["rise_s"], model["time_constant"]
    if rise_s > 0:
        a[2, 3], a[3, 2], a[3, 3] = 1, -1 / (rise_s * memory_s), -1 / rise_s
        q[3, 3] = 2 * model["sigma"] ** 2 / (rise_s**2 * memory_s)
    else:
        a[2, 2], a[3, 3] = -1 / memory_s, -1 / model["slow_error_s"]
        q[2, 2] = 2 * model["sigma"] ** 2 / memory_s
        q[3, 3] = 2 * model["slow_error"] ** 2 / model["slow_error_s"]
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
    slow, coloured = fourth(events.model)
    p = np.diag([INITIAL[2], INITIAL[3], events.model["sigma"] ** 2, slow**2])
    errors, spreads, kept = [], [], []
    reset = np.eye(4)
    for i, step in enumerate(events.step):
        phi = np.eye(4)
        if step >= 0:
            x, p, phi = moved(events.model, x, p, STEPS_S[step], events.force[i])
        before = x, p, phi @ reset
        row = np.eye(4)[min(events.state[i], 1)]
        row[3] = float(coloured and events.state[i] == VELOCITY)
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


@MODELS
@pytest.mark.parametrize("states", [(VELOCITY, POSITION), (VELOCITY, INCREMENT)])
def test_the_compiled_filter_equals_a_dense_one(states, model):
    events = Events(states, model=model)
    e, s, _ = events.run()
    expected_e, expected_s, _ = dense(events)
    np.testing.assert_allclose(s, expected_s, rtol=2e-6)
    np.testing.assert_allclose(e, expected_e, atol=2e-6)


@MODELS
@pytest.mark.parametrize("states", [(VELOCITY, POSITION), (VELOCITY, INCREMENT)])
def test_the_smoothed_velocity_is_that_of_a_dense_smoother(states, model):
    events = Events(states, model=model)
    smoothed = smoothed_velocity(
        events.table,
        events.step,
        events.force,
        events.reading,
        events.state,
        events.variance,
        model["sigma"],
        *fourth(model),
        INITIAL[None],
    )
    np.testing.assert_allclose(smoothed, dense(events)[2], atol=5e-6)


@MODELS
@pytest.mark.parametrize("states", [(VELOCITY, POSITION), (VELOCITY, INCREMENT)])
def test_gradient_and_information_are_those_of_what_forces_noise_and_disturbance_add_to_the_innovations(
    states, model
):
    events = Events(states, model=model)
    slow, coloured = fourth(model)
    shares = np.array([1.0, 1.0 + STEP, 1.0])
    added = np.random.default_rng(2).normal(0, 1, (len(events.step), 2))
    noise, further = np.sqrt(events.variance), np.array([1.0, 1.0, 1.0 + STEP])
    # A factor on one of two shapes, and the logarithm of a mass of 2.5 kg.
    shapes, coriolis = np.column_stack([added[:, 1], added[:, 0]]), np.zeros((len(added), 6))
    coriolis[:, 4] = added[:, 1] / 2.5
    gradient, information = gradient_and_information(
        np.array([table_of(model, share) for share in shares]),
        events.step,
        events.force,
        shapes,
        np.array([1]),
        coriolis,
        np.array([4]),
        np.array([2.5]),
        events.reading,
        events.state,
        further[:, None] ** 2,
        np.zeros(len(events.step), np.int64),
        noise,
        model["sigma"] * shares,
        np.full(3, slow) if coloured else slow * shares,
        coloured,
        INITIAL,
    )
    e, s, _ = events.run()
    read = np.isfinite(e)

    def under(**changed):
        moved_e, moved_s, _ = events.run(**changed)
        return (moved_e - e)[read], (moved_s - s)[read]

    apart = [
        under(table=table_of(model, 1.0 + STEP), share=1.0 + STEP),
        under(variance=events.variance * (1.0 + STEP) ** 2),
    ]
    pushes = [under(force=events.force + column[:, None]) for column in added.T]
    de = np.array([*(change / STEP for change, _ in apart), *(change for change, _ in pushes)])
    ds = np.array([*(change / STEP for _, change in apart), *(change for _, change in pushes)])
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
    masses = np.array([1.4 * shape.rigid_body(dof)[0] for dof in range(6)])
    axes = build_axes(drawn.dive, drawn.file, drawn.configuration).axes
    return tuple(likelihood_of(axis, shape, masses, ()) for axis in axes)


def innovations_of_all(joint, theta):
    """Innovations and variances of all axes' readings, behind those of each its mass less the estimate in `word`."""
    errors, variances = [], []
    for problem, of_axis in zip(joint.at(theta), joint.slices, strict=True):
        error, variance = problem.filtered(theta[of_axis], np.inf)
        read, (mean, precision) = np.isfinite(problem.reading), problem.word
        errors += [error[read], [(np.exp(theta[of_axis][MASS]) - mean) * np.sqrt(precision)]]
        variances += [variance[read], [1.0]]
    return np.concatenate(errors), np.concatenate(variances)


def assert_score_is_the_slope(joint):
    """Masses move the Coriolis forces of the other axes: the differences over all innovations see that as well."""
    theta = joint.prior_mean.copy()
    # So large a disturbance that innovations are of the size that they are expected to be.
    theta[[of_axis.start + DISTURBANCE for of_axis in joint.slices]] += 3.0
    gradient, information = joint.score(theta)
    by_parameter = slopes(
        lambda moved: innovations_of_all(joint, moved), theta, joint.difference, range(len(theta))
    )
    slope, curvature = weigh(*innovations_of_all(joint, theta), *by_parameter)
    # What a dive says little of is known by its prior.
    size = np.sqrt(np.diag(curvature) + joint.prior_precision)
    np.testing.assert_allclose(gradient / size, slope / size, atol=2e-4)
    np.testing.assert_allclose(
        information / np.outer(size, size), curvature / np.outer(size, size), atol=2e-5
    )


def test_the_likelihood_alone_is_that_of_all_innovations_and_of_a_mass_told_by_other_axes():
    axes = problems()
    reading = axes[0].reading.copy()
    reading[::7] = np.nan
    joint = JointLikelihood((replace(axes[0], reading=reading, word=(1.1, 30.0)), *axes[1:]))
    expected = gaussian(*innovations_of_all(joint, joint.prior_mean))
    assert joint.log_likelihood(joint.prior_mean) == pytest.approx(expected, rel=1e-10)


def test_an_attitude_without_noise_is_believed_to_a_tenth_of_a_milliradian_and_no_further():
    roll = next(each for each in problems() if each.axis.dof == 3)
    at = [channel.name for channel in roll.axis.channels].index("attitude")
    read = roll.axis.channel == at
    theta = roll.prior_mean.copy()
    theta[roll.noise_index + at] = np.log(1e-7)
    np.testing.assert_allclose(roll.noise_variance(theta)[read], 1e-8 * roll.axis.scale[read] ** 2)
    quieter = theta.copy()
    quieter[roll.noise_index + at] = np.log(1e-9)
    assert roll.log_likelihood(quieter) == roll.log_likelihood(theta)
    gradient, _ = roll.score(theta)
    assert gradient[roll.noise_index + at] == 0.0
    theta[roll.noise_index + at] = np.log(2e-3)
    np.testing.assert_allclose(roll.noise_variance(theta)[read], 4e-6 * roll.axis.scale[read] ** 2)


def test_a_state_that_has_run_away_has_no_likelihood():
    problem, *_ = problems()
    away = replace(problem, axis=replace(problem.axis, initial=np.array([[np.inf, 0.0, 1.0, 1.0]])))
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
    assert information[joint.slices[heave].start + MASS, -1] == 0.0
