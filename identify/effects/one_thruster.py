"""Faults of a single thruster: it is weak, points in another direction, or sits in another place."""

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.config import Configuration, Thruster
from bridge.vehicle.effect_coefficients import gain_name
from identify.effects.course import Course
from identify.effects.effect import PULSES, Act, Compensation, Effect, Parameter, Separation, compensated_by

Array = NDArray[np.float64]

UPRIGHT = 0.7
"""A thruster counts as upright, pushing up and down, if the z component of its direction exceeds this magnitude."""

AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def _level(thruster: Thruster) -> bool:
    return abs(thruster.direction[2]) <= UPRIGHT


def weak(number: int) -> Effect:
    def act(course: Course, values: Array) -> Act:
        lost = (values[0] - 1.0) * course.allocation[:, number - 1]
        return Act(wrench=np.outer(course.thrust_n[:, number - 1], lost))

    return Effect(
        "weak_thruster",
        f"thruster {number} is weak, fouled or bent",
        "thruster",
        (Parameter("gain", "1", 0.8, low=0.0, high=2.0, none=1.0),),
        act,
        Separation(manoeuvres=("pulses of one thruster at a time",), sensors=("current beside shaft speed",)),
        needs=(PULSES,),
        number=number,
        feedforward="thruster_gain",
        compensation=compensated_by(Compensation(gain_name(number), "1", "gain")),
    )


def turned(number: int, about: str) -> Effect:
    """A thruster turned about a body axis (Rodrigues' formula)."""

    def act(course: Course, values: Array) -> Act:
        thruster = course.configuration.thrusters[number - 1]
        way, axis = np.array(thruster.direction), np.array(AXES[about])
        cos, sin = np.cos(values[0]), np.sin(values[0])
        to = way * cos + np.cross(axis, way) * sin + axis * (axis @ way) * (1.0 - cos)
        change = thruster.gain * np.concatenate([to - way, np.cross(thruster.position_m, to - way)])
        return Act(wrench=np.outer(course.thrust_n[:, number - 1], change))

    return Effect(
        "thruster_misalignment",
        f"thruster {number} points elsewhere than the vehicle file says: it is turned about {about}",
        "thruster",
        (Parameter("angle", "rad", 0.1, -1.6, 1.6),),
        act,
        Separation(manoeuvres=("pulses in each degree of freedom at low speed",)),
        linear=False,
        needs=(PULSES,),
        number=number,
        variant=f"turned about {about}",
    )


def shifted(number: int, thruster: Thruster) -> Effect:
    """A thruster moved across its thrust: this changes the yaw moment of a level thruster, roll and pitch of an
    upright one."""
    ways = ("across",) if _level(thruster) else ("x", "y")

    def act(course: Course, values: Array) -> Act:
        thruster = course.configuration.thrusters[number - 1]
        way = np.array(thruster.direction)
        by = np.array([*values, 0.0]) if len(values) == 2 else values[0] * np.cross(AXES["z"], way)
        change = thruster.gain * np.concatenate([np.zeros(3), np.cross(by, way)])
        return Act(wrench=np.outer(course.thrust_n[:, number - 1], change))

    return Effect(
        "thruster_misalignment",
        f"thruster {number} sits elsewhere than the vehicle file says",
        "thruster",
        tuple(Parameter(way, "m", 0.02, -1.0, 1.0) for way in ways),
        act,
        Separation(manoeuvres=("pulses in each degree of freedom at low speed",)),
        needs=(PULSES,),
        number=number,
        variant="sits elsewhere",
        # An answer has a field for the angle only.
        telling=lambda _: {},
    )


def of_each_thruster(configuration: Configuration) -> tuple[Effect, ...]:
    """The effects of every single thruster of a configuration."""
    out: list[Effect] = []
    for number, thruster in enumerate(configuration.thrusters, start=1):
        out += [weak(number), shifted(number, thruster)]
        out += [turned(number, about) for about in (("z",) if _level(thruster) else ("x", "y"))]
    return tuple(out)
