"""Where the gap of a dive lies whose recording lacks what the controller used, beside causes in the motion."""

from dataclasses import replace

import pytest

from bridge.effects.hydrodynamics import QUADRATIC_DRAG
from bridge.vehicle.coefficients import DOFS
from identify.challenge.case import dive_of, draw_case
from identify.diagnose import diagnose as module
from identify.diagnose.diagnose import diagnose
from identify.diagnose.findings import FEEDBACK_DOFS
from identify.feedback import unrecorded


@pytest.fixture(scope="module")
def case():
    return draw_case(391_720, names=["wrong_feedback_log", "quadratic_drag"], size=0.9, seconds=110.0)


def where(case) -> set[str]:
    found = diagnose(
        dive_of(case), case.file, case.configuration, effects=(QUADRATIC_DRAG,), progress=lambda *_: None
    )
    assert {one.name for one in found.found} == {"wrong_feedback_log", "quadratic_drag"}
    return {one.dof for one in found.gap.where}


def test_a_gap_lies_where_the_log_is_wrong_unless_a_cause_in_the_motion_is_accepted_too(case, monkeypatch):
    doubted = {
        DOFS[one.dof]
        for one in unrecorded(dive_of(case), case.file.vehicle.water)
        if one.dof in FEEDBACK_DOFS
    }
    assert doubted
    by_drag = where(case)
    assert by_drag - doubted
    found_of = module.findings_of

    def possible(*given):
        return tuple(
            one if one.cause.effect.place == "log" else replace(one, probability=0.4)
            for one in found_of(*given)
        )

    monkeypatch.setattr(module, "findings_of", possible)
    assert where(case) <= doubted
