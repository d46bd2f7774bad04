"""A dive held against what was foretold of it: limits, words, and which dives it is of."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bridge.vehicle.forecast import Credit, ForecastRow
from bridge.vehicle.mode import Mode
from identify.dive import Dive, Signal
from identify.thrust.given_thrust import Given
from identify.validation.against_forecast import (
    Foretelling,
    MadeUp,
    began,
    change_words,
    held_against,
    is_next,
    made_up,
    to_make_up,
    verdict_of,
)
from identify.validation.tracking import WholeError

SURGE = ForecastRow("surge", "m/s", "both", "both", 0.0133, 0.0060, 0.18)
YAW = ForecastRow("yaw", "rad/s", "both", "ff", math.radians(1.08), math.radians(0.17), 0.07)


def error(rms, asked=0.18, axis="surge", unit="m/s"):
    return WholeError(axis, unit, rms, asked, math.nan, math.nan, 0.001)


def test_it_is_told_in_mm_s_and_deg_s_with_the_mode_of_before_if_that_was_another():
    assert change_words(SURGE) == "13 -> 6.0 mm/s"
    assert change_words(YAW) == "1.1 (ff) -> 0.17 deg/s"
    (held,) = held_against([error(0.0061)], [SURGE], Mode.BOTH)
    assert (held.name, held.figures) == ("surge as foretold", "13 -> 6.0 mm/s, flown 6.1")
    assert verdict_of([held]) == "As foretold: surge 13 -> 6.0 mm/s, flown 6.1."


@pytest.mark.parametrize(
    ("flown", "kept", "name"),
    [
        (0.0010, True, "surge as foretold"),
        (0.0079, True, "surge as foretold"),
        (0.0081, None, "surge nearly as foretold"),
        (0.0119, None, "surge nearly as foretold"),
        (0.0121, False, "surge not as foretold"),
    ],
)
def test_a_third_more_is_as_foretold_and_twice_is_not(flown, kept, name):
    (held,) = held_against([error(flown)], [SURGE], Mode.BOTH)
    assert (held.kept, held.name) == (kept, name)
    assert verdict_of([held]).startswith(
        {True: "As foretold", None: "Nearly as foretold", False: "Not as foretold"}[kept]
    )


def test_an_axis_whose_error_the_dive_does_not_tell_is_not_held_against_what_was_foretold():
    """As that of a DVL that lost the bottom as long as the vehicle moved."""
    assert held_against([error(math.nan, asked=math.nan)], [SURGE], Mode.BOTH) == ()


def test_errors_that_are_small_in_any_sea_contradict_nothing():
    small = replace(SURGE, after=0.0015)
    assert held_against([error(0.0049)], [small], Mode.BOTH)[0].kept is None
    assert held_against([error(0.0051)], [small], Mode.BOTH)[0].kept is False


@pytest.mark.parametrize(("rest", "kept"), [(0.0, False), (0.035, False), (0.039, None)])
def test_an_error_that_the_sea_makes_of_a_vehicle_at_rest_contradicts_nothing(rest, kept):
    flown = [replace(error(0.077), rest=0.0), replace(error(0.05, axis="sway"), rest=rest)]
    (held,) = held_against(flown, [SURGE], Mode.BOTH)
    assert held.kept is kept
    assert held.name == f"surge {'not as' if kept is False else 'in a rougher sea than'} foretold"
    assert verdict_of([held]).startswith("Not as foretold" if kept is False else "A rougher sea: not held")


@pytest.mark.parametrize(("asked", "alike"), [(0.136, True), (0.134, False), (0.239, True), (0.241, False)])
def test_another_mission_is_told_and_not_held_against_it(asked, alike):
    (held,) = held_against([error(0.05, asked=asked)], [SURGE], Mode.BOTH)
    assert held.comparable is alike
    assert held.kept is (False if alike else None)
    if not alike:
        assert held.name == "surge in another mission than foretold"
        assert verdict_of([held]).startswith("Another mission than the one that was diagnosed")


def test_each_mode_has_its_own_and_nothing_foretold_is_no_word():
    assert held_against([error(0.006)], [SURGE], Mode.ALONE) == ()
    assert held_against([error(0.006, axis="sway")], [SURGE], Mode.BOTH) == ()
    assert verdict_of([]) == ""


@pytest.mark.parametrize(
    ("went_by", "name"),
    [
        (0.80, "thruster 3 made up for"),
        (0.83, "thruster 3 made up for"),
        (0.64, "thruster 3 made up for twice"),
        (1.00, "thruster 3 made up for too little"),
    ],
)
def test_a_thruster_is_made_up_for_once_twice_or_too_little(went_by, name):
    thruster = MadeUp(Credit(3, 1.0, 0.8, 1.0, acting=False), went_by)
    assert thruster.name == name
    assert thruster.words.startswith(f"asked as if it gave {100 * went_by:.0f} % of its curve; it gives 80 %")
    assert ("rollback" in thruster.mend) is (went_by == 0.64)


@pytest.mark.parametrize(
    ("went_by", "gave", "name"),
    [
        (0.80, Given(0.82, 0.02), "thruster 3 made up for"),
        (0.64, Given(0.63, 0.02), "thruster 3 made up for"),
        (0.80, Given(1.00, 0.02), "thruster 3 changed since it was diagnosed"),
        (0.80, Given(0.60, 0.02), "thruster 3 changed since it was diagnosed"),
        (0.64, Given(0.80, 0.02), "thruster 3 made up for twice"),
        (1.00, Given(0.80, 0.02), "thruster 3 made up for too little"),
    ],
)
def test_what_a_thruster_gave_in_the_dive_decides_rather_than_what_the_diagnosis_found(went_by, gave, name):
    thruster = MadeUp(Credit(3, 1.0, 0.8, 1.0, acting=False), went_by, gave)
    assert thruster.name == name
    assert thruster.passed is (name == "thruster 3 made up for")
    assert f"in this dive it gave {100 * gave.gain:.0f} ± 2 %" in thruster.words
    assert ("diagnose this dive" in thruster.mend) is thruster.changed


def test_where_the_dive_does_not_tell_clearly_the_diagnosis_decides_and_in_shadow_nothing():
    credit = Credit(3, 1.0, 0.8, 1.0, acting=False)
    assert MadeUp(credit, 0.8, Given(0.94, 0.09)).name == "thruster 3 made up for"
    unclear = MadeUp(credit, 0.8, Given(0.94, 0.09), acts=False)
    assert (unclear.name, unclear.passed) == ("thruster 3 not known in shadow", False)
    assert unclear.words.endswith("in this dive it gave 94 ± 9 %")
    assert MadeUp(credit, 0.8, Given(0.94, 0.02)).changed


def test_in_shadow_the_accepted_gain_comes_on_top_of_the_vehicles_own():
    credits = tuple(Credit(number, 1.0, 0.8, None, acting=False) for number in (1, 2, 3))
    first, second, third = to_make_up(np.array([0.8, math.nan]), credits, {1: Given(0.8, 0.01)}, idle=[3])
    assert first.went_by == pytest.approx(0.64)
    assert (first.name, first.passed) == ("thruster 1 made up for twice", False)
    assert first.words == "will be asked as if it gave 64 % of its curve; in this dive it gave 80 ± 1 %"
    assert (second.went_by, second.name, second.passed) == (0.8, "thruster 2 not known in shadow", False)
    assert third.passed is None  # no axis of the feed-forward needs it


def test_a_strong_thruster_is_made_up_for_twice_above_its_gain():
    strong = Credit(1, 1.0, 1.2, 1.0, acting=False)
    assert MadeUp(strong, 1.44).twice
    assert MadeUp(strong, 1.0).unmended


def test_thrusters_of_which_a_dive_tells_nothing_are_left_out():
    credits = (Credit(1, 1.0, 0.8, None, acting=False), Credit(2, 0.9, 0.8, None, acting=False))
    (second,) = made_up(np.array([math.nan, 0.72]), credits)
    assert second.once
    assert made_up(None, credits) == ()


def dive(sha256, unix_s, name="d"):
    time_s = np.array([60.0, 61.0])
    return Dive(name, Path("d"), sha256, depth=Signal(time_s, np.zeros((2, 1))), unix_at_boot_s=unix_s)


def test_the_next_dives_are_those_after_the_one_that_was_diagnosed():
    first = dive("a", 1_790_000_000.0)
    foretelling = Foretelling("v", "c", "d", "a", began(first), ())
    assert foretelling.dived == "2026-09-21T14:14:20Z"
    assert not is_next(first, foretelling)
    assert not is_next(dive("a", None), foretelling)
    assert not is_next(dive("b", 1_789_999_990.0), foretelling)
    assert is_next(dive("b", 1_790_000_010.0), foretelling)
    assert is_next(dive("b", None, "2026-09-22T0900Z-x"), foretelling)
    assert not is_next(dive("b", None, "2026-09-20T0900Z-x"), foretelling)
    assert is_next(dive("b", None), foretelling)
