"""The velocity of an autopilot's own filter: how late it is told and how smooth, found from the dive; and the axes of a
dive with it dated back."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.config import VehicleFile
from identify.dive import Dive, Signal
from identify.estimators.axes import Axes, build_axes
from identify.estimators.lasting import lasting, too_short
from identify.estimators.likelihood_axis import MASS_RATIO, likelihood_of, rigid_mass
from identify.estimators.likelihood_joint import alone
from identify.estimators.scoring import climb
from identify.estimators.shared import shared
from identify.ingest.rotation import attitude_at, to_body
from identify.unpushed import refuse_unpushed

Array = NDArray[np.float64]

USUAL, MOST = np.array([0.15, 0.08]), np.array([0.8, 0.5])
"""Lateness and smoothing, s: where the search begins, and the most that a filter is believed to have."""

ENOUGH = 0.5
"""Nats: as far as an axis is climbed here."""

TURNS, SETTLED_S = 5, 0.005


def dated(dive: Dive, file: VehicleFile, name: str) -> Dive:
    """The dive with the velocity of an autopilot's own filter at the times at which it was so, and its smoothing.

    Both are what makes surge and sway agree best with the thrust and with their own turning; what is left of them is
    fitted with each axis (`lateness.timing_of`).
    """
    if (
        not dive.velocity_is_filtered
        or dive.velocity is None
        or dive.attitude is None
        or not len(dive.velocity)
    ):
        return dive
    timing = USUAL
    for _ in range(TURNS):
        further = _further(dated_back(dive, *timing.tolist()), file, name)
        timing = np.clip(timing + further, 0.0, MOST)
        if np.all(np.abs(further) < SETTLED_S):
            break
    return dated_back(dive, *timing.tolist())


def dated_back(dive: Dive, late_s: float, smoothing_s: float) -> Dive:
    """The dive with its velocity late_s earlier. It is north-east-down that a filter tells late: the body has turned
    since."""
    velocity, attitude = dive.velocity, dive.attitude
    if velocity is None or attitude is None:
        return dive
    then = attitude_at(attitude, velocity.time_s) * np.array([1.0, -1.0, -1.0, -1.0])
    before = attitude_at(attitude, velocity.time_s - late_s)
    north_east_down = to_body(then, velocity.value)
    return replace(
        dive,
        velocity=Signal(velocity.time_s - late_s, to_body(before, north_east_down)),
        velocity_late_s=late_s,
        velocity_smoothing_s=smoothing_s,
    )


def _further(dive: Dive, file: VehicleFile, name: str) -> Array:
    """By how much later still, and smoother, than it is taken to be the velocity is, (2,) in s, by surge and sway."""
    shape = file.vehicle.configurations[name]
    masses = np.array([MASS_RATIO * rigid_mass(shape, dof) for dof in range(6)])
    found, precision = np.zeros(2), 1e-9 * np.eye(2)
    for axis in build_axes(dive, file, name).axes:
        if axis.dof < 2 and axis.timing:
            problem = likelihood_of(axis, shape, masses, (), "both")
            theta = climb(problem, problem.prior_mean, ENOUGH, alone).theta
            maximum = climb(problem.slowed(theta), theta, ENOUGH, alone)
            place = slice(problem.noise_place - len(axis.timing), problem.noise_place)
            own = np.linalg.inv(np.linalg.inv(maximum.precision)[place, place])
            found, precision = found + own @ maximum.theta[place], precision + own
    return np.asarray(np.linalg.solve(precision, found))


def lasting_axes(dive: Dive, file: VehicleFile, name: str) -> Axes:
    """Those that were read for long enough to be identified; raises FitError where none was, where nothing was pushed, and as
    `build_axes`."""
    lasting(dive)
    refuse_unpushed(dive, file, name)
    built = build_axes(dated(dive, file, name), file, name)
    short = {axis.dof: reason for axis in built.axes if (reason := too_short(dive, axis.dof))}
    kept = tuple(axis for axis in built.axes if axis.dof not in short)
    return replace(built, axes=kept, missing=built.missing | short)


shared_axes = shared(lasting_axes)
"""Of a dive, a vehicle file and a configuration: its `Axes`, for all methods that hold them."""
