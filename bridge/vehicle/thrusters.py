"""Thruster model: PWM to thrust and back, thrusts to wrench and back, and the limits of both.

The T200 figures are Blue Robotics' public performance data of September 2019 (bollard pull).
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from bridge.arrays import Array
from bridge.errors import ConfigError
from bridge.vehicle.config import CONFIGS, Configuration, ThrustCurve

NEUTRAL_US = 1500.0

WRONG_SHARE = 0.1
"""A measured thrust on the wrong side of neutral is noise up to this share of the largest."""

TABLES = 16
"""Number of thrust tables kept in the cache."""


class Curve(Protocol):
    """The static curve of a thruster between `min_n` and `max_n`."""

    @property
    def min_n(self) -> float: ...

    @property
    def max_n(self) -> float: ...

    @property
    def neutral_us(self) -> float:
        """The pulse width of a thruster at rest."""
        ...

    @property
    def ends_us(self) -> tuple[float, float]:
        """Pulse widths of full thrust astern and ahead; neutral is the first of a thruster that pushes one way."""
        ...

    def thrust(self, pwm_us: ArrayLike) -> Array:
        """Thrust (N) at each pulse width, held at the ends of the curve."""
        ...

    def pwm(self, thrust_n: ArrayLike) -> Array:
        """Pulse width for each thrust, held at the ends; zero thrust is neutral."""
        ...


class TableCurve:
    """A measured curve: straight lines between the points of a table.

    The inverse jumps over the dead zone: any thrust above zero lies beyond its edge. With `one_way`, points below
    neutral do not count.
    """

    def __init__(
        self, pwm_us: Array, thrust_n: Array, neutral_us: float = NEUTRAL_US, one_way: bool = False
    ) -> None:
        self.neutral_us = neutral_us
        forward, reverse = pwm_us >= neutral_us, pwm_us == neutral_us if one_way else pwm_us <= neutral_us
        rising = np.maximum.accumulate(np.maximum(thrust_n[forward], 0.0))
        falling = np.minimum.accumulate(np.minimum(thrust_n[reverse][::-1], 0.0))
        self._pwm_us = np.concatenate([pwm_us[reverse], pwm_us[forward]])
        self._thrust_n = np.concatenate([falling[::-1], rising])
        self._forward = _inverse(pwm_us[forward], rising)
        self._reverse = _inverse(pwm_us[reverse][::-1], -falling)

    @property
    def points(self) -> tuple[Array, Array]:
        """Rising pulse widths and the thrust (N) at each."""
        return self._pwm_us, self._thrust_n

    @property
    def min_n(self) -> float:
        return float(self._thrust_n[0])

    @property
    def max_n(self) -> float:
        return float(self._thrust_n[-1])

    @property
    def ends_us(self) -> tuple[float, float]:
        return float(self._pwm_us[0]), float(self._pwm_us[-1])

    def thrust(self, pwm_us: ArrayLike) -> Array:
        return np.asarray(np.interp(np.asarray(pwm_us, dtype=float), self._pwm_us, self._thrust_n))

    def pwm(self, thrust_n: ArrayLike) -> Array:
        wanted = np.asarray(thrust_n, dtype=float)
        ahead = np.interp(wanted, *self._forward)
        astern = np.interp(-wanted, *self._reverse)
        return np.where(wanted > 0, ahead, np.where(wanted < 0, astern, self.neutral_us))


def _inverse(pwm_us: Array, magnitude_n: Array) -> tuple[Array, Array]:
    """Rising thrust magnitudes and their pulse widths, starting at the outer edge of the dead zone."""
    edge = max(int(np.count_nonzero(magnitude_n <= 0)) - 1, 0)
    return magnitude_n[edge:], pwm_us[edge:]


@dataclass(frozen=True)
class QuadraticCurve:
    """thrust = limit_n o |o| with o = (pwm - neutral_us) / span_us, zero within the dead band, and below neutral for a
    thruster that pushes one way.

    Thrusts smaller than the step at the band's edge are unavailable: their pulse widths lie inside the band.
    """

    limit_n: float
    span_us: float
    dead_band_us: float
    neutral_us: float = NEUTRAL_US
    one_way: bool = False

    @property
    def max_n(self) -> float:
        return self.limit_n

    @property
    def min_n(self) -> float:
        return 0.0 if self.one_way else -self.limit_n

    @property
    def ends_us(self) -> tuple[float, float]:
        return self.neutral_us - (0.0 if self.one_way else self.span_us), self.neutral_us + self.span_us

    def thrust(self, pwm_us: ArrayLike) -> Array:
        offset = np.asarray(pwm_us, dtype=float) - self.neutral_us
        o = np.clip(offset / self.span_us, 0.0 if self.one_way else -1.0, 1.0)
        return np.where(np.abs(offset) <= self.dead_band_us, 0.0, self.limit_n * o * np.abs(o))

    def pwm(self, thrust_n: ArrayLike) -> Array:
        share = np.clip(np.asarray(thrust_n, dtype=float) / self.limit_n, 0.0 if self.one_way else -1.0, 1.0)
        return self.neutral_us + self.span_us * np.sign(share) * np.sqrt(np.abs(share))


def thrust_curve(curve: ThrustCurve, directory: Path) -> Curve:
    """Return the thrust curve of a vehicle file in `directory`.

    Raises ConfigError if a table is missing, malformed or lacks the voltage, or if its name points outside the
    directory: a vehicle file may come with a stranger's dive.
    """
    if curve.kind == "quadratic":
        return QuadraticCurve(curve.max_n, curve.span_us, curve.dead_band_us, curve.neutral_us, curve.one_way)
    name = Path(curve.file)
    if name.is_absolute() or ".." in name.parts:
        raise ConfigError(
            f"thrust_curve: file: {curve.file} leads out of the vehicle file's folder; put the table beside the "
            "vehicle file and give its name alone"
        )
    path = directory / name
    if not path.exists():
        path = CONFIGS / "thrusters" / name
    pwm_us, thrust_n = _table_at(path, curve.voltage_v, curve.neutral_us)
    _check_sides(path, pwm_us, thrust_n, curve)
    return TableCurve(pwm_us, thrust_n, curve.neutral_us, curve.one_way)


def _check_sides(path: Path, pwm_us: Array, thrust_n: Array, curve: ThrustCurve) -> None:
    """Raise ConfigError if a table pushes the wrong way on either side of neutral, where it would count for none."""
    wrong = np.where(pwm_us < curve.neutral_us, 0.0 if curve.one_way else thrust_n, 0.0)
    wrong = np.where(pwm_us > curve.neutral_us, -thrust_n, wrong)
    worst = int(np.argmax(wrong))
    if wrong[worst] > WRONG_SHARE * np.abs(thrust_n).max():
        side, way = ("below", "ahead") if pwm_us[worst] < curve.neutral_us else ("above", "astern")
        raise ConfigError(
            f"{path}: it pushes {way} at {pwm_us[worst]:g} us, {side} thrust_curve: neutral_us of "
            f"{curve.neutral_us:g}; give the pulse at which its thrusters rest, and positive thrust above it"
        )


@lru_cache(TABLES)
def _points(path: Path, _changed_ns: int, _size: int) -> Array:
    """Read a table (n, 3) of voltage, pulse width and thrust. Cached until the file changes, because a diagnosis asks
    for it thirty times."""
    lines = path.read_text(encoding="utf-8").splitlines()
    rows = [line for line in lines if line.strip() and not line.startswith("#")]
    if not rows or rows[0].replace(" ", "") != "voltage_v,pwm_us,thrust_n":
        raise ConfigError(f"{path}: a thrust table starts with 'voltage_v,pwm_us,thrust_n'; add that line")
    try:
        points = [[float(cell) for cell in row.split(",")] for row in rows[1:]]
    except ValueError:
        points = [[]]
    if not all(len(point) == 3 and np.isfinite(point).all() for point in points):
        raise ConfigError(f"{path}: a line holds something else than three numbers; mend it")
    return np.array(points).reshape(-1, 3)


def _table_at(path: Path, voltage_v: float, neutral_us: float) -> tuple[Array, Array]:
    try:
        status = path.stat()
        table = _points(path, status.st_mtime_ns, status.st_size)
    except (OSError, UnicodeDecodeError):
        raise ConfigError(f"{path}: can't read this thrust table; check thrust_curve: file") from None
    voltages = np.unique(table[:, 0])
    if not len(voltages) or not voltages[0] <= voltage_v <= voltages[-1]:
        known = f"{voltages[0]:g} to {voltages[-1]:g} V" if len(voltages) else "no voltage at all"
        raise ConfigError(
            f"{path}: the table holds {known}, not {voltage_v:g} V; change thrust_curve: voltage_v"
        )
    above = voltages[np.searchsorted(voltages, voltage_v)]
    below = voltages[np.searchsorted(voltages, voltage_v, side="right") - 1]
    low, high = (_sorted(table[table[:, 0] == v]) for v in (below, above))
    pwm_us = np.union1d(np.union1d(low[:, 1], high[:, 1]), [neutral_us])
    share = (voltage_v - below) / (above - below) if above > below else 0.0
    at_low, at_high = (np.interp(pwm_us, t[:, 1], t[:, 2]) for t in (low, high))
    return pwm_us, (1 - share) * at_low + share * at_high


def _sorted(table: Array) -> Array:
    return table[np.argsort(table[:, 1])]


def shaft_speed(curve: ThrustCurve, thrust_n: ArrayLike) -> Array:
    """Signed shaft speed in rev/s from T = k n |n|, with k by direction."""
    thrust = np.asarray(thrust_n, dtype=float)
    k = np.where(thrust >= 0, curve.forward_n_s2, curve.reverse_n_s2)
    speed: Array = np.sign(thrust) * np.sqrt(np.abs(thrust) / k)
    return speed


def allocation_matrix(configuration: Configuration) -> Array:
    """Wrench about the origin per newton of each thruster, shape (6, n), including each thruster's gain."""
    columns = []
    for thruster in configuration.thrusters:
        force = np.array(thruster.direction)
        columns.append(thruster.gain * np.concatenate([force, np.cross(thruster.position_m, force)]))
    return np.array(columns).T if columns else np.zeros((6, 0))


class Allocator:
    """Converts a wrench to thrusts by the pseudo-inverse; scales all down together if any would exceed its limit.

    Raises ConfigError for thrusters that push one way alone: the pseudo-inverse asks for both.
    """

    def __init__(self, configuration: Configuration, curve: Curve) -> None:
        if not curve.min_n < 0 < curve.max_n:
            raise ConfigError(
                "thrust_curve: its thrusters push one way alone: their dives can be identified and diagnosed, but such "
                "a vehicle can be neither driven nor planned for; give a curve with thrust ahead and astern for that"
            )
        self.matrix = allocation_matrix(configuration)
        self.high_n = min(configuration.thruster_limit_n, curve.max_n)
        self.low_n = max(-configuration.thruster_limit_n, curve.min_n)
        self._inverse = np.linalg.pinv(self.matrix, rcond=1e-6)

    def reach(self) -> Array:
        """Largest magnitude of each component of the wrench, N and N m, shape (6,)."""
        return np.asarray(np.abs(self.matrix).sum(axis=1) * min(self.high_n, -self.low_n))

    def allocate(self, tau: ArrayLike) -> tuple[Array, Array, float]:
        """Return thrusts (n,) in N, the wrench (6,) that they produce, and the scale (1 if nothing was limited)."""
        thrust = self._inverse @ np.asarray(tau, dtype=float)
        worst = max(
            1.0, float(thrust.max(initial=0.0)) / self.high_n, float(thrust.min(initial=0.0)) / self.low_n
        )
        thrust = thrust / worst
        return thrust, self.matrix @ thrust, 1.0 / worst


class Pulses:
    """The inverse of the curve, but a straight line to neutral below `straight_below_n` (N, a scalar or one per
    thruster).

    On the straight line a small thrust is lost in the dead zone; jumping over the dead zone instead, noise about zero
    would throw the propellers to and fro.
    """

    def __init__(self, curve: Curve, straight_below_n: ArrayLike) -> None:
        self._curve = curve
        self._below_n: Array = np.asarray(straight_below_n, dtype=float)
        width_n = np.where(self._below_n > 0, self._below_n, 1.0)
        self._ahead: Array = (curve.pwm(width_n) - NEUTRAL_US) / width_n
        self._astern: Array = (NEUTRAL_US - curve.pwm(-width_n)) / width_n

    def __call__(self, thrust_n: Array) -> Array:
        """Pulse widths (n,) in microseconds for thrusts (n,) in N."""
        straight = NEUTRAL_US + thrust_n * np.where(thrust_n > 0, self._ahead, self._astern)
        return np.where(np.abs(thrust_n) < self._below_n, straight, self._curve.pwm(thrust_n))


def can_sway(configuration: Configuration) -> bool:
    """Whether the thrust in sway is more than three tenths of the thrust in surge."""
    ahead, aside = abs(allocation_matrix(configuration)).sum(axis=1)[:2]
    return bool(aside > 0.3 * ahead)


def thrust_by_shaft(curve: ThrustCurve, rpm: Array) -> Array:
    """T = k n |n| for signed shaft speeds (n, k), with n in rev/s and k by direction; NaN if unknown."""
    speed = rpm / 60.0
    return np.asarray(np.where(rpm >= 0, curve.forward_n_s2, curve.reverse_n_s2) * speed * np.abs(speed))
