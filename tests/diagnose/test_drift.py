"""The floor of the gap: what a coloured disturbance alone drives a velocity to."""

import pytest

from identify.diagnose.drift import _spread


def test_after_long_the_spread_is_the_stationary_one_of_a_body_under_coloured_force():
    mass, damping, sigma, memory_s = 100.0, 50.0, 2.0, 1.5
    a, b = damping / mass, 1 / memory_s
    exact = (sigma / mass) ** 2 / (a * (a + b))
    assert _spread(mass, damping, sigma, memory_s, 40.0) == pytest.approx(exact, rel=1e-3)


def test_after_a_moment_it_is_that_of_a_constant_force():
    assert _spread(100.0, 50.0, 2.0, 1.5, 0.01) == pytest.approx((2.0 * 0.01 / 100.0) ** 2, rel=0.02)


def test_of_a_force_without_damping_it_is_that_of_an_integrated_markov_process():
    from math import exp

    sigma, memory_s, span_s = 3.0, 2.0, 5.0
    exact = 2 * sigma**2 * memory_s * (span_s - memory_s * (1 - exp(-span_s / memory_s)))
    assert _spread(1.0, 0.0, sigma, memory_s, span_s) == pytest.approx(exact, rel=1e-3)
