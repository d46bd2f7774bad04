"""Attitude as quaternions w x y z (body to north-east-down), vectorised."""

import numpy as np

from bridge.arrays import Array
from bridge.attitude import body_to_earth
from identify.dive import Signal


def quaternions_from_euler(roll: Array, pitch: Array, yaw: Array) -> Array:
    """Quaternions (n, 4) from angles in radians, rotated about z, then y, then x (Fossen 2011, eq. 2.72).

    NaN if an angle is not finite.
    """
    # A recording may hold any float; an infinite angle counts as unknown, like NaN.
    with np.errstate(invalid="ignore"):
        cr, sr = np.cos(roll / 2), np.sin(roll / 2)
        cp, sp = np.cos(pitch / 2), np.sin(pitch / 2)
        cy, sy = np.cos(yaw / 2), np.sin(yaw / 2)
    return np.column_stack(
        (
            cr * cp * cy + sr * sp * sy,
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
        )
    )


def euler_angles(quaternion: Array) -> tuple[Array, Array, Array]:
    """Roll, pitch and heading (n,) in radians, from quaternions (n, 4)."""
    w, x, y, z = quaternion.T
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    heading = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return (
        np.asarray(roll),
        np.asarray(np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0))),
        np.asarray(heading),
    )


def attitude_at(attitude: Signal, time_s: Array) -> Array:
    """Unit quaternions (m, 4) interpolated between the known samples, along the shorter way."""
    attitude = attitude.finite()
    q = attitude.value
    flips = np.where(np.einsum("ij,ij->i", q[1:], q[:-1]) < 0, -1.0, 1.0)
    continuous = q * np.concatenate(([1.0], np.cumprod(flips)))[:, None]
    between = Signal(attitude.time_s, continuous).at(time_s)
    unit: Array = between / np.linalg.norm(between, axis=1, keepdims=True)
    return unit


def to_body(quaternion: Array, north_east_down: Array) -> Array:
    """Turn vectors (n, 3) from north-east-down to body axes, at attitudes (n, 4)."""
    w, r = quaternion[:, :1], -quaternion[:, 1:]
    turned = 2.0 * np.cross(r, north_east_down)
    return north_east_down + w * turned + np.cross(r, turned)


def in_body(velocity: Signal, attitude: Signal) -> Signal:
    """A velocity (n, 3) in north-east-down turned into body axes, at its times at which the attitude is known."""
    known = attitude.finite()
    if len(known) < 2:
        return Signal(np.zeros(0), np.zeros((0, 3)))
    inside = velocity.between(known.time_s[0], np.nextafter(known.time_s[-1], np.inf))
    return Signal(inside.time_s, to_body(attitude_at(known, inside.time_s), inside.value))


def to_earth(quaternion: Array, body: Array) -> Array:
    """Turn vectors (n, 3) from body axes to north-east-down, at attitudes (n, 4)."""
    return np.asarray((body_to_earth(quaternion) @ body[:, :, None])[..., 0])


def turned_by(turn: Array, vector: Array) -> Array:
    """Rotate vectors (n, 3) by rotation vectors (n, 3), rad, given in the same axes (Rodrigues)."""
    angle = np.linalg.norm(turn, axis=1, keepdims=True)
    along = np.cross(turn, vector)
    first, second = np.sinc(angle / np.pi), 0.5 * np.sinc(angle / (2.0 * np.pi)) ** 2
    result: Array = vector + first * along + second * np.cross(turn, along)
    return result


def turned_on(attitude: Array, turn: Array) -> Array:
    """Attitudes (n, 4) turned on by rotation vectors (n, 3) in body axes, rad."""
    angle = np.linalg.norm(turn, axis=1, keepdims=True)
    w1, r1 = np.cos(0.5 * angle), 0.5 * np.sinc(angle / (2.0 * np.pi)) * turn
    w0, r0 = attitude[:, :1], attitude[:, 1:]
    w = w0 * w1 - (r0 * r1).sum(axis=1, keepdims=True)
    return np.hstack([w, w0 * r1 + w1 * r0 + np.cross(r0, r1)])


def to_body_turn(before: Array, after: Array) -> Array:
    """Rotation vectors (n, 3) in body axes, rad, that turn attitudes (n, 4) into others (n, 4) the shorter way."""
    w0, r0, w1, r1 = before[:, :1], before[:, 1:], after[:, :1], after[:, 1:]
    w = w0 * w1 + (r0 * r1).sum(axis=1, keepdims=True)
    r = w0 * r1 - w1 * r0 - np.cross(r0, r1)
    r, w = np.where(w < 0, -r, r), np.abs(w)
    half = np.arctan2(np.linalg.norm(r, axis=1, keepdims=True), w)
    turn: Array = 2.0 * r / np.sinc(half / np.pi)
    return turn
