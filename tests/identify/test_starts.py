"""Where the climb of one axis starts: what plain regression knows, and the likelier of two summits."""

from dataclasses import replace

import closed_loop
import numpy as np
import pytest

from identify.estimators import starts
from identify.estimators.axes import build_axes
from identify.estimators.likelihood_axis import DAMPING, DISTURBANCE, MASS, likelihood_of
from identify.estimators.likelihood_joint import ROUGHLY, alone
from identify.estimators.scoring import Maximum, climb, log_posterior
from identify.estimators.starts import regressed, rough_maximum

SHAPE = closed_loop.vehicle_file().vehicle.configurations["only"]


def problem(damped="linear", **keys):
    dive = closed_loop.dive(np.random.default_rng(2), seconds=120.0, **keys)
    (axis,) = build_axes(dive, closed_loop.vehicle_file(), "only").axes
    return likelihood_of(axis, SHAPE, np.full(6, 100.0), (), damped)


def test_regression_knows_mass_drag_and_disturbance_of_a_quiet_dive():
    theta = regressed(problem(noise=1e-4), 72.0)
    assert np.exp(theta[MASS]) == pytest.approx(closed_loop.MASS, rel=0.05)
    assert np.exp(theta[DAMPING]) == pytest.approx(closed_loop.DAMPING, rel=0.05)
    assert np.exp(theta[DISTURBANCE]) == pytest.approx(0.35, rel=0.6)


def test_regression_tells_quadratic_drag_from_linear():
    one = problem("both", noise=1e-4, quadratic=80.0)
    theta = regressed(one, 72.0)
    assert one.quadratic(theta) == pytest.approx(80.0, rel=0.1)
    assert np.exp(theta[DAMPING]) == pytest.approx(closed_loop.DAMPING, rel=0.2)


def test_a_regression_of_nonsense_starts_at_the_end_of_what_is_believed():
    one = problem()
    backwards = replace(one, axis=replace(one.axis, force=-one.axis.force))
    theta = regressed(backwards, 72.0)
    assert np.exp(theta[MASS]) == pytest.approx(0.3 * 72.0)
    assert np.exp(theta[DAMPING]) == pytest.approx(0.02 * 72.0)
    empty = replace(one, axis=replace(one.axis, force=np.full_like(one.axis.force, np.nan)))
    assert np.array_equal(regressed(empty, 72.0), one.prior_mean)


def test_the_likelier_of_two_summits_is_taken_whichever_start_leads_there(monkeypatch):
    one = problem()
    best = climb(one, one.prior_mean, ROUGHLY, alone)

    def misled(of, start, enough, score):
        """A climb that sticks where it starts from the prior's mean."""
        if np.array_equal(start, one.prior_mean):
            return Maximum(start, log_posterior(of, start), best.information, best.precision, 1, True)
        return climb(of, start, enough, score)

    monkeypatch.setattr(starts, "climb", misled)
    found = rough_maximum(one, 72.0, {})
    assert found.log_likelihood == pytest.approx(best.log_likelihood, abs=1.0)


def test_a_start_without_a_solution_leaves_the_other(monkeypatch):
    one = problem()

    def failing(of, start, enough, score):
        if np.array_equal(start, one.prior_mean):
            raise np.linalg.LinAlgError
        return climb(of, start, enough, score)

    monkeypatch.setattr(starts, "climb", failing)
    assert np.exp(rough_maximum(one, 72.0, {}).theta[MASS]) == pytest.approx(closed_loop.MASS, rel=0.05)
    monkeypatch.setattr(starts, "climb", lambda *_: climb(one, np.full_like(one.prior_mean, np.nan)))
    with pytest.raises(np.linalg.LinAlgError):
        rough_maximum(one, 72.0, {})


def test_the_files_model_is_the_start_where_it_is_likelier_than_regression(monkeypatch):
    one = problem()
    seen = []
    monkeypatch.setattr(starts, "regressed", lambda *_: one.prior_mean - 1.0)

    def watched(of, start, enough, score):
        seen.append(start)
        return climb(of, start, enough, score)

    monkeypatch.setattr(starts, "climb", watched)
    rough_maximum(one, 72.0, {"M_u": closed_loop.MASS, "D_u": closed_loop.DAMPING})
    assert np.exp(seen[-1][[MASS, DAMPING]]) == pytest.approx([closed_loop.MASS, closed_loop.DAMPING])
