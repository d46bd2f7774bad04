"""Where a gap lies, in words: by shares of it, at their exact bounds."""

from types import SimpleNamespace

import pytest

from identify.diagnose.result import Disturbance, Gap, Share, Slice
from identify.diagnose.words.gap import (
    disturbance_words,
    drifts_elsewhere,
    gap_sentence,
    strength,
    where_line,
    where_sentence,
)

STEADY, TURNING = "steady", "turning"


def gap_of(*where, by_speed=(), drifted=(), before=2.0):
    """A gap of shares by degree of freedom and phase; by_speed: of surge's from a speed on, each 0.1 m/s wide."""
    slices = [Slice("surge", "speed", low, low + 0.1, share) for low, share in by_speed]
    slices += [Slice("surge", "time", 0.0, 9.0, 1.0), Slice("yaw", "speed", 0.0, 0.1, 1.0)]
    shares, drifts = ([Share(*each) for each in parts] for parts in (where, drifted))
    return Gap(before, (), (), {}, tuple(shares), tuple(slices), (), (), tuple(drifts))


@pytest.mark.parametrize(
    ("where", "said"),
    [
        ([("surge", STEADY, 0.95), ("yaw", TURNING, 0.05)], "all of it lies in surge, steady"),
        ([("surge", STEADY, 0.94), ("yaw", TURNING, 0.06)], "most of it lies in surge, steady"),
        ([("yaw", TURNING, 0.5), ("surge", STEADY, 0.49)], "the largest part of it lies in yaw, turning"),
        ([("yaw", TURNING, 0.4), ("surge", STEADY, 0.35)], "the largest part of it lies in yaw, turning"),
        (
            [("yaw", TURNING, 0.39), ("surge", STEADY, 0.31), ("surge", TURNING, 0.3)],
            "most of it lies in surge, most of that steady",
        ),
        (
            [
                ("yaw", TURNING, 0.2),
                ("surge", TURNING, 0.25),
                ("surge", STEADY, 0.125),
                ("surge", "rest", 0.125),
            ],
            "the largest part of it lies in surge, the largest part of that turning",
        ),
        ([], "no degree of freedom was compared"),
    ],
)
def test_the_largest_degree_of_freedom_is_named_with_its_phase_and_how_much_lies_there(where, said):
    assert where_sentence(gap_of(*where)) == said


@pytest.mark.parametrize(
    ("by_speed", "above"),
    [
        ([(0.0, 0.25), (0.1, 0.25), (0.2, 0.5)], ", mostly above 0.10 m/s"),
        ([(0.0, 0.26), (0.1, 0.24), (0.2, 0.5)], ""),
        ([(0.0, 0.1), (0.1, 0.1), (0.2, 0.8)], ", mostly above 0.20 m/s"),
        # That is rest.
        ([(-0.1, 0.1), (0.019, 0.9)], ""),
        ([(-0.1, 0.1), (0.02, 0.9)], ", mostly above 0.02 m/s"),
        ([(0.0, 0.0), (0.1, 0.0)], ""),
    ],
)
def test_a_speed_is_named_above_which_three_quarters_lie(by_speed, above):
    gap = gap_of(("surge", STEADY, 1.0), by_speed=by_speed)
    assert where_sentence(gap, "the gap") == f"all of the gap lies in surge, steady{above}"


@pytest.mark.parametrize(
    ("drifted", "before", "elsewhere"),
    [
        ([("surge", STEADY, 0.4), ("yaw", STEADY, 0.35), ("yaw", TURNING, 0.25)], 1.21, "yaw"),
        ([("surge", STEADY, 0.6), ("yaw", STEADY, 0.4)], 2.0, ""),
        # Within noise, or not compared.
        ([("yaw", STEADY, 1.0)], 1.2, ""),
        ([], 2.0, ""),
    ],
)
def test_a_drift_beyond_noise_that_is_mostly_in_another_degree_of_freedom_is_told(drifted, before, elsewhere):
    gap = gap_of(("surge", STEADY, 1.0), drifted=drifted, before=before)
    assert drifts_elsewhere(gap) == elsewhere
    assert gap_sentence(gap).endswith(
        "while most of the drift in the fitted dive is in yaw" if elsewhere else "in surge, steady"
    )


def test_three_parts_are_listed_of_those_that_hold_a_fiftieth():
    parts = [("surge", STEADY, 0.02), ("yaw", TURNING, 0.9), ("sway", STEADY, 0.019), ("heave", "rest", 0.0)]
    assert where_line(SimpleNamespace(gap=gap_of(*parts))) == "yaw, turning; surge, steady"
    assert where_line(SimpleNamespace(gap=gap_of(*parts)), most=1) == "yaw, turning"
    parts = [("surge", STEADY, 0.3), ("yaw", TURNING, 0.3), ("sway", STEADY, 0.2), ("heave", "rest", 0.2)]
    assert where_line(SimpleNamespace(gap=gap_of(*parts))) == "surge, steady; yaw, turning; sway, steady"


def test_a_force_goes_closely_with_a_variable_from_four_tenths_on_and_hardly_below_one_tenth():
    assert [strength(share) for share in (0.4, 0.39, 0.1, 0.09)] == [
        "closely",
        "in part",
        "in part",
        "hardly",
    ]


def test_a_disturbance_is_told_beside_the_thrust_or_beside_what_the_motion_takes_where_nothing_pushes():
    assert disturbance_words(Disturbance("surge", 3.14, 0.62, True)) == (
        "3.1 N, 62 % of the variance of the thrusters' force"
    )
    assert disturbance_words(Disturbance("roll", 0.2, 1.0, False, pushed=False)) == (
        "0.20 N m, over 99 % of the variance of the force that the motion takes"
    )
