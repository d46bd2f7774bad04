"""The files of other simulators read back: numbers to the last bit, signs as each simulator has them."""

import json
import math
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest

from bridge.vehicle.config import load_vehicle
from bridge.vehicle.dynamics import restoring
from bridge.vehicle.thrusters import allocation_matrix
from identify.export.model import DRAG_SPEED_M_S, model_of
from identify.export.targets import TARGETS, export

TO_FLU = np.diag([1.0, -1.0, -1.0])
VALUES = {
    "M_u": 111.6, "M_v": 112.41, "M_w": 134.0, "I_p": 5.2, "I_q": 15.5, "I_r": 16.0,
    "D_u": 56.2, "D_v": 70.1, "D_w": 1 / 3, "D_p": 4.0, "D_q": 9.0, "D_r": 11.0,
}  # fmt: skip
PLUGIN = (("x", "U"), ("y", "V"), ("z", "W"), ("k", "P"), ("m", "Q"), ("n", "R"))


@pytest.fixture
def shape():
    return load_vehicle("ruvifist:hovering").vehicle.configurations["hovering"]


@pytest.fixture
def model():
    return model_of(VALUES, load_vehicle("ruvifist:hovering"), "hovering")


@pytest.fixture
def rich(model):
    """With all that an accepted effect may add."""
    first = replace(model.thrusters[0], gain=1.25, reverse_gain=0.8, dead_zone_n=0.5)
    third = replace(model.thrusters[2], least_n=2.0)
    return replace(
        model,
        quadratic=(12.0, 24.0, 48.0, 1.0, 2.0, 3.0),
        thrusters=(first, model.thrusters[1], third, *model.thrusters[3:]),
        current_m_s=(0.3, -0.4, 0.1),
        intervals={"M_u": (110.0, 113.0)},
        unheld=("waves",),
    )


def xml(model, target):
    return ET.fromstring(export(model, target).text)


def floats(text):
    return np.array([float(word) for word in text.split()])


def whats(model, target):
    return {part.what: part.reason for part in export(model, target).left_out}


def hydrodynamics(root):
    return root.find(".//plugin[@name='gz::sim::systems::Hydrodynamics']")


def test_gazebo_brakes_with_negative_coefficients_and_adds_mass_with_positive_ones(rich):
    root = xml(rich, "gazebo")
    plugin = hydrodynamics(root)
    assert plugin.findtext("disable_added_mass") == plugin.findtext("disable_coriolis") == "true"
    for dof, (force, rate) in enumerate(PLUGIN):
        assert float(plugin.findtext(f"{force}{rate}")) == -rich.linear[dof]
        assert float(plugin.findtext(f"{force}{rate}abs{rate}")) == -rich.quadratic[dof]
        assert float(plugin.findtext(f"{force}Dot{rate}")) == -rich.added[dof]
    added = root.find(".//fluid_added_mass")
    assert tuple(float(added.findtext(tag)) for tag in ("xx", "yy", "zz", "pp", "qq", "rr")) == rich.added


def test_gazebos_links_together_have_the_rigid_bodys_centre_and_inertia(model):
    lopsided = replace(model, thrusters=model.thrusters[:5], centre_of_gravity_m=(0.1, 0.02, 0.03))
    total, moment, inertia = 0.0, np.zeros(3), np.zeros((3, 3))
    for link in xml(lopsided, "gazebo").iterfind(".//link"):
        place = sum(
            floats(node.text)[:3]
            for node in (link.find("pose"), link.find("inertial/pose"))
            if node is not None
        )
        mass = float(link.findtext("inertial/mass"))
        total, moment = total + mass, moment + mass * place
        for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
            about_link = link.findtext(f"inertial/inertia/i{'xyz'[i]}{'xyz'[j]}")
            inertia[i, j] += float(about_link or 0.0) + mass * (
                (place @ place) * (i == j) - place[i] * place[j]
            )
    assert total == pytest.approx(72.0, rel=1e-12)
    centre = moment / total
    assert centre == pytest.approx([0.1, -0.02, -0.03])
    about = np.triu(inertia - total * (centre @ centre * np.eye(3) - np.outer(centre, centre)))
    assert about == pytest.approx(np.diag(model.inertia_kgm2), abs=1e-12)


def test_gazebos_thrusters_make_the_wrench_of_ours_in_its_axes(model, shape):
    root = xml(model, "gazebo")
    wrenches = []
    for plugin in root.iterfind(".//plugin[@name='gz::sim::systems::Thruster']"):
        joint = root.find(f".//joint[@name='{plugin.findtext('joint_name')}']")
        link = root.find(f".//link[@name='{joint.findtext('child')}']")
        force, place = floats(joint.findtext("axis/xyz")), floats(link.findtext("pose"))[:3]
        wrenches.append(np.concatenate([force, np.cross(place, force)]))
    turn = np.kron(np.eye(2), TO_FLU)
    assert np.allclose(np.array(wrenches).T, turn @ allocation_matrix(shape), atol=1e-15)


def test_gazebos_thrusters_hold_limits_gains_and_a_dead_zone(rich):
    first, second = xml(rich, "gazebo").findall(".//plugin[@name='gz::sim::systems::Thruster']")[:2]
    assert float(first.findtext("max_thrust_cmd")) == 1.25 * rich.thrusters[0].high_n
    assert float(first.findtext("min_thrust_cmd")) == 1.25 * rich.thrusters[0].low_n * 0.8
    assert float(first.findtext("deadband")) == 1.25 * 0.5
    assert second.find("deadband") is None
    rho, diameter, c = (
        float(second.findtext(tag)) for tag in ("fluid_density", "propeller_diameter", "thrust_coefficient")
    )
    assert rho * c * diameter**4 * (2 * math.pi * 10.0) ** 2 == pytest.approx(0.01427 * 10.0**2)


@pytest.mark.parametrize("roll", [0.2, -0.4])
def test_gazebos_buoyancy_floats_and_rights_as_the_nominal_model_does(model, shape, roll):
    root = xml(model, "gazebo")
    rho = float(root.findtext(".//uniform_fluid_density"))
    volume = np.prod(floats(root.findtext(".//collision//size")))
    up_n = rho * volume * 9.80665
    assert up_n - 72.0 * 9.80665 == pytest.approx(1.0)
    centre = floats(root.findtext(".//collision/pose"))[:3]
    up = TO_FLU @ np.array([0.0, -math.sin(roll), -math.cos(roll)])
    attitude = (math.cos(roll / 2), math.sin(roll / 2), 0.0, 0.0)
    ours = -np.array(restoring(shape, attitude))
    assert TO_FLU @ np.cross(centre, up_n * up) == pytest.approx(ours[3:], abs=1e-9)


def test_stonefish_has_the_mean_mass_the_total_inertias_and_the_net_buoyancy(model):
    root = xml(model, "stonefish")
    hull = root.find("robot/base_link")
    mass = float(hull.find("mass").get("value"))
    assert mass == model.mean_mass_kg
    assert tuple(floats(hull.find("inertia").get("xyz"))) == model.total[3:]
    assert hull.get("physics") == "floating"
    rho = float(root.find("environment/ocean/water").get("density"))
    volume = np.prod(floats(hull.find("dimensions").get("xyz")))
    assert (rho * volume - mass) * 9.80665 == pytest.approx(1.0)
    arm = floats(hull.find("origin").get("xyz")) - floats(hull.find("cg").get("xyz"))
    assert arm[2] * rho * volume * 9.80665 == pytest.approx(-0.05 * 72.0 * 9.80665)


def test_stonefishs_cube_brakes_as_the_model_does_along_each_axis(rich):
    hull = xml(rich, "stonefish").find("robot/base_link")
    face = floats(hull.find("dimensions").get("xyz"))[0] ** 2
    viscous, quadratic = (
        floats(hull.find("hydrodynamics").get(f"{name}_drag")) for name in ("viscous", "quadratic")
    )
    speed = DRAG_SPEED_M_S
    skin = rich.density_kg_m3 * viscous * 4 * face * speed
    meeting = rich.density_kg_m3 / 2 * quadratic * face * speed**3
    assert skin == pytest.approx(np.array(rich.linear[:3]) * speed)
    assert meeting == pytest.approx(np.array(rich.quadratic[:3]) * speed**2)


def rotation(roll, pitch, yaw):
    """Rz(yaw) Ry(pitch) Rx(roll)."""
    (a, b), (c, d), (e, f) = ((math.cos(angle), math.sin(angle)) for angle in (roll, pitch, yaw))
    about_x = np.array([[1, 0, 0], [0, a, -b], [0, b, a]])
    about_y = np.array([[c, 0, d], [0, 1, 0], [-d, 0, c]])
    about_z = np.array([[e, -f, 0], [f, e, 0], [0, 0, 1]])
    return about_z @ about_y @ about_x


def test_stonefishs_thrusters_push_along_their_x_axes_as_ours_do(model, shape):
    columns = []
    for actuator in xml(model, "stonefish").iterfind("robot/actuator"):
        origin = actuator.find("origin")
        force = rotation(*floats(origin.get("rpy")))[:, 0]
        columns.append(np.concatenate([force, np.cross(floats(origin.get("xyz")), force)]))
    assert np.allclose(np.array(columns).T, allocation_matrix(shape), atol=1e-5)


def test_stonefishs_thrusters_take_newtons_with_lag_gain_dead_zone_and_limits(rich):
    first, second = xml(rich, "stonefish").findall("robot/actuator")[:2]
    assert float(first.find("rotor_dynamics/time_constant").get("value")) == 0.05
    asked, given = (floats(first.find(f"thrust_model/{way}").get("value")) for way in ("input", "output"))
    low, high = rich.thrusters[0].low_n, rich.thrusters[0].high_n
    assert asked.tolist() == [low, -0.5, 0.0, 0.5, high]
    assert given == pytest.approx([1.25 * 0.8 * (low + 0.5), 0.0, 0.0, 0.0, 1.25 * (high - 0.5)])
    plain = [floats(second.find(f"thrust_model/{way}").get("value")).tolist() for way in ("input", "output")]
    assert plain == [[low, 0.0, high]] * 2
    rotor = xml(replace(rich, lag_s=0.0), "stonefish").find("robot/actuator/rotor_dynamics")
    assert rotor.get("type") == "zero_order"


def test_ardusubs_plant_holds_the_whole_model(rich):
    plant = json.loads(export(rich, "ardusub-json").text)["plant"]
    assert plant["added_mass"] == list(rich.added)
    assert plant["total_mass"] == list(rich.total)
    assert plant["linear_damping"] == list(rich.linear)
    assert plant["quadratic_damping"] == list(rich.quadratic)
    assert plant["centre_of_buoyancy_m"] == list(rich.centre_of_buoyancy_m)
    assert plant["thruster_lag_s"] == 0.05
    assert plant["thrusters"][0]["direction"] == list(rich.thrusters[0].direction)
    assert [t["servo"] for t in plant["thrusters"]] == list(range(1, 9))
    assert plant["thrust_curve"]["pwm_us"][40] == 1500.0
    assert plant["thrust_curve"]["thrust_n"][40] == 0.0
    assert plant["thrust_curve"]["thrust_n"][-1] > 40.0
    assert plant["intervals_95"] == {"M_u": [110.0, 113.0]}


def test_ardusubs_own_submarine_gets_its_coefficients_from_its_own_formula(rich):
    data = json.loads(export(rich, "ardusub-json").text)["frame_property"]
    area = math.pi / 4 * (4 / 3 * math.pi * 0.2**3 * 3 / 4) ** (2 / 3)
    drag = [1023.6 * area / 2 * c for c in data["linear_drag_coefficient"]]
    turning = [1000.0 * area / 2 * 0.2 * c for c in data["angular_drag_coefficient"]]
    # It has no linear drag: at 0.5 m/s and rad/s all of it is right.
    whole = [q + 2.0 * linear for q, linear in zip(rich.quadratic, rich.linear, strict=True)]
    assert drag == pytest.approx(whole[:3])
    assert turning == pytest.approx(whole[3:])
    assert data["weight"] == data["mass"] == rich.mean_mass_kg
    assert data["thrust"] == rich.curve[-1][1]


@pytest.mark.parametrize(
    ("flow", "comes_from"), [((1.0, 0.0), 180.0), ((0.0, 1.0), 270.0), ((0.0, -0.5), 90.0)]
)
def test_ardusubs_wind_is_told_by_where_it_comes_from(model, flow, comes_from):
    parameters = json.loads(export(replace(model, current_m_s=(*flow, 0.0)), "ardusub-json").text)[
        "parameters"
    ]
    assert parameters["SIM_WIND_DIR"] == pytest.approx(comes_from)
    assert parameters["SIM_WIND_SPD"] == math.hypot(*flow)
    assert (parameters["SIM_WIND_T"], parameters["SIM_BUOYANCY"]) == (1.0, 1.0)


@pytest.mark.parametrize("target", TARGETS)
def test_every_reason_is_one_that_a_rich_model_meets_or_a_plain_one(rich, target):
    unknown = ("M_w", "I_p", "D_w", "D_p")
    gappy = replace(rich, unknown=unknown, quadratic=(12.0, 24.0, 0.0, 0.0, 2.0, 3.0))
    exported = export(gappy, target)
    assert len(exported.left_out) == len(TARGETS[target].reasons)
    assert all("{" not in part.reason and part.what for part in exported.left_out)


@pytest.fixture
def planar():
    """Only what a dive in the horizontal plane tells."""
    known = {name: value for name, value in VALUES.items() if name[-1] in "uvr"}
    return model_of(known, load_vehicle("ruvifist:hovering"), "hovering")


def test_an_unknown_mass_is_no_part_of_the_one_mass_for_all_directions(planar):
    mean_kg = (111.6 + 112.41) / 2
    hull = xml(planar, "stonefish").find("robot/base_link")
    data = json.loads(export(planar, "ardusub-json").text)["frame_property"]
    assert float(hull.find("mass").get("value")) == data["mass"] == data["weight"] == pytest.approx(mean_kg)
    masses = "mass by direction (M_u 111.6 kg, M_v 112.4 kg, M_w unknown)"
    for target in ("stonefish", "ardusub-json"):
        assert "the mean of what is known, 112 kg, is written" in whats(planar, target)[masses]


def test_ardusubs_own_submarine_keeps_its_drag_where_none_is_known(planar):
    data = json.loads(export(planar, "ardusub-json").text)
    along, about = (data["frame_property"][f"{way}_drag_coefficient"] for way in ("linear", "angular"))
    assert (along[2], about[:2]) == (2.0, [1.05, 1.05])
    assert min(*along, *about) > 0
    assert data["plant"]["unknown"] == ["M_w", "I_p", "I_q", "D_w", "D_p", "D_q"]


@pytest.mark.parametrize("target", ["gazebo", "stonefish"])
def test_what_is_unknown_and_the_intervals_stand_in_a_comment_if_there_are_any(planar, rich, model, target):
    assert "Unknown: M_w, I_p, I_q, D_w, D_p, D_q." in export(planar, target).text
    assert "M_u 110 to 113" in export(rich, target).text
    assert "95 % intervals" in whats(rich, target)
    plain = export(model, target)
    assert not any(word in plain.text for word in ("Unknown", "95 %"))
    assert "95 % intervals" not in whats(model, target)


def test_a_current_flows_in_the_axes_of_each_simulator(rich, model):
    gazebo, stonefish_xml = xml(rich, "gazebo"), xml(rich, "stonefish")
    assert floats(hydrodynamics(gazebo).findtext("default_current")).tolist() == [-0.4, 0.3, -0.1]
    assert floats(stonefish_xml.find(".//current/velocity").get("xyz")).tolist() == [0.3, -0.4, 0.1]
    assert hydrodynamics(xml(model, "gazebo")).find("default_current") is None
    assert xml(model, "stonefish").find(".//current") is None


@pytest.mark.parametrize("target", ["gazebo", "stonefish"])
@pytest.mark.parametrize("name", ['<sub> -- "1"', "sub --- heavy"])
def test_a_name_that_xml_would_stumble_over_is_read_back(model, target, name):
    root = xml(replace(model, name=name), target)
    assert name in [element.get("name") for element in root.iter()]
