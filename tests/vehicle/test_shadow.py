"""The model is held against the force that the PID had to give, by the balance of momentum over a minute."""

import math

import pytest

from bridge.vehicle.references import Six
from bridge.vehicle.shadow import NONE_FLOWN, Shadow

TRUE = {"M_u": 100.0, "D_u": 50.0, "M_v": 110.0, "D_v": 60.0, "I_r": 16.0, "D_r": 26.0}
REACH = (130.0, 90.0, 160.0, 32.0, 24.0, 80.0)
TICK_S = 0.05


def six(u: float = 0.0, v: float = 0.0, r: float = 0.0) -> Six:
    return (u, v, 0.0, 0.0, 0.0, r)


def fly(
    shadow: Shadow,
    seconds: float,
    surge: float = 1.0,
    yaw: float = 1.0,
    ahead: float = 0.3,
    turn: float = 0.0,
    extra_n: float = 0.0,
) -> None:
    """Surge and yaw swing; what moves the vehicle is `surge` and `yaw` times its model, and a force beside it."""
    for tick in range(round(seconds / TICK_S)):
        phase = 0.5 * tick * TICK_S
        u, du = ahead * (1 - math.cos(phase)), ahead * 0.5 * math.sin(phase)
        r, dr = turn * (1 - math.cos(phase)), turn * 0.5 * math.sin(phase)
        forces = six(TRUE["M_u"] * du + TRUE["D_u"] * u, 0.0, TRUE["I_r"] * dr + TRUE["D_r"] * r)
        given = six(surge * forces[0] + extra_n, 0.0, yaw * forces[5])
        shadow.step(TICK_S, TRUE, {}, given, forces, six(u, 0.0, r))


def test_a_minute_in_which_the_model_tells_the_force_is_good() -> None:
    shadow = Shadow(REACH)
    assert shadow.fault == NONE_FLOWN
    fly(shadow, 62.0)
    assert shadow.fault == ""


@pytest.mark.parametrize("seconds", [0.1, 13.0, 59.0])
def test_less_than_a_minute_is_told_as_such(seconds: float) -> None:
    shadow = Shadow(REACH)
    fly(shadow, seconds)
    assert shadow.fault == f"shadow: {2 * (seconds // 2):.0f} of 60 s flown"


@pytest.mark.parametrize(
    ("share", "good"), [(0.5, False), (0.7, True), (1.5, True), (2.0, True), (2.5, False)]
)
def test_a_force_of_another_size_than_the_models_is_not_explained(share: float, good: bool) -> None:
    shadow = Shadow(REACH)
    fly(shadow, 62.0, surge=share)
    explained = 1 - (1 - 1 / share) ** 2
    words = f"shadow: {max(100 * explained, 0):.0f} % of surge explained, needs 70"
    assert shadow.fault == ("" if good else words)
    assert len(words) <= 50


def test_a_current_that_the_model_knows_nothing_of_is_told() -> None:
    shadow = Shadow(REACH)
    fly(shadow, 62.0, extra_n=40.0)
    assert "of surge explained, needs 70" in shadow.fault


def test_one_axis_that_is_wrong_spoils_it_and_one_that_was_not_moved_does_not() -> None:
    both, ahead = Shadow(REACH), Shadow(REACH)
    fly(both, 62.0, yaw=3.0, turn=0.3)
    fly(ahead, 62.0, yaw=3.0, turn=0.0)
    assert both.fault == "shadow: 56 % of yaw explained, needs 70"
    assert ahead.fault == ""


def test_a_vehicle_that_lay_still_has_shown_nothing() -> None:
    shadow = Shadow(REACH)
    fly(shadow, 62.0, ahead=0.0)
    assert shadow.fault == "shadow: no axis moved for 10 of 60 s"
    fly(shadow, 50.0, ahead=0.0)
    fly(shadow, 20.0)
    assert shadow.fault == ""


def test_only_the_last_minute_counts() -> None:
    shadow = Shadow(REACH)
    fly(shadow, 30.0, surge=3.0)
    fly(shadow, 40.0)
    assert "of surge explained" in shadow.fault
    fly(shadow, 22.0)
    assert shadow.fault == ""


def test_what_broke_it_is_told_until_a_minute_has_been_flown_since() -> None:
    shadow = Shadow(REACH)
    fly(shadow, 62.0)
    shadow.begin_anew("thrust at a limit")
    assert shadow.fault == "shadow: 0 of 60 s flown since thrust at a limit"
    fly(shadow, 13.0)
    assert shadow.fault == "shadow: 12 of 60 s flown since thrust at a limit"
    fly(shadow, 50.0)
    assert shadow.fault == ""


def test_a_reading_that_is_no_number_begins_it_anew() -> None:
    shadow = Shadow(REACH)
    fly(shadow, 62.0)
    shadow.step(TICK_S, TRUE, {}, six(1.0), six(1.0), six(math.nan))
    assert shadow.fault == "shadow: 0 of 60 s flown since a bad reading"


def test_a_pause_keeps_what_was_seen_and_takes_no_change_of_velocity_across() -> None:
    shadow = Shadow(REACH)
    fly(shadow, 62.0)
    shadow.pause()
    assert shadow.fault == ""
    fly(shadow, 62.0)
    assert shadow.fault == ""


def test_a_loop_that_stood_still_tells_nothing_of_the_time_between() -> None:
    shadow = Shadow(REACH)
    fly(shadow, 58.0)
    shadow.step(30.0, TRUE, {}, six(900.0), six(), six())
    fly(shadow, 6.0)
    assert shadow.fault == ""
