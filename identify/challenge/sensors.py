"""Sensors of a drawn vehicle: how often each reads, its noise, and the faults that an effect may plant in it."""

from typing import NamedTuple

import numpy as np

from bridge.arrays import Array

STEP_S = 1.0 / 130.0
"""The simulator's step; every sensor period is a whole number of steps."""


class Periods(NamedTuple):
    """Steps from one reading of a sensor to its next, 0 for one that is not fitted; `tick`: of the controller."""

    tick: int
    dvl: int
    imu: int
    fog: int
    attitude: int
    depth: int


class Faults(NamedTuple):
    """Errors of the readings; `without_faults` has none.

    dvl_matrix (3, 3): takes the velocity at the transducer to what the DVL reads, by its scale and misalignment, both
    in body axes. dvl_bias (3,): m/s. dvl_arm (3,): position of the transducer, m. accelerometer_tilt (3, 3): rotation
    of the accelerometer. dvl_late_steps: age of the velocity that the DVL reads. bias_wander: share by which biases
    vary over the dive. gyro_bias: about z, rad/s. feedback_unlogged: 1 if the controller uses a velocity that is not
    recorded. depth_gain: of the depth sensor.
    """

    dvl_matrix: Array
    dvl_bias: Array
    dvl_arm: Array
    accelerometer_tilt: Array
    dvl_late_steps: int = 0
    bias_wander: float = 0.0
    gyro_bias: float = 0.0
    feedback_unlogged: int = 0
    depth_gain: float = 1.0


class Noise(NamedTuple):
    """White noise of the sensors: standard deviations, m/s, rad/s, m/s2, rad and m.

    tilt: of roll and pitch. loss: share of DVL readings without bottom lock.
    """

    dvl: float
    loss: float
    gyro: float
    fog: float
    force: float
    tilt: float
    heading: float
    depth: float


class Readings(NamedTuple):
    """Readings as rows in time order: at first noise alone, to which the simulated dive adds what is measured.

    dvl (a, 3) m/s; gyro (b, 3) rad/s and force (b, 3) m/s2, body axes; fog (c, 1) rad/s; attitude (e, 3): roll, pitch,
    heading, rad; depth (f, 1) m.
    """

    dvl: Array
    gyro: Array
    force: Array
    fog: Array
    attitude: Array
    depth: Array


def draw_periods(rng: np.random.Generator) -> Periods:
    """Draw periods for a DVL of 5 to 11.8 Hz, control at 13 or 26 Hz, an IMU of 26 to 65 Hz, a FOG in two of three."""
    return Periods(
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


def without_faults(arm: Array) -> Faults:
    """Sensors without faults, with the DVL at `arm` (3,) m."""
    return Faults(np.eye(3), np.zeros(3), arm, np.eye(3))


def noise_alone(periods: Periods, noise: Noise, steps: int, rng: np.random.Generator) -> Readings:
    """Readings of a dive of `steps` steps that hold noise alone."""

    def white(period: int, *std: float) -> Array:
        count = len(range(0, steps, period)) if period else 0
        return np.asarray(rng.standard_normal((count, len(std))) * np.array(std))

    dvl = white(periods.dvl, *[noise.dvl] * 3)
    dvl[rng.random(len(dvl)) < noise.loss] = np.nan
    return Readings(
        dvl,
        white(periods.imu, *[noise.gyro] * 3),
        white(periods.imu, *[noise.force] * 3),
        white(periods.fog, noise.fog),
        white(periods.attitude, noise.tilt, noise.tilt, noise.heading),
        white(periods.depth, noise.depth),
    )
