"""The degrees of freedom of a dive that are judged, of readings thinned to about the rate that they need."""

from dataclasses import replace

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import (
    PITCH,
    ROLL,
)
from bridge.vehicle.config import Configuration, VehicleFile
from identify.diagnose.filters.regression import LEVELLED
from identify.dive import Dive, Signal
from identify.estimators.axes.axis import Axes
from identify.estimators.axes.build import build_axes
from identify.estimators.likelihood.axis import DAMPING, MASS, AxisLikelihood
from identify.estimators.likelihood.start import StartFit
from identify.ingest.rotation import euler_angles

USUAL_HZ = 25.0
"""Readings a second that thinning keeps, about."""

SLOWEST_LEVELLING_S = 0.25
"""Interval between commands within which an autopilot that levels roll and pitch has answered a tilt: its thrust looks
like a righting moment."""

QUICKEST_S = 0.06
"""Least time constant (mass over damping) of a degree of freedom: three commands of an autopilot's log."""

STILL_RAD = np.deg2rad(0.1)
"""Roll or pitch without thrust and within this rms is held level, and carries no information."""


def thinned(dive: Dive) -> Dive:
    """The dive with gyros and depth thinned to about USUAL_HZ.

    Instantaneous readings are decimated: an average is the reading of no instant, and roll and pitch are fast enough
    for the difference to show. A fibre-optic gyro reads means over intervals, so its readings are averaged.
    """
    return replace(
        dive,
        gyro=_kept(dive.gyro),
        fog=_averaged(dive.fog),
        pressure=_kept(dive.pressure),
        depth=_kept(dive.depth),
    )


def _each(signal: Signal) -> int:
    return max(round(signal.rate_hz / USUAL_HZ), 1)


def _kept(signal: Signal | None) -> Signal | None:
    """Every k-th reading."""
    if signal is None or not len(signal):
        return signal
    k = _each(signal)
    return Signal(signal.time_s[::k], signal.value[::k])


def _averaged(signal: Signal | None) -> Signal | None:
    """Means over k neighbours, at the mean of their times; groups across a gap are dropped."""
    if signal is None or not len(signal) or (k := _each(signal)) < 2:
        return signal
    n = len(signal) // k
    time_s = signal.time_s[: n * k].reshape(n, k)
    value = signal.value[: n * k].reshape(n, k, -1).mean(axis=1)
    regular = np.ptp(time_s, axis=1) < 1.5 * (k - 1) / signal.rate_hz
    return Signal(time_s.mean(axis=1)[regular], value[regular])


def without_quick(start: StartFit, built: Axes, configuration: Configuration) -> Axes:
    """The axes without degrees of freedom that settle within a few commands, or swing or may be levelled within a slow
    sample: the recording misses the thrust in between.

    The first fit is one without causes, and may take a weak thrust for a small inertia: a hull has that of its body.
    """
    quick = {
        problem.axis.dof
        for problem, of_axis in zip(start.joint.problems, start.joint.slices, strict=True)
        if max(np.exp(start.theta[of_axis][MASS]), configuration.rigid_body(problem.axis.dof)[0])
        < QUICKEST_S * _braking_of(problem, start.theta[of_axis])
    }
    left = dict.fromkeys(
        quick, f"it settles within {QUICKEST_S:g} s, too quickly to be told from recorded commands"
    )
    left |= {
        problem.axis.dof: "it swings too quickly for commands that are known every "
        f"{problem.axis.unknown_s:.2g} s"
        for problem, of_axis in zip(start.joint.problems, start.joint.slices, strict=True)
        if problem.axis.stiffness * problem.axis.unknown_s**2 > np.exp(start.theta[of_axis][MASS])
    }
    left |= {
        axis.dof: f"an autopilot may level it between commands that are known every {axis.unknown_s:.2g} s"
        for axis in built.axes
        if axis.dof in LEVELLED and axis.unknown_s > SLOWEST_LEVELLING_S
    }
    kept = tuple(axis for axis in built.axes if axis.dof not in left)
    return replace(built, axes=kept, missing=built.missing | left) if kept and left else built


def _braking_of(problem: AxisLikelihood, theta: Array) -> float:
    """Slope of an axis's drag at its usual speed, N s/m or N m s/rad."""
    quadratic = problem.axis.quadratic + problem.quadratic(theta)
    usual = float(np.sqrt(np.average(problem.axis.speed**2, weights=problem.axis.step_s)))
    return float(np.exp(theta[DAMPING])) + 2.0 * quadratic * usual


def axes_of(dive: Dive, file: VehicleFile, configuration_name: str) -> Axes:
    """The axes of a dive that are judged.

    All its runs have one trim force in common: a steady push is a cause, and a trim of each run would pass for the slow
    part of the disturbance.
    """
    built = build_axes(thinned(dive), file, configuration_name)
    return _without_still(built, dive).with_common_trims()


def _without_still(built: Axes, dive: Dive) -> Axes:
    """The axes without roll and pitch that are held level and unpushed.

    Their little motion is rounding, which noiseless readings turn into a cause.
    """
    if dive.attitude is None:
        return built
    roll, pitch, _ = euler_angles(dive.attitude.value)
    angles = {ROLL: roll, PITCH: pitch}
    still = {dof: float(np.nanstd(angle)) < STILL_RAD for dof, angle in angles.items()}
    left = {dof: "it was held level, and no thruster pushed" for dof in built.unpushed if still.get(dof)}
    kept = tuple(axis for axis in built.axes if axis.dof not in left)
    return replace(built, axes=kept, missing=built.missing | left)
