"""The feed-forward, and the model that is held against the PID's force over a minute."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.vehicle.feedforward import Lead, Slope, feedforward
from bridge.vehicle.mode import Mode
from bridge.vehicle.references import Reference, Six
from bridge.vehicle.shadow import NONE_FLOWN, Shadow

GOOD = {"M_u": 96.4, "D_u": 42.13, "M_v": 112.0, "D_v": 53.0, "I_r": 16.0, "D_r": 26.07}
REFERENCE = Reference((0.4, -0.2, 0.1, 0.0, 0.0, 0.15), (0.1, 0.05, 0.2, 0.0, 0.0, -0.03), 0.0, 0.6)
REACH = (100.0,) * 6


def test_the_wrench_is_mass_times_acceleration_plus_damping_times_velocity_with_the_inertia_in_yaw():
    term = feedforward(GOOD, REFERENCE, REACH)
    wanted = (96.4 * 0.1 + 42.13 * 0.4, 112.0 * 0.05 - 53.0 * 0.2, 0.0, 0.0, 0.0, -16.0 * 0.03 + 26.07 * 0.15)
    assert term.tau == pytest.approx(wanted)
    assert term.faults == ()


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, -5.0, 1e9, None])
@pytest.mark.parametrize(
    ("name", "dof", "word"), [("M_u", 0, "surge"), ("D_v", 1, "sway"), ("I_r", 5, "yaw")]
)
def test_a_coefficient_that_is_no_good_turns_its_axis_off_with_a_text_and_leaves_the_others(
    name, dof, word, value
):
    bad = {k: v for k, v in GOOD.items() if k != name} | ({} if value is None else {name: value})
    term, whole = feedforward(bad, REFERENCE, REACH), feedforward(GOOD, REFERENCE, REACH)
    assert term.tau[dof] == 0.0
    assert [term.tau[i] for i in range(6) if i != dof] == [whole.tau[i] for i in range(6) if i != dof]
    assert len(term.faults) == 1
    assert word in term.faults[0]
    assert name in term.faults[0]
    assert len(term.faults[0]) <= 50


def test_a_hull_with_quadratic_damping_alone_needs_no_linear_one():
    bare = {name: value for name, value in GOOD.items() if name != "D_u"}
    term = feedforward(bare, REFERENCE, REACH, {"X_uu": 60.0})
    speed = REFERENCE.nu[0]
    assert term.faults == ()
    assert term.tau[0] == pytest.approx(GOOD["M_u"] * REFERENCE.nu_dot[0] + 60.0 * abs(speed) * speed)
    assert feedforward(bare, REFERENCE, REACH, {"Y_vv": 60.0}).off == (0,)


def test_a_reference_that_is_not_finite_gives_zero():
    broken = Reference((math.nan, 0.1, 0, 0, 0, 0), (0.0,) * 6, 0.0, 0.6)
    term = feedforward(GOOD, broken, REACH)
    assert term.tau[0] == 0.0
    assert term.tau[1] == pytest.approx(5.3)
    assert "reference" in term.faults[0]


anything = st.floats(allow_nan=True, allow_infinity=True)


@given(
    st.dictionaries(st.sampled_from(sorted(GOOD)), anything),
    st.tuples(*[anything] * 6),
    st.tuples(*[anything] * 6),
)
@settings(max_examples=150)
def test_whatever_comes_in_the_wrench_is_finite_and_within_reach(coefficients, nu, nu_dot):
    term = feedforward(coefficients, Reference(nu, nu_dot, 0.0, 0.6), (30.0, 20.0, 0.0, 0.0, 0.0, 5.0))
    assert all(math.isfinite(force) for force in term.tau)
    assert abs(term.tau[0]) <= 30.0
    assert abs(term.tau[1]) <= 20.0
    assert abs(term.tau[5]) <= 5.0


def surge(force: float) -> tuple[float, float, float, float, float, float]:
    return (force, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_through_lag_and_hold_a_led_ramp_arrives_as_it_was_wanted():
    lag_s, tick_s, slope = 0.05, 0.05, 4.0
    lead, thrust, arrived = Lead(lag_s + tick_s / 2, REACH), 0.0, []
    for tick in range(40):
        asked = lead.step(surge(slope * tick * tick_s), tick_s)[0]
        # The mean of the thrust over the tick, and the thrust at its end.
        left = math.exp(-tick_s / lag_s)
        arrived.append(asked + (thrust - asked) * (1 - left) * lag_s / tick_s)
        thrust = asked + (thrust - asked) * left
    wanted = [slope * (tick + 0.5) * tick_s for tick in range(40)]
    assert arrived[20:] == pytest.approx(wanted[20:], abs=1e-6)


def test_a_wrench_that_jumps_is_not_kicked_further_than_a_tenth_of_the_reach():
    lead = Lead(0.075, REACH)
    lead.step(surge(-5.0), 0.05)
    assert lead.step(surge(80.0), 0.05)[0] == pytest.approx(80.0 + 10.0)
    assert lead.step(surge(-80.0), 0.05)[0] == pytest.approx(-80.0 - 10.0)


def test_a_wrench_that_rests_and_one_just_begun_are_not_led():
    lead = Lead(0.075, REACH)
    assert lead.step(surge(7.0), 0.05) == surge(7.0)
    assert lead.step(surge(7.0), 0.05) == surge(7.0)
    lead.reset()
    assert lead.step(surge(9.0), 0.05) == surge(9.0)
    assert lead.step(surge(11.0), 0.0) == surge(11.0)


NOTHING_OFF: tuple[int, ...] = ()


def test_the_applied_wrench_begins_at_zero_and_grows_to_the_whole_reach_in_half_a_second():
    slope = Slope(REACH)
    applied = [slope.step(surge(100.0), NOTHING_OFF, 0.05)[0] for _ in range(12)]
    assert applied == pytest.approx([10.0 * min(tick, 10) for tick in range(1, 13)])
    assert slope.step(surge(-100.0), NOTHING_OFF, 0.05)[0] == pytest.approx(90.0)


def test_a_wrench_that_grows_slowly_is_applied_as_it_is():
    slope = Slope(REACH)
    for tick in range(20):
        assert slope.step(surge(9.0 * tick), NOTHING_OFF, 0.05) == surge(min(9.0 * tick, 100.0))


def test_an_axis_that_is_off_is_at_zero_at_once_and_grows_from_there():
    slope = Slope(REACH)
    for _ in range(10):
        slope.step(surge(100.0), NOTHING_OFF, 0.05)
    assert slope.step(surge(100.0), (0,), 0.05)[0] == 0.0
    assert slope.step(surge(100.0), NOTHING_OFF, 0.05)[0] == pytest.approx(10.0)
    slope.reset()
    assert slope.step(surge(100.0), NOTHING_OFF, 0.05)[0] == pytest.approx(10.0)


@pytest.mark.parametrize(("dt_s", "grown"), [(3600.0, 20.0), (0.0, 0.0), (-1.0, 0.0)])
def test_a_loop_that_stood_still_or_a_clock_that_ran_back_is_no_reason_for_a_kick(dt_s, grown):
    assert Slope(REACH).step(surge(100.0), NOTHING_OFF, dt_s)[0] == pytest.approx(grown)


forces = st.tuples(*[st.floats(-1e9, 1e9)] * 6)


@given(st.lists(st.tuples(forces, st.sets(st.sampled_from([0, 1, 5])), st.floats(-1.0, 10.0)), max_size=30))
def test_whatever_is_wanted_size_and_slope_are_bounded(ticks):
    slope, before = Slope(REACH), (0.0,) * 6
    for wanted, off, dt_s in ticks:
        applied = slope.step(wanted, off, dt_s)
        for dof in range(6):
            assert abs(applied[dof]) <= REACH[dof]
            if dof in off:
                assert applied[dof] == 0.0
            else:
                assert abs(applied[dof] - before[dof]) <= 20.0 + 1e-9
        before = applied


@pytest.mark.parametrize(("before", "after"), [(0, 2), (0, 3), (1, 2), (1, 3), (3, 2)])
def test_these_changes_of_the_mode_and_no_others_leave_more_to_the_feed_forward(before, after):
    raising = {(a, b) for a in Mode for b in Mode if b.raises(a)}
    assert (Mode(before), Mode(after)) in raising
    assert len(raising) == 5


TRUE = {"M_u": 100.0, "D_u": 50.0, "M_v": 110.0, "D_v": 60.0, "I_r": 16.0, "D_r": 26.0}
SHADOWED_REACH = (130.0, 90.0, 160.0, 32.0, 24.0, 80.0)
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


@pytest.fixture
def shadow() -> Shadow:
    return Shadow(SHADOWED_REACH)


def test_a_minute_in_which_the_model_tells_the_force_is_good(shadow):
    assert shadow.fault == NONE_FLOWN
    fly(shadow, 62.0)
    assert shadow.fault == ""


@pytest.mark.parametrize("seconds", [0.1, 13.0, 59.0])
def test_less_than_a_minute_is_told_as_such(shadow, seconds):
    fly(shadow, seconds)
    assert shadow.fault == f"shadow: {2 * (seconds // 2):.0f} of 60 s flown"


@pytest.mark.parametrize(
    ("share", "good"), [(0.5, False), (0.7, True), (1.5, True), (2.0, True), (2.5, False)]
)
def test_a_force_of_another_size_than_the_models_is_not_explained(shadow, share, good):
    fly(shadow, 62.0, surge=share)
    explained = 1 - (1 - 1 / share) ** 2
    words = f"shadow: {max(100 * explained, 0):.0f} % of surge explained, needs 70"
    assert shadow.fault == ("" if good else words)
    assert len(words) <= 50


def test_a_share_that_just_misses_is_not_rounded_to_what_is_needed(shadow):
    fly(shadow, 62.0, surge=2.22)  # 1 - (1 - 1 / 2.22)^2 is 0.698
    assert shadow.fault == "shadow: 69 % of surge explained, needs 70"


def test_a_current_that_the_model_knows_nothing_of_is_told(shadow):
    fly(shadow, 62.0, extra_n=40.0)
    assert "of surge explained, needs 70" in shadow.fault


def test_one_axis_that_is_wrong_spoils_it_and_one_that_was_not_moved_does_not():
    both, ahead = Shadow(SHADOWED_REACH), Shadow(SHADOWED_REACH)
    fly(both, 62.0, yaw=3.0, turn=0.3)
    fly(ahead, 62.0, yaw=3.0, turn=0.0)
    assert both.fault == "shadow: 55 % of yaw explained, needs 70"
    assert ahead.fault == ""


def test_a_vehicle_that_lay_still_has_shown_nothing(shadow):
    fly(shadow, 62.0, ahead=0.0)
    assert shadow.fault == "shadow: no axis moved for 10 of 60 s"
    fly(shadow, 50.0, ahead=0.0)
    fly(shadow, 20.0)
    assert shadow.fault == ""


def test_only_the_last_minute_counts(shadow):
    fly(shadow, 30.0, surge=3.0)
    fly(shadow, 40.0)
    assert "of surge explained" in shadow.fault
    fly(shadow, 22.0)
    assert shadow.fault == ""


def test_what_broke_it_is_told_until_a_minute_has_been_flown_since(shadow):
    fly(shadow, 62.0)
    shadow.begin_anew("thrust at a limit")
    assert shadow.fault == "shadow: 0 of 60 s flown since thrust at a limit"
    fly(shadow, 13.0)
    assert shadow.fault == "shadow: 12 of 60 s flown since thrust at a limit"
    fly(shadow, 50.0)
    assert shadow.fault == ""


def test_what_broke_it_is_told_once_a_tick_or_a_block_was_flown_and_of_several_the_last(shadow):
    shadow.begin_anew("a bad reading")
    assert shadow.fault == NONE_FLOWN
    fly(shadow, TICK_S)
    shadow.begin_anew("a bad reading")
    assert shadow.fault == "shadow: 0 of 60 s flown since a bad reading"
    shadow.begin_anew("thrust at a limit")
    assert shadow.fault == "shadow: 0 of 60 s flown since thrust at a limit"
    shadow.begin_anew()
    fly(shadow, 3.0)
    shadow.pause()
    shadow.begin_anew("a bad reading")
    assert shadow.fault == "shadow: 0 of 60 s flown since a bad reading"


def test_a_reading_that_is_no_number_begins_it_anew(shadow):
    fly(shadow, 62.0)
    shadow.step(TICK_S, TRUE, {}, six(1.0), six(1.0), six(math.nan))
    assert shadow.fault == "shadow: 0 of 60 s flown since a bad reading"


def test_a_pause_keeps_what_was_seen_and_takes_no_change_of_velocity_across(shadow):
    fly(shadow, 62.0)
    shadow.pause()
    assert shadow.fault == ""
    fly(shadow, 62.0)
    assert shadow.fault == ""


def test_a_loop_that_stood_still_tells_nothing_of_the_time_between(shadow):
    fly(shadow, 58.0)
    shadow.step(30.0, TRUE, {}, six(900.0), six(), six())
    fly(shadow, 6.0)
    assert shadow.fault == ""


@pytest.mark.parametrize(("tick_s", "flown_s"), [(0.25, 2), (0.26, 0), (0.0, 0)])
def test_a_tick_of_a_quarter_of_a_second_counts_and_a_longer_one_breaks_what_was_begun(
    shadow, tick_s, flown_s
):
    for _ in range(10):
        shadow.step(tick_s, TRUE, {}, six(25.0), six(25.0), six(0.5))
    assert shadow.fault == f"shadow: {flown_s} of 60 s flown"


def test_an_axis_moves_if_the_feed_forward_gives_a_twentieth_of_what_the_vehicle_can(shadow):
    fly(shadow, 62.0, ahead=0.04)
    assert shadow.fault == "shadow: no axis moved for 10 of 60 s"
    fly(shadow, 62.0, ahead=0.1)
    assert shadow.fault == ""


def test_an_axis_without_thrusters_is_not_moved_by_rounding():
    shadow = Shadow((0.0,) * 6)
    for _ in range(round(62.0 / TICK_S)):
        shadow.step(TICK_S, TRUE, {}, six(), six(5e-7), six())
    assert shadow.fault == "shadow: no axis moved for 10 of 60 s"
