"""Dates what ArduPilot's low-pass filters delay at the motion itself: rates of turn and accelerations.

Both filters are Butterworth's of second order, whose delay of all that is slow beside their corner f is
sqrt(2) / (2 pi f): 11 ms at the 20 Hz that ArduSub has by default. Angles and velocities don't come through them. A
recording without the parameter is taken as it is: it need not be the autopilot's own.
"""

import math
from collections.abc import Mapping
from typing import Final

from identify.dive import Signal

CORNERS: Final = {"gyro": "INS_GYRO_FILTER", "specific_force": "INS_ACCEL_FILTER"}
"""Parameters with the corner frequency of each signal's filter, Hz; 0 for no filter."""


def delay_s(corner_hz: float) -> float:
    """Delay of a filter with this corner; 0 without one."""
    return math.sqrt(0.5) / (math.pi * corner_hz) if corner_hz > 0.0 else 0.0


def before_low_pass(
    signals: Mapping[str, Signal | None], parameters: Mapping[str, float]
) -> dict[str, Signal | None]:
    """The signals of an ArduPilot vehicle, dated before its filters; as far as their corners are known."""
    dated = dict(signals)
    for name, parameter in CORNERS.items():
        if (signal := dated.get(name)) is not None:
            late_s = delay_s(parameters.get(parameter, 0.0))
            dated[name] = Signal(signal.time_s - late_s, signal.value)
    return dated
