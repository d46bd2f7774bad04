"""Accepted effects in the files of other simulators: what a target can hold is held, the rest is named."""

import json
import math
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from bridge.vehicle.accepted_effect import AcceptedEffect
from bridge.vehicle.config import load_vehicle
from identify.effects.library import library
from identify.export.model import model_of
from identify.export.targets import TARGETS, export, with_effects

VALUES = {"M_u": 111.6, "D_u": 56.2, "M_v": 112.4, "D_v": 53.0}
DRAG = AcceptedEffect(
    "quadratic_drag",
    "quadratic_drag",
    {"X_uu": 60.0, "Y_vv": 90.0, "Z_ww": 0.0, "K_pp": 0.0, "M_qq": 0.0, "N_rr": 3.0},
)
WEAK = AcceptedEffect("weak_thruster", "weak_thruster of thruster 2", {"gain": 0.75}, 2)
STARTS = AcceptedEffect("dead_zone", "dead_zone (above it so much less)", {"half_width": 0.8})
LEAST = AcceptedEffect("dead_zone", "dead_zone (all above it)", {"half_width": 2.0})
ASTERN = AcceptedEffect("reverse_thrust_loss", "reverse_thrust_loss", {"gain": 0.7})
DELAY = AcceptedEffect("dvl_delay", "dvl_delay", {"delay": 0.1})
VEHICLE = load_vehicle("ruvifist:hovering").vehicle
EFFECTS = library(VEHICLE.configurations["hovering"], VEHICLE.thrust_curve.lag_s)


@pytest.fixture
def model():
    return model_of(VALUES, load_vehicle("ruvifist:hovering"), "hovering")


def whats(model, target):
    return {part.what: part.reason for part in export(model, target).left_out}


def test_without_effects_a_model_stays_as_it_is(model):
    assert with_effects(model, (), EFFECTS) is model


def test_effects_of_hull_and_thrusters_have_their_place(model):
    rich = with_effects(model, (DRAG, WEAK, STARTS, ASTERN), EFFECTS)
    assert rich.quadratic == (60.0, 90.0, 0.0, 0.0, 0.0, 3.0)
    assert [one.gain for one in rich.thrusters] == [1.0, 0.75, *[1.0] * 6]
    assert rich.thrusters[1].thrust_n(10.0) == pytest.approx(0.75 * 9.2)
    assert rich.thrusters[1].thrust_n(-10.0) == pytest.approx(-0.75 * 9.2 * 0.7)
    assert rich.unheld == ()


@pytest.mark.parametrize("target", list(TARGETS))
def test_what_has_no_place_is_named_with_its_reason(model, target):
    told = whats(with_effects(model, (DRAG, DELAY), EFFECTS), target)
    assert "beside them" in told["accepted effects (dvl_delay)"]


@pytest.mark.parametrize("target", list(TARGETS))
def test_what_is_in_masses_and_dampings_already_is_neither_added_nor_left_out(model, target):
    fouled = AcceptedEffect("fouling", "fouling (since the last time)", {"share": 0.2})
    weak = AcceptedEffect("thrust_gain", "thrust_gain", {"gain": 0.9})
    assert export(with_effects(model, (fouled, weak), EFFECTS), target).text == export(model, target).text
    assert with_effects(model, (fouled, weak), EFFECTS).unheld == ()


def test_gazebo_brakes_with_the_square_of_the_speed_and_has_the_least_thrust_as_its_deadband(model):
    root = ET.fromstring(export(with_effects(model, (DRAG, LEAST), EFFECTS), "gazebo").text)
    assert float(root.findtext(".//xUabsU")) == -60.0
    assert {float(band.text) for band in root.iter("deadband")} == {2.0}
    assert "dead zone" not in str(whats(with_effects(model, (LEAST,), EFFECTS), "gazebo"))


def test_stonefishs_table_gives_nothing_below_the_least_thrust_and_all_above_it(model):
    root = ET.fromstring(export(with_effects(model, (LEAST,), EFFECTS), "stonefish").text)
    law = root.find(".//thrust_model")
    asked, given = (np.array(law.find(tag).get("value").split(), dtype=float) for tag in ("input", "output"))
    assert np.all(np.diff(asked) > 0)
    for n in (-30.0, -2.0, -1.99, 0.0, 1.0, 1.99, 2.0, 30.0):
        assert np.interp(n, asked, given) == pytest.approx(n if abs(n) >= 2.0 else 0.0)


def test_ardusubs_plant_holds_them_all(model):
    plant = json.loads(
        export(with_effects(model, (DRAG, WEAK, STARTS, ASTERN), EFFECTS), "ardusub-json").text
    )["plant"]
    assert plant["quadratic_damping"][:2] == [60.0, 90.0]
    second = plant["thrusters"][1]
    assert (second["gain"], second["reverse_gain"], second["dead_zone_n"]) == (0.75, 0.7, 0.8)


def test_a_thruster_turned_about_the_vertical_points_so_much_further_to_starboard(model):
    turned = AcceptedEffect(
        "thruster_misalignment", "thruster_misalignment of thruster 1 (turned about z)", {"angle": 0.1}, 1
    )
    before, after = (math.atan2(m.thrusters[0].direction[1], m.thrusters[0].direction[0])
                     for m in (model, with_effects(model, (turned,), EFFECTS)))  # fmt: skip
    assert after - before == pytest.approx(0.1)


def test_a_current_and_a_buoyancy_add_to_what_is_there(model):
    current = AcceptedEffect("steady_current", "steady_current", {"north": 0.1, "east": -0.2})
    lighter = AcceptedEffect("net_buoyancy", "net_buoyancy", {"force": 2.0})
    changed = with_effects(model, (current, lighter), EFFECTS)
    assert changed.current_m_s == (0.1, -0.2, 0.0)
    assert changed.net_buoyancy_n == model.net_buoyancy_n + 2.0
