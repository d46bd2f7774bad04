"""Puts the inputs of an algebraic fit on one grid: zero-phase low-pass, differentiation, body velocity at the origin.

The source paper "processed the data to increase the signal-to-noise ratio" without saying how. Here it is a
Butterworth low-pass run forward and backward (scipy's `sosfiltfilt`: no phase shift, gain 1/2 at the cut-off, order
doubled). The same filter runs on velocity and on the wrench, so that the linear model still holds between them.
"""

from dataclasses import dataclass

import numpy as np

from bridge.arrays import Array
from bridge.errors import FitError
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive, Signal
from identify.ingest.rotation import attitude_at
from identify.thrust.wrench import wrench

ORDER = 4
SHORTEST_S = 20.0
SLOWEST_COMMAND_HZ = 5.0


@dataclass(frozen=True)
class AlignedDive:
    """Samples on one uniform grid: `time_s` (n,), `nu`, `nu_dot`, `tau` (n, 6) in SI, `attitude` (n, 4) w x y z.

    `valid` (n,): whether bottom velocity was known around this time. `has` (6,): whether this velocity was measured
    at all.
    """

    time_s: Array
    nu: Array
    nu_dot: Array
    tau: Array
    attitude: Array
    valid: np.ndarray[tuple[int], np.dtype[np.bool_]]
    has: np.ndarray[tuple[int], np.dtype[np.bool_]]
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.time_s)


def low_pass(value: Array, rate_hz: float, cutoff_hz: float) -> Array:
    """Zero-phase Butterworth along the first axis; the value unchanged if the cut-off is at or above Nyquist."""
    if cutoff_hz >= rate_hz / 2:
        return value
    from scipy.signal import butter, sosfiltfilt  # a second to load, and the app shows curves without it

    sections = butter(ORDER, cutoff_hz, fs=rate_hz, output="sos")
    pad = min(len(value) - 1, int(3 * rate_hz / cutoff_hz))
    filtered: Array = sosfiltfilt(sections, value, axis=0, padlen=pad)
    return filtered


def derivative(value: Array, rate_hz: float) -> Array:
    """Central differences along the first axis, one-sided at the ends."""
    slope: Array = np.gradient(value, 1 / rate_hz, axis=0)
    return slope


def aligned(
    dive: Dive,
    file: VehicleFile,
    configuration_name: str,
    rate_hz: float = 10.0,
    cutoff_hz: float = 1.0,
) -> AlignedDive:
    """Return the velocity of the origin, its derivative and the wrench on a common grid.

    Linear velocity comes from the DVL, carried from the transducer to the origin by the rates; yaw rate comes from
    the FOG if there is one, otherwise from the gyro. Unmeasured components are zero, and `has` marks them. Raises
    FitError if velocity, rates or forces are missing or overlap for less than 20 s, or if commands are rare.
    """
    forces = wrench(dive, file, configuration_name)
    measured = [s for s in (dive.velocity, dive.gyro, dive.fog) if s is not None and len(s) > 1]
    if not measured:
        raise FitError(
            "neither velocity nor rates of turn are recorded: nothing can be identified", of=dive.source
        )
    apart_s = forces.sampled_s or (
        float(np.median(np.diff(forces.time_s))) if len(forces.time_s) > 1 else np.inf
    )
    commands_hz = 1 / max(apart_s, 1e-9)
    if commands_hz < SLOWEST_COMMAND_HZ:
        raise FitError(
            f"thruster commands come at {commands_hz:.1f} Hz, too slow to know the force between them; "
            f"record at least {SLOWEST_COMMAND_HZ:.0f} Hz",
            of=dive.source,
        )
    start = max(float(forces.time_s[0]), *(float(s.time_s[0]) for s in measured))
    end = min(float(forces.time_s[-1]), *(float(s.time_s[-1]) for s in measured))
    if end - start < SHORTEST_S:
        raise FitError(
            f"velocity, rates and forces overlap for {max(end - start, 0):.1f} s, "
            f"at least {SHORTEST_S:.0f} s are needed; dive longer",
            of=dive.source,
        )
    time_s = start + np.arange(int((end - start) * rate_hz) + 1) / rate_hz
    rates = _rates(dive, time_s)
    at_transducer, valid = _velocity(dive, time_s)
    dvl = file.vehicle.sensors.dvl
    arm = np.zeros(3) if dvl is None else np.asarray(dvl.mounting.position_m)
    nu = np.column_stack((at_transducer - np.cross(rates, arm), rates))
    half = 0.5 / rate_hz
    tau = forces.mean_between(time_s - half, time_s + half)
    smooth = low_pass(nu, rate_hz, cutoff_hz)
    return AlignedDive(
        time_s,
        smooth,
        derivative(smooth, rate_hz),
        low_pass(tau, rate_hz, cutoff_hz),
        _attitude(dive, time_s),
        valid,
        np.array([*_known(dive.velocity), *_known(dive.gyro)[:2], _known(dive.yaw_rate)[0]]),
        forces.notes,
    )


def _known(signal: Signal | None) -> list[bool]:
    """Whether each column of a signal is known at any time; of none, for all that it may have."""
    return [False] * 3 if signal is None else [bool(np.isfinite(column).any()) for column in signal.value.T]


def _velocity(dive: Dive, time_s: Array) -> tuple[Array, np.ndarray[tuple[int], np.dtype[np.bool_]]]:
    """Velocity (n, 3), and whether a valid sample lies within one and a half periods."""
    if dive.velocity is None:
        return np.zeros((len(time_s), 3)), np.ones(len(time_s), np.bool_)
    known_s = dive.velocity.in_part().time_s
    if len(known_s) < 2:
        return np.zeros((len(time_s), 3)), np.zeros(len(time_s), np.bool_)
    after = np.clip(np.searchsorted(known_s, time_s), 1, len(known_s) - 1)
    nearest = np.minimum(np.abs(time_s - known_s[after]), np.abs(time_s - known_s[after - 1]))
    return np.nan_to_num(dive.velocity.at(time_s)), nearest <= 1.5 / dive.velocity.rate_hz


def _rates(dive: Dive, time_s: Array) -> Array:
    rates = np.zeros((len(time_s), 3)) if dive.gyro is None else dive.gyro.at(time_s)
    if dive.yaw_rate is not None:
        rates[:, 2] = dive.yaw_rate.at(time_s)[:, 0]
    return np.nan_to_num(rates)


def _attitude(dive: Dive, time_s: Array) -> Array:
    """Attitude at the times, (n, 4); level if the recording has no attitude."""
    if dive.attitude is None or len(dive.attitude) < 2:
        return np.tile([1.0, 0.0, 0.0, 0.0], (len(time_s), 1))
    return attitude_at(dive.attitude, time_s)
