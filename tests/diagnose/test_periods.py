"""The periods of what pushes are read off the dive, however the vehicle turns meanwhile."""

import numpy as np
import pytest

from identify.challenge.case import dive_of, draw_case
from identify.diagnose.nominal import nominal_of
from identify.diagnose.seas import CURRENTS_S, WAVES_S, period_interval, seas_of


def seas_with(names, seed):
    case = draw_case(seed, names=names, size=0.7, seconds=200.0)
    nominal = nominal_of(dive_of(case), case.file, next(iter(case.file.vehicle.configurations)))
    return case, seas_of(nominal)


def periods(effect):
    return [float(one) for one in effect.variant.removesuffix(" s").replace(" and ", ", ").split(", ")]


@pytest.mark.parametrize(
    ("name", "seed", "near"), [("waves", 300_911, 0.15), ("varying_current", 300_912, 0.3)]
)
def test_a_sea_that_comes_and_goes_is_among_the_candidates_with_its_period(name, seed, near):
    case, seas = seas_with([name], seed)
    true_s = case.truth()["effects"][0]["parameters"]["period"]
    found = [effect for effect in seas if effect.name == name]
    assert found
    for effect in found:
        assert all(one == pytest.approx(true_s, rel=near) for one in periods(effect))


def test_every_line_lies_in_its_band_and_has_its_own_parameters():
    _, seas = seas_with([], 300_913)
    for effect in seas:
        low, high = WAVES_S if effect.name == "waves" else CURRENTS_S
        assert all(0.95 * low <= one <= 1.05 * high for one in periods(effect))
        assert len(effect.parameters) == len(periods(effect)) * (6 if effect.name == "waves" else 4)
        assert np.all(effect.none() == 0.0)


def test_a_period_is_known_to_half_a_turn_in_the_dive():
    low, high = period_interval(90.0, 600.0)
    assert (1 / low - 1 / 90.0) * 600.0 == pytest.approx(0.5)
    assert (1 / 90.0 - 1 / high) * 600.0 == pytest.approx(0.5)


def test_a_period_as_long_as_the_dive_has_ends():
    low, high = period_interval(200.0, 120.0)
    assert 0 < low < 200.0 < high < np.inf
