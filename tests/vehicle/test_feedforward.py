import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.vehicle.feedforward import Mode, feedforward
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
