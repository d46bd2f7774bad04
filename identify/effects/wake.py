"""Effects of the water around a propeller on its thrust: inflow, wash and reaction torque."""

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.config import Configuration
from identify.effects.course import Course
from identify.effects.effect import PULSES, Act, Effect, Parameter, Separation, past_the_shaft

IN_LINE = 0.7
"""Cosine limit: a thruster stands in another's wash if it lies within 45 degrees of its axis."""


def inflow_m_s(course: Course) -> Array:
    """Speed of the water into each thruster, along its thrust, (n, k)."""
    places, ways = _places(course.configuration)
    # (omega x place) . way = omega . (place x way)
    return np.asarray(course.nu[:, :3] @ ways.T + course.nu[:, 3:] @ np.cross(places, ways).T)


def _places(configuration: Configuration) -> tuple[Array, Array]:
    """Positions and directions of all thrusters, (k, 3) each."""
    places = np.array([t.position_m for t in configuration.thrusters]).reshape(-1, 3)
    return places, np.array([t.direction for t in configuration.thrusters]).reshape(-1, 3)


def _starved(course: Course, values: Array) -> Act:
    """T = T_nn |n| n - T_nu |n| ua (Fossen and Blanke 2000, the bilinear model), with |n| as the square root of |T|."""
    speed = np.sqrt(np.abs(course.thrust_n))
    return past_the_shaft(course, -values[0] * speed * inflow_m_s(course))


INFLOW_LOSS = Effect(
    "inflow_loss",
    "thrust that falls as the water comes at the propeller",
    "thruster",
    (Parameter("slope", "N^0.5 s/m", 0.5, low=0.0),),
    _starved,
    Separation(manoeuvres=("one speed at different thrusts: accelerating, coasting, towed",)),
    needs=(PULSES,),
)


def _onto_the_hull(course: Course, values: Array) -> Act:
    """Wash flows opposite to the thrust; it meets the hull if the thruster pushes outwards, away from the origin."""
    places, ways = _places(course.configuration)
    outwards = np.sign(np.round((places * ways).sum(axis=1), 9))
    return past_the_shaft(course, -values[0] * outwards * np.maximum(outwards * course.thrust_n, 0.0))


def _onto_another(course: Course, values: Array) -> Act:
    """A thruster in the wash of another active thruster loses a share of its own thrust."""
    places, ways = _places(course.configuration)
    between = places[None] - places[:, None]
    far = np.linalg.norm(between, axis=2)
    along = (between * ways[:, None]).sum(axis=2) / np.where(far > 0, far, 1.0)
    thrust = course.thrust_n
    ahead, astern = (thrust > 0).astype(np.float64), (thrust < 0).astype(np.float64)
    washed = ahead @ (along < -IN_LINE) + astern @ (along > IN_LINE) > 0
    return past_the_shaft(course, -values[0] * washed * thrust)


HULL_INTERACTION, THRUSTER_INTERACTION = (
    Effect(
        "hull_interaction",
        f"thrusters that lose a share of their thrust where wash meets {target}",
        "thruster",
        (Parameter("loss", "1", 0.1, low=0.0, high=1.0),),
        act,
        Separation(manoeuvres=("pulses of one thruster at a time",)),
        needs=(PULSES,),
        variant=f"wash on {target}",
    )
    for act, target in ((_onto_the_hull, "the hull"), (_onto_another, "another thruster"))
)


def _torque(course: Course, values: Array) -> Act:
    """All propellers turn in the same direction, so each reaction acts about the thruster's own axis: K for the
    components about x and y, from level thrusters, and N for those about z, from upright thrusters."""
    _, ways = _places(course.configuration)
    wrench = np.zeros_like(course.nu)
    wrench[:, 3:] = values[[0, 0, 1]] * (course.thrust_n @ ways)
    return Act(wrench=wrench)


PROPELLER_TORQUE = Effect(
    "propeller_torque",
    "propellers whose reaction torques do not cancel",
    "thruster",
    (Parameter("K", "N m/N", 0.01), Parameter("N", "N m/N", 0.01)),
    _torque,
    Separation(manoeuvres=("a pulse of equal thrust on all",)),
    needs=(PULSES,),
)

EFFECTS = (INFLOW_LOSS, HULL_INTERACTION, THRUSTER_INTERACTION, PROPELLER_TORQUE)
