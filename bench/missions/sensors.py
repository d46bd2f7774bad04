"""Readings of a drawn vehicle's sensors: periods in physics steps, white noise on each reading."""

from dataclasses import dataclass

import numpy as np

from bench.missions.vehicles import log_uniform

STEP_S = 0.005
"""The simulator's step; every period and latency is a whole number of EVENT_STEPS of it."""

EVENT_STEPS = 2


@dataclass(frozen=True)
class SensorSuite:
    """Periods in steps and standard deviations in SI units. `fog_steps` is 0 without a fibre-optic gyro.

    A FOG reading is the mean over its period; all other readings are instantaneous. `dvl_loss` is the share of DVL
    readings without bottom lock. `tick_steps` is the controller's period.
    """

    tick_steps: int
    dvl_steps: int
    dvl_first: int
    dvl_latency_steps: int
    dvl_loss: float
    dvl_m_s: float
    gyro_steps: int
    gyro_rad_s: float
    fog_steps: int
    fog_rad_s: float
    attitude_steps: int
    tilt_rad: float
    heading_rad: float
    depth_steps: int
    depth_m: float


def draw_sensors(rng: np.random.Generator, has_fog: bool, dvl_latency_s: float) -> SensorSuite:
    """Draw the sensors: DVL 4 to 10 Hz with 2 to 6 mm/s, gyro at 50 or 100 Hz, FOG means at 20 or 50 Hz, attitude,
    depth."""
    dvl_steps = int(rng.choice([20, 24, 28, 32, 40, 50]))
    fog_steps = int(rng.choice([4, 10])) if has_fog else 0
    # 4e-6 rad/s/sqrt(Hz) is the DSP-1750's 0.013 deg/sqrt(h).
    fog_density = log_uniform(rng, 4e-6, 1.2e-5)
    return SensorSuite(
        tick_steps=int(rng.choice([10, 20])),
        dvl_steps=dvl_steps,
        dvl_first=EVENT_STEPS * int(rng.integers(dvl_steps // EVENT_STEPS)),
        dvl_latency_steps=round(dvl_latency_s / STEP_S),
        dvl_loss=float(rng.choice([0.0, 0.01])),
        dvl_m_s=rng.uniform(0.002, 0.006),
        gyro_steps=int(rng.choice([2, 4])),
        gyro_rad_s=rng.uniform(0.0007, 0.0015),
        fog_steps=fog_steps,
        fog_rad_s=fog_density / float(np.sqrt(fog_steps * STEP_S)) if has_fog else 0.0,
        attitude_steps=int(rng.choice([4, 10])),
        tilt_rad=rng.uniform(0.0005, 0.002),
        heading_rad=rng.uniform(0.002, 0.005),
        depth_steps=20,
        depth_m=rng.uniform(0.002, 0.006),
    )
