"""Trends: exact where the line is, honest where there is none, robust to what dives differ by."""

import numpy as np
import pytest

from identify.batch.rows import Row, Value
from identify.batch.trend import common_series, fit_trend, holm, ratio

DAY_S = 86400.0
START_S = 1.77e9


def days(count):
    return START_S + DAY_S * np.arange(count)


def row(day, **values):
    """A dive of values given as (value, relative standard error)."""
    found = {n: Value(v, v * r, v * (1 - 2 * r), v * (1 + 2 * r)) for n, (v, r) in values.items()}
    return Row(f"{day}", f"{day}.tlog", str(day), "only", "converged", START_S + DAY_S * day, values=found)


def test_a_line_is_found_exactly_whatever_the_weights():
    t = days(6)
    trend = fit_trend(t, 10 + 0.5 * np.arange(6), np.array([0.1, 0.2, 0.1, 0.4, 0.1, 0.3]))
    assert trend.change == pytest.approx(2.5)
    assert trend.at(t[0]) == pytest.approx(10)
    assert trend.at(t[-1]) == pytest.approx(12.5)
    assert trend.percent(trend.change) == pytest.approx(25)
    assert trend.scatter == 0


def test_a_value_with_a_small_interval_pulls_harder():
    t, y = days(3), np.array([1.0, 1.0, 2.0])
    heavy = fit_trend(t, y, np.array([0.1, 0.1, 0.01]))
    light = fit_trend(t, y, np.array([0.1, 0.1, 10.0]))
    assert abs(heavy.at(t[2]) - 2) < abs(light.at(t[2]) - 2)


@pytest.mark.parametrize("count", [0, 1, 2])
def test_two_dives_are_no_trend(count):
    assert fit_trend(days(count), np.ones(count), np.ones(count)) is None


def test_dives_of_one_moment_are_no_trend():
    assert fit_trend(np.full(5, START_S), np.arange(5.0), np.ones(5)) is None


def test_values_that_are_all_the_same_have_no_trend():
    trend = fit_trend(days(5), np.full(5, 16.0), np.full(5, 0.05))
    assert (trend.change, trend.is_real) == (0.0, False)


@pytest.mark.parametrize("between", [0.0, 0.5, 5.0])
def test_false_alarms_are_as_rare_as_said_however_much_dives_differ(between):
    rng = np.random.default_rng(1)
    std = np.array([0.2, 0.5, 1.0, 0.3, 0.6, 0.2, 0.4, 0.8])
    alarms = sum(
        fit_trend(days(8), 50 + std * rng.normal(size=8) + between * rng.normal(size=8), std).is_real
        for _ in range(600)
    )
    assert alarms / 600 < 0.075


def test_the_scatter_between_dives_is_found():
    rng = np.random.default_rng(2)
    found = [
        fit_trend(days(30), 0.7 * rng.normal(size=30) + 0.3 * rng.normal(size=30), np.full(30, 0.3)).scatter
        for _ in range(60)
    ]
    assert np.sqrt(np.mean(np.square(found))) == pytest.approx(0.7, rel=0.1)


def test_chances_of_many_are_raised_step_by_step():
    assert holm({"a": 0.01, "b": 0.04, "c": 0.03}) == pytest.approx({"a": 0.03, "c": 0.06, "b": 0.06})
    assert holm({"a": 0.9, "b": 0.8}) == pytest.approx({"b": 1.0, "a": 1.0})


def test_a_common_series_is_that_which_all_share():
    growth = 1.02
    rows = [row(d, D_u=(50 * growth**d, 0.01), D_v=(80 * growth**d, 0.02)) for d in range(6)]
    series = common_series(rows, ["D_u", "D_v"])
    assert np.diff(series.value) == pytest.approx(np.full(5, np.log(growth)))
    assert series.std == pytest.approx(np.full(6, 1 / np.hypot(100, 50)))


def test_dives_that_show_other_coefficients_do_not_look_like_a_change():
    early = [row(d, D_u=(50, 0.01)) for d in range(4)]
    late = [row(d, D_u=(50, 0.01), D_r=(900, 0.01)) for d in range(4, 8)]
    assert common_series([*early, *late], ["D_u", "D_r"]).value == pytest.approx(np.zeros(8), abs=1e-9)


def test_a_ratio_has_the_dives_that_both_have():
    rows = [row(0, D_u=(50, 0.03)), row(1, D_u=(50, 0.03), M_u=(100, 0.04)), row(2, M_u=(100, 0.04))]
    found = ratio(common_series(rows, ["D_u"]), common_series(rows, ["M_u"]), rows)
    assert found.rows == (1,)
    assert found.std == pytest.approx([0.05])


def test_nothing_gives_an_empty_series():
    assert common_series([row(0)], ["D_u"]).rows == ()
