"""Where the gap of a dive lies whose recording lacks what the controller used, beside causes in the motion."""

from dataclasses import replace

import pytest

from bridge.vehicle.coefficients import DOFS
from identify.challenge.case import dive_of, draw_case
from identify.checks.controller import unrecorded
from identify.diagnose import diagnose as module
from identify.diagnose.diagnose import diagnose
from identify.diagnose.findings import FEEDBACK_DOFS
from identify.diagnose.nominal import nominal_of
from identify.diagnose.recording import unjudged_notes
from identify.diagnose.unexplained import unexplained_of
from identify.diagnose.weighing import weighing_of
from identify.effects.hydrodynamics import QUADRATIC_DRAG


@pytest.fixture(scope="module")
def case():
    return draw_case(391_720, names=["wrong_feedback_log", "quadratic_drag"], size=0.9, seconds=110.0)


def where(case) -> set[str]:
    found = diagnose(
        dive_of(case), case.file, case.configuration, effects=(QUADRATIC_DRAG,), progress=lambda *_: None
    )
    assert {one.name for one in found.findings} == {"wrong_feedback_log", "quadratic_drag"}
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


def test_no_unknown_force_is_looked_for_where_the_controller_may_have_used_the_same_unrecorded_velocity(case):
    nominal = nominal_of(dive_of(case), case.file, case.configuration)
    assert 1 in nominal.doubted
    assert nominal.suspected == (0, 2)
    assert "In surge and heave no unknown force" in " ".join(unjudged_notes(nominal))
    assert not {*nominal.suspected, *nominal.doubted} & pushed(nominal)
    # As if the recorded velocity were the controller's: its answers to the sea look like forces there.
    trusted = replace(nominal, doubted=tuple(dof for dof in nominal.doubted if dof > 2))
    assert trusted.suspected == ()
    assert {0, 2} <= pushed(trusted)


def pushed(nominal) -> set[int]:
    """The degrees of freedom in which an unknown force is found, with nothing else to name."""
    weighing = weighing_of(nominal, ())
    return {shape.dof for shape in unexplained_of(weighing, weighing.fitted(())).shapes}
