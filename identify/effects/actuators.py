"""Thrusters that deviate from their curve or lag, all alike or a single one: weak, turned or moved."""

from collections.abc import Callable

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import ASTERN, LEAST, START, gain_name
from bridge.vehicle.config import Configuration, Thruster
from identify.effects.course import Course, delayed, shaft_lagged, thrust_of
from identify.effects.effect import (
    PULSES,
    QUICK_COMMANDS,
    SIZES,
    Act,
    Compensation,
    Effect,
    ModelPart,
    Parameter,
    Separation,
    before_the_shaft,
    compensated_by,
    past_the_shaft,
)
from identify.estimators.timing.lateness import behind_filter


def _slow(course: Course, more_asked: Array) -> Array:
    """The change of the lagged thrust by an additional demand."""
    if course.by_shaft:
        return shaft_lagged(course.asked_n + more_asked, course.step_s, course.lag_s) - course.thrust_n
    return thrust_of(more_asked, course.step_s, course.lag_s)


THRUST_GAIN = Effect(
    "thrust_gain",
    "all thrusters push more or less than their curve",
    "thruster",
    (Parameter("gain", "1", 0.9, low=0.0, none=1.0),),
    lambda course, values: past_the_shaft(course, (values[0] - 1.0) * course.thrust_n),
    Separation(manoeuvres=("a weighed mass, or 0.5 kg hung on it",)),
    feedforward="thruster_gain",
    refit_absorbs=True,
)


def _low_end(course: Course, values: Array) -> Act:
    """T (1 - c (1 - |T| / Tmax))."""
    asked = course.asked_n
    share = np.maximum(1.0 - np.abs(asked) / course.configuration.thruster_limit_n, 0.0)
    return past_the_shaft(course, _slow(course, -values[0] * share * asked))


THRUST_CURVE = Effect(
    "thrust_curve",
    "thrust that falls short at the low end of the curve",
    "thruster",
    (Parameter("low_end_loss", "1", 0.2, low=0.0, high=1.0),),
    _low_end,
    Separation(manoeuvres=("a staircase of thrust ahead and astern",), sensors=("shaft speeds",)),
    needs=(PULSES,),
)


def _astern(course: Course, values: Array) -> Act:
    return past_the_shaft(course, _slow(course, (values[0] - 1.0) * np.minimum(course.asked_n, 0.0)))


REVERSE_THRUST_LOSS = Effect(
    "reverse_thrust_loss",
    "thrusters that push less astern than their curve",
    "thruster",
    (Parameter("gain", "1", 0.8, low=0.0, none=1.0),),
    _astern,
    Separation(manoeuvres=("steps ahead and astern", "a spin both ways")),
    needs=(PULSES,),
    feedforward="reverse_loss",
    model_part="reverse_gain",
    compensation=compensated_by(Compensation(ASTERN, "1", "gain")),
)


def _silent(course: Course, values: Array) -> Act:
    asked = course.asked_n
    return before_the_shaft(course, _slow(course, np.where(np.abs(asked) < values[0], -asked, 0.0)))


def _late_to_start(course: Course, values: Array) -> Act:
    return before_the_shaft(course, _slow(course, -np.clip(course.asked_n, -values[0], values[0])))


WIDTHS = tuple(float(width) for width in np.round(np.geomspace(0.2, 8.0, 40), 4))
"""Sizes of a dead zone that ends at once, a tenth apart: a thrust falls in or out of it, so that a fit finds no way to
a width that is farther off than half of that."""

DEAD_ZONES: tuple[tuple[Callable[[Course, Array], Act], str, str, ModelPart, tuple[float, ...]], ...] = (
    (_silent, "all above it", LEAST, "least_n", WIDTHS),
    (_late_to_start, "above it so much less", START, "dead_zone_n", SIZES),
)
DEAD_ZONE, DEAD_ZONE_SHIFTED = (
    Effect(
        "dead_zone",
        "thrusters that give nothing below a least thrust",
        "thruster",
        (Parameter("half_width", "N", 0.5, low=0.0),),
        act,
        Separation(manoeuvres=("a slow ramp through zero",), sensors=("shaft speeds",)),
        linear=False,
        sizes=sizes,
        steep=sizes == WIDTHS,
        needs=(PULSES,),
        feedforward="dead_zone",
        variant=variant,
        model_part=part,
        compensation=compensated_by(Compensation(coefficient, "N", "half_width")),
    )
    for act, variant, coefficient, part, sizes in DEAD_ZONES
)


def _saturated(course: Course, values: Array) -> Act:
    over = course.asked_n - np.clip(course.asked_n, -values[0], values[0])
    return before_the_shaft(course, _slow(course, -over))


LEAST_LIMIT = 0.1
"""Share of the largest command of a thruster below which a limit counts as none: thrusters that give next to nothing,
with masses and drags of next to nothing, fit any motion."""


def _may_limit(course: Course, values: Array) -> bool:
    return bool(values[0] >= LEAST_LIMIT * np.abs(course.asked_n).max())


SATURATION = Effect(
    "saturation",
    "thrusters that give no more than a limit",
    "thruster",
    (Parameter("limit", "N", 15.0, low=0.0, none=np.inf),),
    _saturated,
    Separation(manoeuvres=("a ladder of amplitudes",), sensors=("shaft speeds",)),
    linear=False,
    model_part="limit_n",
    sizes=SIZES,
    needs=(PULSES,),
    possible=_may_limit,
)


def thruster_lag(nominal_s: float) -> tuple[Effect, Effect]:
    """A lag other than the nominal lag, which is that of the course: of first order, or in two stages.

    Motor and jet each take their time (Healey et al. 1995), so that the thrust may rise later after a step, and then
    more steeply. The second stage follows the nominal lag, up to two equal stages. The time constant is the mean
    lateness of both together.
    """

    def in_one(course: Course, values: Array) -> Act:
        slower = thrust_of(course.asked_n, course.step_s, float(values[0]))
        return before_the_shaft(course, slower - course.thrust_n)

    def in_two(course: Course, values: Array) -> Act:
        second_s = float(np.clip(values[0] - nominal_s, 0.0, 0.5 * values[0]))
        slower = thrust_of(course.asked_n, course.step_s, float(values[0]) - second_s)
        return before_the_shaft(course, behind_filter(slower, course.step_s, second_s) - course.thrust_n)

    return (
        _lag(nominal_s, in_one, "of first order", "lag_s"),
        _lag(nominal_s, in_two, "in two stages", "other_lag_s"),
    )


def shaft_lag(nominal_s: float) -> Effect:
    """A lag of the shafts' speed other than the nominal lag."""

    def of_shafts(course: Course, values: Array) -> Act:
        slower = shaft_lagged(course.asked_n, course.step_s, float(values[0]))
        return before_the_shaft(course, slower - course.thrust_n)

    return _lag(nominal_s, of_shafts, "of the shafts' speed", "other_lag_s")


def _lag(
    nominal_s: float, act: Callable[[Course, Array], Act], variant: str, model_part: ModelPart
) -> Effect:
    return Effect(
        "thruster_lag",
        "thrusters that answer more slowly, or more quickly, than the vehicle file says",
        "thruster",
        (Parameter("time_constant", "s", nominal_s + 0.05, low=0.0, high=5.0, none=nominal_s),),
        act,
        Separation(sensors=("shaft speeds, and fast steps in a log of 50 Hz",)),
        linear=False,
        sizes=SIZES,
        needs=(QUICK_COMMANDS,),
        variant=variant,
        timing="lag",
        model_part=model_part,
    )


def _late(course: Course, values: Array) -> Act:
    late = delayed(course.thrust_n, course.step_s, float(values[0]))
    return before_the_shaft(course, late - course.thrust_n)


COMMAND_DELAY = Effect(
    "command_delay",
    "commands that reach the propellers late",
    "thruster",
    (Parameter("delay", "s", 0.05, low=0.0, high=2.0),),
    _late,
    Separation(sensors=("shaft speeds beside the pulses",)),
    linear=False,
    sizes=SIZES,
    needs=(QUICK_COMMANDS,),
    timing="delay",
)

EFFECTS = (
    THRUST_GAIN, THRUST_CURVE, REVERSE_THRUST_LOSS, DEAD_ZONE, DEAD_ZONE_SHIFTED, SATURATION, COMMAND_DELAY,
)  # fmt: skip


UPRIGHT = 0.7
"""A thruster counts as upright, pushing up and down, if the z component of its direction exceeds this magnitude."""

AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


def _level(thruster: Thruster) -> bool:
    return abs(thruster.direction[2]) <= UPRIGHT


def weak(number: int) -> Effect:
    def act(course: Course, values: Array) -> Act:
        lost = (values[0] - 1.0) * course.allocation[:, number - 1]
        return Act(wrench=np.outer(lost, course.thrust_n[:, number - 1]).T)

    return Effect(
        "weak_thruster",
        f"thruster {number} is weak, fouled or bent",
        "thruster",
        (Parameter("gain", "1", 0.8, low=0.0, high=2.0, none=1.0, seldom_above=1.0),),
        act,
        Separation(manoeuvres=("pulses of one thruster at a time",), sensors=("current beside shaft speed",)),
        needs=(PULSES,),
        number=number,
        feedforward="thruster_gain",
        model_part="gain",
        compensation=compensated_by(Compensation(gain_name(number), "1", "gain")),
        sudden=True,
    )


def turned(number: int, about: str) -> Effect:
    """A thruster turned about a body axis (Rodrigues' formula)."""

    def act(course: Course, values: Array) -> Act:
        thruster = course.configuration.thrusters[number - 1]
        way, axis = np.array(thruster.direction), np.array(AXES[about])
        cos, sin = np.cos(values[0]), np.sin(values[0])
        to = way * cos + np.cross(axis, way) * sin + axis * (axis @ way) * (1.0 - cos)
        change = thruster.gain * np.concatenate([to - way, np.cross(thruster.position_m, to - way)])
        return Act(wrench=np.outer(change, course.thrust_n[:, number - 1]).T)

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
        model_part="direction",
        about=about,
        sudden=True,
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
        return Act(wrench=np.outer(change, course.thrust_n[:, number - 1]).T)

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
