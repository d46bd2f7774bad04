"""Sensors of the planted vehicle: drawn rates, white noise, and faults."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

STEP_S = 1.0 / 130.0
"""The simulator's step; every sensor period is a whole number of steps."""


class Clock(NamedTuple):
    """Periods in steps; 0 for a sensor that is not fitted."""

    tick: int
    dvl: int
    imu: int
    fog: int
    attitude: int
    depth: int


class Faults(NamedTuple):
    """Errors of the readings; `honest` has none.

    seen (3, 3), bias (3,), arm (3,): of the DVL, whose velocity is `late` steps old. wander: share by which biases
    vary. gyro: bias about z, rad/s. tilt (3, 3): rotation of the accelerometer. unseen: 1 if the controller uses a
    velocity that is not recorded.
    """

    seen: Array
    bias: Array
    arm: Array
    tilt: Array
    late: int = 0
    wander: float = 0.0
    gyro: float = 0.0
    unseen: int = 0


class Noise(NamedTuple):
    """Standard deviations of white noise, SI units; `loss` is the share of DVL readings without bottom lock."""

    dvl: float
    loss: float
    gyro: float
    fog: float
    force: float
    tilt: float
    heading: float
    depth: float


class Readings(NamedTuple):
    """Readings as rows in time order.

    dvl (a, 3); gyro and force (b, 3); fog (c, 1); attitude (e, 3): roll, pitch, heading; depth (f, 1). They hold
    noise before the dive; the dive adds the measured values.
    """

    dvl: Array
    gyro: Array
    force: Array
    fog: Array
    attitude: Array
    depth: Array


def draw_clock(rng: np.random.Generator) -> Clock:
    """Draw rates: DVL 5 to 11.8 Hz, control 13 or 26 Hz, IMU 26 to 65 Hz, and a FOG in two of three vehicles."""
    return Clock(
        tick=int(rng.choice([5, 10])),
        dvl=int(rng.choice([11, 13, 16, 20, 26])),
        imu=int(rng.choice([2, 3, 5])),
        fog=int(rng.choice([0, 4, 5])),
        attitude=int(rng.choice([5, 10])),
        depth=int(rng.choice([13, 20])),
    )


def draw_noise(rng: np.random.Generator) -> Noise:
    return Noise(
        dvl=rng.uniform(0.002, 0.006),
        loss=float(rng.choice([0.0, 0.01, 0.02])),
        gyro=rng.uniform(0.0008, 0.002),
        fog=rng.uniform(2e-5, 1e-4),
        force=rng.uniform(0.01, 0.04),
        tilt=rng.uniform(0.0005, 0.0015),
        heading=rng.uniform(0.001, 0.004),
        depth=rng.uniform(0.002, 0.006),
    )


def honest(arm: Array) -> Faults:
    """Sensors without faults, with the DVL at `arm` (3,) m."""
    return Faults(np.eye(3), np.zeros(3), arm, np.eye(3))


def noise_of(clock: Clock, noise: Noise, steps: int, rng: np.random.Generator) -> Readings:
    """Arrays for the readings of a dive of `steps` steps, filled with noise only."""

    def white(period: int, *spread: float) -> Array:
        count = len(range(0, steps, period)) if period else 0
        return np.asarray(rng.standard_normal((count, len(spread))) * np.array(spread))

    dvl = white(clock.dvl, *[noise.dvl] * 3)
    dvl[rng.random(len(dvl)) < noise.loss] = np.nan
    return Readings(
        dvl,
        white(clock.imu, *[noise.gyro] * 3),
        white(clock.imu, *[noise.force] * 3),
        white(clock.fog, noise.fog),
        white(clock.attitude, noise.tilt, noise.tilt, noise.heading),
        white(clock.depth, noise.depth),
    )
