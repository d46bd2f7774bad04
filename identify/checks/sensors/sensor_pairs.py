"""Pairs of sensors that see one motion: how alike they move over windows, without their means, and which agree.

For coarse checks, of a file that somebody maps for the first time.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.config import GRAVITY_M_S2
from identify.checks.sensors.windows import edge_means, finite_readings, integral
from identify.dive import Dive, Signal
from identify.ingest.rotation import attitude_at, euler_angles, to_body, to_body_turn, to_earth

WINDOW_S, EDGE_S = 0.5, 0.25
FEWEST_WINDOWS = 12
CLEAR, UNCLEAR = 0.7, 0.4
"""Correlations above which two signals agree, and below which they disagree."""

NEAR_UNIT, NEARER_UNIT = 1.25, 1.1
"""Factors within which a ratio counts as that of two units: of a few that lie far apart, and of many."""

RISE_S = 2.0
"""Length of a window in which a vehicle that holds its depth rises by more than a depth sensor's noise."""

LEAST_TURN_RAD, LEAST_RISE_M, LEAST_TILT_M_S2, LEAST_PUSH_M_S2 = 2e-3, 5e-3, 0.05, 0.02
"""Spread over windows below which noise may move a signal: of an angle, a depth, a tilt's share of gravity, an
acceleration."""

PASCALS_PER_METRE = 9900.0
"""Between fresh water and the sea."""


@dataclass(frozen=True)
class Match:
    """How alike two signals move: correlation, and spread of the first over that of the second, with its sign."""

    correlation: float
    ratio: float

    @property
    def words(self) -> str:
        return f"correlation {self.correlation:.2f}, ratio {self.ratio:.3g}"


def matched(seen: Array, said: Array, least: float) -> Match | None:
    """How alike two series (n,) move; None if they are short, or if one moves less than `least`."""
    known = np.isfinite(seen) & np.isfinite(said)
    seen, said = seen[known], said[known]
    if len(seen) < FEWEST_WINDOWS or min(float(np.std(seen)), float(np.std(said))) == 0.0:
        return None
    if max(float(np.std(seen)), float(np.std(said))) < least:
        return None
    correlation = float(np.corrcoef(seen, said)[0, 1])
    return Match(correlation, math.copysign(float(np.std(seen) / np.std(said)), correlation))


def clearest(matches: Sequence[Match | None]) -> Match | None:
    """The match of the largest correlation, of either sign; None without any."""
    known = [match for match in matches if match is not None]
    return max(known, key=lambda match: abs(match.correlation), default=None)


def readings(signal: Signal | None) -> Signal | None:
    """The finite readings of a signal, with zeros for axes that nothing read; None if fewer than two."""
    if signal is None:
        return None
    unread = ~np.isfinite(signal.value).any(axis=0)
    return finite_readings(Signal(signal.time_s, np.where(unread, 0.0, signal.value)))


def window_edges(signals: tuple[Signal, ...], longest_s: float = WINDOW_S) -> Array | None:
    """Edges of windows over the time that all signals have, each up to `longest_s`; None if that is short."""
    start_s = max(float(signal.time_s[0]) for signal in signals)
    end_s = min(float(signal.time_s[-1]) for signal in signals)
    if end_s - start_s < FEWEST_WINDOWS * WINDOW_S:
        return None
    window_s = float(np.clip((end_s - start_s) / FEWEST_WINDOWS, WINDOW_S, longest_s))
    # A little more, so that the end of a whole number of windows is none short of it.
    count = int((end_s - start_s) / window_s + 1e-9)
    return start_s + window_s * np.arange(count + 1, dtype=np.float64)


def unit_factor(ratio: float, ratios: tuple[float, ...]) -> float | None:
    """The factor that mends a signal if `ratio` is a ratio of two units; None for any other ratio."""
    for unit in ratios:
        if unit / NEAR_UNIT < abs(ratio) < unit * NEAR_UNIT:
            return 1.0 / unit
    return None


def agreeing(dive: Dive) -> set[tuple[str, str]]:
    """The pairs of signals that agree in sign and unit; both may still be wrong alike."""
    pushes = pushes_of(dive)
    matches = {
        ("attitude", "gyro"): turn_match(dive),
        ("attitude", "specific_force"): tilt_match(dive),
        ("velocity", "depth"): rise_match(dive),
        ("velocity", "specific_force"): clearest(pushes.by_size() if pushes else ()),
        ("depth", "pressure"): pressure_match(dive),
    }
    return {
        pair
        for pair, match in matches.items()
        if match is not None and match.correlation > CLEAR and 1 / NEAR_UNIT < match.ratio < NEAR_UNIT
    }


def turn_match(dive: Dive) -> Match | None:
    """How alike attitude and gyro turn: the clearest correlation and its ratio over axes; None without both."""
    return clearest([match for row in turn_table(dive) or () for match in row])


def turn_table(dive: Dive) -> tuple[tuple[Match | None, ...], ...] | None:
    """By axis of the attitude's turning and by axis of the gyro, how alike they move over windows."""
    turns = turns_of(dive)
    if turns is None:
        return None
    seen, said = turns
    return tuple(tuple(matched(seen[:, a], said[:, b], LEAST_TURN_RAD) for b in range(3)) for a in range(3))


def turns_of(dive: Dive) -> tuple[Array, Array] | None:
    """Turns (windows, 3), rad, in the body's axes over windows, by the attitude and by the gyro."""
    attitude, gyro = readings(dive.attitude), readings(dive.gyro)
    edges_s = window_edges((attitude, gyro)) if attitude is not None and gyro is not None else None
    if attitude is None or gyro is None or edges_s is None:
        return None
    return turns_between(attitude, gyro, edges_s)


def turns_between(attitude: Signal, gyro: Signal, edges_s: Array) -> tuple[Array, Array]:
    """Turns (m - 1, 3), rad, in the body's axes between the edges (m,), by the attitude and by the gyro."""
    at_edges = attitude_at(attitude, edges_s)
    seen = to_body_turn(at_edges[:-1], at_edges[1:])
    said = np.diff(
        np.column_stack([integral(gyro.time_s, gyro.value[:, k], edges_s) for k in range(3)]), axis=0
    )
    return seen, said


def tilt_match(dive: Dive) -> Match | None:
    """Gravity along x, by the accelerometer, against pitch; both as means over windows."""
    force, attitude = readings(dive.specific_force), readings(dive.attitude)
    edges_s = window_edges((force, attitude)) if force is not None and attitude is not None else None
    if force is None or attitude is None or edges_s is None:
        return None
    said = np.diff(integral(force.time_s, force.value[:, 0], edges_s)) / WINDOW_S
    pitch = np.interp(0.5 * (edges_s[1:] + edges_s[:-1]), attitude.time_s, euler_angles(attitude.value)[1])
    return matched(said, GRAVITY_M_S2 * np.sin(pitch), LEAST_TILT_M_S2)


def pressure_match(dive: Dive) -> Match | None:
    """Depth against the metres of water that the pressure comes to."""
    depth, pressure = readings(dive.depth), readings(dive.pressure)
    if depth is None or pressure is None:
        return None
    by_pressure = pressure.at(depth.time_s)[:, 0] / PASCALS_PER_METRE
    return matched(depth.value[:, 0], by_pressure, LEAST_RISE_M)


def rise_match(dive: Dive) -> Match | None:
    """Change of depth over windows against the downward velocity, turned by the attitude if there is one."""
    depth, velocity, attitude = readings(dive.depth), readings(dive.velocity), readings(dive.attitude)
    if depth is None and dive.pressure is not None:
        depth = readings(Signal(dive.pressure.time_s, dive.pressure.value / PASCALS_PER_METRE))
    if depth is None or velocity is None:
        return None
    edges_s = window_edges((depth, velocity), RISE_S)
    if edges_s is None:
        return None
    down = velocity.value[:, 2]
    if attitude is not None:
        down = to_earth(attitude_at(attitude, velocity.time_s), velocity.value)[:, 2]
    fallen = np.diff(edge_means(depth.time_s, depth.value, edges_s, EDGE_S)[:, 0])
    return matched(fallen, np.diff(integral(velocity.time_s, down, edges_s)), LEAST_RISE_M)


@dataclass(frozen=True)
class Pushes:
    """Over windows (n, 3), m/s2 in body axes: the velocity's change, that by turning alone, and the
    accelerometer's reading, less gravity."""

    moved: Array
    turning: Array
    felt: Array

    def by_sign(self) -> tuple[Match | None, Match | None]:
        """Along x and y. The turning of an axis holds the other velocities alone, so it does not hide the sign of its
        own."""
        return self._matched(self.moved, self.felt - self.turning)

    def by_size(self) -> tuple[Match | None, Match | None]:
        """Along x and y, both sides of which grow with the unit of the velocity, or not at all."""
        return self._matched(self.moved + self.turning, self.felt)

    def _matched(self, seen: Array, said: Array) -> tuple[Match | None, Match | None]:
        along_x, along_y = (matched(seen[:, axis], said[:, axis], LEAST_PUSH_M_S2) for axis in (0, 1))
        return along_x, along_y


def pushes_of(dive: Dive) -> Pushes | None:
    """None without all four signals, or for a short dive."""
    force, velocity = readings(dive.specific_force), readings(dive.velocity)
    gyro, attitude = readings(dive.gyro), readings(dive.attitude)
    if force is None or velocity is None or gyro is None or attitude is None:
        return None
    edges_s = window_edges((force, velocity, attitude))
    if edges_s is None:
        return None
    middle_s = 0.5 * (edges_s[1:] + edges_s[:-1])
    gravity = to_body(attitude_at(attitude, middle_s), np.tile((0.0, 0.0, GRAVITY_M_S2), (len(middle_s), 1)))
    read = np.diff(
        np.column_stack([integral(force.time_s, force.value[:, k], edges_s) for k in range(3)]), axis=0
    )
    at_edges = edge_means(velocity.time_s, velocity.value, edges_s, EDGE_S)
    return Pushes(
        np.diff(at_edges, axis=0) / WINDOW_S,
        np.cross(gyro.at(middle_s), velocity.at(middle_s)),
        read / WINDOW_S + gravity,
    )
