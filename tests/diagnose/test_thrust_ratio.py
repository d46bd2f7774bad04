"""The ratio of thrust given to thrust asked, and the gain that the feed-forward takes of it."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.integrate import quad
from soak import rest_in_soak

from bridge.vehicle.config import load_vehicle
from identify.challenge.case import Case, dive_of, draw_case
from identify.challenge.scenario import Planted, Scenario
from identify.diagnose import feedforward_gain as module
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.feedforward_gain import feedforward_gain, feedforward_gain_by
from identify.diagnose.gap.missing import Missing
from identify.diagnose.lateness import lateness_of
from identify.diagnose.result import NOTHING, Diagnosis, Finding, Gap, Value
from identify.diagnose.simulators.comparison import Against, against, plain
from identify.diagnose.simulators.thrust_ratio import thrust_ratio
from identify.diagnose.words.against import difference_lines, thrust_sentences
from identify.effects.actuators import COMMAND_DELAY, DEAD_ZONE, THRUST_GAIN
from identify.effects.environment import STEADY_CURRENT
from identify.effects.hydrodynamics import QUADRATIC_DRAG
from identify.effects.library import library
from identify.effects.sensors import DVL_SCALE
from identify.estimators.likelihood.axis import DISTURBANCE, TIME_CONSTANT
from identify.statistics import birge_mean

FILE = load_vehicle("ruvifist:hovering")
HULL = {
    "M_u": 100.0,
    "D_u": 40.0,
    "M_v": 120.0,
    "D_v": 60.0,
    "M_w": 150.0,
    "D_w": 90.0,
    "I_r": 9.0,
    "D_r": 20.0,
}


def known(value: float, share: float = 0.01, unit: str = "kg") -> Value:
    """A value with an interval of that standard error."""
    reach = math.exp(1.959963984540054 * share)
    return Value(value, unit, value / reach, value * reach)


def diagnosis(late: Value | None = None, times: float = 1.0, **numbers: float) -> Diagnosis:
    gap = Gap(4.0, (), (), {}, (), (), ())
    values = {name: known(times * value) for name, value in (HULL | numbers).items()}
    return Diagnosis(
        "dive", "ruvifist", "hovering", "no_gap", gap, (), (), None, None, None, None, (), 1.0, None, NOTHING, values,
        late=late,
    )  # fmt: skip


def seconds(value: float, std: float) -> Value:
    return Value(value, "s", value - 1.96 * std, value + 1.96 * std)


def test_masses_and_drags_all_larger_alike_are_less_thrust():
    ratio = thrust_ratio(diagnosis(), diagnosis(times=1.25))
    assert ratio.differs
    assert ratio.whole.value == pytest.approx(0.8)
    assert {dof: value.value for dof, value in ratio.by_axis.items()} == pytest.approx(
        dict.fromkeys(("surge", "sway", "heave", "yaw"), 0.8)
    )
    # A mass and a drag in both recordings, each known to 1 %; four axes.
    std = math.log(ratio.by_axis["surge"].high95 / 0.8) / 1.96
    assert std == pytest.approx(0.01, rel=1e-3)
    assert math.log(ratio.whole.high95 / 0.8) / 1.96 == pytest.approx(0.005, rel=1e-3)


def test_roll_and_pitch_may_go_by_the_thrust_or_by_the_righting_moment_that_stays():
    ratio = thrust_ratio(diagnosis(), diagnosis(times=1.25))
    for dof in (3, 4):
        assert ratio.at(dof).low95 < ratio.whole.value < ratio.at(dof).value < ratio.at(dof).high95 == 1.0
    alike = thrust_ratio(diagnosis(), diagnosis())
    assert alike.at(3) == Value(1.0, "1", 1.0, 1.0)


def test_masses_that_are_larger_where_drags_are_not_are_no_other_thrust():
    heavier = {name: 1.2 * value for name, value in HULL.items() if name.startswith("M")}
    ratio = thrust_ratio(diagnosis(), diagnosis(**heavier))
    assert not ratio.differs
    assert ratio.by_axis["surge"].low95 < 1.0 / 1.2 < 1.0 < ratio.by_axis["surge"].high95


def test_one_axis_that_is_far_off_hardly_moves_the_ratio_of_the_whole():
    weak = {"I_r": 2 * 1.25 * 9.0, "D_r": 2 * 1.25 * 20.0}
    vehicle = diagnosis(**({name: 1.25 * value for name, value in HULL.items()} | weak))
    ratio = thrust_ratio(diagnosis(), vehicle)
    assert ratio.by_axis["yaw"].value == pytest.approx(0.4)
    assert ratio.whole.value == pytest.approx(0.8, rel=0.03)


def test_errors_that_a_mass_and_a_drag_share_are_counted_once():
    alone = thrust_ratio(diagnosis(), diagnosis(times=1.25)).by_axis["sway"]
    shared = replace(diagnosis(times=1.25), correlation={frozenset(("M_v", "D_v")): 0.98})
    both = thrust_ratio(diagnosis(), shared).by_axis["sway"]
    assert both.high95 - both.low95 > 1.15 * (alone.high95 - alone.low95)


def test_a_number_that_reaches_zero_tells_no_thrust():
    vehicle = diagnosis()
    loose = {**vehicle.numbers, "D_u": Value(40.0, "N/(m/s)", 0.0, 90.0)}
    ratio = thrust_ratio(diagnosis(M_u=90.0), replace(vehicle, numbers=loose))
    assert ratio.by_axis["surge"].value == pytest.approx(0.9)


@pytest.mark.parametrize(
    ("vehicle_s", "std", "is_later"), [(0.17, 0.01, True), (0.17, 0.06, False), (0.021, 0.0001, False)]
)
def test_a_delay_counts_beyond_three_standard_errors_and_five_milliseconds(vehicle_s, std, is_later):
    ratio = thrust_ratio(diagnosis(seconds(0.02, std)), diagnosis(seconds(vehicle_s, std)))
    assert ratio.later.value == pytest.approx(vehicle_s - 0.02)
    assert ratio.later.high95 - ratio.later.value == pytest.approx(1.96 * math.sqrt(2) * std, rel=1e-3)
    assert ratio.is_later is is_later


def test_a_recording_that_does_not_tell_its_delay_gives_none():
    assert thrust_ratio(diagnosis(), diagnosis(seconds(0.1, 0.01))).later is None


def test_values_that_disagree_beyond_their_errors_widen_the_error_of_their_mean():
    agreeing = birge_mean(np.array([1.0, 1.01]), np.diag([1e-4, 1e-4]))
    assert agreeing == pytest.approx((1.005, math.sqrt(0.5e-4)))
    mean, std = birge_mean(np.array([1.0, 1.2]), np.diag([1e-4, 1e-4]))
    # Squares sum to 200 where 1 is expected.
    assert (mean, std) == pytest.approx((1.1, math.sqrt(200 * 0.5e-4)))


def with_other_thrust(case: Case, gain: float, delay_s: float, north: float, east: float) -> Case:
    """The same vehicle and mission with other thrust, later, in a current; its noise is another."""

    def apply(scenario: Scenario, rng: np.random.Generator) -> None:
        rng.standard_normal(7)
        late = np.full_like(scenario.prop.delay, delay_s)
        scenario.prop = scenario.prop._replace(way=gain * scenario.prop.way, delay=late)
        scenario.moving_water()[:, :2] += north, east

    return replace(case, planted=(Planted("thrust_gain", {}, apply, 1.0),))


FEW = (COMMAND_DELAY, STEADY_CURRENT, THRUST_GAIN, DEAD_ZONE, QUADRATIC_DRAG)


@pytest.fixture(scope="module", params=rest_in_soak([FEW, None]), ids=["few effects", "all effects"])
def comparison(request: pytest.FixtureRequest) -> Against:
    simulator = draw_case(1, names=[], seconds=120.0)
    vehicle = with_other_thrust(simulator, gain=0.8, delay_s=0.15, north=0.08, east=0.05)
    return against(
        dive_of(vehicle),
        dive_of(simulator),
        simulator.file,
        simulator.file,
        simulator.configuration,
        effects=request.param,
        progress=lambda *_: None,
    )


def test_planted_thrust_and_delay_are_told_first_with_their_intervals(comparison: Against):
    thrust = comparison.thrust
    assert thrust.whole.low95 < 0.8 < thrust.whole.high95
    assert thrust.whole.high95 - thrust.whole.low95 < 0.05
    assert {"surge", "sway", "yaw"} <= set(thrust.by_axis)
    assert thrust.by_axis["surge"].value == pytest.approx(0.8, abs=0.04)
    assert thrust.by_axis["yaw"].low95 < 0.8 < thrust.by_axis["yaw"].high95
    assert thrust.later.low95 < 0.15 < thrust.later.high95
    assert thrust.later.value == pytest.approx(0.15, abs=0.01)
    first, second = thrust_sentences(comparison)
    assert first.startswith("The vehicle's thrust is 0.80")
    assert "by axis: surge 0.8" in first
    assert second.startswith("It comes 15")
    assert " ms later than the simulator's (95 %: " in second


def test_after_the_thrust_no_mass_or_drag_is_left_to_change_and_the_current_is(comparison: Against):
    assert comparison.differences == ()
    assert [finding.name for finding in comparison.lacks] == ["command_delay", "steady_current"]
    assert [finding.name for finding in comparison.stories] == ["thrust_gain"]
    order = sorted(comparison.lacks, key=lambda each: -each.gain_nats)
    assert [line.partition(",")[0].lower().replace(" ", "_") for line in difference_lines(comparison)] == [
        finding.name for finding in order
    ]
    data = plain(comparison)["against"]["thrust"]
    assert data["differs"] is True
    assert data["ratio"]["value"] == comparison.thrust.whole.value
    assert data["by_axis"]["yaw"]["unit"] == "1"
    assert data["later"]["value"] == comparison.thrust.later.value


def test_lateness_holds_the_delay_that_was_found_and_what_the_fit_still_asks_for(
    monkeypatch: pytest.MonkeyPatch,
):
    class Test:
        def __init__(self, size: float, score: float) -> None:
            self.late = self
            self.size, self.score = size, score

    class Now:
        feedback_unrecorded = frozenset({2})
        joint = theta = None

    tests = {0: Test(0.01, 2.0), 5: Test(0.01, 2.0), 2: Test(9.0, 90.0), 1: Test(0.0, 0.0)}
    monkeypatch.setattr("identify.diagnose.lateness.doubts_of", lambda *_: tests)
    late = lateness_of((), Now())
    assert late.value == pytest.approx(0.01)
    assert late.high95 - late.value == pytest.approx(1.96 * 0.005 / math.sqrt(2), rel=1e-3)
    effect = next(
        each for each in library(FILE.vehicle.configurations["hovering"], 0.03) if each.name == "thruster_lag"
    )
    cause = Cause(effect, np.array([0.13]))
    lag = Finding(cause, (), {}, 0.99, {"time_constant": Value(0.13, "s", 0.11, 0.15)}, 50.0)
    assert lateness_of((lag,), Now()).value == pytest.approx(0.1 + 0.01)
    monkeypatch.setattr("identify.diagnose.lateness.doubts_of", lambda *_: {1: tests[1]})
    assert lateness_of((), Now()) is None


def test_a_steady_force_leaves_an_error_that_grows_to_the_force_over_the_braking_or_without_end():
    force, since_s = np.full(40, 3.0), 0.5 * np.arange(1, 41)
    braked = module._error(force, 20.0, np.full(40, 6.0), 0.5)
    np.testing.assert_allclose(braked, 0.5 * (1.0 - np.exp(-0.3 * since_s)))
    np.testing.assert_allclose(module._error(force, 20.0, np.zeros(40), 0.5), 0.15 * since_s)


def test_at_the_beginning_of_each_run_no_error_is_known():
    force, braking = np.full(40, 3.0), np.full(40, 6.0)
    once = module._error(force[:20], 20.0, braking[:20], 0.5)
    square = module._mean_square(force, 20.0, braking, 0.5, [slice(0, 20), slice(20, 40)])
    assert square == pytest.approx(np.mean(once**2))


def fit(rise_s, std_n=4.0, memory_s=5.0):
    """A fit of surge and sway alike, of 20 kg, seen each half second."""
    theta = np.zeros(5)
    theta[[DISTURBANCE, TIME_CONSTANT]] = np.log([std_n, memory_s])
    problems = tuple(
        SimpleNamespace(axis=SimpleNamespace(dof=dof), rise_s=lambda _: rise_s) for dof in (0, 1)
    )
    course = SimpleNamespace(mass=np.full(6, 20.0), step_s=0.5 / module.EACH)
    joint = SimpleNamespace(problems=problems, slices=(slice(0, 5), slice(5, 10)))
    return SimpleNamespace(joint=joint, theta=np.tile(theta, 2), course=course)


@pytest.mark.parametrize("rise_s", [0.0, 1.5])
def test_a_disturbance_moves_a_braked_vehicle_by_the_integral_of_its_spectrum(rise_s):
    """Of a force d of 4 N with r T d'' + T d' + d = white noise, T = 5 s and r = `rise_s`."""
    memory_s, mass, braking = 5.0, 20.0, 6.0

    def spectrum(rate):
        return 1.0 / ((1.0 - rise_s * memory_s * rate**2) ** 2 + (memory_s * rate) ** 2)

    whole, _ = quad(spectrum, 0.0, np.inf)
    moved, _ = quad(lambda rate: spectrum(rate) / (braking**2 + (mass * rate) ** 2), 0.0, np.inf)
    assert module._driven(fit(rise_s), 1, braking) == pytest.approx(4.0**2 * moved / whole, rel=1e-6)


def test_nothing_is_known_of_a_disturbance_without_braking_or_of_an_axis_that_is_not_fitted():
    assert module._driven(fit(0.0), 0, 0.0) == module._driven(fit(0.0), 2, 6.0) == 0.0


def test_a_feed_forward_leaves_the_missing_force_before_and_its_rest_after_beside_the_disturbance():
    now, time_s, braking = fit(0.0), 0.5 * np.arange(40), np.full((40, 6), 6.0)
    wrench = np.zeros((40, 6))
    wrench[:, 0] = 3.0
    missing = Missing(time_s, wrench, 0.0 * wrench, 0.0 * wrench)
    gain = feedforward_gain_by(0.5 * wrench, missing, now, braking)
    noise = 2.0 * module._driven(now, 0, 6.0)
    square = np.mean(module._error(wrench[:, 0], 20.0, braking[:, 0], 0.5) ** 2)
    assert (gain.before_m_s, gain.after_m_s) == pytest.approx(
        (np.sqrt(square + noise), np.sqrt(square / 4 + noise))
    )


def test_no_feed_forward_makes_up_for_a_wrong_reading_or_for_a_force_that_it_does_not_know(nominal):
    count = len(nominal.course.time_s[:: module.EACH])
    missing = Missing(nominal.course.time_s[:: module.EACH], *np.zeros((3, count, 6)))
    for effect, is_known in (
        (DVL_SCALE, False), (replace(DVL_SCALE, feedforward=QUADRATIC_DRAG.feedforward), False),
        (QUADRATIC_DRAG, True), (replace(QUADRATIC_DRAG, feedforward=""), False),
    ):  # fmt: skip
        cause = Cause(effect, np.full(len(effect.parameters), 1.5))
        gain = feedforward_gain(cause, (), missing, nominal, np.full((count, 6), 6.0))
        assert (gain is not None) is is_known
