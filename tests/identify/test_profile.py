"""The ends of intervals, against a likelihood whose ends are known."""

import numpy as np
import pytest

from identify.estimators.profile import NEAREST, stretches
from identify.identification import Z95


class Sample:
    """A reading of exp(a) + b (or of 1 + a + b) and one of b, each with the noise `spread`."""

    def __init__(self, spread, bent=True):
        self.spread, self.bent = spread, bent
        self.prior_mean, self.prior_precision = np.zeros(2), np.zeros(2)

    def innovations(self, theta):
        level = np.exp(theta[0]) if self.bent else 1.0 + theta[0]
        return np.array([1.0 - level - theta[1], -theta[1]]), np.full(2, self.spread**2)

    def sensitivities(self, theta, dofs):
        assert not dofs
        slope = np.exp(theta[0]) if self.bent else 1.0
        return *self.innovations(theta), np.array([[-slope, 0.0], [-1.0, -1.0]]), np.zeros((2, 2))


def test_a_parabola_keeps_its_ends():
    below, above = stretches(Sample(0.1, bent=False), np.zeros(2), 0)
    assert below == pytest.approx(1.0, abs=1e-9)
    assert above == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("spread", [0.01, 0.1, 0.2])
def test_ends_move_by_what_the_likelihood_with_all_else_at_its_best_has_fallen_there(spread):
    """With b at its best, exp(a) is normal about 1 with the variance of the two readings together."""
    below, above = stretches(Sample(spread), np.zeros(2), 0)
    far = Z95 * spread * np.sqrt(2.0)
    assert below == pytest.approx(far / -np.expm1(-far), rel=1e-6)
    assert above == pytest.approx(max(far / np.expm1(far), NEAREST), rel=1e-6)
