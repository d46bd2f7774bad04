"""Contributions of the other axes to an axis's readings: at the DVL's lever arm, to depth, roll and pitch, and to the
restoring force."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.config import GRAVITY_M_S2, Configuration, VehicleFile
from bridge.vehicle.dynamics import restoring
from identify.dive import Dive, Signal
from identify.estimators.motion import FEWEST, Motion, smoothed, smoothed_velocity
from identify.estimators.readings import HEAVE, PITCH, ROLL, YAW
from identify.ingest.rotation import to_body_turn

Array = NDArray[np.float64]

LEAST_COSINE = 0.1
"""Smallest cosine of pitch used: closer to vertical, heading does not show how a vehicle turns."""

TILTED, OFTEN = 0.5, 5
"""Cosine of the tilt below which a vehicle lies on its side, and the number of such readings that makes it one that
tumbles."""


def tumbles(dive: Dive) -> bool:
    """Whether a vehicle turns over. The angles of roll, pitch and heading then wrap, fold and swap, and none of them
    is the integral of a rate of turn."""
    if dive.attitude is None or not len(dive.attitude):
        return False
    return bool(np.count_nonzero(down_axis(dive.attitude.value)[2] < TILTED) >= OFTEN)


def turned_by(attitude: Signal) -> Signal:
    """Integrals of the rates of turn (n, 3) about the body's own axes: the sum of the turns between readings. They
    neither wrap nor fold at any attitude."""
    turns = to_body_turn(attitude.value[:-1], attitude.value[1:])
    return Signal(attitude.time_s, np.vstack([np.zeros((1, 3)), np.cumsum(turns, axis=0)]))


def at_origin(dive: Dive, time_s: Array, lever: Array) -> tuple[Signal | None, Motion]:
    """Return the recorded velocity (n, 3) at the body's origin, with the DVL at `lever` (3,), and the motion at times
    (m,)."""
    nu = smoothed_velocity(dive, time_s)
    velocity = dive.velocity
    if velocity is None or len(velocity) < FEWEST or not lever.any():
        return velocity, Motion(time_s, nu)
    by_turning = np.cross(nu[:, 3:], lever)
    carried = np.column_stack([np.interp(velocity.time_s, time_s, column) for column in by_turning.T])
    velocity = Signal(velocity.time_s, velocity.value - carried)
    return velocity, Motion(time_s, smoothed_velocity(replace(dive, velocity=velocity), time_s))


def with_rates_of_places(dive: Dive, file: VehicleFile, motion: Motion) -> Motion:
    """Return the motion with velocities from depth and attitude where no other sensor read them (Fossen 2011, eq.
    2.28)."""
    nu = motion.nu.copy()
    depth, over = dive.depth_by(file.vehicle.water), tumbles(dive)
    if depth is not None and len(depth) >= FEWEST and not nu[:, HEAVE].any() and not over:
        nu[:, HEAVE] = _rate(depth, 0, motion.time_s)
    if dive.attitude is not None and len(dive.attitude) >= FEWEST and not nu[:, 3:].all(axis=1).any():
        if over:
            turned = turned_by(dive.attitude)
            for i in range(3):
                if not nu[:, ROLL + i].any():
                    nu[:, ROLL + i] = _rate(turned, i, motion.time_s)
            return Motion(motion.time_s, nu)
        w, x, y, z = dive.attitude.value.T
        down_x, down_y, down_z = down_axis(dive.attitude.value)
        heading = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
        euler = np.column_stack([np.arctan2(down_y, down_z), np.arcsin(np.clip(-down_x, -1.0, 1.0)), heading])
        angles = Signal(dive.attitude.time_s, euler)
        roll, pitch = (np.interp(motion.time_s, angles.time_s, euler[:, i]) for i in range(2))
        by_roll, by_pitch, by_heading = (_rate(angles, i, motion.time_s) for i in range(3))
        body = (
            by_roll - np.sin(pitch) * by_heading,
            np.cos(roll) * by_pitch + np.cos(pitch) * np.sin(roll) * by_heading,
            np.cos(pitch) * np.cos(roll) * by_heading - np.sin(roll) * by_pitch,
        )
        for dof, rate in enumerate(body, start=ROLL):
            if not nu[:, dof].any():
                nu[:, dof] = rate
    return Motion(motion.time_s, nu)


def _rate(place: Signal, column: int, time_s: Array) -> Array:
    return np.asarray(np.gradient(smoothed(place, column, time_s), time_s))


@dataclass(frozen=True)
class Place:
    """Integral of one axis's own velocity: the reading, (n, 1), less the contribution of the other axes.

    `carried` (m,) is that contribution at the times of the motion.
    """

    reading: Signal
    carried: Array


def places_of(dive: Dive, file: VehicleFile, motion: Motion, attitude: Array | None) -> dict[int, Place]:
    """Return depth, roll, pitch and heading by degree of freedom, as far as they are recorded (Fossen 2011, 2.18,
    2.26).

    For a vehicle that tumbles, return its turns about each of its own axes; its depth is then not the integral of a
    single axis.
    """
    still = np.zeros(len(motion.time_s))
    if tumbles(dive) and dive.attitude is not None:
        turned = turned_by(dive.attitude)
        parts = (Signal(turned.time_s, turned.value[:, i : i + 1]) for i in range(3))
        return {dof: Place(part, still) for dof, part in zip((ROLL, PITCH, YAW), parts, strict=True)}
    depth = dive.depth_by(file.vehicle.water)
    places: dict[int, tuple[Signal, Array]] = {}
    if attitude is None or dive.attitude is None:
        if depth is not None:
            places[HEAVE] = depth, still
    else:
        u, v, w, _, q, r = motion.nu.T
        down_x, down_y, down_z = down_axis(attitude)
        if depth is not None:
            places[HEAVE] = depth, down_x * u + down_y * v + (down_z - 1.0) * w
        roll, pitch = np.arctan2(down_y, down_z), np.arcsin(np.clip(-down_x, -1.0, 1.0))
        x, y, z = down_axis(dive.attitude.value)
        turned = q * np.sin(roll) + r * np.cos(roll)
        places[ROLL] = Signal(dive.attitude.time_s, np.arctan2(y, z)[:, None]), turned * np.tan(pitch)
        level = q * (np.cos(roll) - 1.0) - r * np.sin(roll)
        w, i, j, k = dive.attitude.value.T
        heading = np.unwrap(np.arctan2(2 * (w * k + i * j), 1 - 2 * (j * j + k * k)))
        turning = (q * np.sin(roll) + r * np.cos(roll)) / np.maximum(np.cos(pitch), LEAST_COSINE)
        places[YAW] = Signal(dive.attitude.time_s, heading[:, None]), turning - r
        places[PITCH] = Signal(dive.attitude.time_s, np.arcsin(np.clip(-x, -1.0, 1.0))[:, None]), level
    out = {}
    for dof, (read, rate) in places.items():
        carried = motion.integral(rate)
        at = np.interp(read.time_s, motion.time_s, carried)
        out[dof] = Place(Signal(read.time_s, read.value - at[:, None]), carried)
    return out


def down_axis(attitude: Array) -> tuple[Array, Array, Array]:
    """The earth's down axis in body axes, from attitudes (n, 4)."""
    w, x, y, z = attitude.T
    return 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)


def restoring_force(
    configuration: Configuration,
    dof: int,
    motion: Motion,
    attitude: Array | None,
    place: Place | None,
    stiffness: float,
) -> Array:
    """Restoring force (m,) at the times of the motion; for roll and pitch without the part that the `stiffness`
    makes."""
    if attitude is None:
        return np.full(len(motion.time_s), configuration.net_buoyancy_n if dof == HEAVE else 0.0)
    g = np.asarray(restoring(configuration, tuple(attitude.T))[dof])
    if stiffness == 0.0 or place is None:
        return g
    down_x, down_y, down_z = down_axis(attitude)
    angle = np.arctan2(down_y, down_z) if dof == ROLL else np.arcsin(np.clip(-down_x, -1.0, 1.0))
    return g - stiffness * (angle - place.carried)


def stiffness_of(dive: Dive, configuration: Configuration, dof: int) -> float:
    """Righting moment per angle, N m/rad. 0 for other axes, and for a vehicle that tumbles: its righting moment is
    not proportional to its turns, and comes from the recorded attitude alone."""
    if dof not in (ROLL, PITCH) or tumbles(dive):
        return 0.0
    return configuration.centre_of_gravity_below_buoyancy_m * configuration.dry_mass_kg * GRAVITY_M_S2
