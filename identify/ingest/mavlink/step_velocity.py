"""Dates the velocity that a driver sent to an autopilot as steps of position, by the accelerometer.

A step holds a distance and a duration. Drivers that measure the distance send the mean velocity, valid in the middle of
the step. Drivers of a DVL send the last velocity times the duration, valid at the end, half a step later. A `.BIN` does
not name the driver (record VISO).
"""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.config import GRAVITY_M_S2
from identify.dive import Signal
from identify.ingest.rotation import attitude_at, to_body

FEWEST: Final = 50
LONGEST_S: Final = 1.0
"""Longer steps bridge a loss of the bottom."""
SPIKE: Final = 6.0
"""A change of velocity with so many times the usual error is a spike."""
LEAST_NATS: Final = 5.0
"""The end of the step is chosen if it is so much likelier than the middle, which the message's definition implies."""


def dated(
    steps: Signal, gyro: Signal | None, specific_force: Signal | None, attitude: Signal | None
) -> Signal | None:
    """Velocity (n, 3), body axes, m/s, from `steps` (n, 4): their durations, s, and ways, m, at their ends. None
    without any step that lasts.

    Dated at the middles of the steps, or at their ends if gyro (n, 3), specific force (n, 3) and attitude (n, 4) fit
    better there.
    """
    good = steps.value[:, 0] > 0
    if not good.any():
        return None
    step_s = steps.value[good, 0]
    at_end = Signal(steps.time_s[good], steps.value[good, 1:] / step_s[:, None])
    middle = Signal(at_end.time_s - step_s / 2, at_end.value)
    inertial = [signal.finite() for signal in (gyro, specific_force, attitude) if signal is not None]
    if len(inertial) < 3 or min(map(len, inertial)) < FEWEST:
        return middle.in_order()
    gained = _gained(at_end, *inertial)
    inside = (middle.time_s >= gained.time_s[0]) & (at_end.time_s <= gained.time_s[-1])
    between_s = np.diff(at_end.time_s)
    pairs = inside[1:] & inside[:-1] & (between_s <= LONGEST_S) & np.isclose(between_s, step_s[1:], rtol=0.5)
    pairs &= np.isfinite(np.diff(at_end.value, axis=0)).all(axis=1)
    if np.count_nonzero(pairs) < FEWEST:
        return middle.in_order()
    fits_end = _misfit(at_end, gained, pairs) + LEAST_NATS < _misfit(middle, gained, pairs)
    return at_end if fits_end else middle.in_order()


def _gained(velocity: Signal, gyro: Signal, force: Signal, attitude: Signal) -> Signal:
    """Velocity (k, 3) that the specific force gives from its first reading on, in the axes of a body that turns."""
    known = force.between(
        max(gyro.time_s[0], attitude.time_s[0]),
        np.nextafter(min(gyro.time_s[-1], attitude.time_s[-1]), np.inf),
    )
    if len(known) < FEWEST:
        return Signal(np.zeros(1), np.zeros((1, 3)))
    down = np.zeros_like(known.value)
    down[:, 2] = GRAVITY_M_S2
    gravity = to_body(attitude_at(attitude, known.time_s), down)
    acceleration = (
        known.value + gravity - np.cross(gyro.at(known.time_s), np.nan_to_num(velocity.at(known.time_s)))
    )
    steps = 0.5 * (acceleration[1:] + acceleration[:-1]) * np.diff(known.time_s)[:, None]
    return Signal(known.time_s, np.vstack([np.zeros(3), np.cumsum(steps, axis=0)]))


def _misfit(velocity: Signal, gained: Signal, pairs: NDArray[np.bool_]) -> float:
    """How badly the changes of a velocity (n, 3) between the neighbours `pairs` (n - 1,) are those that are gained, in
    nats.

    A constant error of the force and one that grows with time, such as a bias and its drift, are taken off.
    """
    off = np.diff(velocity.value - gained.at(velocity.time_s), axis=0)[pairs]
    columns = np.column_stack([np.ones(len(off)), np.linspace(-1.0, 1.0, len(off))])
    off = off - columns @ np.linalg.lstsq(columns, off, rcond=None)[0]
    usual = np.maximum(np.median(np.abs(off), axis=0), 1e-12)
    bounded = np.clip(off, -SPIKE * usual, SPIKE * usual)
    return float(0.5 * len(off) * np.log(np.maximum(np.mean(bounded**2, axis=0), 1e-24)).sum())
