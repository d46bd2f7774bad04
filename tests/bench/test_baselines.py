"""The baselines: exact on data without noise, and as far off as they are on noisy ones."""

from importlib.util import find_spec

import numpy as np
import pytest

from bench.baselines import least_squares
from bench.baselines.regression import AxisTerms, axis_terms
from bench.missions.mission import draw_one
from bridge.errors import FitError

MASS, DAMPING = 20.0, 30.0


def clean_axis() -> AxisTerms:
    """An axis that obeys its equation to the letter, and is asked at 20 Hz."""
    time_s = 0.05 * np.arange(1200)
    speed = 0.3 * np.sin(0.7 * time_s) + 0.1 * np.sin(1.9 * time_s)
    slope = 0.21 * np.cos(0.7 * time_s) + 0.19 * np.cos(1.9 * time_s)
    products = np.column_stack([np.sin(0.31 * time_s), np.cos(1.3 * time_s)])
    force = MASS * slope + DAMPING * speed + products @ [3.0, -2.0] + 0.5
    return AxisTerms(0, 20.0, force, speed, slope, products)


def test_least_squares_is_exact_without_noise() -> None:
    found = least_squares.fitted(clean_axis())
    assert (found.mass, found.damping) == pytest.approx((MASS, DAMPING), rel=1e-9)
    assert found.mass_std < 1e-6


def test_least_squares_states_the_textbooks_interval() -> None:
    axis, rng = clean_axis(), np.random.default_rng(5)
    errors = []
    for _ in range(200):
        noisy = AxisTerms(0, 20.0, axis.force + rng.standard_normal(1200), axis.velocity, axis.acceleration,
                          axis.products)  # fmt: skip
        found = least_squares.fitted(noisy)
        errors.append((found.mass - MASS) / found.mass_std)
    assert np.std(errors) == pytest.approx(1.0, abs=0.15)


def test_only_axes_that_the_dive_pushes_are_fitted() -> None:
    mission = draw_one(100_010)
    found = least_squares.estimate(mission.dive, mission.file, mission.configuration, lambda *_report: None)
    pushed = {axis.dof for axis in axis_terms(mission.dive, mission.file, mission.configuration, 20.0, 1.0)}
    assert [p.identifiable for p in found.parameters[:6]] == [dof in pushed for dof in range(6)]
    assert found["M_u"].value == pytest.approx(mission.truth["M_u"], rel=0.3)


def test_too_short_a_dive_is_refused() -> None:
    mission = draw_one(100_010)
    with pytest.raises(FitError):
        least_squares.estimate(
            mission.dive.between(0.0, 10.0), mission.file, mission.configuration, lambda *_report: None
        )


if find_spec("pysindy") is not None:  # it comes with the optional extra `bench`

    @pytest.mark.filterwarnings("ignore")
    def test_sindy_finds_the_true_coefficients_without_noise() -> None:
        from bench.baselines import sindy, sindy_weak

        smooth = sindy.fitted(clean_axis(), sindy._differentiated())
        weak = sindy.fitted(clean_axis(), sindy_weak._weak(clean_axis()))
        for found in (smooth, weak):
            assert (found.mass, found.damping) == pytest.approx((MASS, DAMPING), rel=0.02)
