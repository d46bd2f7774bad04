"""What has changed since parameters were accepted: a pattern of shifts, each in the sizes that its cause has."""

import numpy as np
import pytest

from bench.missions.mission import draw_one
from bridge.vehicle.coefficients import DAMPINGS, MASSES
from bridge.vehicle.config import Prior
from identify.diagnose.changed import changes_of, shift_of
from identify.diagnose.gap import Missing
from identify.diagnose.nominal import nominal_of
from identify.diagnose.search import explain
from identify.diagnose.simulation import EACH
from identify.effects.actuators import THRUST_GAIN
from identify.effects.hydrodynamics import QUADRATIC_DRAG
from identify.effects.rigid_body import ADDED_PAYLOAD, ENTRAINED_WATER
from identify.effects.sensors import DVL_SCALE

LIBRARY = (THRUST_GAIN, DVL_SCALE, ENTRAINED_WATER, ADDED_PAYLOAD, QUADRATIC_DRAG)
RELATIVE_STD = 0.01


def quiet(*_report):
    pass


@pytest.fixture(scope="module")
def found():
    mission = draw_one(100_302, seconds=150.0)
    nominal = nominal_of(mission.dive, mission.file, mission.configuration)
    return explain(nominal, (QUADRATIC_DRAG,), quiet)


def accepted(found, mass=1.0, damping=1.0, more_kg=0.0):
    """What was accepted, where the dive's own values are so many times that; the dive weighs `more_kg` more."""
    course, out = found.now.course, {}
    for dof in range(6):
        before_kg = course.mass[dof] / mass - (more_kg if dof < 3 else 0.0)
        out[MASSES[dof].name] = Prior(before_kg, RELATIVE_STD * before_kg)
        if course.damping[dof] > 0:
            out[DAMPINGS[dof].name] = Prior(
                course.damping[dof] / damping, RELATIVE_STD * course.damping[dof] / damping
            )
    return out


def told(found, earlier):
    nothing = np.zeros_like(found.now.course.nu[::EACH])
    missing = Missing(found.now.course.time_s[::EACH], nothing, nothing, nothing)
    return changes_of(shift_of(found, earlier, LIBRARY), found, missing)


def test_where_nothing_changed_there_is_no_cause(found):
    causes, tried = told(found, accepted(found))
    assert causes == ()
    assert {one.name for one in tried} == {"thrust_gain", "dvl_scale", "entrained_water", "added_payload"}
    assert not any(one.accepted for one in tried)


def test_masses_and_dampings_that_all_rose_alike_are_a_thrust_that_fell(found):
    causes, _ = told(found, accepted(found, mass=1.25, damping=1.25))
    assert causes[0].name == "thrust_gain"
    gain = causes[0].parameters["gain"]
    assert gain.value == pytest.approx(0.8, abs=0.02)
    assert gain.low95 < gain.value < gain.high95
    assert causes[0].feedforward is not None


def test_so_many_kilograms_more_in_all_directions_are_water_that_is_carried_along(found):
    more_kg = 0.2 * float(found.now.course.mass[0])
    causes, _ = told(found, accepted(found, more_kg=more_kg))
    assert "entrained_water" in {causes[0].name, *causes[0].also}
    if causes[0].name == "entrained_water":
        assert causes[0].parameters["mass"].value == pytest.approx(more_kg, rel=0.1)


def test_only_what_was_accepted_is_compared(found):
    earlier = {
        name: prior for name, prior in accepted(found, mass=1.25, damping=1.25).items() if name == "M_u"
    }
    shift = shift_of(found, earlier, LIBRARY)
    assert shift.size.shape == (1,)
    assert shift.size[0] == pytest.approx(-0.2, abs=1e-6)
