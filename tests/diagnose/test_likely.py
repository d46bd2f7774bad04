"""Causes that are less probable than not are not accepted, nor are the masses and dampings fitted beside them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from identify.challenge.case import dive_of, draw_case
from identify.diagnose.accepted import likely_accepted
from identify.diagnose.candidates import Cause
from identify.diagnose.diagnose import diagnose
from identify.diagnose.findings import strongest_first
from identify.diagnose.nominal import nominal_of
from identify.diagnose.recording import ENOUGH_S, short_dive_note
from identify.diagnose.result import Finding
from identify.diagnose.search import explained_by
from identify.dive import Dive, Signal
from identify.effects.hydrodynamics import COUPLED_DAMPING, QUADRATIC_DRAG


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
    sure = Finding(found.causes[0], (), {}, 0.9, {}, 30.0)
    whole = likely_accepted([sure], found, nominal, library, (), shape)
    none = likely_accepted([replace(sure, probability=0.42)], found, nominal, library, (), shape)
    assert [one.name for one in whole.effects] == ["quadratic_drag"]
    assert none.effects == ()
    assert none.sentences[0] == (
        "Quadratic drag was not accepted: it is 42 % probable, likelier absent than present."
    )
    # Without its quadratic part, all of the drag is linear again.
    plain = explained_by([], nominal, library).now
    assert none.values["D_u"].value == pytest.approx(float(plain.course.damping[0]))
    assert none.values["D_u"].value > 1.02 * whole.values["D_u"].value


def test_an_accepted_cause_comes_before_a_possible_one_whatever_nats_each_saves():
    def one(probability: float, gain_nats: float) -> Finding:
        return Finding(Cause(QUADRATIC_DRAG, QUADRATIC_DRAG.start()), (), {}, probability, {}, gain_nats)

    heard, possible, strong, stronger = one(0.9, 0.0), one(0.499, 80.0), one(0.972, 40.0), one(0.968, 60.0)
    half = one(0.5, 1.0)
    given = (possible, half, heard, strong, stronger)
    assert strongest_first(given) == (stronger, strong, heard, half, possible)


def test_a_dive_just_too_short_is_not_told_to_last_as_long_as_it_should():
    dive = Dive("d", Path("d"), "", velocity=Signal(np.array([0.0, ENOUGH_S - 0.1]), np.zeros((2, 3))))
    (note,) = short_dive_note(dive)
    assert note.startswith(f"The dive lasts {ENOUGH_S - 1:.0f} s: ")
    assert note.endswith(f"dive {ENOUGH_S:.0f} s or more.")


def test_a_short_dive_is_told_to_be_one(case):
    said = diagnose(
        dive_of(case),
        case.file,
        case.configuration,
        effects=(QUADRATIC_DRAG,),
        progress=lambda *_report: None,
    )
    assert any("lasts 109 s: with so little of it to hold out" in note for note in said.notes)
