"""What rounding thruster commands to whole microseconds hides, and the likeliest wrench behind it."""

from pathlib import Path

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.config import Vehicle, VehicleFile
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
    variance = hidden_by_rounding(dive, file.vehicle, file.path.parent, configuration_name)
    allocation = allocation_matrix(file.vehicle.configurations[configuration_name])
    rounded = Signal(asked.time_s, asked.value @ allocation.T)
    change = unrounded_by_run(rounded, variance, dive.breaks_s) - rounded.value
    return Signal(asked.time_s, asked.value + change @ np.linalg.pinv(allocation).T)


def hidden_by_rounding(dive: Dive, vehicle: Vehicle, directory: Path, configuration_name: str) -> Array:
    """Variance (n, 6) of the part of each command's wrench that rounding to whole microseconds hides. Zero if the
    commanded wrench is recorded too, because the readings that it responds to are then recorded as well."""
    commands = dive.thruster_commands
    if dive.pwm is None or (dive.tau_cmd is not None and len(dive.tau_cmd)):
        return np.zeros((0 if commands is None else len(commands), 6))
    return _rounding(dive.pwm, vehicle, directory, configuration_name)


def _rounding(pwm: Signal, vehicle: Vehicle, directory: Path, configuration_name: str) -> Array:
    """Variance (n, 6) of the part of each command's wrench that rounding hides: a uniform error of one microsecond
    through the slope of the thrust curve. Zero if pulses are not rounded."""
    configuration = vehicle.configurations[configuration_name]
    pulses = pwm.value[:, : len(configuration.thrusters)]
    known = np.isfinite(pulses)
    if len(pwm) < 2 or not np.array_equal(pulses[known], np.round(pulses[known])):
        return np.zeros((len(pwm), 6))
    slope = thrust_slope(pulses, vehicle, directory)
    return np.asarray(slope**2 / 12.0 @ (allocation_matrix(configuration) ** 2).T)


def thrust_slope(pulses_us: Array, vehicle: Vehicle, directory: Path) -> Array:
    """Slope (n, k) of the thrust curve at pulses (n, k), N per us; at rest for no pulse or no number."""
    curve = thrust_curve(vehicle.thrust_curve, directory)
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
