"""The ends of intervals, against a likelihood whose ends are known."""

import numpy as np
import pytest

from identify.estimators.intervals import ENDLESS, stretches
from identify.estimators.scoring import gaussian, weigh
from identify.identification import Z95


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
    assert below == ENDLESS
    assert above < 1.0
