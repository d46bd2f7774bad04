"""Rotation from a device's axes to the body's (FRD: x forward, y right, z down), by the mounting in the vehicle file.

Vectors: v_body = M v_device with M = Rz(yaw) Ry(pitch) Rx(roll) diag(signs).

Attitude: a device gives q, its rotation from device to earth in ENU, v_enu = R(q) v_device. The bridge needs the
rotation from body to earth in NED. A body vector is a device vector turned by M, and NED swaps the first two axes of
ENU and reverses the third:

    R(body to ned) = E R(q) M^T,    E = [[0, 1, 0], [1, 0, 0], [0, 0, -1]] = its own inverse, det +1.

With the usual mounting of an IMU, label up and x forward, M = diag(1, -1, -1) (roll 180). Level and nose north, the
device's x points north, a yaw of +90 deg in ENU: R(q) = Rz(90), and E Rz(90) diag(1, -1, -1) = I.
"""

import math
from functools import lru_cache

import numpy as np

from bridge.arrays import Quaternion, Vector3
from bridge.attitude import product, quaternion_of, rotation_matrix
from bridge.sensors.samples import DvlSample, FogBlock, ImuSample, Sample
from bridge.vehicle.config import Mounting

Matrix = tuple[Vector3, Vector3, Vector3]

_HALF = math.sqrt(0.5)
_ENU_TO_NED: Quaternion = (0.0, _HALF, _HALF, 0.0)


def to_body(sample: Sample, mounting: Mounting) -> Sample:
    """Return `sample` in body axes; velocities remain those of the device's position.

    A fibre-optic gyro has a single axis, its z: only the sign of that axis is taken from the mounting. A mounting
    whose signs mirror the axes can't turn an attitude, so the attitude is left out.
    """
    if isinstance(sample, ImuSample):
        matrix = mounting_matrix(mounting)
        turn = _body_to_device(mounting)
        return ImuSample(
            sample.time_s,
            _turned(matrix, sample.specific_force),
            _turned(matrix, sample.rate),
            None if sample.attitude is None or turn is None else _attitude(sample.attitude, turn),
            sample.temperature_c,
        )
    if isinstance(sample, DvlSample):
        velocity = _turned(mounting_matrix(mounting), sample.velocity)
        return DvlSample(sample.time_s, velocity, sample.sigma, sample.altitude_m)
    if isinstance(sample, FogBlock):
        if mounting_matrix(mounting)[2][2] > 0:
            return sample
        return FogBlock(sample.time_s, -sample.rate, sample.valid)
    return sample


@lru_cache(maxsize=64)
def mounting_matrix(mounting: Mounting) -> Matrix:
    """The matrix M of the module's docstring, as rows."""
    matrix = rotation_matrix(mounting.rotation_deg) @ np.diag(mounting.signs)
    x, y, z = ((float(a), float(b), float(c)) for a, b, c in matrix)
    return x, y, z


@lru_cache(maxsize=64)
def _body_to_device(mounting: Mounting) -> Quaternion | None:
    matrix = np.array(mounting_matrix(mounting))
    if not np.allclose(matrix @ matrix.T, np.eye(3)) or np.linalg.det(matrix) < 0:
        return None
    return quaternion_of(matrix.T)


def _turned(matrix: Matrix, vector: Vector3) -> Vector3:
    x, y, z = vector
    (a, b, c), (d, e, f), (g, h, i) = matrix
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def _attitude(device_to_enu: Quaternion, body_to_device: Quaternion) -> Quaternion:
    w, x, y, z = product(product(_ENU_TO_NED, device_to_enu), body_to_device)
    norm = math.copysign(math.sqrt(w * w + x * x + y * y + z * z), w)
    return w / norm, x / norm, y / norm, z / norm
