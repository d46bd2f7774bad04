"""Attitudes: quaternions w x y z from body axes (FRD) to north-east-down, their angles and matrices.

Roll, pitch and heading turn about x, y and z: R = Rz(heading) Ry(pitch) Rx(roll) (Fossen 2011, section 2.2).
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from bridge.arrays import Array, Quaternion, Vector3

LOCKED = 1e-9
"""Cosine of the pitch below which roll and heading are the same angle."""


def down_in_body(attitude: Sequence[Any] | Array) -> tuple[Any, Any, Any]:
    """The earth's unit vector down, in body axes; of floats, arrays (n,) or tensors alike."""
    w, x, y, z = attitude
    return 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)


def body_to_earth(attitude: Array) -> Array:
    """Matrices (..., 3, 3) that turn body vectors to north-east-down, of unit quaternions (..., 4)."""
    w, x, y, z = np.moveaxis(attitude, -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        down_in_body((w, x, y, z)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def roll_pitch(attitude: Quaternion) -> tuple[float, float]:
    """Roll and pitch, rad; NaN without an attitude."""
    x, y, z = down_in_body(attitude)
    return math.atan2(y, z), math.asin(min(max(-x, -1.0), 1.0)) if math.isfinite(x) else math.nan


def heading_of(attitude: Quaternion) -> float:
    """Heading, rad, -pi to pi."""
    w, x, y, z = attitude
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def unwrapped(angle: float, near: float) -> float:
    """Return `angle` plus the whole turns that bring it nearest to `near`; unchanged if either is NaN."""
    if near != near or angle != angle:
        return angle
    return angle + math.tau * round((near - angle) / math.tau)


def rotation_matrix(angles_deg: Vector3) -> Array:
    """R (3, 3) of roll, pitch and heading in degrees; quarter turns are exact."""
    (cr, sr), (cp, sp), (cy, sy) = (_cos_sin(angle) for angle in angles_deg)
    about_x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    about_y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    about_z = np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
    rotation: Array = about_z @ about_y @ about_x
    return rotation


def angles_of(rotation: Array) -> Vector3:
    """Roll, pitch and heading, rad, of a matrix R (3, 3); straight up or down all of the turn is called heading."""
    level = math.hypot(rotation[0, 0], rotation[1, 0])
    pitch = math.atan2(-rotation[2, 0], level)
    if level < LOCKED:
        return 0.0, pitch, math.atan2(-rotation[0, 1], rotation[1, 1])
    return (math.atan2(rotation[2, 1], rotation[2, 2]), pitch, math.atan2(rotation[1, 0], rotation[0, 0]))


def quaternion_of(rotation: Array) -> Quaternion:
    """The unit quaternion (w >= 0) of a matrix R (3, 3).

    The products of its components form a symmetric matrix whose largest column has no small divisor (Shepperd, 1978).
    """
    m = rotation
    products = 0.25 * np.array(
        [
            [1 + m[0, 0] + m[1, 1] + m[2, 2], m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1]],
            [m[2, 1] - m[1, 2], 1 + m[0, 0] - m[1, 1] - m[2, 2], m[0, 1] + m[1, 0], m[0, 2] + m[2, 0]],
            [m[0, 2] - m[2, 0], m[0, 1] + m[1, 0], 1 - m[0, 0] + m[1, 1] - m[2, 2], m[1, 2] + m[2, 1]],
            [m[1, 0] - m[0, 1], m[0, 2] + m[2, 0], m[1, 2] + m[2, 1], 1 - m[0, 0] - m[1, 1] + m[2, 2]],
        ]
    )
    column = products[int(np.argmax(np.diag(products)))]
    w, x, y, z = (float(c) for c in column / np.linalg.norm(column))
    return (w, x, y, z) if w >= 0 else (-w, -x, -y, -z)


def quaternion_of_angles(roll: float, pitch: float, heading: float) -> Quaternion:
    """The unit quaternion of angles in radians."""
    cr, sr, cp, sp = math.cos(roll / 2), math.sin(roll / 2), math.cos(pitch / 2), math.sin(pitch / 2)
    cy, sy = math.cos(heading / 2), math.sin(heading / 2)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def product(a: Quaternion, b: Quaternion) -> Quaternion:
    """The turn `b`, then `a`."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


def _cos_sin(angle_deg: float) -> tuple[float, float]:
    quarters, remainder = divmod(angle_deg, 90.0)
    if remainder == 0.0:
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(quarters) % 4]
    return math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
