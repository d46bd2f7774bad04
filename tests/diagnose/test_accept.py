"""What a crew accepts, what has changed since, and doubts that go with it."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from fakes.planted import damped, diagnosed, drawn_nominal, explained, planted_nominal, quiet

from bridge.vehicle.coefficients import BY_NAME, DAMPINGS, MASSES, AcceptedEffect
from bridge.vehicle.config import Prior
from identify.challenge.case import dive_of, draw_case
from identify.diagnose import accepted as diagnose_accepted
from identify.diagnose import accepted_before
from identify.diagnose.accepted import known_with_causes, likely_accepted
from identify.diagnose.accepted_before import (
    accepted_causes,
    all_accepted,
    library_with_changes,
    with_accepted,
)
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.changed import Shift, _direct_pattern, beyond_the_curve, changes_of, shift_of
from identify.diagnose.diagnose import diagnose
from identify.diagnose.filters.nominal import nominal_of, refitted
from identify.diagnose.gap.missing import Missing
from identify.diagnose.gap.simulation import EACH, simulation_of, slope_of
from identify.diagnose.result import Finding, Value
from identify.diagnose.words.causes import effect_words
from identify.doubt import Outcome
from identify.effects import actuators, environment, hydrodynamics, rigid_body, sensors, supply
from identify.effects.actuators import DEAD_ZONE, SATURATION, THRUST_GAIN, weak
from identify.effects.environment import STEADY_CURRENT
from identify.effects.hydrodynamics import FOULING, FOULING_SINCE, QUADRATIC_DRAG
from identify.effects.rigid_body import ADDED_PAYLOAD, ENTRAINED_WATER
from identify.effects.sensors import DVL_MISALIGNMENT, DVL_SCALE
from identify.estimators.missing_forces.drag_and_timing import Doubts, Multiplier


def finding_of(effect, *values, width=0.01, also=()):
    """A cause with intervals of a hundredth either way, or wider."""
    cause = Cause(effect, np.array(values, dtype=float))
    parameters = {
        name: Value(value, unit, value - width * abs(value), value + width * abs(value))
        for name, (value, unit) in effect.answer_parameters(cause.values).items()
        if name != "thruster"
    }
    return Finding(cause, also, {}, 0.99, parameters, 50.0)


def accepted_of(causes, now, shape):
    """The result of accepting causes whose fit is `now`."""
    return diagnose_accepted.accepted_of(
        causes, known_with_causes([finding.cause for finding in causes], now), shape
    )


def of_effects(accepted):
    return {name: value.value for name, value in accepted.values.items() if name not in BY_NAME}


def test_without_causes_the_linear_model_alone_is_accepted(nominal, shape):
    accepted = accepted_of((), nominal, shape)
    fitted = {problem.axis.dof for problem in nominal.joint.problems}
    assert {BY_NAME[name].dof for name in accepted.values} <= fitted
    assert accepted.values["M_u"].value == nominal.course.mass[0]
    assert accepted.values["D_u"].low95 < nominal.course.damping[0] < accepted.values["D_u"].high95
    assert (of_effects(accepted), accepted.effects) == ({}, ())


@pytest.mark.parametrize(
    ("effect", "values", "wanted"),
    [
        (hydrodynamics.QUADRATIC_DRAG, (12.0, 0, 0, 0, 0, 3.0), {"X_uu": 12.0, "N_rr": 3.0}),
        (hydrodynamics.COUPLED_DAMPING, (2.0, -1.5), {"Y_r": 2.0, "N_v": -1.5}),
        (hydrodynamics.CROSS_FLOW_LIFT, (5.0, 4.0), {"Y_uv": 5.0, "N_uv": 4.0}),
        (actuators.REVERSE_THRUST_LOSS, (0.7,), {"T_astern": 0.7}),
        (actuators.DEAD_ZONE, (0.6,), {"T_least": 0.6}),
        (actuators.DEAD_ZONE_SHIFTED, (0.6,), {"T_start": 0.6}),
        (supply.LOAD_SAG, (0.05,), {"T_ohm": 0.05}),
        (actuators.weak(2), (0.75,), {"T2_gain": 0.75}),
    ],
    ids=lambda given: getattr(given, "label", ""),
)
def test_each_effect_has_its_own_parameters_on_board(nominal, shape, effect, values, wanted):
    accepted = accepted_of((finding_of(effect, *values),), nominal, shape)
    assert of_effects(accepted) == pytest.approx(wanted)
    assert accepted.sentences == ()
    (kept,) = accepted.effects
    assert (kept.name, kept.label, kept.number) == (effect.name, effect.label, effect.number)
    assert list(kept.parameters.values()) == pytest.approx(list(values))


@pytest.mark.parametrize("effect", [supply.BATTERY_SAG, supply.BATTERY_SAG_BY_VOLTAGE])
def test_an_accepted_battery_sag_says_that_its_rate_is_of_that_dive(nominal, shape, effect):
    sentences = accepted_of((finding_of(effect, 2e-4),), nominal, shape).sentences
    assert any(
        "that of this dive" in said and "the next diagnosis tells by how much" in said.lower()
        for said in sentences
    )


def test_a_munk_moment_and_a_centre_of_mass_become_moments_of_this_vehicles_masses(nominal, shape):
    causes = (
        finding_of(hydrodynamics.MUNK_MOMENT_IN_YAW, 1.3),
        finding_of(rigid_body.CG_OFFSET, 0.02, -0.01),
    )
    values = of_effects(accepted_of(causes, nominal, shape))
    m_u, m_v = nominal.course.mass[:2]
    assert values["N_munk"] == pytest.approx(0.3 * (m_v - m_u))
    assert (values["S_x"], values["S_y"]) == pytest.approx(
        (0.02 * shape.dry_mass_kg, -0.01 * shape.dry_mass_kg)
    )


def test_a_centre_of_mass_accepted_in_one_form_and_found_in_another_beside_it_is_sent_as_their_sum(
    nominal, shape
):
    held = Cause(rigid_body.CG_OFFSET, np.array([0.02, 0.0]))
    whole = all_accepted((finding_of(rigid_body.CG_OFFSET_IN_SPACE, 0.01, 0.0),), (held,))
    values = of_effects(accepted_of(whole, nominal, shape))
    assert values["S_x"] == pytest.approx(0.03 * shape.dry_mass_kg)


def test_a_sag_becomes_the_law_of_the_voltage_that_was_measured(nominal, shape):
    course = nominal.course
    falling = replace(nominal, course=replace(course, voltage_v=16.0 - 0.01 * course.since_s))
    begun_v, rate = supply.voltage_law(falling.course.voltage_v, course.since_s)
    values = of_effects(accepted_of((finding_of(supply.BATTERY_SAG_BY_VOLTAGE, 0.8 * rate),), falling, shape))
    assert values == pytest.approx({"T_volt": begun_v, "T_vshare": 0.8})


@pytest.mark.parametrize(
    ("effect", "size"), [(rigid_body.ENTRAINED_WATER, 3.0), (actuators.THRUST_GAIN, 0.9)]
)
def test_what_a_refit_takes_up_is_sent_once_in_the_masses_and_dampings(nominal, shape, effect, size):
    accepted = accepted_of((finding_of(effect, size),), nominal, shape)
    assert accepted.values == accepted_of((), nominal, shape).values
    assert "is in the masses and dampings of this dive" in accepted.sentences[-1]


@pytest.mark.parametrize(
    ("effect", "values", "words"),
    [
        (sensors.DVL_MISALIGNMENT, (0.05,), "DVL misalignment lies in what is read"),
        (environment.STEADY_CURRENT, (0.05, 0.1), "Steady current is the water's"),
        (actuators.SATURATION, (15.0,), "Saturation is in the model, but the feed-forward can't make up for it"),
        (supply.BATTERY_SAG, (2e-4,), "Battery sag is in the model, but the feed-forward can't"),
        (hydrodynamics.MUNK_MOMENT, (1.3,), "the feed-forward makes up for it in yaw"),
        (hydrodynamics.QUADRATIC_DRAG, (9.0, 0, 20.0, 0, 0, 0), "Z_ww: there is no feed-forward in heave"),
        (actuators.weak(1), (0.1,), "T1_gain 0.1 out of bounds: it is not sent"),
    ],
    ids=lambda given: getattr(given, "label", ""),
)  # fmt: skip
def test_what_the_feed_forward_can_not_make_up_for_is_told_and_still_in_the_model(
    nominal, shape, effect, values, words
):
    accepted = accepted_of((finding_of(effect, *values),), nominal, shape)
    assert words in " ".join(accepted.sentences)
    assert [held.name for held in accepted.in_the_model] == [effect.name]


def test_a_cause_that_the_dive_can_not_tell_from_another_is_accepted_with_a_word_about_it(nominal, shape):
    finding = finding_of(hydrodynamics.QUADRATIC_DRAG, 9.0, 0, 0, 0, 0, 0, also=("inflow_loss",))
    (sentence,) = accepted_of((finding,), nominal, shape).sentences
    assert sentence.endswith("though this dive can't tell it from inflow loss.")


@pytest.mark.parametrize(
    "roll", [{"K_pp": Value(7.0, "N m s2/rad2", -1.0, 15.0)}, {}], ids=["none as well", "not told"]
)
def test_a_parameter_that_may_as_well_be_none_or_was_not_told_is_neither_sent_nor_in_the_model(
    nominal, shape, roll
):
    finding = finding_of(hydrodynamics.QUADRATIC_DRAG, 9.0, 0, 0, 7.0, 0, 0)
    known = {name: value for name, value in finding.parameters.items() if name != "K_pp"}
    accepted = accepted_of((replace(finding, parameters=known | roll),), nominal, shape)
    assert of_effects(accepted) == {"X_uu": 9.0}
    assert accepted.effects[0].parameters["K_pp"] == 0.0
    assert accepted.sentences == ()


def test_an_axis_that_the_dive_hardly_moves_keeps_what_the_vehicle_has(nominal, shape, monkeypatch):
    monkeypatch.setattr("identify.diagnose.accepted.LEAST_KNOWN", 0.0)
    accepted = accepted_of((), nominal, shape)
    assert accepted.values == {}
    assert "M_u and D_u stay as the vehicle has them: this dive hardly tells them." in accepted.sentences


@pytest.mark.parametrize(
    ("causes", "kept"),
    [((), False), ((finding_of(hydrodynamics.QUADRATIC_DRAG, 0, 0, 20.0, 0, 0, 0),), True)],
    ids=["nothing accepted there", "drag accepted there"],
)
def test_an_axis_without_feed_forward_is_rewritten_only_by_a_dive_that_tells_it_well(
    nominal, shape, monkeypatch, causes, kept
):
    monkeypatch.setattr("identify.diagnose.accepted.WELL_KNOWN", 1e-6)
    accepted = accepted_of(causes, nominal, shape)
    assert ("M_w" in accepted.values, "D_w" in accepted.values) == (kept, kept)
    assert {"M_u", "D_u", "M_v", "D_v", "I_r", "D_r"} <= set(accepted.values)
    assert (
        "M_w and D_w stay as the vehicle has them: this dive hardly tells them." in accepted.sentences
    ) != kept


def test_axes_whose_controller_used_what_was_not_recorded_stay_as_the_vehicle_has_them(nominal, shape):
    heard = replace(nominal, feedback_unrecorded=(0, 5))
    accepted = accepted_of((), heard, shape)
    assert not {"M_u", "D_u", "I_r", "D_r"} & set(accepted.values)
    assert "M_v" in accepted.values
    (sentence,) = accepted.sentences
    assert sentence.startswith(
        "M_u, D_u, I_r and D_r stay as the vehicle has them: in surge and yaw the controller used"
    )


WEAK = weak(2)
LIBRARY = (QUADRATIC_DRAG, DEAD_ZONE, SATURATION, THRUST_GAIN, STEADY_CURRENT, DVL_MISALIGNMENT, WEAK)
DRAG = np.array([12.0, 8.0, 0.0, 0.0, 0.0, 3.0])


def kept(effect, *values):
    """An accepted effect as a file has it."""
    names = (p.name for p in effect.parameters)
    return AcceptedEffect(effect.name, effect.label, dict(zip(names, values, strict=True)), effect.number)


def test_what_is_the_vehicles_own_is_taken_along_and_what_is_not_is_told():
    accepted = (
        kept(QUADRATIC_DRAG, *DRAG),
        kept(WEAK, 0.7),
        kept(THRUST_GAIN, 0.9),
        kept(STEADY_CURRENT, 0.1, 0.1),
        AcceptedEffect("kraken", "kraken", {"arms": 8.0}),
    )
    causes = accepted_causes(accepted, LIBRARY)
    assert [cause.effect for cause in causes.lasting] == [QUADRATIC_DRAG, WEAK]
    np.testing.assert_array_equal(causes.lasting[0].values, DRAG)
    _, sentence = causes.sentences(causes.lasting)
    assert "steady current (of that dive alone)" in sentence
    assert (
        "kraken (this library has no such effect, the hull's own model has it, or the recording lacks what shows it)"
    ) in sentence
    assert "thrust gain" not in sentence


def test_what_the_model_before_holds_names_a_thruster_once():
    held = (Cause(weak(3), np.array([0.8])), Cause(STEADY_CURRENT, np.array([0.0, 0.2])))
    (sentence,) = accepted_causes((), ()).sentences(held)
    assert sentence.startswith("The model before holds what was accepted: weak thruster 3 (gain 0.8000) and ")
    assert "0.2" in sentence


def test_accepted_water_is_in_force_where_the_dive_bears_it_out_and_else_told(nominal):
    course = nominal.course
    there = Cause(STEADY_CURRENT, np.array([0.08, -0.05]))
    in_it = refitted(nominal, [there.act(course).times(-1.0)])
    for values, borne_out in ((there.values, True), (-there.values, False)):
        causes = accepted_causes([kept(STEADY_CURRENT, *values)], LIBRARY)
        held = causes.in_force(in_it).accepted
        assert [cause.effect for cause in held] == [STEADY_CURRENT] * borne_out
        (sentence,) = causes.sentences(held)
        assert ("holds what was accepted" in sentence) is borne_out
        assert ("of that dive alone" in sentence) is not borne_out


@pytest.mark.parametrize(("rise", "is_held"), [(7.1, True), (7.0, False)])
def test_accepted_water_is_held_with_which_the_filters_are_likelier_by_more_than_seven_nats(
    monkeypatch, rise, is_held
):
    def likelier(_, causes):
        return SimpleNamespace(log_posterior=rise * len(causes), accepted=causes)

    monkeypatch.setattr(accepted_before, "with_accepted", likelier)
    drag = kept(QUADRATIC_DRAG, 20.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    causes = accepted_causes([drag, kept(STEADY_CURRENT, 0.1, 0.0), kept(STEADY_CURRENT, 0.0, 0.0)], LIBRARY)
    held = [cause.effect for cause in causes.in_force(None).accepted]
    assert held == [QUADRATIC_DRAG, STEADY_CURRENT][: 1 + is_held]


@pytest.mark.parametrize(
    ("effect", "before", "by"),
    [(DEAD_ZONE, (0.8,), (-0.3,)), (QUADRATIC_DRAG, tuple(DRAG), (-5.0, 4.0, 0, 0, 0, 0)), (WEAK, (0.7,), (0.2,))],
    ids=lambda given: getattr(given, "name", ""),
)  # fmt: skip
def test_a_change_adds_what_the_effect_of_another_size_does_beyond_the_accepted_one(
    nominal, effect, before, by
):
    accepted, course = Cause(effect, np.array(before)), nominal.course
    (change,) = library_with_changes((effect,), (accepted,))
    whole = effect.act(course, accepted.values + np.array(by)).wrench - accepted.act(course).wrench
    np.testing.assert_allclose(change.act(course, np.array(by)).wrench, whole, atol=1e-12)
    assert not change.act(course, change.none()).wrench.any()
    assert effect_words(change) == f"a change of {effect_words(effect)}"
    for p, base, value in zip(change.parameters, effect.parameters, before, strict=True):
        assert (p.low + value, p.high + value) == pytest.approx((base.low, base.high))
        assert [bound + value for bound in p.exact] == pytest.approx([*base.exact])


def test_what_was_not_accepted_is_tried_as_before_and_so_is_a_limit_on_top_of_one():
    limit = Cause(SATURATION, SATURATION.start())
    assert library_with_changes(LIBRARY, (limit,)) == LIBRARY
    changed = library_with_changes(LIBRARY, (Cause(QUADRATIC_DRAG, DRAG),))
    assert changed[0].name == "quadratic_drag"
    assert changed[1:] == LIBRARY[1:]


def test_a_dive_is_without_what_its_model_holds_and_flies_with_it(nominal):
    drag = Cause(QUADRATIC_DRAG, DRAG)
    held = with_accepted(nominal, (drag,))
    assert with_accepted(nominal, ()) is nominal
    assert (held.accepted, held.acts) == ((drag,), ())
    surge, before = held.joint.problems[0].axis, nominal.joint.problems[0].axis
    assert (surge.quadratic, before.quadratic) == (DRAG[0], 0.0)
    problem, of_axis = held.joint.problems[0], held.joint.slices[0]
    free = replace(problem, axis=replace(surge, quadratic=0.0))
    braked = problem.mean_force(held.theta[of_axis]) - free.mean_force(held.theta[of_axis])
    # About the speed that is expected: what the slope there brakes the filter takes from its own speed.
    expected = DRAG[0] * (problem.slope - np.abs(surge.speed)) * surge.speed
    np.testing.assert_allclose(braked, np.column_stack([expected, expected]))
    assert 0.0 < np.abs(problem.slope - 2.0 * np.abs(surge.speed)).max() <= problem.slope.min() * 1.001
    np.testing.assert_array_equal(
        simulation_of(held, held.theta, held.motion.nu).slope, slope_of((drag,), held.course)[::2]
    )


def test_accepting_again_keeps_what_was_accepted_with_its_change_in_it(nominal, shape):
    drag, weak_one = Cause(QUADRATIC_DRAG, DRAG), Cause(WEAK, np.array([0.7]))
    (change,) = library_with_changes((QUADRATIC_DRAG,), (drag,))
    by = Cause(change, np.array([-5.0, 0, 0, 0, 0, 0]))
    finding = Finding(by, (), {}, 0.9, {"X_uu": Value(-5.0, "N s2/m2", -6.0, -4.0)}, 30.0)
    whole = all_accepted((finding,), (drag, weak_one))
    parameters = whole[0].parameters
    assert parameters["X_uu"] == Value(7.0, "N s2/m2", 6.0, 8.0)
    assert parameters["Z_ww"] == Value(0.0, "N s2/m2", 0.0, 0.0)
    accepted = accepted_of(whole, nominal, shape)
    values = {name: accepted.values[name].value for name in ("X_uu", "Y_vv", "N_rr", "T2_gain")}
    assert values == pytest.approx({"X_uu": 7.0, "Y_vv": 8.0, "N_rr": 3.0, "T2_gain": 0.7})
    assert not {"Z_ww", "K_pp", "M_qq"} & set(accepted.values)
    assert [effect.label for effect in accepted.effects] == ["quadratic_drag", "weak_thruster of thruster 2"]
    assert all_accepted((), ()) == ()
    other = Finding(Cause(DEAD_ZONE, np.array([0.5])), (), {}, 0.9, {}, 12.0)
    assert all_accepted((other,), (drag,))[1] is other


def test_of_a_change_what_the_dive_does_not_tell_stays_as_it_was_accepted():
    damping = Cause(hydrodynamics.COUPLED_DAMPING, np.array([2.0, -1.5]))
    (change,) = library_with_changes((damping.effect,), (damping,))
    by = Cause(change, np.array([0.5, 37.0]))
    finding = Finding(by, (), {}, 0.9, {"Y_r": Value(0.5, "N s/rad", 0.4, 0.6)}, 30.0)
    (whole,) = all_accepted((finding,), (damping,))
    assert whole.cause.values.tolist() == [2.5, -1.5]
    assert whole.parameters["N_v"].value == -1.5


def diagnosis_of(case, **more):
    return diagnosed(case, QUADRATIC_DRAG, DEAD_ZONE, DVL_MISALIGNMENT, **more)


@pytest.mark.slow
def test_a_drag_that_was_accepted_is_no_gap_on_the_same_dive_and_its_loss_is_a_change_of_it():
    with_drag = draw_case(300051, names=["quadratic_drag"], size=0.7, seconds=85.0)
    without = draw_case(300051, names=[], seconds=85.0)
    first = diagnosis_of(with_drag)
    assert [finding.name for finding in first.findings] == ["quadratic_drag"]
    effects = first.accepted.effects
    again = diagnosis_of(with_drag, effects_accepted=effects)
    assert (again.verdict, again.findings) == ("no_gap", ())
    after = [drift.total for drift in first.gap.after if drift.horizon_s == 5.0]
    assert again.gap.before == pytest.approx(after[0], abs=0.1)
    assert any("holds what was accepted: quadratic drag" in note for note in again.notes)
    lost = diagnosis_of(without, effects_accepted=effects)
    (finding,) = lost.findings
    assert effect_words(finding.cause.effect) == "a change of quadratic drag"
    gone = {name: value for name, value in finding.parameters.items() if abs(value.value) > 1e-9}
    for name, value in gone.items():
        had = first.findings[0].parameters[name]
        assert value.value == pytest.approx(-had.value, abs=2 * (had.high95 - had.low95))
    assert set(gone) >= {
        max(first.findings[0].parameters, key=lambda n: first.findings[0].parameters[n].value)
    }


def test_values_are_accepted_as_fitted_without_a_cause_that_only_shows():
    case = draw_case(300051, names=["quadratic_drag"], size=0.7, seconds=85.0)
    nominal = planted_nominal(case)
    explanation = explained(nominal, QUADRATIC_DRAG)
    (shown,) = explanation.causes
    assert explanation.now.course.damping[0] < 0.9 * nominal.course.damping[0]
    known = known_with_causes([shown], explanation.now)
    shape = nominal.course.configuration
    accepted = likely_accepted((), explanation, known, nominal, (QUADRATIC_DRAG,), (), shape)
    assert accepted.values["D_u"].value == pytest.approx(nominal.course.damping[0], rel=0.02)


SHIFTED_LIBRARY = (THRUST_GAIN, DVL_SCALE, ENTRAINED_WATER, ADDED_PAYLOAD, QUADRATIC_DRAG)
RELATIVE_STD = 0.01


@pytest.fixture(scope="module")
def measured_shift():
    return explained(drawn_nominal(100_302, 150.0), QUADRATIC_DRAG)


def accepted(measured_shift, mass=1.0, damping=1.0):
    """What was accepted, where the dive's own values are so many times that."""
    course, out = measured_shift.now.course, {}
    for dof in range(6):
        before, braking = course.mass[dof] / mass, course.damping[dof] / damping
        out[MASSES[dof].name] = Prior(before, RELATIVE_STD * before)
        if braking > 0:
            out[DAMPINGS[dof].name] = Prior(braking, RELATIVE_STD * braking)
    return out


def changes(measured_shift, shift):
    nothing = np.zeros_like(measured_shift.now.course.nu[::EACH])
    missing = Missing(measured_shift.now.course.time_s[::EACH], nothing, nothing, nothing)
    return changes_of(shift, measured_shift, missing)


def changes_since(measured_shift, earlier):
    return changes(measured_shift, shift_of(measured_shift, earlier, SHIFTED_LIBRARY))


def test_where_nothing_changed_there_is_no_cause(measured_shift):
    causes, tried = changes_since(measured_shift, accepted(measured_shift))
    assert causes == ()
    assert {trial.name for trial in tried} == {"thrust_gain", "dvl_scale", "entrained_water", "added_payload"}
    assert not any(trial.accepted for trial in tried)


def test_masses_and_dampings_that_all_rose_alike_are_a_thrust_that_fell(measured_shift):
    causes, _ = changes_since(measured_shift, accepted(measured_shift, mass=1.25, damping=1.25))
    assert causes[0].name == "thrust_gain"
    gain = causes[0].parameters["gain"]
    assert gain.value == pytest.approx(0.8, abs=0.02)
    assert gain.low95 < gain.value < gain.high95
    assert causes[0].feedforward is not None


def test_a_change_that_pushes_less_than_a_thrust_curve_is_known_to_is_no_cause(measured_shift):
    (fell, *_), _ = changes_since(measured_shift, accepted(measured_shift, mass=1.25, damping=1.25))

    def by(share):
        return replace(fell, cause=replace(fell.cause, values=np.array([1.0 + share])))

    read = replace(fell, cause=Cause(DVL_SCALE, np.array([1.001])))
    slight, strong = by(0.01), by(-0.05)
    assert beyond_the_curve((slight, strong, read), measured_shift.now.course) == ((strong, read), (slight,))


def test_masses_that_all_rose_by_as_much_are_water_that_weighs_so(measured_shift):
    course = measured_shift.now.course
    water = ENTRAINED_WATER.act(course, ENTRAINED_WATER.none() + 6.0).mass
    earlier = accepted(measured_shift)
    for dof in range(6):
        before = course.mass[dof] - water[dof]
        earlier[MASSES[dof].name] = Prior(before, RELATIVE_STD * before)
    causes, _ = changes_since(measured_shift, earlier)
    assert causes[0].name == "entrained_water"
    assert causes[0].parameters["mass"].value == pytest.approx(6.0, abs=0.05)


@pytest.mark.parametrize(
    ("damping", "said"),
    [
        (1.25, "fouling explains: more drag in all degrees of freedom than when"),
        (0.8, "less fouling explains: less drag in all degrees of freedom than when"),
    ],
)
def test_dampings_that_all_fell_alike_are_a_hull_that_was_cleaned_and_no_more_drag(
    measured_shift, damping, said
):
    shift = shift_of(
        measured_shift, accepted(measured_shift, damping=damping), (*SHIFTED_LIBRARY, FOULING_SINCE)
    )
    (cause,), _ = changes(measured_shift, shift)
    assert cause.cause.values == pytest.approx([1.0 - 1.0 / damping], abs=0.01)
    assert f"{effect_words(cause.cause.effect)} explains: {cause.cause.effect.sentence}".startswith(said)


def test_a_payload_that_was_taken_off_is_said_to_be_gone(measured_shift):
    course, earlier = measured_shift.now.course, accepted(measured_shift)
    off = ADDED_PAYLOAD.act(course, np.array([6.0]))
    for group, now, more in ((MASSES, course.mass, off.mass), (DAMPINGS, course.damping, off.damping)):
        for name, before in zip([item.name for item in group], now + more, strict=True):
            if name in earlier:
                earlier[name] = Prior(before, RELATIVE_STD * before)
    cause = changes_since(measured_shift, earlier)[0][0]
    assert cause.parameters["mass"].value == pytest.approx(-6.0, abs=0.1)
    assert effect_words(cause.cause.effect) == "less added payload"
    assert cause.cause.effect.sentence.startswith("a payload that was there before and is not now")


def test_only_what_was_accepted_is_compared(measured_shift):
    earlier = {"M_u": accepted(measured_shift, mass=1.25)["M_u"]}
    shift = shift_of(measured_shift, earlier, SHIFTED_LIBRARY)
    assert shift.size.shape == (1,)
    assert shift.size[0] == pytest.approx(-0.2, abs=1e-6)


SURGE, YAW, OF_MASS, OF_DAMPING = 0, 5, 0, 6
FITS = Multiplier(0.0, 0.0, np.zeros(18))


@pytest.fixture
def fit(monkeypatch):
    """A switch: what the tests of the fit say, by degree of freedom."""

    def says(**doubts):
        by_axis = {SURGE: Doubts(doubts.get("drag", FITS), doubts.get("late", FITS)), YAW: Doubts(FITS, FITS)}
        monkeypatch.setattr(diagnose_accepted, "doubts_of", lambda _joint, _theta: by_axis)

    return says


def changing(score, size, row, by):
    """A force of this size that changes one logarithm by so much."""
    leaning = np.zeros(18)
    leaning[row] = by / size
    return Multiplier(score, size, leaning)


def drag(**coefficients):
    values = [coefficients.get(name, 0.0) for name in ("X_uu", "Y_vv", "Z_ww", "K_pp", "M_qq", "N_rr")]
    parameters = {name: Value(size, "N s2/m2", 0.9 * size, 1.1 * size) for name, size in coefficients.items()}
    return Finding(Cause(hydrodynamics.QUADRATIC_DRAG, np.array(values)), (), {}, 0.98, parameters, 50.0)


ASTERN = Finding(
    Cause(actuators.REVERSE_THRUST_LOSS, np.array([0.7])), (), {}, 0.98, {"gain": Value(0.7, "1", 0.6, 0.8)}, 50.0
)  # fmt: skip


def test_thrust_that_acts_late_beside_the_causes_is_a_doubt_of_its_axis_and_widens_it(nominal, shape, fit):
    fit()
    plain = accepted_of((ASTERN,), nominal, shape)
    before = plain.values
    assert plain.doubts == ()
    fit(late=changing(8.0, 0.02, OF_MASS, 0.1))
    accepted = accepted_of((ASTERN,), nominal, shape)
    (doubt,) = accepted.doubts
    assert {"M_u", "D_u"} <= set(doubt.about)
    assert doubt.outcome is Outcome.DISAGREES
    assert "later, by about 20 ms" in doubt.sentence
    value, low = accepted.values["M_u"].value, accepted.values["M_u"].low95
    assert value == before["M_u"].value
    spread = np.log(before["M_u"].value / before["M_u"].low95)
    assert np.log(value / low) == pytest.approx(np.hypot(spread, 1.96 * 0.1), rel=1e-3)
    assert accepted.values["M_v"] == before["M_v"]


def test_a_drag_that_lacks_is_the_doubt_that_an_identification_has_of_it(nominal, shape, fit):
    fit(drag=changing(9.0, 3.0, OF_DAMPING, -0.3))
    (doubt,) = accepted_of((ASTERN,), nominal, shape).doubts
    assert (doubt.about, doubt.outcome) == (("M_u", "D_u"), Outcome.DISAGREES)
    assert "grows as the speed squared is missing" in doubt.sentence


def test_linear_damping_that_quadratic_drag_may_replace_begins_at_none(nominal, shape, fit):
    fit(drag=changing(9.0, 3.0, OF_DAMPING, -0.9))
    accepted = accepted_of((drag(X_uu=40.0),), nominal, shape)
    (doubt,) = accepted.doubts
    assert (doubt.about, doubt.outcome) == (("D_u",), Outcome.CONVERGED)
    assert "more quadratic drag than was accepted and less linear damping" in doubt.sentence
    damping = accepted.values["D_u"]
    assert damping.low95 == 0.0
    assert damping.high95 > damping.value * (1.0 + 1.96 * 0.9)
    assert accepted.values["D_v"].low95 > 0.0


def test_drag_that_lacks_in_surge_lacks_though_quadratic_drag_was_accepted_in_sway(nominal, shape, fit):
    fit(drag=changing(9.0, 3.0, OF_DAMPING, -0.3))
    surge_alone, sway_alone = np.eye(6)[:2] * 12.0
    sentences = []
    for values in (surge_alone, sway_alone):
        whole = all_accepted((), (Cause(QUADRATIC_DRAG, values),))
        (doubt,) = accepted_of(whole, nominal, shape).doubts
        sentences.append(doubt.sentence)
    assert "more quadratic drag than was accepted" in sentences[0]
    assert "grows as the speed squared is missing" in sentences[1]


def test_an_axis_whose_thrust_follows_what_was_not_recorded_is_not_called_late(nominal, shape, fit):
    fit(late=changing(8.0, 0.02, OF_MASS, 0.1))
    assert accepted_of((ASTERN,), replace(nominal, feedback_unrecorded=(SURGE,)), shape).doubts == ()


@pytest.mark.parametrize("times", [3.0, 0.2])
def test_no_mass_is_accepted_below_the_rigid_body_s_or_beyond_what_water_adds(times):
    """A vehicle file of three times the mass, or of a fifth of it, is of another vehicle."""
    nominal = drawn_nominal()
    shape = nominal.course.configuration
    assert "M_u" in accepted_of((), nominal, shape).values
    other = replace(shape, dry_mass_kg=times * shape.dry_mass_kg)
    refused = accepted_of((), nominal, other)
    assert "M_u" not in refused.values
    assert "D_u" not in refused.values


@pytest.fixture(scope="module")
def draggy():
    """A dive of a hull with quadratic drag, whose file says so, and its diagnosis."""
    case = draw_case(300_933, names=["quadratic_drag"], seconds=150.0)
    file = damped(case.file, "both")
    return case, file, diagnose(dive_of(case), file, case.configuration, progress=quiet)


def test_a_quadratic_drag_that_the_file_gives_its_hull_is_no_cause_but_a_coefficient(draggy):
    case, _, diagnosis = draggy
    assert (diagnosis.verdict, diagnosis.findings) == ("no_gap", ())
    truth = case.truth()["effects"][0]["parameters"]
    for name in ("X_uu", "Y_vv", "Z_ww", "N_rr"):
        assert diagnosis.numbers[name].low95 < truth[name] < diagnosis.numbers[name].high95


def test_of_a_hull_with_quadratic_drag_alone_no_linear_damping_is_accepted(draggy):
    case, file, _ = draggy
    alone = damped(file, "quadratic")
    shape = alone.vehicle.configurations[case.configuration]
    nominal = nominal_of(dive_of(case), alone, case.configuration)
    values = accepted_of((), nominal, shape).values
    assert "X_uu" in values
    assert not {item.name for item in DAMPINGS} & values.keys()
    heard = replace(nominal, feedback_unrecorded=(SURGE,))
    assert accepted_of((), heard, shape).sentences[0].startswith("M_u and X_uu stay as the vehicle has them")


@pytest.mark.parametrize(("elsewhere", "nats"), [(0.0, 50.0), (0.3, 50.0 / 900.0)], ids=["alone", "doubtful"])
def test_a_second_change_counts_by_what_is_left_unexplained(elsewhere, nats):
    """Published numbers that are off everywhere leave a shift that no effect has, and any effect takes some of it."""
    effects, patterns = (ADDED_PAYLOAD, FOULING), np.eye(4)[:2]
    shift = Shift(np.array([0.5, 0.1, elsewhere, elsewhere]), 1e4 * np.eye(4), effects, patterns)
    assert shift.best_further([]) == [(pytest.approx(1250.0), 0), (pytest.approx(50.0), 1)]
    assert shift.best_further([0]) == [(pytest.approx(nats), 1)]


def test_a_second_change_is_stated_with_what_it_saves_of_what_is_left_unexplained(measured_shift):
    effects, patterns = (ADDED_PAYLOAD, FOULING), np.eye(4)[:2]
    shift = Shift(np.array([0.5, 0.2, 0.02, 0.02]), 1e4 * np.eye(4), effects, patterns)
    causes, _ = changes(measured_shift, shift)
    assert [cause.gain_nats for cause in causes] == pytest.approx([1250.0, 200.0 / 4.0])


@pytest.mark.slow
def test_an_accepted_lag_of_the_shafts_speed_is_in_the_model_before():
    still = draw_case(300051, names=[], seconds=85.0)
    lag = AcceptedEffect("thruster_lag", "thruster_lag (of the shafts' speed)", {"time_constant": 0.2})
    notes = diagnosis_of(still, effects_accepted=(lag,)).notes
    assert any("holds what was accepted: thruster lag" in note for note in notes)
    assert not any("this library has no such effect" in note for note in notes)


def test_what_has_grown_on_a_hull_since_takes_the_same_share_of_a_small_drag_as_of_a_large_one(nominal):
    small = replace(nominal, course=replace(nominal.course, damping=1e-3 * nominal.course.damping))
    for now in (nominal, small):
        assert _direct_pattern(FOULING_SINCE, now, ("M_u", "D_u", "D_r")) == pytest.approx([0.0, -1.0, -1.0])
