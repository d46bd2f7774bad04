"""Which causes are named: their forms and bounds, the choice among them, and how probable each is."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest
from fakes.planted import drawn_nominal, explained, planted_nominal

from bridge.vehicle.config import load_vehicle
from identify.challenge.case import draw_case
from identify.challenge.nearest_parameters import course_of
from identify.diagnose import findings
from identify.diagnose.accepted import known_with_causes, likely_accepted
from identify.diagnose.causes import candidates, search, selection
from identify.diagnose.causes import confidence as module
from identify.diagnose.causes.ambiguity import ambiguity_of
from identify.diagnose.causes.candidates import (
    Cause,
    companions,
    other_forms,
    other_variants,
    possible_forms,
    settings_of,
)
from identify.diagnose.causes.confidence import chi_squared, covariance_of, without_doubtful
from identify.diagnose.causes.requirement import remainder_nats
from identify.diagnose.causes.search import explained_by
from identify.diagnose.causes.weighing import Fitted
from identify.diagnose.filters.nominal import refitted
from identify.diagnose.findings import beside_thrust_gain, parameters_of, strongest_first, trials_of
from identify.diagnose.result import Disturbance, Finding, plain_effect
from identify.diagnose.verdict import next_of
from identify.diagnose.words.causes import name_of
from identify.effects.actuators import DEAD_ZONE, DEAD_ZONE_SHIFTED, SATURATION, weak
from identify.effects.effect import Effect
from identify.effects.environment import STEADY_CURRENT, waves
from identify.effects.hydrodynamics import COUPLED_DAMPING, MUNK_MOMENT, MUNK_MOMENT_IN_YAW, QUADRATIC_DRAG
from identify.effects.library import library
from identify.effects.rigid_body import CG_OFFSET, CG_OFFSET_IN_SPACE, NET_BUOYANCY, THRUST_BIAS
from identify.effects.sensors import DVL_BIAS, WRONG_FEEDBACK_LOG


def fit_of(gain: float, *effects: Effect) -> Fitted:
    causes = tuple(Cause(effect, effect.start()) for effect in effects)
    return Fitted(causes, (), np.zeros(0), np.zeros((0, 0)), np.zeros((0, 0)), 0.0, gain, 1.0, gain, gain)


@dataclass(frozen=True)
class Weighed:
    """Fits by the labels of their causes, whoever asks; no more of a weighing."""

    gains: Mapping[tuple[str, ...], float]
    library: tuple[Effect, ...]
    now: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(stamped_s=0.0, course=None))

    def fitted(self, causes: Sequence[Cause]) -> Fitted:
        labels = tuple(sorted(cause.effect.label for cause in causes))
        return replace(fit_of(self.gains[labels], *(cause.effect for cause in causes)), causes=tuple(causes))

    def candidates_with_fit(self, _fit: Fitted) -> None:
        return None

    def candidates_beyond_forms(self, _fit: Fitted) -> None:
        return None


@pytest.mark.parametrize(("share", "taken"), [(0.9, NET_BUOYANCY), (1.1, THRUST_BIAS)])
def test_a_weight_is_taken_for_a_push_in_any_direction_up_to_half_a_per_cent(
    share: float, taken: Effect
) -> None:
    best, less = 2000.0, share * 0.005 * 2000.0
    fits = [fit_of(best, THRUST_BIAS), fit_of(best - less, NET_BUOYANCY)]
    for some in (fits, fits[::-1]):
        fit = selection._simplest(some, fit_of(0.0))
        assert fit.causes[-1].effect is taken


def test_of_causes_of_several_numbers_the_best_is_taken() -> None:
    fit = selection._simplest([fit_of(2000.0, THRUST_BIAS), fit_of(1999.0, STEADY_CURRENT)], fit_of(0.0))
    assert fit.causes[-1].effect is THRUST_BIAS
    assert selection._simplest([], fit_of(0.0)) is None


@pytest.mark.parametrize("fewer", [1.0, 5.0])
def test_a_weight_is_taken_for_a_thruster_that_gives_nothing_at_all_when_it_does_nearly_as_well(
    fewer,
) -> None:
    """The fit of a thruster that would have to pull ends at none, and the best of eight such ends is chosen."""
    nothing, half = (
        replace(fit_of(gain, weak(7)), causes=(Cause(weak(7), np.array([size])),))
        for gain, size in ((100.0, 0.0), (100.0, 0.5))
    )
    weight, light = fit_of(100.0 - fewer, NET_BUOYANCY), fit_of(90.0, NET_BUOYANCY)
    for some in ([nothing, weight], [weight, nothing]):
        fit = selection._simplest(some, fit_of(0.0))
        assert fit.causes[-1].effect is NET_BUOYANCY
    assert selection._simplest([half, fit_of(95.0, NET_BUOYANCY)], fit_of(0.0)) is half
    assert selection._simplest([nothing, light], fit_of(0.0)) is nothing
    # Nor does either come back in a swap.
    for each, replaces in ((weight, True), (light, False)):
        assert selection._replaces(each, nothing, nothing.causes[0], fit_of(0.0)) is replaces
    assert not selection._replaces(nothing, weight, weight.causes[0], fit_of(0.0))
    assert selection._replaces(nothing, light, light.causes[0], fit_of(0.0))


def test_a_steady_push_may_leave_the_filters_as_likely_as_they_were() -> None:
    """They are fitted with trims, so that only the climb's own end tells them apart."""
    assert search._nats_uncertain(fit_of(5.0, NET_BUOYANCY), fit_of(0.0)) == pytest.approx(3.0)
    assert search._nats_uncertain(fit_of(254.0, NET_BUOYANCY), fit_of(0.0)) == pytest.approx(25.4)


def test_what_was_taken_for_being_simpler_is_not_swapped_back() -> None:
    weight, push = fit_of(1995.0, NET_BUOYANCY), fit_of(2000.0, THRUST_BIAS)
    assert selection._replaces(weight, push, push.causes[0], fit_of(0.0))
    assert not selection._replaces(push, weight, weight.causes[0], fit_of(0.0))
    far = fit_of(2020.0, THRUST_BIAS)
    assert selection._replaces(far, weight, weight.causes[0], fit_of(0.0))


def test_a_cause_is_judged_beside_the_best_variants_of_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    gains = {
        (): 0.0,
        (QUADRATIC_DRAG.label, MUNK_MOMENT_IN_YAW.label): 60.0,
        (MUNK_MOMENT_IN_YAW.label,): 10.0,
        (MUNK_MOMENT.label,): 50.0,
    }
    weighing = Weighed(
        {tuple(sorted(labels)): gain for labels, gain in gains.items()}, (MUNK_MOMENT, MUNK_MOMENT_IN_YAW)
    )
    tried = [(1.0, 1.0, Cause(effect, effect.start())) for effect in (QUADRATIC_DRAG, MUNK_MOMENT)]
    monkeypatch.setattr(selection, "ranked_candidates", lambda *_: tried)
    fit = fit_of(60.0, QUADRATIC_DRAG, MUNK_MOMENT_IN_YAW)
    others = selection._others_at_their_best(weighing, fit, 0)  # type: ignore[arg-type]
    assert [cause.effect for cause in others.causes] == [MUNK_MOMENT]


def test_a_drag_that_lacked_a_number_gets_it_back(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside an unknown current the drag of surge does not show; beside the current it does."""
    alone, whole = (
        Cause(QUADRATIC_DRAG, np.array(values))
        for values in ([0.0, 12.0, 0, 0, 0, 1.0], [18.0, 22.0, 0, 0, 0, 1.3])
    )
    weighing = Weighed({(): 0.0, (QUADRATIC_DRAG.label,): 50.0}, (QUADRATIC_DRAG,))
    fit = replace(fit_of(30.0, QUADRATIC_DRAG), causes=(alone,))
    for tried, expected in (((whole, alone), whole), ((alone,), alone)):
        ranked = [(1.0, 1.0, cause) for cause in tried]
        monkeypatch.setattr(selection, "ranked_candidates", lambda *_, ranked=ranked: ranked)
        monkeypatch.setattr(selection, "_shows_in_motion", lambda *_: True)
        fit_after = selection.swapped(weighing, fit)  # type: ignore[arg-type]
        assert fit_after.causes == (expected,)


@pytest.fixture(scope="module")
def course():
    return drawn_nominal().course


@pytest.mark.parametrize("effect", [SATURATION, DEAD_ZONE], ids=lambda effect: effect.name)
@pytest.mark.parametrize("share", [0.2, 1.0])
def test_other_sizes_of_a_limit_are_shares_of_itself_and_no_number_gets_lost(course, effect, share):
    values = share * effect.start()
    acts = list(other_forms(course, Cause(effect, values)))
    for size, act in zip((0.5, 2.0), acts, strict=False):
        np.testing.assert_array_equal(act.wrench, effect.act(course, size * values).wrench)
    assert all(np.isfinite(act.wrench).all() for act in acts)


@pytest.mark.parametrize("effect", [DEAD_ZONE, DEAD_ZONE_SHIFTED], ids=lambda effect: effect.variant)
def test_a_dead_zone_is_tried_up_to_a_quarter_of_what_a_strong_thruster_is_asked_for(course, effect):
    def widths(most_n):
        asked_n = course.asked_n * (most_n / np.abs(course.asked_n).max())
        settings, causes = settings_of((effect,), replace(course, asked_n=asked_n))
        assert len(settings) == len(causes)
        return [float(cause.values[0]) for cause in causes]

    usual = [0.5 * size for size in effect.sizes]
    ratio = usual[-1] / usual[-2]
    assert widths(8.0) == usual
    strong = widths(100.0)
    assert strong[: len(usual)] == usual
    assert 25.0 / ratio < strong[-1] <= 25.0
    assert strong[len(usual)] == pytest.approx(ratio * usual[-1])


def test_a_dead_zone_has_a_slope_between_the_thrusts_of_two_rounded_pulses(course):
    """Without one its width would be unknown, and the zone dropped as one that may be absent."""
    stepped = replace(course, asked_n=0.1 * np.round(10.0 * course.asked_n))
    zone = Cause(DEAD_ZONE, np.array([0.55]))
    slope = zone.slope(stepped, 0)
    wider, narrower = (DEAD_ZONE.act(stepped, np.array([width])).wrench for width in (0.65, 0.45))
    np.testing.assert_allclose(slope.wrench, (wider - narrower) / 0.16, atol=1e-9)
    assert slope.wrench.any()


def test_a_limit_that_is_at_infinity_is_absent_in_every_form(course):
    for act in other_forms(course, Cause(SATURATION, SATURATION.none())):
        assert np.isfinite(act.wrench).all()
        assert not act.wrench.any()


def test_drag_that_grows_is_no_form_of_a_quadratic_one_and_growth_one_of_any_other_cause(course):
    growing = (course.since_s / course.since_s[-1] - 0.5)[:, None]
    for effect, grows in ((QUADRATIC_DRAG, False), (COUPLED_DAMPING, True)):
        cause = Cause(effect, effect.start())
        grown = growing * cause.act(course).wrench
        forms = [act.wrench for act in other_forms(course, cause)]
        assert any(np.allclose(form, grown) for form in forms) == grows


def test_a_centre_of_mass_has_a_form_of_the_acceleration_that_vertical_thrust_makes(course):
    cause = Cause(CG_OFFSET_IN_SPACE, np.array([0.05, 0.0]))
    heave = course.wrench_of(course.thrust_n)[:, 2] / course.mass[2]
    # M = x m w_dot (Fossen 2011, eq. 3.60).
    expected = course.configuration.dry_mass_kg * 0.05 * heave
    forms = [act.wrench for act in other_forms(course, cause)]
    assert heave.any()
    assert any(np.allclose(form[:, 4], expected) and not form[:, [0, 1, 2, 3]].any() for form in forms)


HOVERING = load_vehicle("ruvifist:hovering").vehicle.configurations["hovering"]
WEAK = next(effect for effect in library(HOVERING, 0.05) if effect.name == "weak_thruster")


@pytest.mark.parametrize(("gain", "at_bound"), [(0.0, False), (0.4, False), (2.0, True)])
def test_a_thruster_may_give_nothing_but_not_all_that_a_bound_lets_it(gain: float, at_bound: bool) -> None:
    assert Cause(WEAK, np.array([gain])).at_bound is at_bound


def test_a_weight_is_told_from_none_that_grows_over_the_dive_and_kin_come_and_go_by_powers_of_time(course):
    weight = Cause(NET_BUOYANCY, np.array([5.0]))
    pushed, share = weight.act(course).wrench, (course.since_s / course.since_s[-1])[:, None]

    def is_among(push, acts):
        return any(np.allclose(act.wrench, push) for act in acts)

    assert is_among((share - 0.5) * pushed, [*possible_forms(course, weight)])
    kin = companions(course, weight)
    for power in (2, 3):
        assert is_among((2.0 * share - 1.0) ** power * pushed, kin)


def test_a_push_is_bent_about_its_own_size():
    push = np.array([[3.0, 0.0], [-4.0, 0.0], [5.0, 0.0], [0.0, 0.0]])
    size = math.sqrt(50.0 / 4.0)
    bent = candidates._bent(push, 2.0)
    np.testing.assert_allclose(bent[:, 0], np.array([9.0, -16.0, 25.0, 0.0]) / size)
    assert not bent[:, 1].any()


@pytest.mark.parametrize(
    ("effect", "value", "by", "value_then"),
    [
        (WEAK, 1.0, 0.7, 1.7), (WEAK, 1.0, 1.5, 2.0), (WEAK, 0.5, -0.4, 0.1), (WEAK, 0.5, -0.6, 0.0),
        (DEAD_ZONE, 2.0, 0.2, 2.2), (DEAD_ZONE, 2.0, 9.0, 2.5), (DEAD_ZONE, 2.0, -9.0, 1.5),
        (DEAD_ZONE, 0.3, -0.4, 0.0),
    ],
)  # fmt: skip
def test_a_parameter_moves_within_its_bounds_and_no_further_than_a_slope_holds(effect, value, by, value_then):
    """The force of a thruster's gain is straight, that of a dead zone is not."""
    assert Cause(effect, np.array([value])).moved(0, by).values == pytest.approx([value_then])


def test_a_drag_that_is_not_there_in_some_degrees_of_freedom_is_at_no_bound() -> None:
    assert not Cause(QUADRATIC_DRAG, np.array([20.0, 0.0, 0.0, 0.0, 0.0, 1.0])).at_bound


@pytest.fixture(scope="module")
def case():
    return draw_case(3_850_000_010, names=["quadratic_drag"], size=0.9, seconds=110.0)


def test_a_cause_less_probable_than_not_leaves_the_model_that_is_accepted(case):
    nominal, library = planted_nominal(case), (QUADRATIC_DRAG, COUPLED_DAMPING)
    shape = case.file.vehicle.configurations[case.configuration]
    drag = Cause(QUADRATIC_DRAG, QUADRATIC_DRAG.start())
    explanation = explained_by([drag], nominal, library)
    finding = Finding(explanation.causes[0], (), {}, 0.9, {}, 30.0)
    known = known_with_causes(explanation.causes, explanation.now)
    whole = likely_accepted([finding], explanation, known, nominal, library, (), shape)
    none = likely_accepted(
        [replace(finding, probability=0.42)], explanation, known, nominal, library, (), shape
    )
    assert [effect.name for effect in whole.effects] == ["quadratic_drag"]
    assert none.effects == ()
    assert none.sentences[0] == (
        "Quadratic drag was not accepted: it is 42 % probable, likelier absent than present."
    )
    # Without its quadratic part, all of the drag is linear again.
    plain = explained_by([], nominal, library, explanation.now).now
    assert none.values["D_u"].value == pytest.approx(float(plain.course.damping[0]))
    assert none.values["D_u"].value > 1.02 * whole.values["D_u"].value


def test_an_accepted_cause_comes_before_a_possible_one_whatever_nats_each_saves():
    def finding(probability: float, gain_nats: float) -> Finding:
        return Finding(Cause(QUADRATIC_DRAG, QUADRATIC_DRAG.start()), (), {}, probability, {}, gain_nats)

    heard, possible, strong, stronger = (
        finding(0.9, 0.0),
        finding(0.499, 80.0),
        finding(0.972, 40.0),
        finding(0.968, 60.0),
    )
    half = finding(0.5, 1.0)
    given = (possible, half, heard, strong, stronger)
    assert strongest_first(given) == (stronger, strong, heard, half, possible)


LIBRARY = (NET_BUOYANCY, THRUST_BIAS, QUADRATIC_DRAG)


@pytest.fixture(scope="module")
def heavy_nominal():
    return planted_nominal(draw_case(300_921, names=["net_buoyancy"], size=0.8, seconds=120.0, rpm=False))


@pytest.fixture(scope="module")
def heavy(heavy_nominal):
    return explained(heavy_nominal, *LIBRARY)


def test_weight_and_a_steady_push_down_are_one_to_a_vehicle_that_stays_level(heavy, monkeypatch):
    (cause,) = heavy.causes
    alike = ambiguity_of(heavy, 0)
    # A weight says less than a push in any direction.
    assert (cause.effect.name, alike.names) == ("net_buoyancy", ("thrust_bias",))
    assert all(likeness > 0.99 for likeness in alike.likeness.values())
    assert alike.margin_nats > 20
    # What does as well but is not alike is no other name for it.
    monkeypatch.setattr("identify.diagnose.causes.ambiguity.LEAST_LIKENESS", 1.1)
    apart = ambiguity_of(heavy, 0)
    assert (apart.names, apart.likeness, apart.margin_nats > 20) == ((), {}, True)


@pytest.mark.parametrize(
    ("net_n", "upward_n", "also"),
    [(-0.98, -0.196, ("thrust_bias", "thrust_gain")), (-0.98, -0.3, ("thrust_bias",)), (0.0, -0.196, ("thrust_bias",))],
    ids=["within the thrust's error", "beyond it", "none in the file"],
)  # fmt: skip
def test_a_weight_that_the_thrusts_own_error_makes_is_told_beside_the_thrusts_gain(
    course, net_n, upward_n, also
):
    """A file's thrust that is a fifth too strong takes a weight of 0.98 N for one of 1.18 N."""
    finding = Finding(Cause(NET_BUOYANCY, np.array([upward_n])), ("thrust_bias",), {}, 0.98, {}, 30.0)
    unknown = Finding(Cause(WRONG_FEEDBACK_LOG, np.zeros(0)), (), {}, 0.9, {}, 0.0)
    file = replace(course.configuration, net_buoyancy_n=net_n)
    told, same = beside_thrust_gain([finding, unknown], file, 0.1)
    assert told.also == also
    assert same == unknown


def test_what_nature_does_not_allow_is_no_other_name_for_a_cause(heavy_nominal):
    heavy = explained(heavy_nominal, NET_BUOYANCY, replace(THRUST_BIAS, possible=lambda *_: False))
    (cause,) = heavy.causes
    alike = ambiguity_of(heavy, 0)
    assert (cause.effect.name, alike.names, alike.margin_nats > 20) == ("net_buoyancy", (), True)


def test_a_drag_of_another_power_is_made_up_for_by_the_forms_of_a_quadratic_one(heavy):
    course = heavy.now.course
    cause = Cause(QUADRATIC_DRAG, np.array([10.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    surge = course.nu[:, 0]
    true = -np.sign(surge) * np.abs(surge) ** 1.8
    drag = cause.act(course).wrench[:, 0]
    others = [act.wrench[:, 0] for act in other_forms(course, cause)]
    whole = np.column_stack([drag, *others])
    left = true - whole @ np.linalg.lstsq(whole, true, rcond=None)[0]
    alone = true - drag * (drag @ true) / (drag @ drag)
    assert np.linalg.norm(left) < 0.2 * np.linalg.norm(alone)


def test_what_begins_within_the_dive_is_not_told_among_the_candidates_and_what_shows_nothing_saves_none(
    monkeypatch,
):
    late = replace(QUADRATIC_DRAG, since_s=40.0)
    ranked = [(nats, 1.0, Cause(effect, effect.start())) for nats, effect in ((3.0, DEAD_ZONE), (2.0, late))]
    monkeypatch.setattr(findings, "ranked_candidates", lambda *_: ranked)
    monkeypatch.setattr(findings, "_sizes_with_causes", lambda _: {})
    weighing = SimpleNamespace(
        library=(COUPLED_DAMPING, DEAD_ZONE, late),
        candidates_beyond_forms=lambda _: SimpleNamespace(settings=()),
    )
    told = trials_of(SimpleNamespace(weighing=weighing, fit=SimpleNamespace(causes=())), ())
    assert [(each.name, each.gain_nats) for each in told] == [("dead_zone", 3.0), ("coupled_damping", 0.0)]


def test_every_effect_of_the_library_is_told_with_what_it_saves_beside_the_accepted_one(heavy):
    (cause,) = heavy.causes
    weight = Finding(cause, (), {}, 0.9, {}, heavy.fit.gain)
    tried = trials_of(heavy, (weight,))
    assert {trial.name for trial in tried} == {effect.name for effect in LIBRARY}
    assert [trial.label for trial in tried if trial.accepted] == [cause.effect.label]
    twin = next(
        trial for trial in tried if trial.name in {"net_buoyancy", "thrust_bias"} and not trial.accepted
    )
    assert twin.gain_nats < 2.0
    assert all(trial.why == "" for trial in tried if trial.gain_nats <= 7.0)


@pytest.mark.parametrize(
    ("causes", "gain", "sigma", "why"),
    [
        (6, 30.0, 3.0, "no dive tells more than 6 causes"),
        (5, 12.4, 3.0, "too little here: 12 nats are asked for"),
        (5, 12.5, 1.0, "not in all parts of the dive"),
        (5, 12.5, 1.1, "in doubt: it comes and goes with what else is accepted"),
    ],
)
def test_why_a_candidate_is_no_cause_is_told(monkeypatch, causes, gain, sigma, why):
    monkeypatch.setattr(findings, "required_gain", lambda *_: 12.4)
    explanation = SimpleNamespace(causes=("a cause",) * causes, weighing=None, fit=None)
    assert findings._reason(explanation, gain, sigma, Cause(DEAD_ZONE, DEAD_ZONE.start())) == why


@pytest.mark.parametrize(
    ("gain", "fitted_gain", "shows", "told"),
    [
        # By the equations alone, and fitted in full with the causes.
        (30.0, 20.0, True, (20.0, "why")), (30.0, 40.0, True, (30.0, "why")), (30.0, 5.0, True, (5.0, "")),
        (30.0, 20.0, False, (0.0, "")), (30.0, None, True, (0.0, "")),
        # What saves seven nats is not looked at further.
        (7.0, 5.0, True, (7.0, "")),
    ],
)  # fmt: skip
def test_a_candidate_that_is_no_cause_saves_no_more_than_beside_the_causes(
    monkeypatch, gain, fitted_gain, shows, told
):
    monkeypatch.setattr(findings, "_reason", lambda *_: "why")
    fit = SimpleNamespace(gain=100.0, causes=("a cause",))
    with_it = (*fit.causes, SimpleNamespace(shows=shows))
    further = fit if fitted_gain is None else SimpleNamespace(gain=100.0 + fitted_gain, causes=with_it)
    explanation = SimpleNamespace(fit=fit, weighing=SimpleNamespace(fitted=lambda _: further))
    trial = findings._rejected(explanation, gain, 3.0, Cause(DEAD_ZONE, DEAD_ZONE.start()))
    assert (trial.gain_nats, trial.why, trial.accepted) == (*told, False)


@pytest.mark.parametrize(
    ("causes", "filtered", "shared", "nats"),
    [
        (("another",), (), 0.0, 20.0),
        ((), (), 0.0, 0.0),
        (("another",), (0, 1, 2), 0.0, 20.0),
        (("another",), (0, 1, 2), 90.0, 90.0),
        (("another",), (0, 1, 2), 400.0, 142.8),
    ],
)
def test_a_further_cause_has_to_save_more_than_a_shadow_and_more_behind_a_filter_where_others_act(
    causes, filtered, shared, nats
):
    """A thousandth of what far better told ones save; an autopilot's filter makes up to seven of it, but no more than
    they save where the further one acts."""
    apart = SimpleNamespace(
        fit=SimpleNamespace(unsteady_nats=20_000.0, motion_nats=50_000.0, causes=causes),
        weighing=SimpleNamespace(now=SimpleNamespace(filtered=filtered)),
        overlap=lambda _: shared,
        saved_overlap=lambda _: 0.0,
    )
    assert remainder_nats(apart, Cause(CG_OFFSET, CG_OFFSET.start())) == pytest.approx(nats)


def test_a_steady_push_casts_its_shadow_only_where_a_further_cause_acts_too():
    """Of 30 000 nats of a push, those that the further cause could share, and the 20 000 of all other causes."""
    fit = SimpleNamespace(unsteady_nats=20_000.0, motion_nats=50_000.0, causes=("a push",))
    for shared, nats in ((4_000.0, 24.0), (40_000.0, 50.0)):
        apart = SimpleNamespace(
            fit=fit,
            weighing=SimpleNamespace(now=SimpleNamespace(filtered=())),
            overlap=lambda _, shared=shared: shared,
            saved_overlap=lambda _: 0.0,
        )
        assert remainder_nats(apart, Cause(CG_OFFSET, CG_OFFSET.start())) == pytest.approx(nats)


def test_the_variants_of_a_cause_with_the_same_parameters_are_its_forms_but_not_other_periods_of_a_sea() -> (
    None
):
    course = course_of(*draw_case(391_001, kind="none", seconds=40.0).simulated(0))
    offset = Cause(CG_OFFSET, CG_OFFSET.start())
    (first, *others) = other_variants(course, offset, (CG_OFFSET, CG_OFFSET_IN_SPACE))
    in_space = CG_OFFSET_IN_SPACE.act(course, offset.values).wrench
    assert first.wrench is not None
    np.testing.assert_array_equal(first.wrench, in_space)
    assert any(act.wrench is not None and act.wrench[:, 4].any() for act in others)
    sea = waves(4.0)
    assert not [*other_variants(course, Cause(sea, sea.start()), (sea, waves(5.0)))]


HEAVY_LIBRARY = (NET_BUOYANCY, QUADRATIC_DRAG)

covariance_beside = module._covariance


@pytest.fixture(scope="module")
def heavy_vehicle(heavy_nominal):
    """A dive of a heavy vehicle: the filters without a cause, and the cause."""
    return heavy_nominal, explained(heavy_nominal, *HEAVY_LIBRARY)


def test_a_cause_whose_interval_holds_its_absence_is_dropped_and_the_filters_are_as_without_it(
    heavy_vehicle, monkeypatch
):
    nominal, explanation = heavy_vehicle
    (size,) = explanation.causes[0].values
    monkeypatch.setattr(module, "is_certain", lambda _: False)
    wide = (size / covariance_of(explanation.weighing, explanation.fit)[0, 0] ** 0.5) ** 2
    for factor, stays in ((wide / 4.0, True), (wide / 3.5, False)):
        monkeypatch.setattr(module, "_covariance", lambda *of, by=factor: by * covariance_beside(*of))
        left, covariance = without_doubtful(explanation, nominal, HEAVY_LIBRARY)
        assert (bool(left.causes), len(covariance)) == (stays, int(stays))
    # The last of an axis, how even its two poles are, hardly matters where they are one.
    ends = [of_axis.stop - 1 for of_axis in nominal.joint.slices]
    np.testing.assert_allclose(
        np.delete(left.now.theta, ends), np.delete(nominal.theta, ends), rtol=0.02, atol=0.05
    )
    assert left.now.log_posterior == pytest.approx(nominal.log_posterior, abs=0.1)
    np.testing.assert_allclose(left.now.course.mass, nominal.course.mass, rtol=0.005)


def test_a_lone_cause_that_is_certain_stays_however_wide_its_interval(heavy_vehicle, monkeypatch):
    nominal, explanation = heavy_vehicle
    assert explanation.fit.gain > 200.0
    monkeypatch.setattr(module, "_covariance", lambda *of: 1e9 * covariance_beside(*of))
    left, _ = without_doubtful(explanation, nominal, HEAVY_LIBRARY)
    assert left is explanation


def test_of_causes_that_may_both_be_absent_the_one_that_saves_less_goes_first(heavy_vehicle, monkeypatch):
    """However wide the interval of the one that casts the shadow."""
    nominal, explanation = heavy_vehicle
    fit = explanation.weighing.fitted((*explanation.causes, Cause(QUADRATIC_DRAG, QUADRATIC_DRAG.start())))
    tried = []

    def refitted(causes, *_):
        tried.append([cause.effect for cause in causes])
        return replace(explanation, fit=explanation.weighing.fitted(()))

    monkeypatch.setattr(module, "explained_by", refitted)
    monkeypatch.setattr(module, "_covariance", lambda *_: np.eye(7))
    monkeypatch.setattr(
        module, "_confidence", lambda of, _, k: 0.1 if of.causes[k].effect is NET_BUOYANCY else 0.5
    )
    without_doubtful(replace(explanation, fit=fit), nominal, HEAVY_LIBRARY)
    assert tried == [[NET_BUOYANCY]]


def test_a_moment_stays_though_its_gain_is_over_masses_that_hardly_differ(heavy_vehicle, monkeypatch):
    """The interval of a gain over a difference of masses can hold anything; that the moment is there is another
    question."""
    nominal, explanation = heavy_vehicle

    def of_masses(weighing, _causes):
        size = float(np.sqrt((explanation.fit.slopes**2).sum()))
        nominal = weighing.rows.nuisance
        dense = np.hstack([nominal.dense()[:, 1:], explanation.fit.slopes + 1e-3 * size])
        return nominal.blocks_of(dense)

    monkeypatch.setattr(module, "coupled_nominal", of_masses)
    left, covariance = without_doubtful(explanation, nominal, HEAVY_LIBRARY)
    assert left is explanation
    (size,) = explanation.causes[0].values
    assert size < 2.0 * covariance[0, 0] ** 0.5


def test_nothing_is_named_where_the_disturbance_hides_what_thrust_does(heavy_vehicle, monkeypatch):
    nominal, explanation = heavy_vehicle
    drowned, clear = (
        tuple(Disturbance(dof, 1.0, share, True, True) for dof, share in (("surge", 0.95), ("heave", least)))
        for least in (0.91, 0.5)
    )
    held = tuple(replace(each, driven=False) for each in drowned)
    monkeypatch.setattr(module, "disturbance_of", lambda _: held)
    assert without_doubtful(explanation, nominal, HEAVY_LIBRARY)[0].causes
    monkeypatch.setattr(module, "disturbance_of", lambda _: clear)
    assert without_doubtful(explanation, nominal, HEAVY_LIBRARY)[0].causes
    monkeypatch.setattr(module, "disturbance_of", lambda _: drowned)
    left, covariance = without_doubtful(explanation, nominal, HEAVY_LIBRARY)
    assert (left.causes, covariance.shape) == ((), (0, 0))


def test_a_cause_that_ends_at_a_bound_that_is_a_guess_is_dropped(heavy_vehicle):
    nominal, explanation = heavy_vehicle
    (parameter,) = NET_BUOYANCY.parameters
    (size,) = explanation.causes[0].values
    narrow = replace(NET_BUOYANCY, parameters=(replace(parameter, low=size),))
    fit = replace(explanation.fit, causes=(Cause(narrow, np.array([size])),))
    left, _ = without_doubtful(replace(explanation, fit=fit), nominal, HEAVY_LIBRARY)
    assert left.causes == ()


def test_a_sea_stays_though_parts_of_the_dive_disagree_on_its_lines(monkeypatch):
    case = draw_case(300_911, names=["waves"], size=0.7, seconds=200.0)
    nominal = planted_nominal(case)
    explanation = explained(nominal, waves(5.0))
    assert [cause.effect.name for cause in explanation.causes] == ["waves"]
    monkeypatch.setattr(module, "_covariance", lambda *of: 1e9 * covariance_beside(*of))
    assert without_doubtful(explanation, nominal, (waves(5.0),))[0] is explanation


@pytest.mark.parametrize("freedom", [1, 2, 3, 6, 7, 24])
def test_the_confidence_of_a_distance_is_that_of_chi_squared(freedom):
    from scipy.special import chdtr

    for at in (-1.0, 0.0, 1e-3, 0.5, 3.84, 12.0, 80.0):
        assert chi_squared(freedom, at) == pytest.approx(float(chdtr(freedom, max(at, 0.0))), abs=1e-12)


def test_the_confidence_in_a_cause_is_by_its_distance_from_absence_in_its_own_errors():
    """A thruster that gives nine tenths, known to a tenth, beside a bias of two numbers."""
    causes = (Cause(DVL_BIAS, np.array([0.1, 0.4, 0.0])), Cause(weak(1), np.array([0.9])))
    fit = replace(fit_of(50.0), causes=causes, at=((0, 0), (0, 1), (1, 0)))
    covariance = np.diag([0.1, 0.2, 0.1]) ** 2
    covariance[1, 2] = covariance[2, 1] = 0.01
    assert module._confidence(fit, covariance, 1) == pytest.approx(math.erf(math.sqrt(0.5)))
    assert module._confidence(fit, covariance, 0) == pytest.approx(1.0 - math.exp(-2.5))


def fitted(effect, values, std):
    nothing = np.zeros(0)
    at = tuple((0, p) for p in range(len(std)))
    cause = Cause(effect, np.array(values, dtype=float))
    return Fitted((cause,), at, nothing, nothing, np.diag(np.square(std)), 0.0, 100.0, 1.0, 100.0, 100.0)


@pytest.mark.parametrize(
    ("effect", "values", "std", "names"),
    [
        (QUADRATIC_DRAG, [75, 140, 480, 3040, 78, 42], [4, 13, 110, 1600, 8, 1.1],
         {"X_uu", "Y_vv", "Z_ww", "M_qq", "N_rr"}),
        (DVL_BIAS, [0.05, 0.001, 0.0], [0.001] * 3, {"x", "y", "z"}),
        (QUADRATIC_DRAG, [75, 0, 0, 3040, 0, 0], [60, 70, 70, 1600, 20, 20],
         {"X_uu", "Y_vv", "Z_ww", "K_pp", "M_qq", "N_rr"}),
    ],
    ids=["one may be nothing or enormous", "surely small", "all are vague"],
)  # fmt: skip
def test_a_part_that_may_be_nothing_or_enormous_is_not_told_beside_others(effect, values, std, names):
    assert set(parameters_of(fitted(effect, values, std), 0)) == names


def test_a_number_that_is_told_in_other_terms_has_an_interval_of_both_sides_and_one_with_bounds_ends_there():
    sea = parameters_of(fitted(waves(5.0), [3.0, 0, 0, 0, 0, 0], [0.1] * 6), 0)["force_amplitude"]
    assert -math.inf < sea.low95 < sea.value < sea.high95 < math.inf
    weaker = parameters_of(fitted(weak(1), [0.1], [0.1]), 0)["gain"]
    assert (weaker.low95, weaker.high95) == pytest.approx((0.0, 0.296), abs=1e-3)


@pytest.mark.parametrize(("east_m_s", "begins"), [(0.3, True), (0.01, False)])
def test_the_search_begins_with_the_current_along_which_a_vehicle_drifts_on_every_heading(
    course, east_m_s, begins
):
    heading = np.linspace(0.0, 4.0, len(course.time_s))
    nu = np.zeros_like(course.nu)
    nu[:, 0], nu[:, 1] = east_m_s * np.sin(heading), east_m_s * np.cos(heading)
    euler = np.column_stack([0 * heading, 0 * heading, heading])
    drifting = replace(course, nu=nu, euler=euler, water=None)
    causes = list(search._drift(drifting, (QUADRATIC_DRAG, STEADY_CURRENT)))
    assert [cause.effect.name for cause in causes] == ["steady_current"] * begins
    for cause in causes:
        np.testing.assert_allclose(cause.values, (0.0, 0.3), atol=1e-9)


def test_a_thruster_that_does_as_well_as_the_named_one_is_told_beside_it_with_what_would_tell(nominal):
    """Upright thrusters on one side of a hull whose pitch no sensor shows push alike."""
    named, twin, other = weak(2), replace(weak(2), number=7), weak(3)
    act = named.act(nominal.course, np.array([0.1]))
    spoilt = replace(refitted(nominal, [act.times(-1.0)]), acts=(), course=nominal.course)
    explanation = explained(spoilt, named, twin, other)
    number = explanation.causes[0].effect.number
    group = ambiguity_of(explanation, 0)
    assert (group.names, {number, *group.thrusters}) == ((), {2, 7})
    finding = Finding(explanation.causes[0], (), {}, 0.9, {}, 30.0, other_thrusters=group.thrusters)
    assert sorted(name_of(finding).split(" or ")) == ["weak thruster 2", "weak thruster 7"]
    dive = next_of([finding], [named])
    assert (dive.manoeuvres, dive.splits) == (("pulses of one thruster at a time",), ())
    assert plain_effect(finding)["other_thrusters"] == list(group.thrusters)
