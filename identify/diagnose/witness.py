"""Readings that take no part in the filters and yet tell of some effects at once: shafts, heading, accelerometer.

Each is compared with what it would read if nothing were hidden. What is left is averaged, divided by its own spread and
freed of its own memory of first order, and stands in the regression below the filters' innovations.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.effects.effect import Act
from bridge.effects.shaft import thrust_by_shaft
from bridge.vehicle.config import GRAVITY_M_S2, ThrustCurve
from identify.dive import Dive, Signal

Array = NDArray[np.float64]

EACH_S = 0.12
WINDOW_S = 5.0
"""Over so long heading and gyro, accelerometer and attitude are compared."""

STAMPED_S = 0.004
"""To what a pulse's and a shaft speed's times are known beside each other."""

MOST_MEMORY = 0.98
LEAST_ROWS = 20
LEAST_SHARE = 0.002
"""A spread is taken to be at least this share of the readings' own size."""


@dataclass(frozen=True)
class Witness:
    """What one sensor reads beyond the nominal, averaged, `off` (m,) at `time_s` (m,). known (m, q): columns that are
    nobody's evidence, each known to be small by `precision` (q,); size (m,): what its spread may grow with. kind and
    number say which part of an act it sees."""

    kind: str
    number: int
    time_s: Array
    off: Array
    known: Array
    precision: Array
    size: Array

    def of(self, act: Act, course: Course) -> Array | None:
        """What an act would add to `off`; None for nothing."""
        if self.kind == "shaft":
            return (
                None
                if act.shaft_n is None
                else _meant(course, act.shaft_n[:, self.number], self.time_s, EACH_S)
            )
        if self.kind == "heading":
            # A gyro that reads too much turns further than the heading does.
            return (
                None
                if act.gyro is None
                else -WINDOW_S * _meant(course, act.gyro[:, 2], self.time_s, WINDOW_S)
            )
        part = act.specific_force
        return None if part is None else _meant(course, part[:, self.number], self.time_s, WINDOW_S)


@dataclass(frozen=True)
class Weighed:
    """A witness with what its rows are divided by (m,), and the memory that is taken out of them."""

    witness: Witness
    std: Array
    memory: float

    def whitened(self, values: Array) -> Array:
        """Values (m, k) freed of memory, in standard deviations."""
        out = values / self.std[:, None]
        out[1:] -= self.memory * out[:-1].copy()
        return np.asarray(out / np.sqrt(1.0 - self.memory**2))


def weighed(witness: Witness, acts: Sequence[Act], course: Course) -> Weighed:
    """A witness weighed by what the acts leave of it."""
    left = witness.off.copy()
    for act in acts:
        if (seen := witness.of(act, course)) is not None:
            left -= seen
    if witness.known.any():
        left -= witness.known @ np.linalg.lstsq(witness.known, left, rcond=None)[0]
    floor = 1e-6 + LEAST_SHARE * witness.size
    small = witness.size <= np.median(witness.size)
    base = np.hypot(1.4826 * float(np.median(np.abs(left[small]))), 1e-6)
    large = (
        1.4826 * float(np.median(np.abs(left[~small]) / np.maximum(witness.size[~small], 1e-9)))
        if (~small).any()
        else 0.0
    )
    std = np.maximum(np.hypot(base, large * witness.size), floor)
    scaled = np.clip(left / std, -4.0, 4.0)
    std = std * max(float(np.std(scaled)), 0.5)
    memory = float(
        np.clip(np.mean(scaled[1:] * scaled[:-1]) / max(float(np.mean(scaled**2)), 1e-12), 0.0, MOST_MEMORY)
    )
    return Weighed(witness, std, memory)


def witnesses(dive: Dive, curve: ThrustCurve, course: Course) -> tuple[Witness, ...]:
    """All that a dive has."""
    found = (*_shafts(dive, curve, course), *_heading(dive, course), *_accelerometer(dive, course))
    return tuple(one for one in found if len(one.off) >= LEAST_ROWS)


def _shafts(dive: Dive, curve: ThrustCurve, course: Course) -> Iterator[Witness]:
    """Thrust by shaft speed beyond that by pulse and lag. By how much either curve is off ahead or astern, and when a
    pulse was sent to some milliseconds, nothing tells."""
    if dive.rpm is None:
        return
    count = course.asked_n.shape[1]
    for k in range(min(count, dive.rpm.value.shape[1])):
        read = dive.rpm.value[:, k]
        told = np.isfinite(read)
        at = Signal(dive.rpm.time_s[told], thrust_by_shaft(curve, read[told, None]))
        time_s, thrust = _binned(at, EACH_S, course)
        nominal = _meant(course, course.thrust_n[:, k], time_s, EACH_S)
        later = -_meant(course, np.gradient(course.thrust_n[:, k], course.step_s), time_s, EACH_S)
        known = np.column_stack([np.maximum(nominal, 0.0), np.minimum(nominal, 0.0), later])
        precision = np.array([0.0, 0.0, STAMPED_S**-2.0])
        yield Witness("shaft", k, time_s, thrust[:, 0] - nominal, known, precision, np.abs(nominal))


def _heading(dive: Dive, course: Course) -> Iterator[Witness]:
    """How far the heading turned in a window beyond what the gyros say."""
    turn = dive.fog if dive.fog is not None and len(dive.fog) else dive.gyro
    if dive.attitude is None or turn is None or len(turn) < LEAST_ROWS:
        return
    rate = turn.value[:, -1] if turn is dive.gyro else turn.value[:, 0]
    w, x, y, z = dive.attitude.value.T
    heading = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
    roll, pitch = (np.interp(turn.time_s, course.time_s, course.euler[:, i]) for i in (0, 1))
    q = np.interp(turn.time_s, course.time_s, course.nu[:, 4])
    by_gyro = (q * np.sin(roll) + rate * np.cos(roll)) / np.cos(pitch)
    step_s = np.diff(turn.time_s)
    turned = np.concatenate([[0.0], np.cumsum(0.5 * step_s * (by_gyro[1:] + by_gyro[:-1]))])
    beyond = heading - np.interp(dive.attitude.time_s, turn.time_s, turned)
    edges = np.arange(course.time_s[0] + WINDOW_S, course.time_s[-1] - WINDOW_S, WINDOW_S)
    near = Signal(dive.attitude.time_s, beyond[:, None])
    ends = np.array(
        [np.mean(part.value) if len(part := near.between(t - 0.5, t + 0.5)) else np.nan for t in edges]
    )
    off = np.diff(ends)
    good = np.isfinite(off)
    middle = 0.5 * (edges[1:] + edges[:-1])[good]
    yield _bare("heading", 2, middle, off[good])


def _accelerometer(dive: Dive, course: Course) -> Iterator[Witness]:
    """Specific force ahead and aside beyond that of motion and gravity."""
    if dive.specific_force is None or dive.attitude is None:
        return
    time_s, read = _binned(dive.specific_force, WINDOW_S, course)
    u, v, w, p, q, r = course.nu.T
    down = course.world[2]
    ahead = course.nu_dot[:, 0] + w * q - v * r - GRAVITY_M_S2 * down[:, 0]
    aside = course.nu_dot[:, 1] + u * r - w * p - GRAVITY_M_S2 * down[:, 1]
    for i, expected in enumerate((ahead, aside)):
        off = read[:, i] - _meant(course, expected, time_s, WINDOW_S)
        yield _bare("specific_force", i, time_s, off)


def _bare(kind: str, number: int, time_s: Array, off: Array) -> Witness:
    return Witness(kind, number, time_s, off, np.zeros((len(off), 0)), np.zeros(0), np.zeros(len(off)))


def _binned(signal: Signal, each_s: float, course: Course) -> tuple[Array, Array]:
    """Times (m,) of the middles of bins within the course, and the means (m, k) of what lies in them."""
    began_s, ended_s = float(course.time_s[0]), float(course.time_s[-1])
    inside = (signal.time_s >= began_s) & (signal.time_s < ended_s) & np.isfinite(signal.value).all(axis=1)
    bins = ((signal.time_s[inside] - began_s) / each_s).astype(np.intp)
    count = np.bincount(bins)
    kept = np.flatnonzero(count)
    sums = np.column_stack([np.bincount(bins, column)[kept] for column in signal.value[inside].T])
    times = np.bincount(bins, signal.time_s[inside])[kept] / count[kept]
    return times, sums / count[kept, None]


def _meant(course: Course, values: Array, time_s: Array, each_s: float) -> Array:
    """The mean (m,) of values along the course within half of `each_s` of each time."""
    total = np.concatenate([[0.0], np.cumsum(0.5 * course.step_s * (values[1:] + values[:-1]))])
    until, since = (np.interp(time_s + by, course.time_s, total) for by in (each_s / 2, -each_s / 2))
    span = np.clip(time_s + each_s / 2, course.time_s[0], course.time_s[-1])
    span -= np.clip(time_s - each_s / 2, course.time_s[0], course.time_s[-1])
    return np.asarray((until - since) / np.maximum(span, 1e-9))
