"""What rounding thruster commands to whole microseconds hides, and the likeliest wrench behind it."""

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.thrusters import allocation_matrix, thrust_curve
from identify.dive import Dive, Signal
from identify.statistics import bulk_std

FAR = 6.0
"""A change of the wrench by more than this many standard deviations of rounding is not rounding."""

LAST = 9
"""Number of commands whose median is the level: half a second of a stock autopilot's log."""


def unrounded_thrusts(asked: Signal, dive: Dive, file: VehicleFile, configuration_name: str) -> Signal:
    """Return each thruster's commanded thrust (n, k), corrected by the smallest change that gives the most likely
    wrench behind the rounded wrench (`unrounded`)."""
    variance = hidden_by_rounding(dive, file, configuration_name)
    allocation = allocation_matrix(file.vehicle.configurations[configuration_name])
    rounded = Signal(asked.time_s, asked.value @ allocation.T)
    change = unrounded_by_run(rounded, variance, dive.breaks_s) - rounded.value
    return Signal(asked.time_s, asked.value + change @ np.linalg.pinv(allocation).T)


def hidden_by_rounding(dive: Dive, file: VehicleFile, configuration_name: str) -> Array:
    """Variance (n, 6) of the part of each command's wrench that rounding to whole microseconds hides: a uniform error
    of one microsecond through the slope of the thrust curve.

    Zero if pulses are not rounded, and if the commanded wrench is recorded too, because the readings that it responds
    to are then recorded as well.
    """
    commands, configuration = dive.thruster_commands, file.vehicle.configurations[configuration_name]
    count = 0 if commands is None else len(commands)
    if dive.pwm is None or count < 2 or (dive.tau_cmd is not None and len(dive.tau_cmd)):
        return np.zeros((count, 6))
    pulses = dive.pwm.value[:, : len(configuration.thrusters)]
    known = np.isfinite(pulses)
    if not np.array_equal(pulses[known], np.round(pulses[known])):
        return np.zeros((count, 6))
    return np.asarray(thrust_slope(pulses, file) ** 2 / 12.0 @ (allocation_matrix(configuration) ** 2).T)


def thrust_slope(pulses_us: Array, file: VehicleFile) -> Array:
    """Slope (n, k) of the thrust curve at pulses (n, k), N per us; at rest for no pulse or no number."""
    curve = thrust_curve(file.vehicle.thrust_curve, file.path.parent)
    sent = np.where(np.isfinite(pulses_us) & (pulses_us > 0), pulses_us, curve.neutral_us)
    return np.asarray(0.5 * (curve.thrust(sent + 1.0) - curve.thrust(sent - 1.0)))


def unrounded_by_run(asked: Signal, variance: Array, breaks_s: Array) -> Array:
    """`unrounded` wrenches (n, 6), run by run."""
    at = np.searchsorted(asked.time_s, breaks_s)
    runs = zip(np.split(asked.value, at), np.split(variance, at), strict=True)
    return np.vstack([unrounded(wrenches, hidden) for wrenches, hidden in runs if len(wrenches)])


def unrounded(asked: Array, variance: Array) -> Array:
    """Return the most likely wrench (n, 6) behind a rounded wrench, given the variance (n, 6) of the rounding.

    A recorded force that is partly rounding is an error in a regressor, and makes the mass too large (Fuller 1987,
    section 1.1). The deviation of a command from the median of the last LAST commands is shrunk by the share of its
    spread that exceeds the spread of rounding (Wiener 1949), and kept whole if it is far larger than rounding ever
    is. Later commands are not used: they respond to readings that are yet to be explained.
    """
    out = asked.copy()
    for column in np.flatnonzero(variance.any(axis=0)).tolist():
        recorded, hidden = asked[:, column], float(np.mean(variance[:, column]))
        past = np.lib.stride_tricks.sliding_window_view(np.pad(recorded, (LAST - 1, 0), mode="edge"), LAST)
        level = np.median(past, axis=1)
        beyond = recorded - level
        spread = bulk_std(beyond) ** 2
        believed = 1.0 - hidden / max(spread, hidden)
        small = 1.0 - hidden / np.maximum(beyond**2, hidden)
        share = np.where(beyond**2 > FAR**2 * hidden, 1.0, np.maximum(believed, small))
        out[:, column] = level + share * beyond
    return out
