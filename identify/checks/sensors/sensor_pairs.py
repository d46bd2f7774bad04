"""Pairs of sensors that see one motion: how alike they move over windows, and which of them agree."""

import numpy as np

from bridge.vehicle.config import GRAVITY_M_S2
from identify.checks.mapping.frames import pushes_of
from identify.checks.sensors.correlation import (
    CLEAR,
    EDGE_S,
    NEAR_UNIT,
    WINDOW_S,
    Match,
    clearest,
    matched,
    readings,
    window_edges,
)
from identify.checks.sensors.scales import edge_means, integral
from identify.dive import Dive, Signal
from identify.ingest.rotation import attitude_at, euler_angles, to_body_turn, to_earth

RISE_S = 2.0
"""Length of a window in which a vehicle that holds its depth rises by more than a depth sensor's noise."""

LEAST_TURN_RAD, LEAST_RISE_M, LEAST_TILT_M_S2 = 2e-3, 5e-3, 0.05
"""Spread over windows below which noise may move a signal: of an angle, a depth, a tilt's share of gravity."""

PASCALS_PER_METRE = 9900.0
"""Between fresh water and the sea."""


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
    attitude, gyro = readings(dive.attitude), readings(dive.gyro)
    edges_s = window_edges((attitude, gyro)) if attitude is not None and gyro is not None else None
    if attitude is None or gyro is None or edges_s is None:
        return None
    at_edges = attitude_at(attitude, edges_s)
    seen = to_body_turn(at_edges[:-1], at_edges[1:])
    said = np.diff(
        np.column_stack([integral(gyro.time_s, gyro.value[:, k], edges_s) for k in range(3)]), axis=0
    )
    return tuple(tuple(matched(seen[:, a], said[:, b], LEAST_TURN_RAD) for b in range(3)) for a in range(3))


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
