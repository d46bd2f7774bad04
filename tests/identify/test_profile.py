"""The ends of intervals, against a likelihood whose ends are known."""

import numpy as np
import pytest

from identify.estimators.profile import stretches
from identify.identification import Z95


class Sample:
    """One reading of exp(a) + b with noise `spread` and one of b with noise 1: log value a, nuisance b."""

    def __init__(self, spread, bent=True):
        self.spread, self.bent = spread, bent
        self.prior_mean, self.prior_precision = np.zeros(2), np.zeros(2)

    def innovations(self, theta):
        level = np.exp(theta[0]) if self.bent else 1.0 + theta[0]
        return np.array([1.0 - level - theta[1], -theta[1]]), np.array([self.spread**2, 1.0])

    def sensitivities(self, theta, dofs):
        assert not dofs
        e, s = self.innovations(theta)
        slope = np.exp(theta[0]) if self.bent else 1.0
        return e, s, np.array([[-slope, 0.0], [-1.0, -1.0]]), np.zeros((2, 2))


def test_a_parabola_keeps_its_ends():
    below, above = stretches(Sample(0.1, bent=False), np.zeros(2), 0)
    assert below == pytest.approx(1.0, abs=1e-9)
    assert above == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("spread", [0.02, 0.05, 0.1])
def test_the_logarithm_of_what_is_normal_reaches_further_down_than_up(spread):
    class Known(Sample):
        def innovations(self, theta):
            e, s = super().innovations(theta)
            return e, s * np.array([1.0, 1e-12])

        def sensitivities(self, theta, dofs):
            e, s = self.innovations(theta)
            return e, s, *super().sensitivities(theta, dofs)[2:]

    below, above = stretches(Known(spread), np.zeros(2), 0)
    assert below > 1.0 > above
    far = Z95 * spread
    assert below == pytest.approx(-np.log1p(-far) / far, abs=2 * far**2)
    assert above == pytest.approx(np.log1p(far) / far, abs=2 * far**2)
