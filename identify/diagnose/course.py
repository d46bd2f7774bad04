"""The course of a dive: what its effects depend on, from its readings and from the velocities that a fit came to."""

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.errors import FitError
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.thrusters import NEUTRAL_US, thrust_curve
from identify.diagnose.causal import Expected
from identify.dive import Dive, Signal
from identify.estimators.motion import Motion
from identify.estimators.places import down_axis
from identify.ingest.rotation import attitude_at

Array = NDArray[np.float64]


def course_of(
    dive: Dive, file: VehicleFile, configuration: str, at: Expected, mass: Array, damping: Array
) -> Course:
    """The course of what the filters expect; `mass`, `damping` (6,) are those of the nominal model.

    Raises FitError where the recording has no pulse for every thruster: then nothing can be said of one.
    """
    shape = file.vehicle.configurations[configuration]
    time_s, count = at.time_s, len(shape.thrusters)
    if dive.pwm is None or dive.pwm.value.shape[1] < count or not len(dive.pwm):
        raise FitError(
            f"{dive.name}: no thruster pulses are recorded for the {count} thrusters of '{configuration}'; record "
            "ACTUATOR_OUTPUT_STATUS or SERVO_OUTPUT_RAW, so that a thruster can be told from the hull"
        )
    pulses = np.where(dive.pwm.value[:, :count] > 0, dive.pwm.value[:, :count], NEUTRAL_US)
    asked = Signal(dive.pwm.time_s, thrust_curve(file.vehicle.thrust_curve, file.path.parent).thrust(pulses))
    # A step ago: no reading of an angle helps to explain itself.
    euler = _euler(dive, time_s - (time_s[1] - time_s[0]))
    depth = dive.depth_by(file.vehicle.water)
    return Course(
        shape,
        time_s,
        at.nu,
        at.nu_dot,
        euler,
        _at(depth, time_s),
        _at(dive.altitude, time_s),
        _position(Motion(time_s, at.nu), euler),
        _mean_ahead(asked, time_s),
        np.full((len(time_s), count), np.nan) if dive.rpm is None else dive.rpm.at(time_s)[:, :count],
        _at(dive.voltage, time_s),
        file.vehicle.thrust_curve.lag_s,
        mass,
        damping,
    )


def _mean_ahead(held: Signal, time_s: Array) -> Array:
    """The mean (n, k) of what holds until it changes, over the step that follows each time."""
    steps = np.diff(held.time_s)[:, None] * held.value[:-1]
    total = np.vstack([np.zeros((1, held.value.shape[1])), np.cumsum(steps, axis=0)])
    ends = np.append(time_s, 2 * time_s[-1] - time_s[-2])
    area = np.column_stack([np.interp(ends, held.time_s, column) for column in total.T])
    return np.asarray(np.diff(area, axis=0) / np.diff(ends)[:, None])


def _at(signal: Signal | None, time_s: Array) -> Array:
    return np.full(len(time_s), np.nan) if signal is None or not len(signal) else signal.at(time_s)[:, 0]


def _euler(dive: Dive, time_s: Array) -> Array:
    """Roll, pitch and heading (n, 3); level and ahead where no attitude is recorded."""
    if dive.attitude is None or not len(dive.attitude):
        return np.zeros((len(time_s), 3))
    attitude = attitude_at(dive.attitude, time_s)
    down_x, down_y, down_z = down_axis(attitude)
    w, x, y, z = attitude.T
    heading = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
    return np.column_stack([np.arctan2(down_y, down_z), np.arcsin(np.clip(-down_x, -1.0, 1.0)), heading])


def _position(motion: Motion, euler: Array) -> Array:
    """North and east (n, 2) by dead reckoning from the beginning."""
    u, v = motion.nu[:, 0], motion.nu[:, 1]
    cos, sin = np.cos(euler[:, 2]), np.sin(euler[:, 2])
    return np.column_stack([motion.integral(u * cos - v * sin), motion.integral(u * sin + v * cos)])
