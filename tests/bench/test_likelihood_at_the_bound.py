"""The joint likelihood against what shares no line with it: the benchmark's missions and their Cramer-Rao bound."""

from functools import cache

import numpy as np
import pytest
from soak import rest_in_soak

from bench.bound import cramer_rao
from bench.missions.mission import draw_one
from identify.estimators.likelihood import estimate


def quiet(*_report: object) -> None:
    pass


@cache
def mission(seed, seconds=None, kind=None):
    return draw_one(seed, seconds=seconds, kind=kind)


@pytest.mark.parametrize("seed", rest_in_soak([100010, 100000, 100034]))
def test_intervals_are_as_wide_as_the_bound_and_hold_the_truth(seed):
    dived = mission(seed)
    found, bound = estimate(dived.dive, dived.file, dived.configuration, quiet), cramer_rao(dived)
    told = [found[name] for name in dived.truth if found[name].identifiable]
    assert len(told) >= 6
    ratios = [np.log(p.high95 / p.low95) / (2 * 1.96) / bound[p.name] for p in told]
    errors = [np.log(p.value / dived.truth[p.name]) / bound[p.name] for p in told]
    assert 0.85 < np.median(ratios) < 1.2
    assert np.max(np.abs(errors)) < 4.5


def test_a_mass_that_its_own_axis_hardly_weighs_is_known_from_the_others():
    """Heave is held still; how a pitched hull is turned by its own speed weighs it all the same."""
    dived = mission(100025)
    found = estimate(dived.dive, dived.file, dived.configuration, quiet)["M_w"]
    assert found.identifiable
    assert found.std / found.value < 0.1
    assert abs(np.log(found.value / dived.truth["M_w"])) < 4 * found.std / found.value
