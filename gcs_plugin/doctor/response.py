"""The vehicle's response to each pulse of a wet check, expected and measured.

A response is a small feature vector for each pulse and sensor. The expected response comes from the linear model at
rest, M nu_dot + D nu + G theta = B T, including the righting moment, because a roll or pitch after a pulse swings back
within seconds. Only the first part of a response is used, while its sign is certain.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import DAMPINGS, MASSES
from bridge.vehicle.config import GRAVITY_M_S2, Configuration, Vehicle
from bridge.vehicle.thrusters import Curve, allocation_matrix
from gcs_plugin.doctor.wet_record import Pulse, Series, WetRecord

STEP_S: Final = 0.01
BASELINE_S: Final = 0.8
WINDOWS: Final = {"dvl": (0.5, 1.2), "rate": (0.3, 0.6), "force": (0.1, 0.5), "fog": (0.3, 0.6)}
TOTAL_RATIO: Final = (1.3, 1.6, 2.0, 1.6, 1.6, 1.6)
"""Total over rigid-body mass, by axis, if the vehicle file has no model."""
DAMPING_TIME_S: Final = 3.0


@dataclass(frozen=True)
class Motion:
    """Simulated responses to one newton from each of n thrusters alone.

    `time_s` (k,) since the pulse began, `nu` (k, n, 6), `specific_force` (k, n, 3): its change.
    """

    time_s: Array
    nu: Array
    specific_force: Array


def prior_mass_and_damping(configuration: Configuration) -> tuple[Array, Array]:
    """Total mass (6,) and linear damping (6,): from the file's model if it has values, otherwise by a rule of thumb."""
    ratios = zip(MASSES, TOTAL_RATIO, strict=True)
    mass = np.array(
        [configuration.model.get(c.name, ratio * configuration.rigid_body(c.dof)[0]) for c, ratio in ratios]
    )
    damping = [configuration.model.get(c.name, mass[c.dof] / DAMPING_TIME_S) for c in DAMPINGS]
    return mass, np.array(damping)


def simulate_pulse(configuration: Configuration, on_s: float, lag_s: float) -> Motion:
    """Simulate the linear responses to a pulse of `on_s`."""
    mass, damping = prior_mass_and_damping(configuration)
    righting = np.zeros(6)
    weight = configuration.dry_mass_kg * GRAVITY_M_S2
    righting[3:5] = configuration.centre_of_gravity_below_buoyancy_m * weight
    wrench = allocation_matrix(configuration).T
    count = round((on_s + 1.0) / STEP_S)
    nu, specific_force = np.zeros((count, *wrench.shape)), np.zeros((count, len(wrench), 3))
    angle, thrust = np.zeros_like(wrench), 0.0
    for k in range(1, count):
        wanted = 1.0 if k * STEP_S <= on_s else 0.0
        thrust += (wanted - thrust) * min(1.0, STEP_S / max(lag_s, STEP_S))
        nu_dot = (wrench * thrust - damping * nu[k - 1] - righting * angle) / mass
        nu[k] = nu[k - 1] + STEP_S * nu_dot
        angle += STEP_S * nu[k]
        # Acceleration minus gravity as seen by the tilted body, without its value at rest.
        specific_force[k] = nu_dot[:, :3]
        specific_force[k, :, 0] += GRAVITY_M_S2 * angle[:, 4]
        specific_force[k, :, 1] -= GRAVITY_M_S2 * angle[:, 3]
    return Motion(np.linspace(0.0, (count - 1) * STEP_S, count), nu, specific_force)


def expected(
    vehicle: Vehicle, configuration: Configuration, curve: Curve, pulses: Sequence[Pulse]
) -> dict[str, Array]:
    """Response (pulses, thrusters, k) by sensor that each pulse would cause if it drove each thruster, forwards."""
    levers = {
        slot: np.array(device.mounting.position_m) for slot, device in vehicle.sensors.present().items()
    }
    on_s = float(np.median([pulse.end_s - pulse.start_s for pulse in pulses]))
    moved = simulate_pulse(configuration, on_s, vehicle.thrust_curve.lag_s)
    linear, turning = moved.nu[..., :3], moved.nu[..., 3:]
    series = {
        "dvl": linear + np.cross(turning, levers.get("dvl", np.zeros(3))),
        "rate": turning,
        "force": moved.specific_force
        + np.cross(np.gradient(turning, STEP_S, axis=0), levers.get("imu", np.zeros(3))),
        "fog": turning[..., 2:],
    }
    thrust_n = curve.thrust([pulse.pwm_us for pulse in pulses])
    features = {}
    for name, value in series.items():
        start_s, end_s = WINDOWS[name]
        inside = (moved.time_s >= start_s) & (moved.time_s < end_s)
        features[name] = thrust_n[:, None, None] * value[inside].mean(axis=0)
    return features


def measured(record: WetRecord, pulses: Sequence[Pulse]) -> dict[str, Array]:
    """Response (pulses, k) by sensor that each pulse caused; NaN if the sensor has no data around a pulse."""
    return {
        name: np.array([_feature(series, pulse, WINDOWS[name]) for pulse in pulses])
        for name, series in record.series.items()
    }


def feature_noise(record: WetRecord, pulses: Sequence[Pulse]) -> dict[str, Array]:
    """Standard deviation (k,) by sensor of the same features at rest before the first pulse; 0 if too short.

    It contains the sensor's noise and any other motion of the vehicle.
    """
    std = {}
    for name, series in record.series.items():
        first_s, last_s = series.time_s[0] + BASELINE_S, pulses[0].start_s - WINDOWS[name][1]
        still = [Pulse(0, start_s, start_s, 0.0) for start_s in np.arange(first_s, last_s, 0.25)]
        felt = np.array([_feature(series, pulse, WINDOWS[name]) for pulse in still])
        felt = felt[np.isfinite(felt).all(axis=1)] if len(still) else felt
        std[name] = felt.std(axis=0) if len(felt) > 3 else np.zeros(series.value.shape[1])
    return std


def _feature(series: Series, pulse: Pulse, window: tuple[float, float]) -> Array:
    before = series.mean(pulse.start_s - BASELINE_S, pulse.start_s)
    during = series.mean(pulse.start_s + window[0], pulse.start_s + window[1])
    if before is None or during is None:
        return np.full(series.value.shape[1], np.nan)
    return np.asarray(during - before)


def rest_force(record: WetRecord, pulses: Sequence[Pulse]) -> Array | None:
    """Specific force (3,) before the first pulse; None if the IMU has no data."""
    force = record.series.get("force")
    return None if force is None else force.mean(-np.inf, pulses[0].start_s)
