"""Gazebo (gz-sim): an SDF world with the vehicle, its hydrodynamics, its thrusters and the water's buoyancy.

Sources: gazebosim/gz-sim, src/systems/hydrodynamics/Hydrodynamics.{hh,cc} (the force is coefficient times velocity,
so negative coefficients brake, in Fossen's signs; velocity in the link's axes, less the current),
src/systems/thruster/ Thruster.{hh,cc} (force along the joint's axis on the propeller's link, without delay; omega =
sqrt(T / (rho C D^4)) only spins the propeller), src/systems/buoyancy/Buoyancy.hh (a system of the world: density
times the volume of the collision shapes, at their centre); gazebosim/sdf_tutorials, added_mass/proposal.md
(`fluid_added_mass`, positive, SDFormat 1.10); gazebosim/gz-physics, dartsim/src/SimulationFeatures.cc (gravity acts
on the mass without it).

Added mass is written as `fluid_added_mass`, which DART integrates with the rigid body. The plugin's own added mass is
an explicit force from the last step's acceleration, unstable if it exceeds the mass. Until 2026 its Coriolis matrix
was not Fossen's (2011, eq 6.44): entry (5, 0) took Z_wdot, and most signs were those for positive coefficients. The
plugin therefore gets the same numbers (xDotU and so on, negative), but with both forces disabled. Frames: link FLU,
world ENU.
"""

import math
import xml.etree.ElementTree as ET

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.config import GRAVITY_M_S2
from identify.export.model import (
    KNOW,
    Model,
    Propeller,
    comment,
    document,
    element,
    enu,
    flu,
    number,
    numbers,
    volume_m3,
)

PLUGIN_AXES = (("x", "U"), ("y", "V"), ("z", "W"), ("k", "P"), ("m", "Q"), ("n", "R"))
ADDED_TAGS = ("xx", "yy", "zz", "pp", "qq", "rr")
PROPELLER_KG, PROPELLER_KGM2, PROPELLER_M = 1e-3, 1e-6, 0.1
"""A propeller needs a link with a mass, which is taken from the hull's. Its diameter only affects the spin."""
STEP_S = 1e-3

REASONS = {
    "unknown_mass": "the rigid body's own is written, with no added mass, so that it takes less thrust to start and "
    f"stop there than in the water; {KNOW}",
    "unknown_inertia": f"the rigid body's own is written, with no added inertia; {KNOW}",
    "undamped_moving": f"zero is written: the simulator is undamped there; {KNOW}",
    "undamped_turning": f"zero is written: the simulator is undamped there; {KNOW}",
    "lag": "Gazebo's Thruster applies a commanded force at once; send it commands through a first-order filter of "
    "{model.lag_s:g} s",
    "gain": "Gazebo's Thruster takes the force itself; multiply what is sent to cmd_thrust by the gain",
    "reverse_gain": "Gazebo's Thruster takes the force itself; multiply negative forces sent to cmd_thrust by it",
    "dead_zone": "Gazebo's deadband gives nothing below it and the whole force above, where the model's force grows "
    "from zero; it is written",
    "effects": "its plugins have no such force; the rest of the model was fitted beside them",
    "curve": "Gazebo's Thruster takes newtons, not pulse widths",
    "shape": "seatrial does not know it; a cube that nobody sees carries the buoyancy",
    "added_in_current": "Gazebo takes the Coriolis force of added mass from the velocity through the water only since "
    "2026, before from that over ground",
    "intervals": "SDF holds values alone; they stand in a comment of the file",
}


def write(model: Model) -> str:
    root = ET.Element("sdf", version="1.10")
    world = element(root, "world", name="water")
    comment(world, model, "written by seatrial; added mass acts with the DART engine, Gazebo's own.")
    physics = element(world, "physics", name="step", type="ignored")
    element(physics, "max_step_size", STEP_S)
    element(physics, "real_time_factor", 1.0)
    element(world, "gravity", numbers((0.0, 0.0, -GRAVITY_M_S2)))
    for file, system in (("physics", "Physics"), ("user-commands", "UserCommands"),
                         ("scene-broadcaster", "SceneBroadcaster")):  # fmt: skip
        _plugin(world, file, system)
    element(_plugin(world, "buoyancy", "Buoyancy"), "uniform_fluid_density", model.density_kg_m3)
    vehicle = element(world, "model", name=model.name)
    element(vehicle, "pose", numbers((0.0,) * 6))
    _hull(vehicle, model)
    for i, propeller in enumerate(model.thrusters, start=1):
        _propeller(vehicle, i, propeller)
    _hydrodynamics(vehicle, model)
    for i, propeller in enumerate(model.thrusters, start=1):
        _thruster(vehicle, model, i, propeller)
    return document(root)


def _plugin(parent: ET.Element, file: str, system: str) -> ET.Element:
    return element(parent, "plugin", filename=f"gz-sim-{file}-system", name=f"gz::sim::systems::{system}")


def _hull(vehicle: ET.Element, model: Model) -> None:
    link = element(vehicle, "link", name="base_link")
    inertial = element(link, "inertial")
    mass_kg, centre_m, inertia_kgm2 = without_propellers(model)
    element(inertial, "pose", numbers((*centre_m, 0.0, 0.0, 0.0)))
    element(inertial, "mass", mass_kg)
    inertia = element(inertial, "inertia")
    for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
        element(inertia, f"i{'xyz'[i]}{'xyz'[j]}", float(inertia_kgm2[i, j]))
    added = element(inertial, "fluid_added_mass")
    for tag, value in zip(ADDED_TAGS, model.added, strict=True):
        element(added, tag, value)
    collision = element(link, "collision", name="displaced")
    element(collision, "pose", numbers((*flu(model.centre_of_buoyancy_m), 0.0, 0.0, 0.0)))
    side_m = volume_m3(model, model.dry_mass_kg) ** (1 / 3)
    box = element(element(collision, "geometry"), "box")
    element(box, "size", numbers((side_m,) * 3))


def without_propellers(model: Model) -> tuple[float, Array, Array]:
    """Mass, centre of gravity (3,) and inertia about it (3, 3) of the hull without the propellers, link axes (FLU).

    Together with the links of the propellers it makes the model's rigid body, whose inertia is about its own centre.
    """
    places_m = np.array([flu(p.position_m) for p in model.thrusters]).reshape(-1, 3)
    mass_kg = model.dry_mass_kg - PROPELLER_KG * len(places_m)
    whole_m = np.array(flu(model.centre_of_gravity_m))
    centre_m = (model.dry_mass_kg * whole_m - PROPELLER_KG * places_m.sum(axis=0)) / mass_kg
    inertia = np.diag(model.inertia_kgm2) - _about(mass_kg, centre_m - whole_m)
    for place_m in places_m:
        inertia -= _about(PROPELLER_KG, place_m - whole_m) + PROPELLER_KGM2 * np.eye(3)
    return mass_kg, centre_m, inertia


def _about(mass_kg: float, arm_m: Array) -> Array:
    """Inertia (3, 3) of a point mass at the end of an arm."""
    return np.asarray(mass_kg * (arm_m @ arm_m * np.eye(3) - np.outer(arm_m, arm_m)))


def _propeller(vehicle: ET.Element, i: int, propeller: Propeller) -> None:
    """Add a link with the base's axes and a joint about the direction of thrust."""
    link = element(vehicle, "link", name=f"propeller{i}")
    element(link, "pose", numbers((*flu(propeller.position_m), 0.0, 0.0, 0.0)))
    inertial = element(link, "inertial")
    element(inertial, "mass", PROPELLER_KG)
    inertia = element(inertial, "inertia")
    for axis in "xyz":
        element(inertia, f"i{axis}{axis}", PROPELLER_KGM2)
    joint = element(vehicle, "joint", name=f"thruster{i}", type="revolute")
    element(joint, "parent", "base_link")
    element(joint, "child", f"propeller{i}")
    element(element(joint, "axis"), "xyz", numbers(flu(propeller.direction)))


def _hydrodynamics(vehicle: ET.Element, model: Model) -> None:
    plugin = _plugin(vehicle, "hydrodynamics", "Hydrodynamics")
    element(plugin, "link_name", "base_link")
    element(plugin, "water_density", model.density_kg_m3)
    element(plugin, "disable_added_mass", "true")
    element(plugin, "disable_coriolis", "true")
    for (force, rate), added, linear, quadratic in zip(
        PLUGIN_AXES, model.added, model.linear, model.quadratic, strict=True
    ):
        element(plugin, f"{force}Dot{rate}", -added)
        element(plugin, f"{force}{rate}", -linear)
        element(plugin, f"{force}{rate}abs{rate}", -quadratic)
    if any(model.current_m_s):
        element(plugin, "default_current", numbers(enu(model.current_m_s)))


def _thruster(vehicle: ET.Element, model: Model, i: int, propeller: Propeller) -> None:
    plugin = _plugin(vehicle, "thruster", "Thruster")
    element(plugin, "namespace", model.name)
    element(plugin, "joint_name", f"thruster{i}")
    element(plugin, "velocity_control", "true")
    element(plugin, "fluid_density", model.density_kg_m3)
    element(plugin, "propeller_diameter", PROPELLER_M)
    # T = k n |n| with n in rev/s, and omega in rad/s.
    per_rad = model.forward_n_s2 / (2 * math.pi) ** 2
    element(plugin, "thrust_coefficient", number(per_rad / (model.density_kg_m3 * PROPELLER_M**4)))
    element(plugin, "max_thrust_cmd", propeller.high_n * propeller.gain)
    element(plugin, "min_thrust_cmd", propeller.low_n * propeller.gain * propeller.reverse_gain)
    if propeller.dead_zone_n or propeller.least_n:
        # As the limits, of the force that is sent, which the gain is in.
        element(plugin, "deadband", max(propeller.dead_zone_n, propeller.least_n) * propeller.gain)
