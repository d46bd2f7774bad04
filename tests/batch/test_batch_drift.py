"""Trends and their meaning: exact on a line, honest where there is none, doubts counted."""

from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest

from identify.batch.drift import DOUBTED, Story, drift_of, percent
from identify.batch.rows import Row, Value, doubts_in
from identify.batch.trend import common_series, fit_trend, holm, ratio
from identify.checks.fit.missing_forces import drag_doubts
from identify.checks.fit.thrust_timing import late_doubts
from identify.doubt import Culprit, Doubt, Outcome
from identify.estimators.missing_forces.drag_and_timing import Multiplier

DAY_S = 86400.0
START_S = 1.77e9
TRUE = {"M_u": 111.0, "M_v": 113.0, "I_r": 16.0, "D_u": 56.0, "D_v": 53.0, "D_r": 26.0}
SPREAD = {"M_u": 0.011, "M_v": 0.015, "I_r": 0.014, "D_u": 0.005, "D_v": 0.006, "D_r": 0.005}


def dives(mass=0.0, damping=0.0, thrust=0.0, seed=7, count=12):
    """Weekly dives in which mass, damping and thrust grow by these shares from the first to the last."""
    rng = np.random.default_rng(seed)
    rows = []
    for number in range(count):
        share = number / (count - 1)
        values = {}
        for name, true in TRUE.items():
            grown = true * (1 + share * (mass if name[0] in "MI" else damping)) / (1 + share * thrust)
            std = SPREAD[name] * grown
            value = grown + std * rng.normal()
            values[name] = Value(value, std, value - 1.96 * std, value + 1.96 * std)
        when = START_S + 7 * DAY_S * number
        rows.append(
            Row(f"dive {number}", f"{number}.tlog", str(number), "only", "converged", when, values=values)
        )
    return rows


@pytest.mark.parametrize(
    ("planted", "story"),
    [
        ({}, Story.STEADY),
        ({"damping": 0.2}, Story.FOULING),
        ({"damping": -0.15}, Story.CLEANER),
        ({"thrust": -0.12}, Story.WEAKER),
        ({"thrust": 0.12}, Story.STRONGER),
        ({"mass": 0.1}, Story.HEAVIER),
        ({"mass": -0.1}, Story.LIGHTER),
        ({"mass": 0.1, "damping": 0.3}, Story.SEVERAL),
    ],
)
@pytest.mark.parametrize("seed", [1, 2])
def test_each_story_is_told_as_what_it_is(planted, story, seed):
    drift = drift_of(dives(**planted, seed=seed))
    assert drift.story is story
    assert drift.sentence.startswith(story.value)


def test_the_change_is_told_in_per_cent_with_its_interval():
    drift = drift_of(dives(damping=0.2))
    assert percent(drift.damping.low95) < 20 < percent(drift.damping.high95)
    assert "Over 12 dives from 2026-02-02 02:40 to 2026-04-20 02:40: mass " in drift.sentence
    assert {"D_u", "D_v", "D_r"} == drift.real
    within = max(abs(percent(drift.mass.low95)), abs(percent(drift.mass.high95)))
    assert f"The change of mass is within {within:.1f} %." in drift.sentence


def test_weak_thrust_with_a_falling_battery_names_the_battery():
    rows = dives(thrust=-0.15)
    volts = [replace(row, voltage_v=16.0 - 0.1 * number) for number, row in enumerate(rows)]
    assert "The pack voltage fell by 1.1 V" in drift_of(volts).sentence
    steady = [replace(row, voltage_v=16.0) for row in rows]
    assert "voltage" not in drift_of(steady).sentence


def test_parameters_that_err_together_tell_no_more_than_one():
    together = {frozenset(pair): 1.0 for pair in combinations(("M_u", "M_v", "I_r"), 2)}
    rows = [replace(row, correlation=together) for row in dives()]
    alone, joint = (common_series(some, ["M_u", "M_v", "I_r"]) for some in (dives(), rows))
    single = sum(SPREAD[name] ** -2 for name in ("M_u", "M_v", "I_r")) ** -0.5
    assert alone.std == pytest.approx(np.full(12, single), rel=0.1)
    assert np.all((joint.std > 0.0105) & (joint.std < 0.0155))
    assert joint.value == pytest.approx(alone.value)


def test_errors_that_mass_and_damping_share_fall_out_of_their_ratio():
    shared = [replace(row, correlation={frozenset(("M_u", "D_u")): 0.9}) for row in dives()]
    mass, damping = (common_series(shared, [name]) for name in ("M_u", "D_u"))
    expected = np.sqrt(0.011**2 + 0.005**2 - 2 * 0.9 * 0.011 * 0.005)
    assert ratio(damping, mass, shared).std == pytest.approx(np.full(12, expected), rel=0.1)


def test_two_dives_or_none_that_is_dated_are_too_few():
    for count in (1, 2):
        assert drift_of(dives(count=2)[:count]).sentence == (
            f"{Story.TOO_FEW.value}. A trend takes dives that have a date and converged. Identified in this "
            f"configuration: {count}, with a date {count}, converged {count}, both {count}; of these {count} with a "
            f"mass and {count} with a damping."
        )
    undated = [replace(row, unix_s=None) for row in dives()]
    assert drift_of(undated).story is Story.TOO_FEW


def test_nothing_planted_is_seldom_called_a_story():
    stories = [drift_of(dives(seed=seed)).story for seed in range(60)]
    assert sum(story is not Story.STEADY for story in stories) <= 9


def test_a_dive_in_which_data_and_model_disagree_bends_no_trend_and_is_counted_out():
    rows = dives()
    wrong = {name: replace(v, value=2 * v.value) for name, v in rows[-1].values.items()}
    spoilt = [*rows[:-1], replace(rows[-1], outcome="data and model disagree", values=wrong)]
    drift = drift_of(spoilt)
    assert drift.story is Story.STEADY
    assert drift.trends == drift_of(rows[:-1]).trends
    assert drift.sentence.endswith("Left out: 1 ended as 'data and model disagree'.")
    assert "Left out" not in drift_of(rows).sentence


def test_a_dive_without_a_date_is_in_no_trend_and_is_counted_out():
    rows = dives()
    undated = replace(rows[-1], unix_s=None)
    drift = drift_of([*rows[:-1], undated])
    assert drift.trends == drift_of(rows[:-1]).trends
    assert (drift.counts(undated), drift.takes(undated, "M_u")) == (False, False)
    assert drift.sentence.endswith("Left out: 1 without a date.")


def test_a_fleet_whose_model_never_holds_has_trends_that_say_so():
    rows = dives(damping=0.2)
    doubted = [replace(row, outcome="data and model disagree") for row in rows]
    assert drift_of(doubted).story is drift_of(rows).story is Story.FOULING
    assert drift_of(doubted).sentence == f"{drift_of(rows).sentence} {DOUBTED}"
    assert all(map(drift_of(doubted).counts, doubted))


WARNED = Doubt(("M_u", "D_u"), "No rate of turn was recorded", "M_u may be off; record a gyro.")
HALF = Doubt(
    ("M_u", "M_v", "D_u", "D_v"), "Depth changes by 2 times what it should", "mend it.", Outcome.DISAGREES
)
FORCE = Multiplier(30.0, 0.02, np.zeros(12))
DRAG, LATE = drag_doubts({0: FORCE})[0], late_doubts({0: FORCE}, [0])[0]


def spoilt(row, factor, names, *doubts, outcome="converged"):
    """A dive whose values of these names are wrong, with what speaks against them."""
    wrong = {name: replace(row.values[name], value=factor * row.values[name].value) for name in names}
    return replace(row, values={**row.values, **wrong}, doubts=doubts, outcome=outcome)


def test_a_value_that_a_warning_names_bends_no_trend_and_the_others_of_its_dive_count():
    rows = dives()
    some = [*rows[:-1], spoilt(rows[-1], 1.4, ("M_u", "D_u"), WARNED)]
    drift = drift_of(some)
    assert drift.story is Story.STEADY
    assert drift.trends["M_u"] == drift_of(rows[:-1]).trends["M_u"]
    assert drift.trends["M_v"] == drift_of(rows).trends["M_v"]
    assert drift.sentence.endswith("Left out: the doubted M_u, D_u of 1 dive.")
    assert [drift.takes(some[-1], name) for name in ("M_u", "M_v")] == [False, True]


def test_one_undoubted_inertia_does_not_stand_for_all_that_is_doubted():
    warned = Doubt(tuple(name for name in TRUE if name != "I_r"), WARNED.problem, WARNED.remedy)
    drift = drift_of([replace(row, doubts=(warned,)) for row in dives(damping=0.2)])
    assert drift.story is Story.FOULING
    assert drift.sentence.endswith(DOUBTED)


def test_a_dive_whose_sensor_is_off_by_a_factor_bends_no_trend_of_a_fleet_that_lacks_a_drag():
    rows = [replace(row, doubts=(DRAG, LATE), outcome="data and model disagree") for row in dives()]
    half = spoilt(rows[-1], 2.0, HALF.about, DRAG, HALF, outcome="data and model disagree")
    drift = drift_of([*rows[:-1], half])
    assert drift.story is Story.STEADY
    assert drift.trends["M_u"] == drift_of(rows[:-1]).trends["M_u"]
    assert drift.trends["I_r"] == drift_of(rows).trends["I_r"]
    assert drift.sentence.endswith(f"Left out: the doubted M_u, M_v, D_u, D_v of 1 dive. {DOUBTED}")


def test_dives_that_all_contradict_their_own_recording_make_no_trend():
    everything = replace(HALF, about=tuple(TRUE))
    rows = [replace(row, doubts=(everything,), outcome="data and model disagree") for row in dives()]
    assert drift_of(rows).story is Story.TOO_FEW


def days(count):
    return START_S + DAY_S * np.arange(count)


def row(day, **values):
    """A dive of values given as (value, relative standard error)."""
    results = {n: Value(v, v * r, v * (1 - 2 * r), v * (1 + 2 * r)) for n, (v, r) in values.items()}
    return Row(f"{day}", f"{day}.tlog", str(day), "only", "converged", START_S + DAY_S * day, values=results)


def test_a_line_is_found_exactly_whatever_the_weights():
    t = days(6)
    trend = fit_trend(t, 10 + 0.5 * np.arange(6), np.array([0.1, 0.2, 0.1, 0.4, 0.1, 0.3]))
    assert trend.change == pytest.approx(2.5)
    assert trend.at(t[0]) == pytest.approx(10)
    assert trend.at(t[-1]) == pytest.approx(12.5)
    assert trend.percent(trend.change) == pytest.approx(25)
    assert trend.scatter == 0


def test_where_dives_differ_far_beyond_their_errors_it_is_the_ordinary_line_with_students_t():
    from scipy.stats import linregress
    from scipy.stats import t as stats_t

    value = 50 + np.random.default_rng(3).normal(size=8)
    trend, line = fit_trend(days(8), value, np.full(8, 1e-6)), linregress(days(8), value)
    assert trend.slope_per_s == pytest.approx(line.slope)
    assert trend.p == pytest.approx(line.pvalue, rel=1e-4)
    half = stats_t.ppf(0.975, 6) * line.stderr * 7 * DAY_S
    assert trend.high95 - trend.low95 == pytest.approx(2 * half, rel=1e-4)


@pytest.mark.parametrize("unix_s", [days(0), days(2), np.full(5, START_S)])
def test_two_dives_or_dives_of_one_moment_are_no_trend(unix_s):
    assert fit_trend(unix_s, np.ones(len(unix_s)), np.ones(len(unix_s))) is None


@pytest.mark.parametrize("between", [0.0, 5.0])
def test_false_alarms_are_as_rare_as_said_however_much_dives_differ(between):
    rng = np.random.default_rng(1)
    std = np.array([0.2, 0.5, 1.0, 0.3, 0.6, 0.2, 0.4, 0.8])
    alarms = sum(
        fit_trend(days(8), 50 + std * rng.normal(size=8) + between * rng.normal(size=8), std).is_real
        for _ in range(600)
    )
    assert alarms / 600 < 0.075


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
    result = ratio(common_series(rows, ["D_u"]), common_series(rows, ["M_u"]), rows)
    assert result.rows == (1,)
    assert result.std == pytest.approx([0.05])


LATE_THRUST = Doubt(("M_u", "D_u"), "Thrust acts late", "mend the lag.", Outcome.DISAGREES, Culprit.MODEL)
WARNED_FILE = Doubt(("M_u",), "No rate of turn was recorded", "record a gyro.")


def written(*doubts):
    return {"doubts": [doubt.to_json() for doubt in doubts]}


def test_doubts_come_back_from_the_file_as_they_were_but_for_those_about_a_prior():
    assert doubts_in(written(LATE_THRUST, WARNED_FILE)) == (LATE_THRUST, WARNED_FILE)
    of_prior = replace(WARNED_FILE, culprit=Culprit.PRIOR)
    assert doubts_in(written(of_prior, LATE_THRUST)) == (LATE_THRUST,)
