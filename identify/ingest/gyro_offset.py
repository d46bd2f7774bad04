"""Takes the slow offset off an ArduPilot's rates of turn.

The offset of a small gyro drifts by some 0.1 deg/s within minutes, as that of ArduPilot's own simulator does. The
estimator finds it late, so that the rates that are sent still hold a part of it, and the raw rates of a log hold all of
it. The attitude holds none, because gravity and compass keep it. Beside an attitude that is read to 0.1 mrad an offset
would be neither noise nor motion, and mass and damping would take it up.
"""

from typing import Final

import numpy as np

from bridge.arrays import Array
from identify.dive import Signal
from identify.ingest.rotation import to_body_turn

WINDOW_S: Final = 20.0
"""The offset is a mean over so long: an attitude that is off by 1 mrad then leaves 0.003 deg/s of it, and no gyro's
offset changes by more meanwhile."""

SLOWEST_HZ: Final = 20.0
"""Slower rates don't add up to the angles that were turned in between."""

APART_S: Final = 0.5
RATES_APART_S: Final = 0.15
"""Longest time between two attitudes, and between two rates, that is bridged: a lost message or two."""

FARTHEST_RAD: Final = 0.02
"""An attitude that is off by more than this from what was turned since the attitude before was set anew."""


def without_offset(rates: Signal, attitude: Signal | None) -> Signal:
    """Rates of turn (n, 3), rad/s, less the mean about each of what the attitude (m, 4) does not turn.

    As they are without an attitude, if they come too seldom, or if both were known for less than WINDOW_S.
    """
    if attitude is None or len(rates) < 2 or rates.rate_hz < SLOWEST_HZ:
        return rates
    edges = attitude.between(float(rates.time_s[0]), float(rates.time_s[-1]))
    if len(edges) < 2:
        return rates
    step_s, unturned = np.diff(edges.time_s), _unturned(rates, edges)
    known = (step_s < APART_S) & (np.abs(unturned) < FARTHEST_RAD).all(axis=1)
    # The window is of known time, so that neither a gap nor a heading that was set anew counts.
    since_s = np.concatenate([[0.0], np.cumsum(np.where(known, step_s, 0.0))])
    if since_s[-1] < WINDOW_S:
        return rates
    more = np.vstack([np.zeros((1, 3)), np.cumsum(np.where(known[:, None], unturned, 0.0), axis=0)])
    about_s = np.interp(rates.time_s, edges.time_s, since_s)
    start_s, end_s = (
        np.maximum(about_s - 0.5 * WINDOW_S, 0.0),
        np.minimum(about_s + 0.5 * WINDOW_S, since_s[-1]),
    )
    gained = _at(end_s, since_s, more) - _at(start_s, since_s, more)
    return Signal(rates.time_s, rates.value - gained / (end_s - start_s)[:, None])


def _unturned(rates: Signal, edges: Signal) -> Array:
    """Angles (m - 1, 3) that the rates add up to from each attitude (m, 4) to the next, less those that it turned; NaN
    beside rates that are missing."""
    read = np.isfinite(rates.value).all(axis=1)
    time_s, value = rates.time_s[read], rates.value[read]
    if len(time_s) < 2:
        return np.full((len(edges) - 1, 3), np.nan)
    step_s = np.diff(time_s)
    added = np.where(
        (step_s < RATES_APART_S)[:, None], 0.5 * (value[1:] + value[:-1]) * step_s[:, None], np.nan
    )
    gaps = np.concatenate([[0.0], np.cumsum(np.isnan(added[:, 0]))])
    angle = np.vstack([np.zeros((1, 3)), np.cumsum(np.nan_to_num(added), axis=0)])
    turned = np.diff(_at(edges.time_s, time_s, angle), axis=0) - to_body_turn(
        edges.value[:-1], edges.value[1:]
    )
    missing = np.diff(np.interp(edges.time_s, time_s, gaps)) > 0
    return np.where(missing[:, None], np.nan, turned)


def _at(wanted_s: Array, time_s: Array, value: Array) -> Array:
    """Columns (n, k), straight between their times (n,), at the times (m,)."""
    return np.column_stack([np.interp(wanted_s, time_s, column) for column in value.T])
