"""The search for the likeliest values and their intervals, against functions whose answer is known."""

from dataclasses import replace

import closed_loop
import numpy as np
import pytest
from fitted import gaussian, weigh

from identify.estimators.axes.build import build_axes
from identify.estimators.likelihood import fit as starts
from identify.estimators.likelihood.axis import DAMPING, DISTURBANCE, MASS, TIME_CONSTANT
from identify.estimators.likelihood.fit import regressed, rough_maximum
from identify.estimators.likelihood.intervals import integrated, stretches
from identify.estimators.likelihood.priors import likelihood_of
from identify.estimators.likelihood.scoring import Maximum, climb, log_posterior
from identify.statistics import Z95

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
    surge = problem("both", noise=1e-4, quadratic=80.0)
    theta = regressed(surge, 72.0)
    assert surge.quadratic(theta) == pytest.approx(80.0, rel=0.1)
    assert np.exp(theta[DAMPING]) == pytest.approx(closed_loop.DAMPING, rel=0.2)


def test_a_regression_of_nonsense_starts_at_the_end_of_what_is_believed():
    surge = problem()
    backwards = replace(surge, axis=replace(surge.axis, force=-surge.axis.force))
    theta = regressed(backwards, 72.0)
    assert np.exp(theta[MASS]) == pytest.approx(0.3 * 72.0)
    assert np.exp(theta[DAMPING]) == pytest.approx(0.02 * 72.0)
    empty = replace(surge, axis=replace(surge.axis, force=np.full_like(surge.axis.force, np.nan)))
    assert np.array_equal(regressed(empty, 72.0), surge.prior_mean)


def test_the_likelier_of_two_summits_is_taken_whichever_start_leads_there(monkeypatch):
    surge = problem()
    best = climb(surge, surge.prior_mean, 0.5)

    def misled(of, start, enough):
        """A climb that sticks where it starts from the prior's mean."""
        if np.array_equal(start, surge.prior_mean):
            return Maximum(start, log_posterior(of, start), best.information, best.precision, 1, True)
        return climb(of, start, enough)

    monkeypatch.setattr(starts, "climb", misled)
    summit = rough_maximum(surge, 72.0, {})
    assert summit.log_likelihood == pytest.approx(best.log_likelihood, abs=1.0)


def test_a_start_without_a_solution_leaves_the_other(monkeypatch):
    surge = problem()

    def failing(of, start, enough):
        if np.array_equal(start, surge.prior_mean):
            raise np.linalg.LinAlgError
        return climb(of, start, enough)

    monkeypatch.setattr(starts, "climb", failing)
    assert np.exp(rough_maximum(surge, 72.0, {}).theta[MASS]) == pytest.approx(closed_loop.MASS, rel=0.05)
    monkeypatch.setattr(starts, "climb", lambda *_: climb(surge, np.full_like(surge.prior_mean, np.nan)))
    with pytest.raises(np.linalg.LinAlgError):
        rough_maximum(surge, 72.0, {})


def test_the_files_model_is_the_start_where_it_is_likelier_than_regression(monkeypatch):
    surge = problem()
    seen = []
    monkeypatch.setattr(starts, "regressed", lambda *_: surge.prior_mean - 1.0)

    def watched(of, start, enough):
        seen.append(start)
        return climb(of, start, enough)

    monkeypatch.setattr(starts, "climb", watched)
    rough_maximum(surge, 72.0, {"M_u": closed_loop.MASS, "D_u": closed_loop.DAMPING})
    assert np.exp(seen[-1][[MASS, DAMPING]]) == pytest.approx([closed_loop.MASS, closed_loop.DAMPING])


class Sample:
    """A reading of exp(a) + b (or of 1 + a + b) and one of b, each with the noise `spread`."""

    def __init__(self, spread, bent=True):
        self.spread, self.bent = spread, bent
        self.prior_mean, self.prior_precision = np.zeros(2), np.zeros(2)
        self.difference = np.full(2, 1e-4)

    def innovations(self, theta):
        level = np.exp(theta[0]) if self.bent else 1.0 + theta[0]
        return np.array([1.0 - level - theta[1], -theta[1]]), np.full(2, self.spread**2)

    def log_likelihood(self, theta):
        return gaussian(*self.innovations(theta))

    def score(self, theta):
        slope = np.exp(theta[0]) if self.bent else 1.0
        return weigh(*self.innovations(theta), np.array([[-slope, 0.0], [-1.0, -1.0]]), np.zeros((2, 2)))


@pytest.mark.parametrize("spread", [0.01, 0.1, 0.5])
def test_a_parabola_keeps_its_ends(spread):
    below, above = stretches(Sample(spread, bent=False), np.zeros(2), 0)
    assert below == pytest.approx(1.0, abs=1e-6)
    assert above == pytest.approx(1.0, abs=1e-6)


def ends(spread):
    """With b at its best, exp(a) is normal about 1 with the variance of the two readings together."""
    far = Z95 * spread * np.sqrt(2.0)
    return far, Z95 * -np.expm1(-far) / far, Z95 * -np.expm1(-2.0 * far) / far


def test_ends_move_by_what_the_likelihood_with_all_else_at_its_best_has_fallen_there():
    below, above = stretches(Sample(0.01), np.zeros(2), 0)
    far, near, _ = ends(0.01)
    assert below == pytest.approx(Z95 / near, rel=1e-6)
    assert above == pytest.approx(far / np.expm1(far), rel=1e-6)


def test_the_end_of_a_loosely_known_one_is_found_between_two_points_of_the_likelihood():
    below, above = stretches(Sample(0.1), np.zeros(2), 0)
    far, near, twice = ends(0.1)
    assert below == pytest.approx(1.0 + (Z95 - near) / (twice - near), rel=1e-4)
    # Where 1 - exp(-a) is 1.96 standard deviations, 2 % nearer than between the two points.
    assert below == pytest.approx(-np.log1p(-far) / far, rel=0.025)
    assert above == pytest.approx(far / np.expm1(far), rel=1e-4)


class Walled(Sample):
    """Away from the maximum its equations have no solution."""

    def score(self, theta):
        if theta.any():
            raise np.linalg.LinAlgError
        return super().score(theta)


def test_where_the_end_has_no_solution_the_interval_is_as_wide_as_one_may_be_and_the_rest_is_answered():
    assert stretches(Walled(0.5), np.zeros(2), 0) == (2.0, 2.0)


class TwoSummits(Sample):
    """Beside the summit at 0 another, as high, at -0.8."""

    def innovations(self, theta):
        bowl = theta[0] * (theta[0] + 0.8) / 0.8
        return np.array([bowl, theta[1]]), np.full(2, 0.15**2)

    def score(self, theta):
        slope = (2.0 * theta[0] + 0.8) / 0.8
        return weigh(*self.innovations(theta), np.array([[slope, 0.0], [0.0, 1.0]]), np.zeros((2, 2)))


def test_an_end_that_lies_beyond_a_second_summit_is_not_believed():
    below, above = stretches(TwoSummits(0.15), np.zeros(2), 0)
    assert below == 4.0
    assert above < 1.0


class Sampled:
    """A normal sample of n readings as a likelihood of one axis: its mean in the mass's place, its level in the
    disturbance's; two more parameters that nothing depends on.
    """

    def __init__(self, n):
        self.n = n
        self.slices = (slice(0, 4),)
        self.prior_precision = np.zeros(4)

    def score_of(self, axis, theta):
        assert axis == 0
        inverse = np.exp(-2 * theta[DISTURBANCE])
        gradient = np.zeros(4)
        gradient[MASS] = -self.n * inverse * theta[MASS]
        gradient[DISTURBANCE] = -self.n + self.n * inverse * (1 + theta[MASS] ** 2)
        information = np.eye(4)
        information[MASS, MASS] = self.n * inverse
        information[DISTURBANCE, DISTURBANCE] = 2 * self.n
        return np.arange(4), gradient, information


@pytest.mark.parametrize("n", [30, 100, 1000])
def test_the_mean_of_a_normal_sample_gets_the_variance_of_students_distribution(n):
    _, widening = integrated(Sampled(n), np.zeros(4))
    assert widening[MASS] ** 2 == pytest.approx(1 + 3 / n, abs=12 / n**2)


def test_the_level_moves_up_by_the_degree_of_freedom_that_the_mean_took_and_by_its_skewness():
    shift, _ = integrated(Sampled(100), np.zeros(4))
    assert shift[DISTURBANCE] == pytest.approx(1 / 200 + 1 / 200, rel=0.05)
    assert shift[MASS] == 0.0
    assert shift[TIME_CONSTANT] == 0.0
