"""`Model` from an identification and a vehicle file, and its effects in other simulators' files."""

import json
import math
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from bridge.errors import ConfigError
from bridge.vehicle.coefficients import AcceptedEffect
from bridge.vehicle.config import load_vehicle
from identify.effects.library import accepted_library
from identify.export.model import Propeller, enu, flu, model_of, pointing, volume_m3
from identify.export.targets import TARGETS, export, with_effects

VALUES = {
    "M_u": 111.6, "M_v": 112.41, "M_w": 134.0, "I_p": 5.2, "I_q": 15.5, "I_r": 16.0,
    "D_u": 56.2, "D_v": 70.0, "D_w": 90.0, "D_p": 4.0, "D_q": 9.0, "D_r": 11.0,
}  # fmt: skip


@pytest.fixture
def file():
    return load_vehicle("ruvifist:hovering")


def test_added_mass_is_the_total_less_the_rigid_body_and_quadratic_drag_is_none(file):
    model = model_of(VALUES, file, "hovering")
    assert model.added == pytest.approx((39.6, 40.41, 62.0, 2.0, 6.0, 5.5))
    assert model.total == pytest.approx(tuple(VALUES[n] for n in ("M_u", "M_v", "M_w", "I_p", "I_q", "I_r")))
    assert model.linear == (56.2, 70.0, 90.0, 4.0, 9.0, 11.0)
    assert model.quadratic == (0.0,) * 6
    assert model.mean_mass_kg == pytest.approx((111.6 + 112.41 + 134.0) / 3)
    assert (model.lag_s, model.net_buoyancy_n, model.density_kg_m3) == (0.05, 1.0, 998.2)
    assert (len(model.thrusters), model.intervals, model.notes) == (8, {}, ())


def test_the_centre_of_buoyancy_rights_the_vehicle_as_the_nominal_model_does_and_displacing_nothing_is_refused(
    file,
):
    model = model_of(VALUES, file, "hovering")
    height = -model.centre_of_buoyancy_m[2]
    assert height * model.buoyancy_n == pytest.approx(0.05 * 72.0 * 9.80665)
    assert model.buoyancy_n == pytest.approx(72.0 * 9.80665 + 1.0)
    with pytest.raises(ConfigError, match="displace no water"):
        volume_m3(replace(model, net_buoyancy_n=-800.0), model.dry_mass_kg)


def test_what_was_not_identified_comes_from_the_vehicle_files_model_or_is_none_and_is_told(file):
    shape = file.vehicle.configurations["hovering"]
    shapes = {"hovering": replace(shape, model={"D_p": 7.0})}
    file = replace(file, vehicle=replace(file.vehicle, configurations=shapes))
    few = {name: value for name, value in VALUES.items() if name not in ("D_p", "D_q", "I_q")}
    model = model_of(few, file, "hovering")
    assert model.linear[3:] == (7.0, 0.0, 11.0)
    assert model.added[4] == 0.0
    assert [note.split()[0] for note in model.notes] == ["I_q", "D_p", "D_q"]
    assert "7 is the vehicle file's own" in model.notes[1]
    assert "it is unknown" in model.notes[2]
    assert model.unknown == ("I_q", "D_q")
    light = model_of({**VALUES, "M_u": 70.0}, file, "hovering")
    assert light.added[0] == -2.0
    assert "M_u lies 2 kg below" in light.notes[0]
    assert model.undamped == (4,)


def test_a_propeller_loses_its_dead_zone_and_astern_its_share():
    propeller = Propeller(
        (1.0, 0.0, 0.0), (0.0, 0.0, 0.0), -20.0, 30.0, gain=2.0, reverse_gain=0.5, dead_zone_n=1.0
    )
    assert [propeller.thrust_n(n) for n in (-50.0, -20.0, -0.5, 0.0, 1.0, 11.0, 99.0)] == [
        -19.0, -19.0, 0.0, 0.0, 0.0, 20.0, 58.0,
    ]  # fmt: skip


def test_axes_are_turned_and_a_zero_keeps_no_sign():
    assert flu((1.0, 2.0, -3.0)) == (1.0, -2.0, 3.0)
    assert enu((1.0, 2.0, -3.0)) == (2.0, 1.0, 3.0)
    assert str(flu((0.0, 0.0, 0.0))) == "(0.0, 0.0, 0.0)"
    assert pointing((0.0, 0.0, 1.0)) == pytest.approx((0.0, -1.5707963267948966, 0.0))
    assert pointing((-1.0, 1.0, 0.0)) == pytest.approx((0.0, 0.0, 2.356194490192345))


EFFECT_VALUES = {"M_u": 111.6, "D_u": 56.2, "M_v": 112.4, "D_v": 53.0}
DRAG = AcceptedEffect(
    "quadratic_drag",
    "quadratic_drag",
    {"X_uu": 60.0, "Y_vv": 90.0, "Z_ww": 0.0, "K_pp": 0.0, "M_qq": 0.0, "N_rr": 3.0},
)
WEAK = AcceptedEffect("weak_thruster", "weak_thruster of thruster 2", {"gain": 0.75}, 2)
STARTS = AcceptedEffect("dead_zone", "dead_zone (above it so much less)", {"half_width": 0.8})
LEAST = AcceptedEffect("dead_zone", "dead_zone (all above it)", {"half_width": 2.0})
ASTERN = AcceptedEffect("reverse_thrust_loss", "reverse_thrust_loss", {"gain": 0.7})
VEHICLE = load_vehicle("ruvifist:hovering").vehicle
EFFECTS = accepted_library(VEHICLE.configurations["hovering"], VEHICLE.thrust_curve.lag_s)


@pytest.fixture
def model():
    return model_of(EFFECT_VALUES, load_vehicle("ruvifist:hovering"), "hovering")


def whats(model, target):
    return {part.what: part.reason for part in export(model, target).left_out}


def test_effects_of_hull_and_thrusters_have_their_place(model):
    rich = with_effects(model, (DRAG, WEAK, STARTS, ASTERN), EFFECTS)
    assert rich.quadratic == (60.0, 90.0, 0.0, 0.0, 0.0, 3.0)
    assert [thruster.gain for thruster in rich.thrusters] == [1.0, 0.75, *[1.0] * 6]
    assert rich.thrusters[1].thrust_n(10.0) == pytest.approx(0.75 * 9.2)
    assert rich.thrusters[1].thrust_n(-10.0) == pytest.approx(-0.75 * 9.2 * 0.7)
    assert rich.unheld == ()
    second = json.loads(export(rich, "ardusub-json").text)["plant"]["thrusters"][1]
    assert (second["gain"], second["reverse_gain"], second["dead_zone_n"]) == (0.75, 0.7, 0.8)


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


@pytest.mark.parametrize(
    ("form", "said"), [("of first order", 0), ("in two stages", 1), ("of the shafts' speed", 1)]
)
def test_a_lag_of_another_form_is_written_as_one_as_late_with_a_word(model, form, said):
    lag = AcceptedEffect("thruster_lag", f"thruster_lag ({form})", {"time_constant": 0.3})
    slow = with_effects(model, (lag,), EFFECTS)
    assert (slow.lag_s, slow.unheld) == (0.3, ())
    notes = export(slow, "stonefish").notes[len(model.notes) :]
    assert len(notes) == said
    assert all(f"accepted {form}" in note and "0.3 s" in note for note in notes)
