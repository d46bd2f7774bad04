"""Thrust that depends on the supply: at a given pulse, on the square of the voltage (n goes with V, T with n^2)."""

from collections.abc import Iterator

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.accepted_effects import AHEAD_A_N15, ASTERN_A_N15, NOMINAL_V, SLOW_S
from bridge.vehicle.coefficients import RESISTANCE, VOLTAGE, VOLTAGE_SHARE
from identify.effects.course import Course, lagged
from identify.effects.effect import (
    PULSES,
    SIZES,
    Act,
    Compensation,
    Effect,
    Parameter,
    Separation,
    before_the_shaft,
    compensated_by,
)

RIPPLE_S = SLOW_S
"""Time constant for averaging the recorded voltage: faster changes come from the load."""

LOADS = (0.7, 1.0, 1.4, 2.0)
"""Powers of thrust in the load of all thrusters."""

GIVES_WAY_S = 0.3
"""Response time of a supply to load, s."""

LEAST_FALL = 0.01
"""A battery whose squared voltage falls by less than this share in a dive does not power the thrusters."""


def _with_time(course: Course, values: Array) -> Act:
    return before_the_shaft(course, -(values[0] * course.since_s)[:, None] * course.thrust_n)


def fall_by_voltage(voltage_v: Array, since_s: Array) -> Array:
    """Fall of V^2 since the start, relative to its mean rate of fall (1/s): (n,), in seconds.

    Zero if no voltage is recorded, or if it does not fall. The voltage is smoothed with earlier readings only; the
    mean rate is that of the whole course.
    """
    slow = _slow(voltage_v, since_s)
    if slow is None:
        return np.zeros_like(since_s)
    fall, rate = _fall(slow, since_s)
    return np.asarray(fall / rate) if rate * since_s[-1] > LEAST_FALL else np.zeros_like(since_s)


def voltage_law(voltage_v: Array, since_s: Array) -> tuple[float, float]:
    """The voltage (V) at the start of a course and the mean rate (1/s) at which its square falls from there: a
    `battery_sag` of this rate means thrust fully proportional to the square of the voltage. NaN if no voltage is
    recorded."""
    slow = _slow(voltage_v, since_s)
    return (np.nan, np.nan) if slow is None else (float(slow[0]), _fall(slow, since_s)[1])


def _slow(voltage_v: Array, since_s: Array) -> Array | None:
    known = np.isfinite(voltage_v)
    if not known.any():
        return None
    filled = np.interp(since_s, since_s[known], voltage_v[known])
    return np.asarray(lagged(filled[:, None], float(since_s[1] - since_s[0]), RIPPLE_S)[:, 0])


def _fall(slow_v: Array, since_s: Array) -> tuple[Array, float]:
    fall = 1.0 - (slow_v / slow_v[0]) ** 2
    middle = since_s - since_s.mean()
    return fall, float(middle @ fall) / float(middle @ middle)


def _with_voltage(course: Course, values: Array) -> Act:
    fall_s = fall_by_voltage(course.voltage_v, course.since_s)
    return before_the_shaft(course, -(values[0] * fall_s)[:, None] * course.thrust_n)


def _by_voltage(course: Course) -> tuple[Compensation, ...]:
    """The rate is in units of this dive's fall of V^2."""
    begun_v, rate = voltage_law(course.voltage_v, course.since_s)
    if not (np.isfinite(begun_v) and rate > 0):
        return ()
    return Compensation(VOLTAGE, "V", slope=begun_v), Compensation(VOLTAGE_SHARE, "1", "rate", 1.0 / rate)


BATTERY_SAG = Effect(
    "battery_sag",
    "thrust that falls over the dive as the battery empties",
    "thruster",
    (Parameter("rate", "1/s", 2e-4, low=0.0),),
    _with_time,
    Separation(
        manoeuvres=("a leg at the beginning and again at the end", "a coast-down"), sensors=("the voltage",)
    ),
    variant="with time",
    caveat="The battery sag's rate is that of this dive: one with another load, or from a battery less full, empties "
    "it at another. The next diagnosis tells by how much; where the voltage is recorded, the sag goes by that.",
)

BATTERY_SAG_BY_VOLTAGE = Effect(
    "battery_sag",
    "thrust that falls as the square of the recorded voltage",
    "thruster",
    (Parameter("rate", "1/s", 2e-4, low=0.0),),
    _with_voltage,
    Separation(manoeuvres=("a leg at the beginning and again at the end", "a coast-down")),
    needs=("voltage",),
    feedforward="voltage",
    variant="with the voltage",
    caveat="The battery sag's rate is in the model as that of this dive, in which the voltage fell as it did: a dive "
    "in which it falls faster or slower has another, and the next diagnosis tells by how much.",
    compensation=_by_voltage,
)


def _loaded(course: Course, values: Array) -> Act:
    """V = V0 - R I, with I proportional to |T|^1.5 of every thruster, like the shaft's power, for a T200; T as V^2."""
    thrust = course.thrust_n
    size = np.abs(thrust)
    current = (np.where(thrust > 0, AHEAD_A_N15, ASTERN_A_N15) * size * np.sqrt(size)).sum(axis=1)
    left = np.maximum(1.0 - values[0] * current / NOMINAL_V, 0.0) ** 2
    return before_the_shaft(course, (left - 1.0)[:, None] * thrust)


def _load_losses(course: Course, _: Act) -> Iterator[Act]:
    """Thrust times the load of all thrusters, by other laws, instantaneous and late."""
    thrust = course.thrust_n
    for power in LOADS:
        load = (np.abs(thrust) ** power).sum(axis=1, keepdims=True)
        for late_s in (0.0, GIVES_WAY_S):
            yield Act(wrench=course.wrench_of(lagged(load, course.step_s, late_s) * thrust))


LOAD_SAG = Effect(
    "load_sag",
    "thrust that falls while many thrusters push at once",
    "thruster",
    (Parameter("resistance", "ohm", 0.05, low=0.0, high=2.0),),
    _loaded,
    Separation(manoeuvres=("surge alone against surge and heave at once",), sensors=("shaft speeds",)),
    linear=False,
    sizes=SIZES,
    needs=(PULSES,),
    feedforward="voltage",
    compensation=compensated_by(Compensation(RESISTANCE, "ohm", "resistance")),
    companions=_load_losses,
)

EFFECTS = (BATTERY_SAG, BATTERY_SAG_BY_VOLTAGE, LOAD_SAG)
