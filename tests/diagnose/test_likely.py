"""Causes that are less probable than not are not accepted, nor are the masses and dampings fitted beside them."""

from dataclasses import replace

import pytest

from bridge.effects.hydrodynamics import COUPLED_DAMPING, QUADRATIC_DRAG
from identify.challenge.case import dive_of, draw_case
from identify.diagnose.cause import Cause
from identify.diagnose.diagnose import diagnose
from identify.diagnose.diagnosis import Found
from identify.diagnose.likely import accepted
from identify.diagnose.nominal import nominal_of
from identify.diagnose.search import explained_by


@pytest.fixture(scope="module")
def case():
    return draw_case(3_850_000_010, names=["quadratic_drag"], size=0.9, seconds=110.0)


def test_a_cause_less_probable_than_not_leaves_the_model_that_is_accepted(case):
    nominal, library = (
        nominal_of(dive_of(case), case.file, case.configuration),
        (QUADRATIC_DRAG, COUPLED_DAMPING),
    )
    shape = case.file.vehicle.configurations[case.configuration]
    drag = Cause(QUADRATIC_DRAG, QUADRATIC_DRAG.start())
    found = explained_by([drag], nominal, library)
    sure = Found(found.causes[0], (), {}, 0.9, {}, 30.0)
    whole = accepted([sure], found, nominal, library, (), shape)
    none = accepted([replace(sure, probability=0.42)], found, nominal, library, (), shape)
    assert [one.name for one in whole.effects] == ["quadratic_drag"]
    assert none.effects == ()
    assert none.sentences[0] == (
        "Quadratic drag was not accepted: it is 42 % probable, likelier absent than present."
    )
    # Without its quadratic part, all of the drag is linear again.
    plain = explained_by([], nominal, library).now
    assert none.values["D_u"].value == pytest.approx(float(plain.course.damping[0]))
    assert none.values["D_u"].value > 1.02 * whole.values["D_u"].value


def test_a_short_dive_is_told_to_be_one(case):
    said = diagnose(
        dive_of(case),
        case.file,
        case.configuration,
        effects=(QUADRATIC_DRAG,),
        progress=lambda _share, _words: None,
    )
    assert any("lasts 110 s: with so few pieces of 20 s" in note for note in said.notes)
