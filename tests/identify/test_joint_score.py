"""The score of all axes together against differences over all their innovations."""

from dataclasses import replace

import closed_loop
import numpy as np
import pytest

from bench.missions.mission import draw_one
from identify.estimators.axes import build_axes
from identify.estimators.likelihood_axis import MASS, MASS_RATIO, likelihood_of, rigid_mass
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.scoring import gaussian, score

HEAVE = 2


def problems():
    drawn = draw_one(100007, seconds=40.0, kind="together")
    shape = drawn.drawn.configuration
    masses = np.array([MASS_RATIO * rigid_mass(shape, dof) for dof in range(6)])
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
    away = replace(one, axis=replace(one.axis, initial=np.array([np.inf, 0.0, 1.0, 1.0])))
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


def test_a_pass_takes_half_of_the_way_to_the_speed_that_is_expected_of_an_axis():
    dive = closed_loop.dive(np.random.default_rng(2), seconds=60.0)
    built = build_axes(dive, closed_loop.vehicle_file(), "only")
    shape = closed_loop.vehicle_file().vehicle.configurations["only"]
    one = likelihood_of(built.axes[0], shape, np.full(6, 100.0), (), "both")
    theta = one.prior_mean
    (better,) = JointLikelihood((one,)).with_better_forces(built.motion, theta).problems
    halfway = 0.5 * (one.axis.speed + one.expected_speed(theta))
    np.testing.assert_allclose(better.axis.speed, halfway)
