"""Removes steps of the heading without a turn: resets, as when ArduPilot's estimator aligns its yaw, mostly on arming,
and smaller corrections within a second or so, as when it learns in hard manoeuvres how far its heading was off.

A step would pass for a push in yaw, and for a turn of the current. The last heading counts as true, and the headings
before a step are turned by it.
"""

from dataclasses import replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.dive import Dive, Signal
from identify.ingest.rotation import attitude_at, euler_angles
from identify.words import listed

LEAST_RAD = 0.007
"""0.4 deg, of a step from one attitude to the next."""

FAR = 12.0
"""Standard deviations of the difference between heading and gyro, over one step between attitudes."""

MOST = 0.01
"""Largest share of the steps that may be resets: beyond it, attitude and gyro are of different motions."""

CORRECTED_S, EACH_S = 1.0, 0.25
"""Time that a correction takes, and between the beginnings of the windows in which it is looked for."""

LEAST_CORRECTED_RAD, FAR_CORRECTED = 0.0017, 8.0
"""0.1 deg, and standard deviations of the difference between heading and gyro over a window in such a turn: a gyro's
wrong scale and a compass' deviation grow with the turn, and are no correction."""

TAILS = 2
"""Windows before and behind, which hold the rest of a correction: too little by itself."""

FEW = 5
"""Attitudes at either end of a window."""

TURNING = 0.75
"""Share of the windows that turn too little to show how far the difference grows with a turn."""

MOST_CORRECTED = 0.1
"""Largest share of the windows in which the heading may be corrected: beyond it, it wanders."""

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
    beyond = unturned - np.nanmedian(unturned)
    usual = 1.4826 * float(np.nanmedian(np.abs(beyond)))
    step_s = np.diff(attitude.time_s)
    near = step_s < LONGEST_S
    stamped = STAMP_S * np.abs(turned) / np.maximum(step_s, SHORTEST_S)
    reset = (np.abs(beyond) > max(LEAST_RAD, FAR * usual) + unsure + stamped) & near
    if np.count_nonzero(reset) > MOST * len(reset):
        return dive
    slow = np.where(reset | ~near | np.isnan(beyond), 0.0, beyond)
    corrected = _corrected(attitude.time_s, slow, np.nan_to_num(turned), np.nan_to_num(unsure))
    by = np.where(reset, unturned, np.where(corrected, slow, 0.0))
    if not by.any():
        return dive
    later = np.append(np.cumsum(by[::-1])[::-1], 0.0)
    since_s = attitude.time_s[1:] - dive.span_s[0]
    steps = [
        f"{np.degrees(by[step].sum()):+.1f} deg at {since_s[step].mean():.0f} s"
        for step in _apart(reset, corrected)
    ]
    note = f"The heading was set anew, by {listed(steps)}: the headings before are turned by as much."
    attitude = Signal(attitude.time_s, _turned(attitude.value, later))
    return replace(dive, attitude=attitude, notes=(*dive.notes, note))


def _corrected(time_s: Array, beyond: Array, turned: Array, unsure: Array) -> NDArray[np.bool_]:
    """Which of the steps (n - 1,) from each of n attitudes to the next lie in a window in which the heading departs
    from the gyro by far more than is usual for such a turn; none if these are many. beyond, turned, unsure (n - 1,):
    how far the heading departs from the gyro's turn in a step, that turn, and by how much each may be off, rad."""
    begins_s = np.arange(time_s[0], time_s[-1] - CORRECTED_S, EACH_S)
    out = np.zeros(len(beyond), dtype=np.bool_)
    if not len(begins_s):
        return out
    first = np.searchsorted(time_s, begins_s)
    # The sum of the two may come out a hair beyond the last attitude.
    last = np.minimum(np.searchsorted(time_s, begins_s + CORRECTED_S), len(time_s) - 1)
    # The median of a few: an attitude whose stamp stumbles in a turn departs for itself alone.
    lasting = np.median(sliding_window_view(np.pad(_total(beyond), FEW // 2, mode="edge"), FEW), axis=1)
    off = np.abs(lasting[last] - lasting[first])
    turns, squares = (total[last] - total[first] for total in map(_total, (np.abs(turned), unsure**2)))
    turning = turns >= max(float(np.quantile(turns, TURNING)), 1e-9)
    grows = float(np.median(off[turning] / turns[turning])) if turning.any() else 0.0
    usual = 1.4826 * (float(np.median(off)) + grows * turns)
    far = off > np.maximum(LEAST_CORRECTED_RAD, FAR_CORRECTED * usual) + np.sqrt(squares)
    if np.mean(far) <= MOST_CORRECTED:
        for k in np.flatnonzero(far).tolist():
            out[first[max(k - TAILS, 0)] : last[min(k + TAILS, len(last) - 1)]] = True
    return out


def _total(steps: Array) -> Array:
    """The sum (n,) of the steps (n - 1,) before each attitude."""
    return np.concatenate([[0.0], np.cumsum(steps)])


def _apart(reset: NDArray[np.bool_], corrected: NDArray[np.bool_]) -> list[NDArray[np.intp]]:
    """The steps of each change of the heading: each reset alone, each correction as a whole."""
    slow = np.flatnonzero(corrected & ~reset)
    pieces = np.split(slow, np.flatnonzero(np.diff(slow) > 1) + 1) if len(slow) else []
    return sorted([*pieces, *np.flatnonzero(reset)[:, None]], key=lambda steps: int(steps[0]))


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
    return turn, most


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
