"""How effects of the library move the marks of a run, and how roughly that is known."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from bridge.vehicle.config import Configuration, Water
from identify.dive import Array
from identify.effects.actuators import weak
from identify.effects.course import Course
from identify.effects.effect import Effect
from identify.effects.rigid_body import NET_BUOYANCY
from identify.effects.sensors import DEPTH_SCALE
from identify.repeats.marks import HEAVE
from identify.repeats.usual import DEPTH, FORCE, PITCH, ROLL, YAW, Usual

ROUGH: Final = 0.5
"""Relative standard deviation of a thruster's moments about x and y: arms and righting moment are seldom known."""

ROUGH_THRUST: Final = 0.2
"""The same of its thrust as a share of all."""

REACTION_M: Final = 0.1
"""Standard deviation of a propeller's own torque per thrust, m, which vehicle files do not have."""

OFF_CENTRE_M: Final = 0.05
"""Standard deviation of where a weight hangs."""

SIZES: Final = np.geomspace(0.02, 1.0, 120)
GAINS: Final = np.geomspace(1e-3, 1e-1, 120)


@dataclass(frozen=True)
class Cause:
    """An effect of some size. shift (5,): of the marks; rough (5,): standard deviation of that shift, as far as the
    vehicle file does not tell it. also: names of effects that move no mark otherwise."""

    effect: Effect
    values: Array
    shift: Array
    rough: Array
    also: tuple[str, ...] = ()


def causes_of(usual: Usual, shape: Configuration, water: Water) -> dict[str, tuple[Cause, ...]]:
    """By the effects' labels, each in a range of sizes."""
    course = _course(usual, shape)
    total_n = float(np.abs(course.wrench_of(course.thrust_n)[0, HEAVE]))
    weights = [_weight(course, way * size * total_n) for size in SIZES for way in (1.0, -1.0)]
    gains = [_depth_gain(1.0 + way * size, water) for size in GAINS for way in (1.0, -1.0)]
    thrusters = [
        [_weak(course, number, float(1.0 - size)) for size in SIZES]
        for number in range(1, len(shape.thrusters) + 1)
    ]
    return {each[0].effect.label: tuple(each) for each in (weights, gains, *thrusters)}


def _weight(course: Course, force_n: float) -> Cause:
    shift = _pushed(NET_BUOYANCY, course, [force_n])
    leans = OFF_CENTRE_M * abs(force_n)
    heavier = ("added_payload",) if force_n < 0 else ()
    return Cause(NET_BUOYANCY, np.array([force_n]), shift, np.array([0.0, 0.0, leans, leans, 0.0]), heavier)


def _depth_gain(scale: float, water: Water) -> Cause:
    """A depth sensor reads absolute pressure, and its gain acts on that of the air too: at the surface it reads
    (k - 1) p / (rho g), which shows long before k z does."""
    air_m = 100.0 * water.surface_pressure_hpa / (water.density_kg_m3 * water.gravity_m_s2)
    effect = replace(DEPTH_SCALE, variant="of the absolute pressure")
    shift = np.zeros(5)
    shift[DEPTH] = (scale - 1.0) * air_m
    return Cause(effect, np.array([scale]), shift, np.zeros(5))


def _weak(course: Course, number: int, gain: float) -> Cause:
    effect = weak(number)
    shift = _pushed(effect, course, [gain])
    rough = np.zeros(5)
    rough[FORCE] = ROUGH_THRUST * abs(shift[FORCE])
    rough[[ROLL, PITCH]] = ROUGH * np.abs(shift[[ROLL, PITCH]])
    rough[YAW] = REACTION_M * (1.0 - gain) * abs(course.thrust_n[0, number - 1])
    return Cause(effect, np.array([gain]), shift, rough)


def _pushed(effect: Effect, course: Course, values: Sequence[float]) -> Array:
    wrench = effect.act(course, np.array(values)).wrench
    assert wrench is not None
    return np.concatenate([[0.0], wrench[0, 2:]])


def _course(usual: Usual, shape: Configuration) -> Course:
    """The steady push of the accepted runs, level and at rest."""
    still, none = np.zeros((2, 6)), np.full(2, np.nan)
    asked = np.tile(usual.thrust_n, (2, 1))
    return Course(
        shape, np.arange(2.0), still, still, np.zeros((2, 3)), none, none, np.zeros((2, 2)), asked,
        np.full(asked.shape, np.nan), none, 0.0, np.ones(6), np.ones(6),
    )  # fmt: skip
