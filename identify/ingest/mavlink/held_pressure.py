"""Dates the pressure that an ArduPilot holds, by the vertical velocity of a DVL.

The autopilot reads its barometer ten times a second and sends the last reading (ArduSub.cpp, update_altitude;
GCS_Common.cpp). Its age depends on the phase of the autopilot's tasks, which differs from start to start: 25 to 90 ms
in a simulated ArduSub. A single age for all dives put the mass in heave off by 0.2 %, beyond its interval.
"""

from typing import Final

import numpy as np

from bridge.arrays import Array
from identify.dive import Signal
from identify.ingest.rotation import attitude_at

LATE_S: Final = 0.085
"""Age of a pressure without a DVL."""
SPREAD_S: Final = 0.03
"""Its standard deviation."""
OLDEST_S: Final = 0.15
GAP_S: Final = 1.0
"""Longest time between readings of the DVL over which its velocity is integrated."""
FEWEST: Final = 50
PASSES: Final = 3
SPIKE: Final = 6.0
"""A step of the pressure with so many times the usual error is a spike."""
ALIKE: Final = 1e8
"""Condition number of the squares beyond which the columns are inseparable."""
STEP_S: Final = 2.0
LEAST_STEP_M: Final = 0.2
LEAST_RISE_PA_M: Final = 5000.0
"""Half of what a pressure rises by in a metre of water: in a hull, the air's rises by far less."""


def is_of_air(pressure: Signal, depth: Signal) -> bool:
    """Whether a pressure (n, 1) stays while the autopilot's depth (m, 1) changes: a board with two barometers has that
    of the water as its third, and sends none of it (GCS_MAVLink_Sub.cpp, send_scaled_pressure3).

    By most of the dive's steps over STEP_S: a filter of the autopilot that begins at depth jumps once.
    """
    time_s = pressure.time_s[: np.searchsorted(pressure.time_s, pressure.time_s[-1:] - STEP_S)[0]]
    sunk_m, risen_pa = (each.at(time_s + STEP_S) - each.at(time_s) for each in (depth, pressure))
    sinks = np.abs(sunk_m) > LEAST_STEP_M
    if np.count_nonzero(sinks) < FEWEST:
        return False
    return float(np.median(risen_pa[sinks] / sunk_m[sinks])) < LEAST_RISE_PA_M


def dated(pressure: Signal, velocity: Signal | None, attitude: Signal | None) -> Signal:
    """A pressure (n, 1), stamped as it was sent, at the times at which it was read.

    velocity (n, 3) of a DVL in body axes, m/s, and attitude (n, 4), where they are recorded.
    """
    late_s = LATE_S
    if velocity is not None and attitude is not None:
        late_s = age_s(pressure, velocity.finite(), attitude.finite())
    return Signal(pressure.time_s - late_s, pressure.value)


def age_s(pressure: Signal, velocity: Signal, attitude: Signal) -> float:
    """Age of the readings when sent, 0 to OLDEST_S, by their fit to the depth by the DVL and by LATE_S, each weighed by
    its variance.

    The pressure's steps are fitted by those of the depth, of the speed downwards and of time (the DVL's zero error), so
    neither the water's density nor the sensor's unit matters.
    """
    if len(attitude) < 2:
        return LATE_S
    inside = (velocity.time_s >= attitude.time_s[0]) & (velocity.time_s <= attitude.time_s[-1])
    time_s, nu = velocity.time_s[inside], velocity.value[inside]
    if len(time_s) < FEWEST:
        return LATE_S
    _, x, y, _ = (q := attitude_at(attitude, time_s)).T
    w, z = q[:, 0], q[:, 3]
    down = (
        2 * (x * z - w * y) * nu[:, 0] + 2 * (y * z + w * x) * nu[:, 1] + (1 - 2 * (x * x + y * y)) * nu[:, 2]
    )
    step_s = np.diff(time_s)
    sunk = np.concatenate([[0.0], np.cumsum(0.5 * (down[1:] + down[:-1]) * step_s)])
    late_s = LATE_S
    for _ in range(PASSES):
        read_s = pressure.time_s - late_s
        after = np.searchsorted(time_s, read_s)
        known = (after > 0) & (after < len(time_s))
        known[known] = step_s[after[known] - 1] <= GAP_S
        both = known[1:] & known[:-1] & np.isfinite(np.diff(pressure.value[:, 0]))
        columns = np.column_stack([np.interp(read_s, time_s, sunk), np.interp(read_s, time_s, down), read_s])
        estimate = _lateness(np.diff(pressure.value[:, 0])[both], np.diff(columns, axis=0)[both])
        if estimate is None:
            return LATE_S
        more_s, std_s = estimate
        share = SPREAD_S**2 / (SPREAD_S**2 + std_s**2)
        late_s = float(np.clip(LATE_S + share * (late_s + more_s - LATE_S), 0.0, OLDEST_S))
    return late_s


def _lateness(steps: Array, columns: Array) -> tuple[float, float] | None:
    """Lateness of steps (n,) behind columns (n, 3) and its standard error, s; None if undetermined."""
    if len(steps) < FEWEST:
        return None
    scale = np.sqrt(np.mean(columns**2, axis=0))
    if not (scale > 0).all():
        return None
    columns = columns / scale
    keep = np.ones(len(steps), np.bool_)
    for _ in range(2):
        size = np.linalg.lstsq(columns[keep], steps[keep], rcond=None)[0]
        off = np.abs(steps - columns @ size)
        keep = off <= SPIKE * max(float(np.median(off)), 1e-12)
    square = columns[keep].T @ columns[keep]
    if np.count_nonzero(keep) < FEWEST or np.linalg.cond(square) > ALIKE or size[0] <= 0:
        return None
    std = np.sqrt(np.mean(off[keep] ** 2) * np.linalg.inv(square)[1, 1])
    late_s, std_s = np.array([-size[1], std]) / size[0] * scale[0] / scale[1]
    return float(late_s), float(std_s)
