"""Velocity of a `.tlog` from the best message available, with the axes and interval that the message implies.

MAVLink's definitions: ODOMETRY has the velocity in the axes of `child_frame_id`; VISION_POSITION_DELTA has a change
of position over `time_delta_usec`, in the body's axes at its end; VISION_SPEED_ESTIMATE and LOCAL_POSITION_NED have
the velocity north-east-down.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.dive import Array, Signal
from identify.ingest import rotation
from identify.ingest.messages import Batch, Messages

LOCAL_NED, LOCAL_ENU, LOCAL_OFFSET_NED, LOCAL_FRD = 1, 4, 7, 20
BODY_NED, BODY_OFFSET_NED, BODY_FRD = 8, 9, 12
OF_BODY, OF_EARTH = (BODY_NED, BODY_OFFSET_NED, BODY_FRD), (LOCAL_NED, LOCAL_OFFSET_NED, LOCAL_ENU)
"""MAV_FRAMEs. By MAVLink's list, a velocity in BODY_NED or BODY_OFFSET_NED is a velocity in BODY_FRD."""

FUSED = (3, 5, 8)
"""MAV_ESTIMATOR_TYPEs that smooth, because they fuse accelerations: visual-inertial, the same with GPS, autopilot."""


@dataclass(frozen=True)
class Told:
    """A velocity in body axes, and whether it comes from a filter that fuses it with accelerations."""

    signal: Signal
    filtered: bool


def velocity_of(messages: Messages, attitude: Signal | None) -> Told | None:
    """Velocity from the best source; None without a velocity, or if it needs an attitude that is missing."""
    if (odometry := messages.get("ODOMETRY")) is not None:
        signal = _odometry(odometry, attitude)
        if signal is not None:
            return Told(signal, _is_fused(odometry))
    signal = _deltas(messages.get_from_anyone("VISION_POSITION_DELTA"))
    if signal is None:
        signal = _of_earth(messages.get_from_anyone("VISION_SPEED_ESTIMATE"), ("x", "y", "z"), attitude)
    if signal is not None:
        return Told(signal, False)
    signal = _of_earth(messages.get("LOCAL_POSITION_NED"), ("vx", "vy", "vz"), attitude)
    return None if signal is None else Told(signal, True)


def _odometry(batch: Batch, attitude: Signal | None) -> Signal | None:
    velocity = batch.columns("vx", "vy", "vz")
    velocity[batch.fields["quality"] < 0] = np.nan
    frame, child = batch.fields["frame_id"], batch.fields["child_frame_id"]
    in_body = np.isin(child, OF_BODY)
    if in_body.any():
        return _where(batch.time_s, velocity, in_body)
    attitudes = batch.fields["q"].astype(np.float64)
    # The attitude in the message rotates from the body to the frame of its pose.
    turned = (child == frame) & np.isin(child, (LOCAL_NED, LOCAL_OFFSET_NED, LOCAL_FRD))
    turned &= np.abs(np.linalg.norm(attitudes, axis=1) - 1.0) < 0.1
    if turned.any():
        return _where(batch.time_s, rotation.to_body(attitudes, velocity), turned)
    for earth_frame in OF_EARTH:
        if (child == earth_frame).any():
            ned = velocity[:, [1, 0, 2]] * np.array([1, 1, -1]) if earth_frame == LOCAL_ENU else velocity
            return _turned(batch.time_s, ned, child == earth_frame, attitude)
    return None


def _is_fused(batch: Batch) -> bool:
    return bool(np.isin(batch.fields["estimator_type"], FUSED).all())


def _deltas(batch: Batch | None) -> Signal | None:
    """Mean velocity over each VISION_POSITION_DELTA, dated at its middle and in the body axes of that instant.

    Drivers that state no time (time_usec 0, such as BlueOS's for Water Linked) send the DVL's own velocity times the
    interval, which was never turned.
    """
    if batch is None:
        return None
    step_s = batch.fields["time_delta_usec"].astype(np.float64) * 1e-6
    with np.errstate(divide="ignore", invalid="ignore"):
        velocity = batch.fields["position_delta"].astype(np.float64) / step_s[:, None]
    half = 0.5 * batch.fields["angle_delta"].astype(np.float64)
    stated = (batch.fields["time_usec"] > 0) & np.isfinite(half).all(axis=1)
    velocity[stated] = rotation.turned_by(half[stated], velocity[stated])
    return _where(batch.time_s - step_s / 2, velocity, step_s > 0)


def _of_earth(batch: Batch | None, names: tuple[str, str, str], attitude: Signal | None) -> Signal | None:
    if batch is None:
        return None
    return _turned(batch.time_s, batch.columns(*names), np.ones(len(batch.time_s), np.bool_), attitude)


def _turned(
    time_s: Array, north_east_down: Array, good: NDArray[np.bool_], attitude: Signal | None
) -> Signal | None:
    """Turn a north-east-down velocity into body axes, while the attitude is known."""
    if attitude is None or len(attitude) < 2:
        return None
    inside = (time_s >= attitude.time_s[0]) & (time_s <= attitude.time_s[-1])
    quaternion = rotation.attitude_at(attitude, time_s)
    return _where(time_s, rotation.to_body(quaternion, north_east_down), inside & good)


def _where(time_s: Array, value: Array, good: NDArray[np.bool_]) -> Signal | None:
    return Signal(time_s[good], value[good]) if good.any() else None
