"""Dates the velocity that a driver sent to an autopilot as steps of position: by the accelerometer beside it.

A step says how far the vehicle moved in how long. Drivers that measure the way send its mean, which belongs to the
middle of the step. Those of a DVL send its last velocity times the step, which belongs to the end, half a step later.
A `.BIN` does not say which driver it was (record VISO).
"""

from typing import Final

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.config import GRAVITY_M_S2
from identify.dive import Signal
from identify.ingest.rotation import attitude_at, to_body

FEWEST: Final = 50
LONGEST_S: Final = 1.0
"""Longer steps bridge a loss of the bottom."""
SPIKE: Final = 6.0
"""A change of velocity is a spike so many times the usual one off."""
LEAST_NATS: Final = 5.0
"""The end of the step is taken where it is so much likelier than the middle, which a step means by its definition."""


def dated(
    steps: Signal, gyro: Signal | None, specific_force: Signal | None, attitude: Signal | None
) -> Signal:
    """Velocity (n, 3), body axes, m/s, from `steps` (n, 4): their durations, s, and ways, m, at their ends.

    Dated at the middles of the steps; at their ends, where gyro (n, 3), specific force (n, 3) and attitude (n, 4) tell
    that it is theirs.
    """
    good = steps.value[:, 0] > 0
    end_s, step_s = steps.time_s[good], steps.value[good, 0]
    velocity = Signal(end_s, steps.value[good, 1:] / step_s[:, None])
    middle = Signal(end_s - step_s / 2, velocity.value)
    if gyro is None or specific_force is None or attitude is None or len(attitude) < 2:
        return middle
    at_end, at_middle = (
        misfit(each, step_s, gyro.finite(), specific_force.finite(), attitude.finite())
        for each in (velocity, middle)
    )
    return velocity if at_end + LEAST_NATS < at_middle else middle


def misfit(velocity: Signal, step_s: Array, gyro: Signal, specific_force: Signal, attitude: Signal) -> float:
    """How badly the changes of a velocity (n, 3) are those that the specific force gives, in nats; 0 where that can't
    be told.

    A constant error of the force and one that grows with time, such as a bias and its drift, are taken off.
    """
    began_s = max(velocity.time_s[0], gyro.time_s[0], specific_force.time_s[0], attitude.time_s[0])
    ended_s = min(velocity.time_s[-1], gyro.time_s[-1], specific_force.time_s[-1], attitude.time_s[-1])
    inside = (velocity.time_s >= began_s) & (velocity.time_s <= ended_s)
    force = specific_force.between(began_s, ended_s)
    if np.count_nonzero(inside) < FEWEST or len(force) < FEWEST:
        return 0.0
    down = np.zeros_like(force.value)
    down[:, 2] = GRAVITY_M_S2
    gravity = to_body(attitude_at(attitude, force.time_s), down)
    turned = np.cross(gyro.at(force.time_s), velocity.at(force.time_s))
    acceleration = force.value + gravity - turned
    gained = np.vstack(
        [
            np.zeros(3),
            np.cumsum(0.5 * (acceleration[1:] + acceleration[:-1]) * np.diff(force.time_s)[:, None], axis=0),
        ]
    )
    time_s = velocity.time_s[inside]
    between_s = np.diff(time_s)
    whole = (between_s <= LONGEST_S) & np.isclose(between_s, step_s[inside][1:], rtol=0.5)
    off = (
        np.diff(velocity.value[inside], axis=0) - np.diff(Signal(force.time_s, gained).at(time_s), axis=0)
    )[whole]
    off = off[np.isfinite(off).all(axis=1)]
    if len(off) < FEWEST:
        return 0.0
    columns = np.column_stack([np.ones(len(off)), np.linspace(-1.0, 1.0, len(off))])
    off = off - columns @ np.linalg.lstsq(columns, off, rcond=None)[0]
    usual = np.maximum(np.median(np.abs(off), axis=0), 1e-12)
    bounded = np.clip(off, -SPIKE * usual, SPIKE * usual)
    return float(0.5 * len(off) * np.log(np.mean(bounded**2, axis=0)).sum())
