"""The Cramer-Rao bound of a mission, jointly over all six degrees of freedom.

The readings of a dive have the likelihood of the innovations of a Kalman filter, closed loop or not (Ljung 1999,
section 13.4). The Fisher information is the sum of de' S^-1 de + dS' dS / (2 S^2) over all readings, with de and dS
the sensitivities of an innovation and of its variance (Gupta and Mehra 1974, eq. 35); its inverse is the least
covariance that an unbiased method can have. Filter and sensitivities run over the dive's own readings at the TRUE
parameters and over one joint state, so that the information which an axis holds about another through the Coriolis
forces counts.

Unknown, and so widening the bound: the twelve coefficients, a trim force on every axis, the spread and the time
constant of each axis's disturbance, the noise level of each sensor on each axis. Known, as every method assumes: the
thruster curve and its lag, restoring and buoyancy, the sensors' positions.

A wide Gaussian prior (a factor of e^3 either way; for the trims a tenth of full thrust) keeps the inverse finite if a
dive holds no information at all on a coefficient; below a relative error of 30 % it has no visible effect.
"""

from dataclasses import dataclass

import numpy as np

from bench.bound import kernel
from bench.missions.mission import Mission
from bench.missions.sensors import EVENT_STEPS, STEP_S
from bridge.arrays import Array
from bridge.vehicle.coefficients import COEFFICIENTS
from bridge.vehicle.thrusters import allocation_matrix, thrust_curve
from identify.dive import Signal
from identify.ingest.rotation import euler_angles

LOG_PRIOR_STD = 3.0
TRIM_PRIOR_SHARE = 0.1
START_STD = np.array([0.1] * 6 + [0.0] * 6 + [0.05] * 3 + [1.0, 0.0])


@dataclass(frozen=True)
class Information:
    """Fisher information (p, p) of a mission, its log likelihood and the likelihood's gradient (p,), all at the truth.

    In the order of `kernel`: log masses, log dampings, trims (N, N m), logs of spreads, time constants and noises.
    `prior` (p,) is the wide prior's precision.
    """

    log_likelihood: float
    information: Array
    gradient: Array
    prior: Array

    @property
    def covariance(self) -> Array:
        return np.asarray(np.linalg.inv(self.information + np.diag(self.prior)), dtype=np.float64)


def cramer_rao(mission: Mission) -> dict[str, float]:
    """The least relative standard error of each coefficient of the mission's truth."""
    spread = np.sqrt(np.diag(information(mission).covariance))
    return {c.name: float(spread[i]) for i, c in enumerate(COEFFICIENTS) if c.name in mission.truth}


def information(mission: Mission) -> Information:
    vehicle, sensors, dive = mission.drawn, mission.sensors, mission.dive
    model = kernel.Model(
        vehicle.mass,
        vehicle.damping,
        vehicle.trim,
        vehicle.righting_nm,
        vehicle.configuration.net_buoyancy_n,
        vehicle.disturbance_std,
        vehicle.disturbance_time_s,
    )
    dvl = vehicle.file.vehicle.sensors.dvl
    every = np.array(
        [
            sensors.dvl_steps,
            sensors.gyro_steps,
            sensors.fog_steps,
            sensors.attitude_steps,
            sensors.depth_steps,
        ]
    )
    recorded = kernel.Recorded(
        STEP_S * EVENT_STEPS,
        _wrench(mission),
        np.zeros(3) if dvl is None else np.array(dvl.mounting.position_m),
        _values(dive.velocity, 3),
        _values(dive.gyro, 3),
        _values(dive.fog, 1),
        np.column_stack(euler_angles(_values(dive.attitude, 4))),
        _values(dive.depth, 1),
        every // EVENT_STEPS,
        sensors.dvl_first // EVENT_STEPS,
        np.array(
            [sensors.dvl_m_s, sensors.gyro_rad_s, sensors.fog_rad_s, sensors.tilt_rad, sensors.heading_rad,
             sensors.depth_m]
        ) ** 2,
    )  # fmt: skip
    start, covariance = np.zeros(kernel.STATES), np.diag(START_STD**2)
    start[kernel.DEPTH] = mission.position[0, 2]
    for i, std in enumerate(vehicle.disturbance_std / vehicle.mass):
        covariance[kernel.PUSH + i, kernel.PUSH + i] = std**2
    score = kernel.new_score()
    kernel.scored(
        model, recorded, start, covariance, kernel.new_shadow(model, covariance, recorded.step_s), score
    )
    spread = np.full(kernel.PARAMETERS, LOG_PRIOR_STD)
    spread[kernel.TRIM : kernel.LOG_SPREAD] = TRIM_PRIOR_SHARE * vehicle.reach[[0, 0, 0, 5, 5, 5]]
    return Information(float(score.likelihood[0]), score.information, score.gradient, spread**-2.0)


def _values(signal: Signal | None, columns: int) -> Array:
    return np.zeros((0, columns)) if signal is None else signal.value


def _wrench(mission: Mission) -> Array:
    """Mean wrench (n, 6) over each event step, from the recorded pulses through curve, lag and geometry."""
    pwm, vehicle = mission.dive.pwm, mission.file.vehicle
    assert pwm is not None
    curve = thrust_curve(vehicle.thrust_curve, mission.file.path.parent)
    asked = curve.thrust(pwm.value) @ allocation_matrix(mission.drawn.configuration).T
    inner = mission.sensors.tick_steps // EVENT_STEPS
    h, lag_s = STEP_S * EVENT_STEPS, vehicle.thrust_curve.lag_s
    keep = np.exp(-h / lag_s)
    share = lag_s / h * (1.0 - keep)
    wrench = np.zeros(6)
    out = np.empty((len(asked), inner, 6))
    decay = keep ** np.arange(inner)
    for i, target in enumerate(asked):
        out[i] = target + (wrench - target) * (share * decay)[:, None]
        wrench = target + (wrench - target) * keep**inner
    return out.reshape(-1, 6)
