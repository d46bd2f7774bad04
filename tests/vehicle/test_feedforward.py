import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.vehicle.feedforward import LEAD_SHARE, Lead, Mode, feedforward
from bridge.vehicle.references import Reference

GOOD = {"M_u": 96.4, "D_u": 42.13, "M_v": 112.0, "D_v": 53.0, "I_r": 16.0, "D_r": 26.07}
REFERENCE = Reference((0.4, -0.2, 0.1, 0.0, 0.0, 0.15), (0.1, 0.05, 0.2, 0.0, 0.0, -0.03), 0.0, 0.6)
REACH = (100.0,) * 6


def test_the_wrench_is_mass_times_acceleration_plus_damping_times_velocity_with_the_inertia_in_yaw() -> None:
    term = feedforward(GOOD, REFERENCE, REACH)
    wanted = (96.4 * 0.1 + 42.13 * 0.4, 112.0 * 0.05 - 53.0 * 0.2, 0.0, 0.0, 0.0, -16.0 * 0.03 + 26.07 * 0.15)
    assert term.tau == pytest.approx(wanted)
    assert term.faults == ()


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, -5.0, 1e9, None])
@pytest.mark.parametrize(
    ("name", "dof", "word"), [("M_u", 0, "surge"), ("D_v", 1, "sway"), ("I_r", 5, "yaw")]
)
def test_a_coefficient_that_is_no_good_turns_its_axis_off_with_a_text_and_leaves_the_others(
    name: str, dof: int, word: str, value: float | None
) -> None:
    bad = {k: v for k, v in GOOD.items() if k != name} | ({} if value is None else {name: value})
    term, whole = feedforward(bad, REFERENCE, REACH), feedforward(GOOD, REFERENCE, REACH)
    assert term.tau[dof] == 0.0
    assert [term.tau[i] for i in range(6) if i != dof] == [whole.tau[i] for i in range(6) if i != dof]
    assert len(term.faults) == 1
    assert word in term.faults[0]
    assert name in term.faults[0]
    assert len(term.faults[0]) <= 50


def test_a_reference_that_is_not_finite_gives_zero() -> None:
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
def test_whatever_comes_in_the_wrench_is_finite_and_within_reach(coefficients, nu, nu_dot) -> None:  # type: ignore[no-untyped-def]
    term = feedforward(coefficients, Reference(nu, nu_dot, 0.0, 0.6), (30.0, 20.0, 0.0, 0.0, 0.0, 5.0))
    assert all(math.isfinite(force) for force in term.tau)
    assert abs(term.tau[0]) <= 30.0
    assert abs(term.tau[1]) <= 20.0
    assert abs(term.tau[5]) <= 5.0


@pytest.mark.parametrize(
    ("mode", "ff", "pid"), [(0, False, True), (1, False, True), (2, True, False), (3, True, True)]
)
def test_the_modes_say_what_is_applied(mode: int, ff: bool, pid: bool) -> None:
    assert (Mode(mode).applies_feedforward, Mode(mode).applies_pid) == (ff, pid)


def surge(force: float) -> tuple[float, float, float, float, float, float]:
    return (force, 0.0, 0.0, 0.0, 0.0, 0.0)


def test_through_lag_and_hold_a_led_ramp_arrives_as_it_was_wanted() -> None:
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


def test_a_wrench_that_jumps_is_not_kicked_further_than_a_tenth_of_the_reach() -> None:
    lead = Lead(0.075, REACH)
    lead.step(surge(-5.0), 0.05)
    assert lead.step(surge(80.0), 0.05)[0] == pytest.approx(80.0 + LEAD_SHARE * 100.0)
    assert lead.step(surge(-80.0), 0.05)[0] == pytest.approx(-80.0 - LEAD_SHARE * 100.0)


def test_a_wrench_that_rests_and_one_just_begun_are_not_led() -> None:
    lead = Lead(0.075, REACH)
    assert lead.step(surge(7.0), 0.05) == surge(7.0)
    assert lead.step(surge(7.0), 0.05) == surge(7.0)
    lead.reset()
    assert lead.step(surge(9.0), 0.05) == surge(9.0)
    assert lead.step(surge(11.0), 0.0) == surge(11.0)
