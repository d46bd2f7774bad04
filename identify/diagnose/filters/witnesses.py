"""Sensors outside the filters that show some effects directly: shafts, heading, accelerometer.

Each is compared with its prediction by the nominal model. The residual is averaged in bins, normalised, freed of its
first-order autocorrelation, and added to the regression below the filters' innovations.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.config import GRAVITY_M_S2, VehicleFile
from bridge.vehicle.thrusters import thrust_by_shaft, thrust_curve
from identify.diagnose.filters.deviation import deviations
from identify.dive import Dive, Signal
from identify.effects.course import Course, delayed, lagged
from identify.effects.effect import Act
from identify.estimators.axes.readings import reads_fog, tumbles
from identify.ingest.rotation import euler_angles
from identify.statistics import bulk_std

EACH_S = 0.3
WINDOW_S = 5.0
"""Averaging time of heading against gyro, and of accelerometer against attitude."""

LATE_S, SLOWER_S = (-0.05, 0.05, 0.1, 0.2), 0.1
"""A speed controller's telemetry is late, held and filtered by unknown amounts. Shifts of thrust by these times, and
lags longer by this, are nuisances."""

JITTER_S = 0.03
"""Random error of a reading's time, in addition to its mean delay, s."""

ROUNDED_S = (-JITTER_S, JITTER_S)
"""A course samples thrust at its own instants, between the pulses' edges. Shifts within this are nuisances: rounding
alone would otherwise show a lag off by a step or two."""

MOST_MEMORY = 0.98
LEAST_ROWS = 20
LEAST_SHARE = 0.01
"""Least standard deviation, relative to the readings' size."""


@dataclass(frozen=True)
class Bins:
    """Times (n,) of readings, the bin (n,) of each, counts (m,) of the bins, and the times (t,) of the course."""

    time_s: Array
    of: NDArray[np.intp]
    count: Array
    course_s: Array

    def mean(self, values: Array) -> Array:
        """Means (m,) of values (n,) at the times."""
        return np.asarray(np.bincount(self.of, values) / self.count)

    def along(self, values: Array) -> Array:
        """Means (m,) of values (t,) along the course."""
        index, share = self._between
        return np.asarray(_binned_means(self.of, self.count, index, share, np.ascontiguousarray(values)))

    @cached_property
    def _between(self) -> tuple[NDArray[np.intp], Array]:
        """Instant of the course before each reading, and the reading's share of the way to the next instant.

        Many acts are read at the same times, so that these are looked up once.
        """
        index = np.clip(
            np.searchsorted(self.course_s, self.time_s, side="right") - 1, 0, len(self.course_s) - 2
        )
        share = (self.time_s - self.course_s[index]) / (self.course_s[index + 1] - self.course_s[index])
        return index, np.clip(share, 0.0, 1.0)


@njit(cache=True, nogil=True)
def _binned_means(
    of: NDArray[np.intp], count: Array, index: NDArray[np.intp], share: Array, values: Array
) -> Array:
    """Means in bins, as of `Bins`, of values interpolated from the instant `index` (n,) by `share` (n,) of the step."""
    total = np.zeros(len(count))
    for i in range(len(of)):
        before = values[index[i]]
        total[of[i]] += before + share[i] * (values[index[i] + 1] - before)
    return total / count


@dataclass(frozen=True)
class Witness:
    """One sensor's residual beyond the nominal model, averaged in bins, `off` (m,).

    known (m, q): nuisance columns with prior precision (q,); size (m,): scale of a proportional error; timing_std
    (m,): the part of the error by jitter. kind and number select the part of an act that the sensor measures.
    """

    kind: Literal["shaft", "heading", "specific_force"]
    number: int
    bins: Bins
    off: Array
    known: Array
    precision: Array
    size: Array
    timing_std: Array

    @property
    def time_s(self) -> Array:
        return self.bins.mean(self.bins.time_s)

    def of(self, act: Act) -> Array | None:
        """An act's contribution to `off`; None for none."""
        if self.kind == "heading":
            # If a gyro reads high, its integrated rate turns further than the heading.
            return None if act.gyro is None else -WINDOW_S * self.bins.along(act.gyro[:, 2])
        part = act.shaft_n if self.kind == "shaft" else act.specific_force
        return None if part is None else self.bins.along(part[:, self.number])

    def left(self, acts: Sequence[Act]) -> Array:
        """`off` less the contributions of acts."""
        seen = [part for act in acts if (part := self.of(act)) is not None]
        return np.asarray(self.off - sum(seen, np.zeros(len(self.off))))


@dataclass(frozen=True)
class WeighedWitness:
    """A witness with the standard deviations of its rows (m,), and its first-order autocorrelation."""

    witness: Witness
    std: Array
    memory: float

    def whitened(self, values: Array) -> Array:
        """Values (m, k), prewhitened and normalised."""
        out = values / self.std[:, None]
        out[1:] -= self.memory * out[:-1].copy()
        return np.asarray(out / np.sqrt(1.0 - self.memory**2))


def weighed_witness(witness: Witness, acts: Sequence[Act], course: Course) -> WeighedWitness:
    """Weigh a witness by its residual less the acts."""
    witness = _with_acts(witness, acts, course)
    left = witness.left(acts)
    if witness.known.any():
        left -= witness.known @ np.linalg.lstsq(witness.known, left, rcond=None)[0]
    floor = 1e-6 + LEAST_SHARE * witness.size
    small = witness.size <= np.median(witness.size)
    base = np.hypot(bulk_std(left[small]), 1e-6)
    large = bulk_std(left[~small] / np.maximum(witness.size[~small], 1e-9)) if (~small).any() else 0.0
    std = np.maximum(np.hypot(base, large * witness.size), floor)
    std = np.hypot(std, witness.timing_std)
    scaled = np.clip(left / std, -4.0, 4.0)
    std = std * max(float(np.std(scaled)), 0.5)
    memory = float(
        np.clip(np.mean(scaled[1:] * scaled[:-1]) / max(float(np.mean(scaled**2)), 1e-12), 0.0, MOST_MEMORY)
    )
    return WeighedWitness(witness, std, memory)


def _with_acts(witness: Witness, acts: Sequence[Act], course: Course) -> Witness:
    """A shaft's witness with nuisance columns for the acts' thrust, which telemetry delays and filters as well."""
    shafts = [act.shaft_n[:, [witness.number]] for act in acts if act.shaft_n is not None]
    if witness.kind != "shaft" or not shafts:
        return witness
    more, step_s = np.asarray(sum(shafts)), course.step_s
    slower_s = course.lag_s + SLOWER_S
    late = [delayed(more, step_s, late_s) - more for late_s in LATE_S]
    late.append(SLOWER_S / slower_s * (lagged(more, step_s, slower_s) - more))
    late += [delayed(more, step_s, late_s) - more for late_s in ROUNDED_S]
    known = witness.known.copy()
    known[:, -len(late) :] += np.column_stack([witness.bins.along(shifted[:, 0]) for shifted in late])
    return replace(witness, known=known)


def witnesses(dive: Dive, file: VehicleFile, course: Course) -> tuple[Witness, ...]:
    """All witnesses of a dive."""
    all_witnesses = (*_shafts(dive, file, course), *_heading(dive, course), *_accelerometer(dive, course))
    return tuple(witness for witness in all_witnesses if len(witness.off) >= LEAST_ROWS)


def _shafts(dive: Dive, file: VehicleFile, course: Course) -> Iterator[Witness]:
    """Thrust by shaft speed less thrust by pulse and lag.

    Scales of either curve ahead and astern, and the telemetry's delay, are nuisances: a thruster's timing shows in
    the vehicle's motion.
    """
    if dive.rpm is None or dive.pwm is None or course.by_wrench:
        return
    curve = file.vehicle.thrust_curve
    count, lag_s = course.asked_n.shape[1], max(curve.lag_s, 1e-6)
    thrust_n, slower_n = (_by_pulses(dive.pwm, file, count, lag) for lag in (lag_s, lag_s + SLOWER_S))
    for k in range(min(count, dive.rpm.value.shape[1])):
        bins, read = _binned(Signal(dive.rpm.time_s, dive.rpm.value[:, k : k + 1]), EACH_S, course)
        if not len(bins.count):
            continue
        thrust = bins.mean(thrust_by_shaft(curve, read)[:, 0])
        at = thrust_n(bins.time_s)[:, k]
        nominal = bins.mean(at)
        late = [bins.mean(thrust_n(bins.time_s - late_s)[:, k] - at) for late_s in LATE_S]
        late.append(bins.mean(slower_n(bins.time_s)[:, k] - at))
        given = course.thrust_n[:, [k]]
        rounded = [delayed(given, course.step_s, late_s) - given for late_s in ROUNDED_S]
        late += [bins.along(shifted[:, 0]) for shifted in rounded]
        before = thrust_n(bins.time_s - JITTER_S)[:, k]
        after = thrust_n(bins.time_s + JITTER_S)[:, k]
        timing_std = bins.mean(0.5 * np.abs(after - before))
        known = np.column_stack([np.maximum(nominal, 0.0), np.minimum(nominal, 0.0), *late])
        yield Witness(
            "shaft", k, bins, thrust - nominal, known, np.zeros(known.shape[1]), np.abs(nominal), timing_std
        )


def _by_pulses(pwm: Signal, file: VehicleFile, count: int, lag_s: float) -> Callable[[Array], Array]:
    """The thrusters' output by curve and lag at any times, (n, k).

    It has edges between a course's instants, and shafts are read there.
    """
    curve = file.vehicle.thrust_curve
    by_pulse = thrust_curve(curve, file.path.parent)
    asked = by_pulse.thrust(np.where(pwm.value[:, :count] > 0, pwm.value[:, :count], by_pulse.neutral_us))
    given = _lagging(np.ascontiguousarray(asked), np.exp(-np.diff(pwm.time_s) / lag_s))

    def at(time_s: Array) -> Array:
        last = np.maximum(np.searchsorted(pwm.time_s, time_s, side="right") - 1, 0)
        fading = np.exp(-np.maximum(time_s - pwm.time_s[last], 0.0) / lag_s)[:, None]
        return np.asarray(asked[last] + fading * (given[last] - asked[last]))

    return at


@njit(cache=True, nogil=True)
def _lagging(asked: Array, keep: Array) -> Array:
    """Output (n, k) at each pulse, by the demand (n, k) from each pulse on and the share (n - 1,) of the distance to it
    that is left at the next."""
    given = asked.copy()
    for i in range(len(keep)):
        for k in range(asked.shape[1]):
            given[i + 1, k] = asked[i, k] + keep[i] * (given[i, k] - asked[i, k])
    return given


def _heading(dive: Dive, course: Course) -> Iterator[Witness]:
    """Turn of the heading in a window, less the fibre-optic gyro's; the compass' deviation is a nuisance. Without that
    gyro the heading is among the readings."""
    turn = dive.fog if reads_fog(dive) else None
    if dive.attitude is None or turn is None or len(turn) < LEAST_ROWS or tumbles(dive):
        return
    rate = turn.value[:, -1]
    heading = np.unwrap(euler_angles(dive.attitude.value)[2])
    roll, pitch = (np.interp(turn.time_s, course.time_s, course.euler[:, i]) for i in (0, 1))
    q = np.interp(turn.time_s, course.time_s, course.nu[:, 4])
    by_gyro = (q * np.sin(roll) + rate * np.cos(roll)) / np.cos(pitch)
    turned = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(turn.time_s) * (by_gyro[1:] + by_gyro[:-1]))])
    beyond = heading - np.interp(dive.attitude.time_s, turn.time_s, turned)
    edges = np.arange(course.time_s[0] + WINDOW_S, course.time_s[-1] - WINDOW_S, WINDOW_S)
    if len(edges) < 2:
        return
    ends = _about(edges, Signal(dive.attitude.time_s, np.column_stack([beyond, deviations(heading)])))
    off, *deviation = np.diff(ends, axis=0).T
    # A turn between two runs was not seen.
    across = np.searchsorted(dive.breaks_s, edges[1:] + 0.5) > np.searchsorted(
        dive.breaks_s, edges[:-1] - 0.5
    )
    good = np.isfinite(off) & ~across
    time_s = course.time_s[(course.time_s >= edges[0]) & (course.time_s < edges[-1])]
    window = np.minimum(((time_s - edges[0]) / WINDOW_S).astype(np.intp), len(off) - 1)
    kept = good[window]
    number = np.cumsum(good) - 1
    bin_of = number[window[kept]].astype(np.intp)
    bins = Bins(
        time_s[kept], bin_of, np.bincount(bin_of, minlength=int(good.sum())).astype(np.float64), course.time_s
    )
    plain = _plain_witness("heading", 2, bins, off[good])
    yield replace(plain, known=np.column_stack(deviation)[good], precision=np.ones(len(deviation)))


def _about(instants: Array, signal: Signal) -> Array:
    """Means (n, k) of the samples within half a second of each instant (n,), NaN without one."""
    parts = [signal.between(t - 0.5, t + 0.5).value for t in instants]
    none = np.full(signal.value.shape[1], np.nan)
    return np.array([np.mean(part, axis=0) if len(part) else none for part in parts])


def _accelerometer(dive: Dive, course: Course) -> Iterator[Witness]:
    """Specific force ahead and aside, less the prediction by motion and gravity."""
    if dive.specific_force is None or dive.attitude is None:
        return
    bins, read = _binned(dive.specific_force, WINDOW_S, course)
    u, v, w, p, q, r = course.nu.T
    down = course.world[2]
    ahead = course.nu_dot[:, 0] + w * q - v * r - GRAVITY_M_S2 * down[:, 0]
    aside = course.nu_dot[:, 1] + u * r - w * p - GRAVITY_M_S2 * down[:, 1]
    for i, expected in enumerate((ahead, aside)):
        yield _plain_witness("specific_force", i, bins, bins.mean(read[:, i]) - bins.along(expected))


def _plain_witness(
    kind: Literal["heading", "specific_force"], number: int, bins: Bins, off: Array
) -> Witness:
    return Witness(
        kind, number, bins, off, np.zeros((len(off), 0)), np.zeros(0), np.zeros(len(off)), np.zeros(len(off))
    )


def _binned(signal: Signal, each_s: float, course: Course) -> tuple[Bins, Array]:
    """Bins of the valid readings within the course, and these readings (n, k)."""
    began_s, ended_s = float(course.time_s[0]), float(course.time_s[-1])
    inside = (signal.time_s >= began_s) & (signal.time_s < ended_s) & np.isfinite(signal.value).all(axis=1)
    time_s = signal.time_s[inside]
    _, bin_of, count = np.unique(
        ((time_s - began_s) / each_s).astype(np.intp), return_inverse=True, return_counts=True
    )
    return Bins(time_s, bin_of, count.astype(np.float64), course.time_s), signal.value[inside]
