"""The bias that noise in the acceleration puts on the paper's mass."""

import numpy as np
import pytest

from bench.paper_noise import noise_table, survey_surge


def test_without_noise_the_mass_is_exact_at_every_cut_off() -> None:
    table = noise_table(np.random.default_rng(0), (0.0,))
    assert table.error_percent == pytest.approx(0.0, abs=0.01)


def test_unfiltered_noise_of_0_02_takes_off_two_fifths_of_the_mass() -> None:
    table = noise_table(np.random.default_rng(0), (0.02,), (5.0,))
    assert table.error_percent[0, 0] == pytest.approx(-39.0, abs=2.0)


@pytest.mark.parametrize("noise", [0.01, 0.02, 0.04])
def test_the_bias_is_that_of_errors_in_variables(noise: float) -> None:
    _, nu_dot, _ = survey_surge()
    expected = -100 * noise**2 / (noise**2 + nu_dot.var())
    table = noise_table(np.random.default_rng(3), (noise,), (5.0,))
    assert table.error_percent[0, 0] == pytest.approx(expected, abs=1.5)


def test_the_lower_the_cut_off_the_smaller_the_bias() -> None:
    table = noise_table(np.random.default_rng(0))
    noisy = table.error_percent[1:]
    assert (np.diff(noisy, axis=1) > 0).all()
    assert (np.diff(table.error_percent, axis=0) < 0).all()
    assert table.error_percent.shape == (len(table.noise_m_s2), len(table.cutoff_hz))
