"""The noise levels' own uncertainty, against samples whose answer is known."""

import numpy as np
import pytest

from identify.estimators.intervals import integrated
from identify.estimators.likelihood_axis import DISTURBANCE, MASS, TIME_CONSTANT


class Sample:
    """A normal sample of n readings as a likelihood of one axis: its mean in the mass's place, its level in the
    disturbance's; two more parameters that nothing depends on.
    """

    def __init__(self, n):
        self.n = n
        self.places = (slice(0, 4),)
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
    _, widening = integrated(Sample(n), np.zeros(4))
    assert widening[MASS] ** 2 == pytest.approx(1 + 3 / n, abs=12 / n**2)


def test_the_level_moves_up_by_the_degree_of_freedom_that_the_mean_took_and_by_its_skewness():
    shift, _ = integrated(Sample(100), np.zeros(4))
    assert shift[DISTURBANCE] == pytest.approx(1 / 200 + 1 / 200, rel=0.05)
    assert shift[MASS] == 0.0
    assert shift[TIME_CONSTANT] == 0.0
