"""Frames: whether the velocity is in earth axes, with its unit, and whether a wrench is in forward, left, up.

The velocity's change is held against the accelerometer. The motion goes against a wrench where that turns round.
"""

import math

import numpy as np

from identify.checks.mapping.mend import FLU, Mend, column_mend, mended
from identify.checks.sensors.sensor_pairs import (
    CLEAR,
    EDGE_S,
    NEARER_UNIT,
    RISE_S,
    UNCLEAR,
    WINDOW_S,
    pushes_of,
    readings,
    window_edges,
)
from identify.checks.sensors.windows import edge_means, integral
from identify.dive import Dive, Signal
from identify.ingest.mapping.units import FOOT_M, KNOT_M_S
from identify.ingest.rotation import attitude_at, to_earth

SPEEDS = {100.0: "cm/s", 1000.0: "mm/s", 1 / FOOT_M: "ft/s", 1 / KNOT_M_S: "knots", 3.6: "km/h"}
"""Velocities per m/s in other units."""

SPEED_CLEAR = 0.9
"""Correlation from which a velocity's size is judged by an acceleration: with more noise, it seems half too large."""

LEAST_GONE_M, FITS, MISSES = 0.02, 0.15, 0.35
"""Least distance travelled in a window that can judge axes; shares of it within which right axes agree, and beyond
which wrong ones disagree."""

EAST_FIRST, UP = (1, 0, 2), (1.0, 1.0, -1.0)
"""Order and factors that make north, east, down of columns of east, north, up."""
EARTH: tuple[tuple[tuple[float, ...], tuple[int, ...], str], ...] = (
    ((1.0, 1.0, 1.0), (), "north, east, down"),
    (UP, EAST_FIRST, "east, north, up"),
    ((1.0, -1.0, -1.0), (), "those of the attitude, with z up"),
    ((-1.0, 1.0, 1.0), EAST_FIRST, "east, north, up"),
)
"""Factors and order of columns in earth axes to make them north, east, down, and the axes in words. The last is of
columns whose y and z were turned round before."""


def speed_mends(dive: Dive) -> tuple[Mend, ...]:
    """A velocity in another unit."""
    pushes = pushes_of(dive)
    ratios = [
        abs(match.ratio)
        for match in (pushes.by_size() if pushes else ())
        if match is not None and abs(match.correlation) > SPEED_CLEAR
    ]
    if not ratios:
        return ()
    ratio = float(np.median(ratios))
    unit = min(SPEEDS, key=lambda each: abs(math.log(ratio / each)))
    if not unit / NEARER_UNIT < ratio < unit * NEARER_UNIT:
        return ()
    problem = f"The velocity changes by {ratio:.3g} times what the accelerometer comes to, so it is in {SPEEDS[unit]}"
    return (column_mend("velocity", (1 / unit,) * 3, problem),)


def earth_mends(dive: Dive) -> tuple[Mend, ...]:
    """A velocity in earth axes, which changes as the accelerometer says once the attitude has turned it."""
    as_it_is = _least(dive)
    if as_it_is is None or as_it_is > UNCLEAR:
        return ()
    ways = [Mend("velocity", factors, order=order, frame="NED") for factors, order, _ in EARTH]
    turned = [_least(mended(dive, mend)) or 0.0 for mend in ways]
    best = int(np.argmax(turned))
    if turned[best] < CLEAR:
        return ()
    factors, order, name = EARTH[best]
    problem = (
        f"The velocity does not change as the accelerometer says (correlation {as_it_is:.2f}), but does so when the "
        f"attitude turns it ({turned[best]:.2f}): it is in earth axes, {name}"
    )
    return (column_mend("velocity", factors, problem, order, frame="NED"),)


def is_of_earth(position: Signal, velocity: Signal, attitude: Signal) -> tuple[bool, str] | None:
    """Whether a velocity (n, 3) is in the earth axes of a position (m, 3) rather than in the body's, by how that
    changes, and the evidence; None if that is unclear. All are as one program writes them, in axes of its own."""
    placed, moved, turned = readings(position), readings(velocity), readings(attitude)
    if placed is None or moved is None or turned is None:
        return None
    edges_s = window_edges((placed, moved, turned), RISE_S)
    if edges_s is None:
        return None
    gone = np.diff(edge_means(placed.time_s, placed.value, edges_s, EDGE_S), axis=0)[:, :2]
    by_body = to_earth(attitude_at(turned, moved.time_s), moved.value)
    misses = [
        np.diff(np.column_stack([integral(moved.time_s, way[:, k], edges_s) for k in (0, 1)]), axis=0) - gone
        for way in (moved.value, by_body)
    ]
    sizes = [float(np.nanmedian(np.linalg.norm(each, axis=1))) for each in (gone, *misses)]
    if not sizes[0] > LEAST_GONE_M:
        return None
    as_it_is, once_turned = (size / sizes[0] for size in sizes[1:])
    if not (min(as_it_is, once_turned) < FITS and max(as_it_is, once_turned) > MISSES):
        return None
    evidence = (
        f"its position moves as it says but for {100 * as_it_is:.0f} % as it is, and but for {100 * once_turned:.0f} % "
        "where the attitude turns it from the body's axes"
    )
    return as_it_is < once_turned, evidence


def _least(dive: Dive) -> float | None:
    """The least correlation of x and y; None if either is unclear."""
    pushes = pushes_of(dive)
    known = [match.correlation for match in (pushes.by_sign() if pushes else ()) if match is not None]
    return min(known) if len(known) == 2 else None


MIRRORED, KEPT = (1, 2, 4, 5), (0, 3)
"""Sway, heave, pitch and yaw, which turn round between forward, left, up and forward, right, down; and the others."""

NAMES = "X", "Y", "Z", "K", "M", "N"


def wrench_mends(dive: Dive) -> tuple[Mend, ...]:
    """Mends a wrench in axes forward, left, up: it opposes the motion in exactly the axes whose sign differs."""
    wrench = readings(dive.tau_cmd)
    if wrench is None:
        return ()
    follows: dict[int, float] = {}
    for first, moved in ((0, readings(dive.velocity)), (3, readings(dive.gyro))):
        if moved is not None:
            follows |= {first + k: _follows(wrench, moved, first + k, k) for k in range(3)}
    against = {dof: by for dof, by in follows.items() if by < -CLEAR}
    if not against or set(against) & {*KEPT} or any(follows.get(dof, 0.0) > CLEAR for dof in MIRRORED):
        return ()
    evidence = ", ".join(f"{NAMES[dof]} {by:.2f}" for dof, by in against.items())
    problem = (
        "The wrench is in axes forward, left, up (FLU, as in ROS), not FRD: the motion goes against it (correlation of "
        f"{evidence})"
    )
    return (column_mend("tau_cmd", FLU * 2, problem),)


def _follows(wrench: Signal, moved: Signal, dof: int, axis: int) -> float:
    """Correlation of a force, means over windows, with its least-squares fit by inertia, drag and a steady part;
    negative if both oppose it, 0 if unclear."""
    edges_s = window_edges((wrench, moved))
    if edges_s is None:
        return 0.0
    force = np.diff(integral(wrench.time_s, wrench.value[:, dof], edges_s)) / WINDOW_S
    speed = edge_means(moved.time_s, moved.value, edges_s, EDGE_S)[:, axis]
    parts = np.column_stack([np.diff(speed), 0.5 * (speed[1:] + speed[:-1]), np.ones(len(force))])
    known = np.isfinite(parts).all(axis=1) & np.isfinite(force)
    parts, force = parts[known], force[known]
    if len(force) < parts.shape[1] or not (force.std() and parts[:, 0].std()):
        return 0.0
    size = np.linalg.lstsq(parts, force, rcond=None)[0]
    if size[0] * size[1] < 0:
        return 0.0
    return float(np.sign(size[0]) * np.corrcoef(parts @ size, force)[0, 1])
