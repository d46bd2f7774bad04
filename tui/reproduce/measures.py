"""The paper's measures of its validation dives, computed from ours."""

import math
from dataclasses import dataclass

import numpy as np

from bridge.vehicle.config import VehicleFile
from bridge.vehicle.thrusters import allocation_matrix, thrust_curve
from identify.dive import Array, Dive, Signal
from identify.validate import phases

HEADING_COLUMN = 12
SLOW = 1e-3
LATE_SHARE = 0.5
SAME_SPEED_M_S = 0.005


@dataclass(frozen=True)
class Turn:
    """Tracking of a turn: lag in s over its second half, angle past the end and mean |error| in degrees."""

    lag_s: float
    overshoot_deg: float
    error_deg: float


@dataclass(frozen=True)
class Demand:
    """Load of the horizontal thrusters at a steady speed: the sum of |T| in N, and of |T|^1.5 in N^1.5."""

    thrust_n: float
    ideal_power: float


def heading(dive: Dive) -> tuple[Signal, Signal]:
    """Measured and desired heading, (n, 1) rad, unwrapped."""
    assert dive.attitude is not None
    assert dive.nu_ref is not None
    w, x, y, z = dive.attitude.value.T
    yaw = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
    wanted = np.unwrap(dive.nu_ref.value[:, HEADING_COLUMN])
    wanted = wanted + math.tau * round((float(yaw[0]) - float(wanted[0])) / math.tau)
    return Signal(dive.attitude.time_s, yaw[:, None]), Signal(dive.nu_ref.time_s, wanted[:, None])


def span(dive: Dive, dof: int) -> tuple[float, float]:
    """First and last time at which the velocity reference of degree of freedom `dof` is not zero, boot time in s."""
    assert dive.nu_ref is not None
    moving = dive.nu_ref.time_s[np.abs(dive.nu_ref.value[:, dof]) > SLOW]
    return float(moving[0]), float(moving[-1])


def turned(dive: Dive) -> Turn:
    """Measure how the dive's single turn was followed."""
    measured, wanted = heading(dive)
    assert dive.nu_ref is not None
    time_s = dive.nu_ref.time_s
    rate = dive.nu_ref.value[:, 5]
    moving = np.flatnonzero(np.abs(rate) > SLOW)
    first, last = int(moving[0]), int(moving[-1])
    behind = (wanted.value - measured.at(time_s))[:, 0]
    way = math.copysign(1.0, float(rate[first : last + 1].sum()))
    cruising = moving[np.abs(rate[moving]) > (1 - 1e-6) * np.abs(rate).max()]
    late = cruising[int(LATE_SHARE * len(cruising)) :]
    return Turn(
        float(np.mean(behind[late] / rate[late])),
        max(math.degrees(float((-way * behind[last:]).max())), 0.0),
        math.degrees(float(np.abs(behind[first:]).mean())),
    )


def steady_speed(dive: Dive, dof: int) -> float:
    """Mean measured speed while the reference of an axis is steady, m/s."""
    assert dive.velocity is not None
    assert dive.nu_ref is not None
    known = np.isfinite(dive.velocity.value[:, dof])
    time_s = dive.velocity.time_s[known]
    wanted = dive.nu_ref.at(time_s)
    steady = phases(wanted[:, dof], wanted[:, 6 + dof]).steady
    return float(dive.velocity.value[known, dof][steady].mean())


def demand(dive: Dive, file: VehicleFile, configuration: str, speed_m_s: float) -> Demand:
    """Demand on the thrusters that can push along surge, during pure surge at a steady speed."""
    assert dive.pwm is not None
    assert dive.nu_ref is not None
    shape, curve = file.vehicle.configurations[configuration], file.vehicle.thrust_curve
    along = np.abs(allocation_matrix(shape)[0]) > 0.1
    wanted = dive.nu_ref.at(dive.pwm.time_s)
    at_speed = np.abs(np.abs(wanted[:, 0]) - speed_m_s) < SAME_SPEED_M_S
    alone = np.abs(wanted[:, [1, 5, 6]]).max(axis=1) < SAME_SPEED_M_S
    pwm_us = dive.pwm.value[at_speed & alone][:, : len(along)][:, along]
    thrust: Array = np.abs(thrust_curve(curve, file.path.parent).thrust(pwm_us))
    return Demand(float(thrust.sum(axis=1).mean()), float((thrust**1.5).sum(axis=1).mean()))
