"""A cause that another would do as well as is told with that other, and never surer than evidence makes it."""

from dataclasses import replace

import numpy as np
import pytest

from identify.challenge.case import dive_of, draw_case
from identify.diagnose.candidates import Cause, other_forms
from identify.diagnose.confidence import ambiguity_of
from identify.diagnose.findings import trials_of
from identify.diagnose.nominal import nominal_of
from identify.diagnose.result import Finding
from identify.diagnose.search import LEAST_GAIN, explain
from identify.diagnose.verdict import MOST_PROBABLE, probability
from identify.effects.hydrodynamics import QUADRATIC_DRAG
from identify.effects.rigid_body import NET_BUOYANCY, THRUST_BIAS

LIBRARY = (NET_BUOYANCY, THRUST_BIAS, QUADRATIC_DRAG)


@pytest.fixture(scope="module")
def heavy():
    case = draw_case(300_921, names=["net_buoyancy"], size=0.8, seconds=120.0, rpm=False)
    nominal = nominal_of(dive_of(case), case.file, next(iter(case.file.vehicle.configurations)))
    return explain(nominal, LIBRARY, lambda *_report: None)


def test_weight_and_a_steady_push_down_are_one_to_a_vehicle_that_stays_level(heavy):
    (cause,) = heavy.causes
    alike = ambiguity_of(heavy, 0)
    # A weight says less than a push in any direction.
    assert (cause.effect.name, alike.names) == ("net_buoyancy", ("thrust_bias",))
    assert all(one > 0.99 for one in alike.likeness.values())
    assert alike.margin_nats > 20


def test_a_cause_is_as_probable_as_its_margin_and_never_certain():
    margins = np.array([-5.0, 0.0, 3.0, 6.0, 20.0, 1e6])
    told = np.array([probability(one) for one in margins])
    assert np.all(np.diff(told) >= 0)
    assert told[0] == 0.0
    assert told[-1] == pytest.approx(MOST_PROBABLE, abs=1e-4)


def test_a_drag_of_another_power_is_made_up_for_by_the_forms_of_a_quadratic_one(heavy):
    course = heavy.now.course
    cause = Cause(QUADRATIC_DRAG, np.array([10.0, 0.0, 0.0, 0.0, 0.0, 0.0]))
    surge = course.nu[:, 0]
    true = -np.sign(surge) * np.abs(surge) ** 1.8
    own = cause.act(course).wrench[:, 0]
    others = [act.wrench[:, 0] for act in other_forms(course, cause)]
    whole = np.column_stack([own, *others])
    left = true - whole @ np.linalg.lstsq(whole, true, rcond=None)[0]
    alone = true - own * (own @ true) / (own @ own)
    assert np.linalg.norm(left) < 0.2 * np.linalg.norm(alone)


def test_what_does_as_well_but_is_not_alike_is_no_other_name_for_a_cause(heavy, monkeypatch):
    monkeypatch.setattr("identify.diagnose.confidence.LEAST_LIKENESS", 1.1)
    alike = ambiguity_of(heavy, 0)
    assert (alike.names, alike.likeness) == ((), {})
    assert alike.margin_nats > 20


def test_every_effect_of_the_library_is_told_with_what_it_saves_beside_the_accepted_one(heavy):
    (cause,) = heavy.causes
    mine = Finding(cause, (), {}, 0.9, {}, heavy.fit.gain)
    tried = trials_of(heavy, (mine,))
    assert {one.name for one in tried} == {effect.name for effect in LIBRARY}
    assert [one.label for one in tried if one.accepted] == [cause.effect.label]
    twin = next(one for one in tried if one.name in {"net_buoyancy", "thrust_bias"} and not one.accepted)
    assert twin.gain_nats < 2.0
    assert all(one.why == "" for one in tried if one.gain_nats <= LEAST_GAIN)


def test_a_small_weight_shows_as_early_as_a_push_that_is_as_large():
    small = 0.09
    assert Cause(NET_BUOYANCY, np.array([small])).shows
    assert Cause(THRUST_BIAS, np.array([0.0, 0.0, small, 0.0])).shows


def test_where_all_but_the_form_is_alike_a_few_nats_of_thousands_tell_nothing_apart():
    case = draw_case(3_860_000_011, names=[], seconds=110.0)
    shape = case.file.vehicle.configurations[case.configuration]
    vehicle = replace(
        case.file.vehicle,
        configurations={case.configuration: replace(shape, net_buoyancy_n=shape.net_buoyancy_n + 6.0)},
    )
    found = explain(
        nominal_of(dive_of(case), replace(case.file, vehicle=vehicle), case.configuration),
        LIBRARY,
        lambda *_: None,
    )
    alike = ambiguity_of(found, 0)
    assert {found.causes[0].effect.name, *alike.names} == {"net_buoyancy", "thrust_bias"}
    assert alike.margin_nats > 1000
