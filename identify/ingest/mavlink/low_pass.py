"""Undoes an autopilot's low-pass filters of rates of turn and accelerations.

Both are Butterworth filters of second order. They delay motion far slower than their corner f by sqrt(2) / (2 pi f):
11 ms at ArduSub's default of 20 Hz. Angles and velocities are not filtered. A recording without the parameter stays
unchanged, since it may not be the autopilot's own.

Motion at half of the corner is delayed by 0.05 rad more and weakened by 3 %. A quiet gyro shows even that: from a
simulated ArduSub, yaw's drag came out 4 % too large. If the rates are sampled fast enough, a filter over each rate and
its neighbours undoes both effects up to UP_TO.
"""

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from bridge.arrays import Array
from identify.dive import Signal

REACH: Final = 2
"""Neighbours on each side in the filter over the rates of turn."""

UP_TO: Final = 0.6
"""Share of the corner up to which the filter is undone: less would leave turns, more would raise noise."""

FASTEST: Final = 0.3
"""Share of the sampling rate that UP_TO may reach."""

UNEVEN: Final = 0.1
"""Largest error of the steps to the neighbours, as a share: a rate next to a lost message stays unchanged."""


def delay_s(corner_hz: float) -> float:
    """Delay of a filter with this corner; 0 for no filter."""
    return math.sqrt(0.5) / (math.pi * corner_hz) if corner_hz > 0.0 else 0.0


def before_low_pass(
    signals: Mapping[str, Signal | None], corners: Mapping[str, str], parameters: Mapping[str, float]
) -> dict[str, Signal | None]:
    """The signals of a vehicle with an autopilot, dated before its filters; as far as their corners are known.

    `corners` are the parameters with the corner frequency of each signal's filter, Hz; 0 for no filter.
    """
    dated = dict(signals)
    for name, parameter in corners.items():
        if (signal := dated.get(name)) is not None:
            corner_hz = parameters.get(parameter, 0.0)
            if name == "gyro":
                signal = undone(signal, corner_hz)
            dated[name] = Signal(signal.time_s - delay_s(corner_hz), signal.value)
    return dated


def undone(rates: Signal, corner_hz: float) -> Signal:
    """Rates of turn (n, 3) behind the filter, as its delay alone would leave them; as they are if they come too
    seldom for that."""
    if corner_hz <= 0.0 or UP_TO * corner_hz > FASTEST * rates.rate_hz or len(rates) <= 2 * REACH:
        return rates
    step_s, value = 1.0 / rates.rate_hz, rates.value.copy()
    windows = np.lib.stride_tricks.sliding_window_view(rates.value, 2 * REACH + 1, axis=0)
    steps_s = np.lib.stride_tricks.sliding_window_view(np.diff(rates.time_s), 2 * REACH)
    even = (np.abs(steps_s - step_s) < UNEVEN * step_s).all(axis=1)
    value[REACH:-REACH][even] = windows[even] @ _weights(corner_hz, step_s)
    return Signal(rates.time_s, value)


def _weights(corner_hz: float, step_s: float) -> Array:
    """Weights (2 REACH + 1,) of a reading and its neighbours that undo best all but the delay."""
    angle = np.linspace(0.0, UP_TO, 100)
    passed = np.exp(1j * math.sqrt(2.0) * angle) / (1.0 + 1j * math.sqrt(2.0) * angle - angle**2)
    neighbour = np.arange(-REACH, REACH + 1)
    shifted = np.exp(2j * np.pi * corner_hz * step_s * np.outer(angle, neighbour)) * passed[:, None]
    equations = np.vstack([shifted.real, shifted.imag])
    wanted = np.concatenate([np.ones(len(angle)), np.zeros(len(angle))])
    return np.asarray(np.linalg.lstsq(equations, wanted, rcond=None)[0])
