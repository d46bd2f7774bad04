"""The 48 ways in which axes can be mistaken in steps of 90 degrees: 24 turns and their mirror images."""

import itertools
import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bridge.sensors.mounting import mounting_matrix
from bridge.vehicle.config import Mounting, Vector3

Array = NDArray[np.float64]


def _all_turns() -> tuple[Array, ...]:
    turns = []
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1.0, -1.0), repeat=3):
            matrix = np.zeros((3, 3))
            matrix[range(3), order] = signs
            turns.append(matrix)
    # The identity first, then the proper turns, then the mirrors, each sorted by how little they turn.
    return tuple(sorted(turns, key=lambda m: (bool(np.linalg.det(m) < 0), -np.trace(m))))


TURNS: Final = _all_turns()
IDENTITY: Final = 0


@dataclass(frozen=True, slots=True)
class Correction:
    """The values that the vehicle file should have for a mounting instead."""

    rotation_deg: Vector3
    signs: Vector3


def is_mirror(turn: Array) -> bool:
    return bool(np.linalg.det(turn) < 0)


def describe(turn: Array) -> str:
    """Describe the measured axes by the true ones: `x shows -y, y shows x`."""
    parts = []
    for row, name in enumerate("xyz"):
        column = int(np.abs(turn[row]).argmax())
        if column != row or turn[row, column] < 0:
            parts.append(f"{name} shows {'-' if turn[row, column] < 0 else ''}{'xyz'[column]}")
    return ", ".join(parts) or "all axes are right"


def corrected(mounting: Mounting, turn: Array) -> Correction:
    """Return the mounting that undoes `turn`, given measured = turn @ true under the present `mounting`.

    The signs stay as they are for a turn. For a mirror one more sign changes: the choice that leaves least rotation.
    """
    matrix = turn.T @ np.array(mounting_matrix(mounting))
    now = np.array(mounting.signs)
    flips = [np.ones(3)] if not is_mirror(turn) else [1.0 - 2.0 * np.eye(3)[axis] for axis in range(3)]
    best = max(flips, key=lambda flip: np.trace(matrix @ np.diag(now * flip)))
    signs = now * best
    rotation = euler_deg(matrix @ np.diag(signs))
    return Correction(rotation, (float(signs[0]), float(signs[1]), float(signs[2])))


def euler_deg(rotation: Array) -> Vector3:
    """Roll, pitch and yaw in degrees of Rz(yaw) Ry(pitch) Rx(roll)."""
    pitch = math.asin(max(-1.0, min(1.0, -rotation[2, 0])))
    if abs(rotation[2, 0]) > 1.0 - 1e-9:
        # Straight up or down, roll and yaw are the same angle: all of it is called yaw.
        roll, yaw = 0.0, math.atan2(-rotation[0, 1], rotation[1, 1])
    else:
        roll = math.atan2(rotation[2, 1], rotation[2, 2])
        yaw = math.atan2(rotation[1, 0], rotation[0, 0])
    roll, pitch, yaw = (round(math.degrees(angle), 3) + 0.0 for angle in (roll, pitch, yaw))
    return roll, pitch, yaw
