"""What the body itself is otherwise than the vehicle file says: mass, balance, buoyancy."""

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.effects.effect import Act, Effect, Parameter
from bridge.vehicle.config import GRAVITY_M_S2

Array = NDArray[np.float64]


def _off_centre(course: Course, values: Array) -> Act:
    """The forces of first moments (m x, m y), kg m, of the mass about the origin (Fossen 2011, eqs 3.57 and 3.60)."""
    x, y = values.tolist()
    u, v, _, _, _, r = course.nu.T
    du, dv, _, _, _, dr = course.nu_dot.T
    wrench = np.zeros_like(course.nu)
    wrench[:, 0] = y * dr + x * r**2
    wrench[:, 1] = -x * dr + y * r**2
    wrench[:, 5] = -x * (dv + u * r) + y * (du - v * r)
    return Act(wrench=wrench)


CG_OFFSET = Effect(
    "cg_offset",
    "a centre of mass that is off the origin ahead or aside, or added mass that couples sway and yaw",
    "body",
    (Parameter("x", "kg m", 0.5), Parameter("y", "kg m", 0.5)),
    _off_centre,
    "only its sum with the added mass is told; static trim, or weighing both ends, splits them",
)


def _height(course: Course, values: Array) -> Act:
    """Thrust and weight that act higher or lower than taken: pitch with surge, roll with sway, and their righting."""
    roll, pitch, _ = course.euler.T
    weight = course.configuration.dry_mass_kg * GRAVITY_M_S2
    wrench = np.zeros_like(course.nu)
    wrench[:, 3] = -values[0] * weight * np.sin(roll) * np.cos(pitch)
    wrench[:, 4] = -values[0] * weight * np.sin(pitch)
    return Act(wrench=wrench)


PITCH_ROLL_COUPLING = Effect(
    "pitch_roll_coupling",
    "a centre of mass that is lower or higher than the vehicle file says",
    "body",
    (Parameter("height", "m", 0.01, -0.5, 0.5),),
    _height,
    "a pitch step, and a weight that tilts it at rest",
    needs=("attitude",),
)


def _buoyancy(course: Course, values: Array) -> Act:
    roll, pitch, _ = course.euler.T
    up = -values[0]
    wrench = np.zeros_like(course.nu)
    wrench[:, 0] = -up * np.sin(pitch)
    wrench[:, 1] = up * np.cos(pitch) * np.sin(roll)
    wrench[:, 2] = up * np.cos(pitch) * np.cos(roll)
    return Act(wrench=wrench)


NET_BUOYANCY = Effect(
    "net_buoyancy",
    "a buoyancy other than the vehicle file says, as of fresh or salt water",
    "body",
    (Parameter("force", "N", 1.0),),
    _buoyancy,
    "a drift without thrust; at depth again",
)


def _heavier(course: Course, mass: Array) -> Array:
    return np.asarray(-mass * course.nu_dot - course.coriolis_of(mass, course.nu))


def _entrained(course: Course, values: Array) -> Act:
    return Act(wrench=_heavier(course, np.array([values[0]] * 3 + [0.0] * 3)))


ENTRAINED_WATER = Effect(
    "entrained_water",
    "water that the hull carries along: as much more mass in surge, sway and heave",
    "body",
    (Parameter("mass", "kg", 2.0),),
    _entrained,
    "the same more in all three; weighing it wet",
)


def _payload(course: Course, values: Array) -> Act:
    """More mass, and drag in proportion."""
    share = values[0] / course.configuration.dry_mass_kg
    mass = np.array([values[0]] * 3 + [0.0] * 3)
    return Act(wrench=_heavier(course, mass) - share * course.damping * course.nu)


ADDED_PAYLOAD = Effect(
    "added_payload",
    "a payload that was not there before: more mass and more drag",
    "body",
    (Parameter("mass", "kg", 2.0),),
    _payload,
    "the parameters that were accepted before",
)

EFFECTS = (CG_OFFSET, PITCH_ROLL_COUPLING, NET_BUOYANCY, ENTRAINED_WATER, ADDED_PAYLOAD)
