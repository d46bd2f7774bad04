"""The joint likelihood against what shares no line with it: the benchmark's missions and their Cramer-Rao bound."""

from functools import cache

import numpy as np
import pytest

from bench.bound import cramer_rao
from bench.missions.mission import draw_one
from identify.estimators.axes import build_axes
from identify.estimators.likelihood import estimate
from identify.estimators.likelihood_axis import MASS_RATIO, likelihood_of, rigid_mass
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.scoring import score


def quiet(_share: float, _text: str) -> None:
    pass


@cache
def mission(seed, seconds=None, kind=None):
    return draw_one(seed, seconds=seconds, kind=kind)


def test_the_score_of_all_axes_is_the_slope_of_their_likelihood():
    """Masses move the Coriolis forces of the other axes: the differences over all innovations see that as well."""
    dived = mission(100007, 40.0, "together")
    shape = dived.drawn.configuration
    masses = np.array([MASS_RATIO * rigid_mass(shape, dof) for dof in range(6)])
    axes = build_axes(dived.dive, dived.file, dived.configuration).axes
    joint = JointLikelihood(tuple(likelihood_of(axis, shape, masses, ()) for axis in axes))
    theta = joint.prior_mean
    gradient, information = joint.score(theta)
    by_differences = score(joint, theta)
    size = np.sqrt(np.diag(by_differences[1]))
    np.testing.assert_allclose(gradient / size, by_differences[0] / size, atol=2e-4)
    np.testing.assert_allclose(
        information / np.outer(size, size), by_differences[1] / np.outer(size, size), atol=2e-5
    )


@pytest.mark.parametrize("seed", [100000, 100010, 100034])
def test_intervals_are_as_wide_as_the_bound_and_hold_the_truth(seed):
    dived = mission(seed)
    found, bound = estimate(dived.dive, dived.file, dived.configuration, quiet), cramer_rao(dived)
    told = [found[name] for name in dived.truth if found[name].identifiable]
    assert len(told) >= 6
    ratios = [np.log(p.high95 / p.low95) / (2 * 1.96) / bound[p.name] for p in told]
    errors = [np.log(p.value / dived.truth[p.name]) / bound[p.name] for p in told]
    assert 0.85 < np.median(ratios) < 1.2
    assert np.max(np.abs(errors)) < 4.5


def test_a_mass_that_its_own_axis_hardly_weighs_is_known_from_the_others():
    """Heave is held still; how a pitched hull is turned by its own speed weighs it all the same."""
    dived = mission(100025)
    found = estimate(dived.dive, dived.file, dived.configuration, quiet)["M_w"]
    assert found.identifiable
    assert found.std / found.value < 0.1
    assert abs(np.log(found.value / dived.truth["M_w"])) < 4 * found.std / found.value
