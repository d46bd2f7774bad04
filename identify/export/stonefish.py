"""Stonefish: a scenario with the water and one robot, a box with the vehicle's masses, drag and thrusters.

Sources: patrykcieslak/stonefish, Library/src/core/ScenarioParser.cpp (elements and attributes), Library/src/entities/
SolidEntity.cpp (forces), Library/include/actuators/ActuatorDynamics.h (rotor and thrust models), docs/{actuators,
bodies,environment,materials,robots}.rst. Earth NED; the robot's axes are ours, FRD.

- No element takes added mass: with physics `submerged` it is computed from an ellipsoid about the geometry, and its
  mean over x, y, z is used for all directions. So physics is `floating`, which adds none, and the body has the mean
  total mass and the total inertias. Volume grows with the mass, so that the net buoyancy stays.
- `viscous_drag` Cf: F = rho Cf sum(A v_t) over the faces: for a box that moves along x, 2 rho Cf (A_y + A_z) v.
- `quadratic_drag` Cd: F = rho/2 Cd sum(A |v_n| |v| v) over the faces that meet the water: since February 2024 a cube
  of the speed, not its square.
- A `thruster` of rotor dynamics `first_order` and thrust model `linear_interpolation` whose input is in newtons is a
  lag on the thrust itself, and its table holds gains, limits and a dead zone.
"""

import xml.etree.ElementTree as ET

from bridge.arrays import Vector3
from bridge.vehicle.config import GRAVITY_M_S2
from identify.export.model import (
    DRAG_SPEED_M_S,
    KNOW,
    Model,
    Propeller,
    comment,
    document,
    element,
    numbers,
    pointing,
    volume_m3,
)

START_DEPTH_M = 5.0
STEEP = 1e-3
"""A table can't jump, so it rises to the least thrust within this share of it."""

REASONS = {
    "unknown_inertia": f"the rigid body's own is written; {KNOW}",
    "undamped_moving": "zero is written: the simulator is undamped there, for Stonefish has coefficients of its own "
    f"for all three directions or for none; {KNOW}",
    "shape": "seatrial does not know it; the body is a cube of the right volume: with a mesh of your own in its place, "
    "drag changes",
    "mass_by_axis": "Stonefish has one mass for all directions: {model.mean_mass_words}, is written, "
    "with physics floating so that none is added from the geometry; the Munk moment is lost with the differences",
    "turning_damping": "Stonefish computes moments of drag from the faces of the body, here a cube, with the "
    "coefficients of its translation",
    "oblique": "Stonefish adds the axes' coefficients by direction cosines, so that drag across them is up to sqrt(3) "
    "times that along them",
    "quadratic": "Stonefish's quadratic_drag grows with the cube of the speed since 2024; it is right at 0.5 m/s",
    "thrusters": "Stonefish wants a mesh of each propeller, to be drawn: put a propeller.obj into its data folder",
    "dead_zone_before_lag": "Stonefish's table of thrust acts after the lag",
    "effects": "Stonefish computes no such force; the rest of the model was fitted beside them",
    "curve": "the thrusters here take a setpoint in newtons, not pulse widths",
    "intervals": "a scenario holds values alone; they stand in a comment of the file",
}


def write(model: Model) -> str:
    root = ET.Element("scenario")
    comment(root, model, "written by seatrial; the thrusters' setpoints are newtons.")
    environment = element(root, "environment")
    element(environment, "ned", latitude="0.0", longitude="0.0")
    ocean = element(environment, "ocean")
    element(ocean, "water", density=numbers((model.density_kg_m3,)))
    element(ocean, "waves", height="0.0")
    if any(model.current_m_s):
        element(element(ocean, "current", type="uniform"), "velocity", xyz=numbers(model.current_m_s))
    materials = element(root, "materials")
    element(materials, "material", name="Hull", density=numbers((model.density_kg_m3,)), restitution="0.5")
    element(element(root, "looks"), "look", name="Yellow", rgb="1.0 0.9 0.0", roughness="0.3")
    robot = element(root, "robot", name=model.name, fixed="false", self_collisions="false")
    _hull(robot, model)
    for i, propeller in enumerate(model.thrusters, start=1):
        _thruster(robot, model, i, propeller)
    element(robot, "world_transform", xyz=numbers((0.0, 0.0, START_DEPTH_M)), rpy=numbers((0.0,) * 3))
    return document(root)


def coefficients(model: Model, side_m: float) -> tuple[Vector3, Vector3]:
    """Viscous and quadratic drag coefficients (x, y, z) of a cube with the model's drag along each axis."""
    face_m2, rho = side_m**2, model.density_kg_m3
    x, y, z = (linear / (4 * rho * face_m2) for linear in model.linear[:3])
    xx, yy, zz = (2 * q / (rho * face_m2 * DRAG_SPEED_M_S) for q in model.quadratic[:3])
    return (x, y, z), (xx, yy, zz)


def _hull(robot: ET.Element, model: Model) -> None:
    mass_kg = model.mean_mass_kg
    side_m = volume_m3(model, mass_kg) ** (1 / 3)
    # With a larger buoyancy, a shorter arm gives the same righting moment.
    up_n = mass_kg * GRAVITY_M_S2 + model.net_buoyancy_n
    centre_m = [
        g + (b - g) * model.buoyancy_n / up_n
        for g, b in zip(model.centre_of_gravity_m, model.centre_of_buoyancy_m, strict=True)
    ]
    viscous, quadratic = coefficients(model, side_m)
    level = numbers((0.0,) * 3)
    link = element(robot, "base_link", name="Hull", type="box", physics="floating", buoyant="true")
    element(link, "dimensions", xyz=numbers((side_m,) * 3))
    element(link, "origin", xyz=numbers(centre_m), rpy=level)
    element(link, "material", name="Hull")
    element(link, "look", name="Yellow")
    element(link, "mass", value=numbers((mass_kg,)))
    element(link, "inertia", xyz=numbers(model.total[3:]))
    element(link, "cg", xyz=numbers(model.centre_of_gravity_m), rpy=level)
    element(link, "hydrodynamics", viscous_drag=numbers(viscous), quadratic_drag=numbers(quadratic))


def _thruster(robot: ET.Element, model: Model, i: int, propeller: Propeller) -> None:
    actuator = element(robot, "actuator", name=f"Thruster{i}", type="thruster")
    limit_n = max(-propeller.low_n, propeller.high_n)
    element(
        actuator,
        "specs",
        max_setpoint=numbers((limit_n,)),
        inverted_setpoint="false",
        normalized_setpoint="false",
    )
    drawn = element(actuator, "propeller", diameter="0.1", right="true")
    element(drawn, "mesh", filename="propeller.obj", scale="1.0")
    element(drawn, "material", name="Hull")
    element(drawn, "look", name="Yellow")
    if model.lag_s:
        rotor = element(actuator, "rotor_dynamics", type="first_order")
        element(rotor, "time_constant", value=numbers((model.lag_s,)))
    else:
        element(actuator, "rotor_dynamics", type="zero_order")
    edge_n = propeller.least_n
    edges = {edge_n, edge_n * (1 - STEEP), -edge_n, -edge_n * (1 - STEEP)}
    asked = sorted(
        {propeller.low_n, -propeller.dead_zone_n, 0.0, propeller.dead_zone_n, propeller.high_n} | edges
    )
    law = element(actuator, "thrust_model", type="linear_interpolation")
    element(law, "input", value=numbers(asked))
    element(law, "output", value=numbers(propeller.thrust_n(force) for force in asked))
    element(actuator, "origin", xyz=numbers(propeller.position_m), rpy=numbers(pointing(propeller.direction)))
    element(actuator, "link", name="Hull")
