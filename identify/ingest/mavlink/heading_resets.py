"""Removes resets of the heading: steps without a turn, as when ArduPilot's estimator aligns its yaw, mostly on arming.

A step would pass for a push in yaw, and for a turn of the current. The last heading counts as true, and the headings
before a step are turned by it.
"""

from dataclasses import replace

import numpy as np

from bridge.arrays import Array
from identify.dive import Dive, Signal
from identify.ingest.rotation import attitude_at, euler_angles
from identify.words import listed

LEAST_RAD = 0.007
"""0.4 deg: smaller resets do not matter."""

FAR = 12.0
"""Standard deviations of the difference between heading and gyro, over one step between attitudes."""

MOST = 0.01
"""Largest share of the steps that may be resets: beyond it, attitude and gyro are of different motions."""

LONGEST_S, SLOWEST_HZ = 0.5, 8.0
"""Least rate of the gyro, and longest time between two attitudes, to know the turn between them."""

STAMP_S = 0.02
"""Heading and gyro of a bag without header times are dated by so much apart, now and then: a turn is no reset."""

SHORTEST_S = 1e-3
"""Least time between two attitudes by which a rate is reckoned."""

STEEP_RAD = 1.2
"""Pitch beyond which the heading is ill-defined."""


def without_heading_resets(dive: Dive) -> Dive:
    """The dive with a continuous heading, and a note on its resets."""
    if dive.attitude is None or dive.gyro is None or dive.gyro.rate_hz < SLOWEST_HZ or len(dive.attitude) < 3:
        return dive
    attitude = dive.attitude
    turned, unsure = _turned_by(dive.gyro, attitude)
    unturned = _less(attitude, turned)
    if not np.isfinite(unturned).any():
        return dive
    # A gyro's bias is no reset.
    beyond = np.abs(unturned - np.nanmedian(unturned))
    usual = 1.4826 * float(np.nanmedian(beyond))
    reset = (beyond > max(LEAST_RAD, FAR * usual) + unsure) & (np.diff(attitude.time_s) < LONGEST_S)
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


def _less(attitude: Signal, turned: Array) -> Array:
    """Change (n - 1,) of the heading from each attitude to the next less a turn, rad, between -pi and pi."""
    change = np.diff(euler_angles(attitude.value)[2]) - turned
    return np.asarray(np.arctan2(np.sin(change), np.cos(change)))


def _turned_by(gyro: Signal, attitude: Signal) -> tuple[Array, Array]:
    """Turn of the heading (n - 1,) by the gyro from each attitude to the next, rad, NaN where unknown; and the most by
    which it may be off, for a rate that rises or falls between two readings of the gyro at any time."""
    time_s = np.unique(np.concatenate((attitude.time_s, gyro.time_s)))
    middle_s = 0.5 * (time_s[1:] + time_s[:-1])
    rates = _heading_rate(attitude, gyro, time_s)
    turned = 0.5 * (rates[1:] + rates[:-1]) * np.diff(time_s)
    read = _heading_rate(attitude, gyro, gyro.time_s)
    # Nothing is known of the rate before the first reading and after the last.
    off = np.pad(0.5 * np.abs(np.diff(read)) * np.diff(gyro.time_s), 1)
    off = np.nan_to_num(off)[np.searchsorted(gyro.time_s, middle_s)]
    step = np.searchsorted(attitude.time_s, middle_s) - 1
    inside = (step >= 0) & (step < len(attitude) - 1)
    turn, most = (
        np.bincount(step[inside], each[inside], minlength=len(attitude) - 1).astype(np.float64)
        for each in (turned, off)
    )
    rate = np.abs(turn) / np.maximum(np.diff(attitude.time_s), SHORTEST_S)
    return turn, most + STAMP_S * rate


def _heading_rate(attitude: Signal, gyro: Signal, time_s: Array) -> Array:
    """Rate of the heading (m,) at times, rad/s (Fossen 2011, eq. 2.27); NaN near a pitch of 90 deg, where it is
    singular."""
    rates = gyro.at(time_s)
    roll, pitch, _ = euler_angles(attitude_at(attitude, time_s))
    turned = (np.sin(roll) * rates[:, 1] + np.cos(roll) * rates[:, 2]) / np.cos(pitch)
    turned[np.abs(pitch) > STEEP_RAD] = np.nan
    return np.asarray(turned)


def _turned(quaternion: Array, by: Array) -> Array:
    """Attitudes (n, 4) turned about the world's down axis by angles (n,)."""
    c, s = np.cos(0.5 * by), np.sin(0.5 * by)
    w, x, y, z = quaternion.T
    return np.column_stack((c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w))
