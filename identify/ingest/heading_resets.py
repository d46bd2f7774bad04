"""Headings that an autopilot sets anew: steps that no turning made, as ArduPilot's estimator takes them where it aligns
its yaw, on arming above all.

A step would pass for a push in yaw, and for a turn of the water. The last heading is taken for the true one, and the
headings before a step are turned by it.
"""

from dataclasses import replace

import numpy as np

from bridge.arrays import Array
from identify.dive import Dive, Signal
from identify.ingest.rotation import attitude_at, euler_angles
from identify.words import listed

LEAST_RAD = 0.007
"""0.4 deg: smaller ones are no matter."""

FAR = 12.0
"""Standard deviations of the difference between heading and gyro, over one step between attitudes."""

MOST = 0.01
"""Share of the steps that may be resets: if more are, attitude and gyro tell of different motions."""

LONGEST_S, SLOWEST_HZ = 0.5, 8.0
"""A gyro at this rate tells how far the vehicle turned between two attitudes, if they are no further apart."""

STEEP_RAD = 1.2
"""Pitch beyond which a heading says little."""


def without_heading_resets(dive: Dive) -> Dive:
    """The dive with one heading throughout, and with a note where it was set anew."""
    if dive.attitude is None or dive.gyro is None or dive.gyro.rate_hz < SLOWEST_HZ or len(dive.attitude) < 3:
        return dive
    attitude = dive.attitude
    unturned = _unturned(attitude, dive.gyro)
    if not np.isfinite(unturned).any():
        return dive
    # A gyro's bias is no reset.
    beyond = np.abs(unturned - np.nanmedian(unturned))
    usual = 1.4826 * float(np.nanmedian(beyond))
    reset = (beyond > max(LEAST_RAD, FAR * usual)) & (np.diff(attitude.time_s) < LONGEST_S)
    if not 0 < np.count_nonzero(reset) <= MOST * len(reset):
        return dive
    later = np.append(np.cumsum(np.where(reset, unturned, 0.0)[::-1])[::-1], 0.0)
    value = _turned(attitude.value, later)
    steps = [
        f"{np.degrees(unturned[k]):+.1f} deg at {attitude.time_s[k + 1] - dive.span_s[0]:.0f} s"
        for k in np.flatnonzero(reset)
    ]
    note = f"The heading was set anew, by {listed(steps)}: the headings before are turned by as much."
    return replace(dive, attitude=Signal(attitude.time_s, value), notes=(*dive.notes, note))


def _unturned(attitude: Signal, gyro: Signal) -> Array:
    """Change (n - 1,) of the heading from each attitude to the next that the gyro does not tell of, rad, between -pi
    and pi; NaN where it was not read."""
    before, after = attitude.value[:-1], attitude.value[1:]
    middle_s, step_s = 0.5 * (attitude.time_s[1:] + attitude.time_s[:-1]), np.diff(attitude.time_s)
    rates = gyro.at(middle_s)
    roll, pitch, _ = euler_angles(attitude_at(attitude, middle_s))
    # Rate of the heading (Fossen 2011, eq. 2.27), which has none where the nose points straight up or down.
    turned = (np.sin(roll) * rates[:, 1] + np.cos(roll) * rates[:, 2]) / np.cos(pitch) * step_s
    turned[np.abs(pitch) > STEEP_RAD] = np.nan
    change = euler_angles(after)[2] - euler_angles(before)[2] - turned
    return np.asarray(np.arctan2(np.sin(change), np.cos(change)))


def _turned(quaternion: Array, by: Array) -> Array:
    """Attitudes (n, 4) turned about the world's down axis by angles (n,)."""
    c, s = np.cos(0.5 * by), np.sin(0.5 * by)
    w, x, y, z = quaternion.T
    return np.column_stack((c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w))
