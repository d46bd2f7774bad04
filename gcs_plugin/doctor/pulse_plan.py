"""The pulses of the wet check, planned: which thruster, when, how hard and for how long."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from bridge.errors import ConfigError
from bridge.vehicle.config import Configuration, Vehicle
from bridge.vehicle.thrusters import NEUTRAL_US, Curve, allocation_matrix
from gcs_plugin.doctor.response import prior_mass_and_damping

WHOLE_S: Final = 60.0
REST_S: Final = 8.0
PULSE_S: Final = 1.0
LEAST_GAP_S: Final = 2.5
MOST_SPEED_M_S: Final = 0.15
MOST_RATE_RAD_S: Final = 0.5
MOST_SHARE: Final = 0.25  # of the thruster's limit
LEAST_N: Final = 1.0


@dataclass(frozen=True, slots=True)
class PlannedPulse:
    """A single push: `thruster` counts from 0, `start_s` from the beginning of the check."""

    thruster: int
    start_s: float
    duration_s: float
    thrust_n: float
    pwm_us: float


def pulses(vehicle: Vehicle, configuration: str, curve: Curve) -> tuple[PlannedPulse, ...]:
    """A rest, then each thruster forwards once; the next begins when the vehicle has had time to settle.

    No pulse is planned to take the vehicle beyond a slow walk of 0.15 m/s or 0.5 rad/s, unless that is less than 1 N
    of thrust, or a thruster beyond a quarter of its limit. Raises ConfigError for an unknown configuration or one
    without thrusters.
    """
    shape = vehicle.configurations[vehicle.configuration_named(configuration)]
    count = len(shape.thrusters)
    if curve.neutral_us != NEUTRAL_US:
        raise ConfigError(
            f"thrust_curve: neutral_us is {curve.neutral_us:g}, and thrusters are tested from rest at "
            f"{NEUTRAL_US:g} us alone; set the speed controllers to that"
        )
    if not count:
        raise ConfigError(f"configuration '{configuration}' has no thrusters; add them to the vehicle file")
    every_s = max((WHOLE_S - REST_S) / count, PULSE_S + LEAST_GAP_S)
    planned = []
    for index in range(count):
        thrust_n = _gentle_thrust_n(shape, curve, index)
        pwm_us = float(curve.pwm(thrust_n))
        planned.append(PlannedPulse(index, REST_S + index * every_s, PULSE_S, thrust_n, pwm_us))
    return tuple(planned)


def duration_s(planned: tuple[PlannedPulse, ...]) -> float:
    """How long the whole check takes."""
    last = planned[-1]
    return last.start_s + last.duration_s + LEAST_GAP_S


def _gentle_thrust_n(shape: Configuration, curve: Curve, index: int) -> float:
    """Thrust (N) of a thruster whose pulse stays within the limits of speed and rate, drag neglected."""
    mass, _ = prior_mass_and_damping(shape)
    per_newton = np.abs(allocation_matrix(shape)[:, index]) * PULSE_S / mass
    limits = np.array([MOST_SPEED_M_S] * 3 + [MOST_RATE_RAD_S] * 3)
    gentle = float((limits / np.maximum(per_newton, 1e-9)).min())
    most = min(MOST_SHARE * shape.thruster_limit_n, curve.max_n)
    return min(max(gentle, LEAST_N), most)
