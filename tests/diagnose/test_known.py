"""Effects that were accepted earlier: in the model before, and what has changed of them is found as such."""

from dataclasses import replace

import numpy as np
import pytest

from bench.missions.mission import draw_one
from bridge.vehicle.accepted_effect import AcceptedEffect
from identify.challenge.case import dive_of, draw_case
from identify.diagnose.accepted import accepted_of
from identify.diagnose.candidates import Cause
from identify.diagnose.changed import (
    accepted_causes,
    all_accepted,
    held_sentence,
    library_with_changes,
    with_accepted,
)
from identify.diagnose.diagnose import diagnose
from identify.diagnose.nominal import nominal_of
from identify.diagnose.result import Finding, Value
from identify.diagnose.simulation import simulation_of, slope_of
from identify.diagnose.wording import effect_words
from identify.effects.actuators import DEAD_ZONE, SATURATION, THRUST_GAIN, weak
from identify.effects.environment import STEADY_CURRENT
from identify.effects.hydrodynamics import QUADRATIC_DRAG
from identify.effects.sensors import DVL_MISALIGNMENT

WEAK = weak(2)
LIBRARY = (QUADRATIC_DRAG, DEAD_ZONE, SATURATION, THRUST_GAIN, STEADY_CURRENT, DVL_MISALIGNMENT, WEAK)
DRAG = np.array([12.0, 8.0, 0.0, 0.0, 0.0, 3.0])


def kept(effect, *values):
    """An accepted effect as a file has it."""
    names = (p.name for p in effect.parameters)
    return AcceptedEffect(effect.name, effect.label, dict(zip(names, values, strict=True)), effect.number)


@pytest.fixture(scope="module")
def mission():
    return draw_one(100_300, seconds=60.0)


@pytest.fixture(scope="module")
def nominal(mission):
    return nominal_of(mission.dive, mission.file, mission.configuration)


def test_what_is_the_vehicles_own_is_taken_along_and_what_is_not_is_told():
    accepted = (
        kept(QUADRATIC_DRAG, *DRAG),
        kept(WEAK, 0.7),
        kept(THRUST_GAIN, 0.9),
        kept(STEADY_CURRENT, 0.1, 0.1),
        AcceptedEffect("kraken", "kraken", {"arms": 8.0}),
    )
    causes, (sentence,) = accepted_causes(accepted, LIBRARY)
    assert [cause.effect for cause in causes] == [QUADRATIC_DRAG, WEAK]
    np.testing.assert_array_equal(causes[0].values, DRAG)
    assert "steady current (of that dive alone)" in sentence
    assert "kraken (this library has no such effect)" in sentence
    assert "thrust gain" not in sentence


def test_the_model_before_says_which_accepted_effects_it_holds():
    (sentence,) = held_sentence((Cause(QUADRATIC_DRAG, DRAG),))
    assert sentence.startswith("The model before holds what was accepted: quadratic drag (X_uu 12")
    assert "Z_ww" not in sentence
    assert held_sentence(()) == ()


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
    for p, own, value in zip(change.parameters, effect.parameters, before, strict=True):
        assert (p.low + value, p.high + value) == pytest.approx((own.low, own.high))


def test_what_was_not_accepted_is_tried_as_before_and_so_is_a_limit_on_top_of_one():
    limit = Cause(SATURATION, SATURATION.start())
    assert library_with_changes(LIBRARY, (limit,)) == LIBRARY
    changed = library_with_changes(LIBRARY, (Cause(QUADRATIC_DRAG, DRAG),))
    assert changed[0].name == "quadratic_drag"
    assert changed[1:] == LIBRARY[1:]


def test_a_dive_is_without_what_its_model_holds_and_flies_with_it(nominal):
    drag = Cause(QUADRATIC_DRAG, DRAG)
    own = with_accepted(nominal, (drag,))
    assert with_accepted(nominal, ()) is nominal
    assert (own.accepted, own.acts) == ((drag,), ())
    surge, before = own.joint.problems[0].axis, nominal.joint.problems[0].axis
    assert (surge.quadratic, before.quadratic) == (DRAG[0], 0.0)
    problem, place = own.joint.problems[0], own.joint.places[0]
    free = replace(problem, axis=replace(surge, quadratic=0.0))
    braked = problem.mean_force(own.theta[place]) - free.mean_force(own.theta[place])
    # About the speed that is expected: what the slope there brakes the filter takes from its own speed.
    expected = DRAG[0] * (problem.slope - np.abs(surge.speed)) * surge.speed
    np.testing.assert_allclose(braked, np.column_stack([expected, expected]))
    assert 0.0 < np.abs(problem.slope - 2.0 * np.abs(surge.speed)).max() <= problem.slope.min() * 1.001
    np.testing.assert_array_equal(
        simulation_of(own, own.theta, own.motion.nu).slope, slope_of((drag,), own.course)[::2]
    )


def test_accepting_again_keeps_what_was_accepted_with_its_change_in_it(nominal, mission):
    drag, weak_one = Cause(QUADRATIC_DRAG, DRAG), Cause(WEAK, np.array([0.7]))
    (change,) = library_with_changes((QUADRATIC_DRAG,), (drag,))
    by = Cause(change, np.array([-5.0, 0, 0, 0, 0, 0]))
    found = Finding(by, (), {}, 0.9, {"X_uu": Value(-5.0, "N s2/m2", -6.0, -4.0)}, 30.0)
    whole = all_accepted((found,), (drag, weak_one))
    told = whole[0].parameters
    assert told["X_uu"] == Value(7.0, "N s2/m2", 6.0, 8.0)
    assert told["Z_ww"] == Value(0.0, "N s2/m2", 0.0, 0.0)
    shape = mission.file.vehicle.configurations[mission.configuration]
    accepted = accepted_of(whole, nominal, shape)
    values = {name: accepted.values[name].value for name in ("X_uu", "Y_vv", "N_rr", "T2_gain")}
    assert values == pytest.approx({"X_uu": 7.0, "Y_vv": 8.0, "N_rr": 3.0, "T2_gain": 0.7})
    assert not {"Z_ww", "K_pp", "M_qq"} & set(accepted.values)
    assert [one.label for one in accepted.effects] == ["quadratic_drag", "weak_thruster of thruster 2"]
    assert all_accepted((), ()) == ()


def told(case, **more):
    return diagnose(
        dive_of(case),
        case.file,
        case.configuration,
        effects=(QUADRATIC_DRAG, DEAD_ZONE, DVL_MISALIGNMENT),
        progress=lambda *_report: None,
        **more,
    )


@pytest.mark.slow
def test_a_drag_that_was_accepted_is_no_gap_on_the_same_dive_and_its_loss_is_a_change_of_it():
    with_drag = draw_case(300051, names=["quadratic_drag"], size=0.7, seconds=110.0)
    without = draw_case(300051, names=[], seconds=110.0)
    first = told(with_drag)
    assert [one.name for one in first.findings] == ["quadratic_drag"]
    effects = first.accepted.effects
    again = told(with_drag, effects_accepted=effects)
    assert (again.verdict, again.findings) == ("no_gap", ())
    after = [drift.total for drift in first.gap.after if drift.horizon_s == 5.0]
    assert again.gap.before == pytest.approx(after[0], abs=0.1)
    assert any("holds what was accepted: quadratic drag" in note for note in again.notes)
    lost = told(without, effects_accepted=effects)
    (one,) = lost.findings
    assert effect_words(one.cause.effect) == "a change of quadratic drag"
    gone = {name: value for name, value in one.parameters.items() if abs(value.value) > 1e-9}
    for name, value in gone.items():
        had = first.findings[0].parameters[name]
        assert value.value == pytest.approx(-had.value, abs=2 * (had.high95 - had.low95))
    assert set(gone) >= {
        max(first.findings[0].parameters, key=lambda n: first.findings[0].parameters[n].value)
    }


def test_a_cause_that_another_dive_names_otherwise_is_left_as_it_is():
    drag = Cause(QUADRATIC_DRAG, DRAG)
    other = Finding(Cause(DEAD_ZONE, np.array([0.5])), (), {}, 0.9, {}, 12.0)
    assert all_accepted((other,), (drag,))[1] is other
