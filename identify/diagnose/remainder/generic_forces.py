"""Generic forces: functions of speed, thrust, heading, time and place that no cause names, of unit spread."""

from collections.abc import Iterator
from typing import Literal

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import YAW
from identify.effects.course import Course, lagged

Variable = Literal[
    "speed", "acceleration", "yaw_rate", "heading", "depth", "altitude", "time", "voltage", "thrust", "thrust_sign",
    "position",
]  # fmt: skip

Parity = Literal["odd", "even", "neither"]

Force = tuple[Variable, Parity | None, Array]
"""Variable that a force depends on, its parity in that variable, and its values (n,)."""

PAST_S = (1.5, 3.0, 6.0, 12.0)
"""Memory of water or vehicle: longer than a disturbance, shorter than most legs."""


def unit_forces(course: Course, dofs: list[int]) -> Iterator[Force]:
    """Instantaneous forces of unit standard deviation, without constant forces."""
    return of_unit_spread(_forces(course, dofs))


def of_unit_spread(forces: Iterator[Force]) -> Iterator[Force]:
    for variable, parity, force in forces:
        spread = float(np.std(force)) if np.isfinite(force).all() else 0.0
        if spread > 0:
            yield variable, parity, force / spread


def _forces(course: Course, dofs: list[int]) -> Iterator[Force]:
    nu, since = course.nu, course.since_s / max(float(course.since_s[-1]), 1e-9)
    for dof in dofs:
        speed = nu[:, dof]
        name = _speed_in(dof)
        yield name, "odd", speed * np.abs(speed)
        yield name, "odd", speed**3
        yield name, "even", speed**2
        yield name, "even", np.abs(speed)
        yield name, "odd", np.sign(speed) * np.sqrt(np.abs(speed))
        yield "acceleration", "odd", course.nu_dot[:, dof]
    for i, first in enumerate(dofs):
        for second in dofs[i + 1 :]:
            yield "speed", "even", nu[:, first] * nu[:, second]
            yield "speed", "odd", np.abs(nu[:, first]) * nu[:, second]
            yield "speed", "odd", nu[:, first] * np.abs(nu[:, second])
    wrench = course.wrench_of(course.thrust_n)
    for dof in dofs:
        if np.std(wrench[:, dof]) > 0:
            yield "thrust", "odd", wrench[:, dof]
            yield "thrust", "even", np.abs(wrench[:, dof])
            yield "thrust", "odd", wrench[:, dof] * np.abs(wrench[:, dof])
            yield "thrust_sign", "odd", np.tanh(wrench[:, dof] / (0.1 * np.std(wrench[:, dof])))
            yield "thrust", "odd", wrench[:, dof] * np.abs(nu[:, dof])
    heading = course.euler[:, 2]
    for k in (1, 2):
        yield "heading", None, np.sin(k * heading)
        yield "heading", None, np.cos(k * heading)
    for k in (1, 2, 3):
        yield "time", None, since**k
    for dof in dofs:
        yield "time", None, since * nu[:, dof]
        yield "time", None, since * wrench[:, dof]
    heights: tuple[tuple[Variable, Array], ...] = (("depth", course.depth_m), ("altitude", course.altitude_m))
    for height, values in heights:
        if np.isfinite(values).all():
            # The constant part is a force by itself.
            yield height, None, values - values.mean()
            yield height, None, values**2 - np.mean(values**2)
            for dof in dofs:
                yield height, None, values * nu[:, dof]
    if np.isfinite(course.voltage_v).all():
        yield "voltage", None, course.voltage_v - course.voltage_v.mean()
        for dof in dofs:
            yield "voltage", None, course.voltage_v * wrench[:, dof]
    north, east = course.position_m.T
    to_north, to_east, _ = course.world
    for axis in range(2):
        yield "position", None, north * to_north[:, axis]
        yield "position", None, east * to_east[:, axis]
        yield "position", None, np.hypot(north, east) * np.sign(nu[:, axis])


def of_other_speeds(course: Course, dofs: list[int]) -> Iterator[Force]:
    """Forces linear in other axes' speeds; the axis's own speed belongs to the nominal model."""
    for dof in dofs:
        yield _speed_in(dof), "odd", course.nu[:, dof]


def _speed_in(dof: int) -> Variable:
    return "yaw_rate" if dof == YAW else "speed"


def of_the_past(course: Course, dof: int) -> Iterator[Force]:
    """Functions of an earlier speed, as of water set in motion."""
    speed = course.nu[:, dof]
    name = _speed_in(dof)
    for past_s in PAST_S:
        before = lagged(speed[:, None], course.step_s, past_s)[:, 0]
        yield name, "odd", before
        yield name, "odd", before * np.abs(before)
        yield name, "odd", (before - speed) * np.abs(before)
        yield name, "odd", (before - speed) * np.abs(before - speed)
