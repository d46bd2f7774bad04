"""The velocity of an autopilot's own filter: how late it is told and how smooth, found from the dive; and the axes of a
dive with it dated back."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.config import VehicleFile
from identify.dive import Dive, Signal
from identify.estimators.axes import LAGS_FORGOTTEN, Axes, Axis, build_axes, delayed
from identify.estimators.lasting import lasting, too_short
from identify.estimators.lateness import Timing, by_lateness
from identify.estimators.likelihood_axis import MASS_RATIO, AxisLikelihood, likelihood_of, rigid_mass
from identify.estimators.likelihood_joint import alone
from identify.estimators.readings import YAW
from identify.estimators.scoring import climb
from identify.estimators.shared import shared
from identify.estimators.starts import rough_maximum
from identify.forces import wrench
from identify.ingest.rotation import attitude_at, to_body
from identify.side_by_side import side_by_side
from identify.unpushed import refuse_unpushed

Array = NDArray[np.float64]

LATE_S = (0.0, 0.1, 0.2, 0.35, 0.5)
"""Of the velocity, half of it by smoothing: where the search begins, by surge and sway."""

LEAST, MOST = np.array([-0.1, 0.0, 0.0]), np.array([0.8, 0.5, 1.0])
"""Lateness, smoothing and delay, s, that are believed: stamps of pulses and of velocities may be apart, too."""

DELAYS_S = (0.0, 0.1, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0)
"""Of the thrust: where the search for it begins, by yaw, which no filter of velocities hides."""

LAGS_S = (0.05, 0.1, 0.2, 0.3, 0.45)
"""Of thrusters that follow later than the vehicle file says: tried where yaw finds the thrust late by LATE_ENOUGH_S. A
filter's smoothing would take a lag for its own, and yaw alone tells it from a delay."""

LATE_ENOUGH_S = 0.03
LIKELIER = 3.0
"""Nats by which a lag has to do better than a delay in yaw."""

SURGE, SWAY = 0, 1

DELAY_SPREAD_S = 0.1
"""How far from where it is taken to be the thrust's delay may well be."""

ROUGH_S = 150.0
"""Of the middle of a dive: enough to tell where a search begins."""

FAR = 30.0
"""Nats below the best, twice in a row, from which on a grid is not gone on with."""

ENOUGH = 0.5
"""Nats: as far as an axis is climbed here."""

APART = 10.0
"""Nats that another date may cost by itself: it makes other steps of the same readings."""

TURNS, LONGEST_TURN_S, SETTLED_S = 8, 0.2, 0.005
"""An axis that says hardly anything of its timing may ask for any step; none goes further than LONGEST_TURN_S."""


def dated(dive: Dive, file: VehicleFile, name: str) -> Dive:
    """The dive with the velocity of an autopilot's own filter at the times at which it was so, and its smoothing.

    Both are what makes surge and sway agree best with the thrust and with their own turning; by how much the thrust
    itself is late yaw tells, and so much later it is told to be. What is left of them is fitted with each axis
    (`lateness.timing_of`).
    """
    if (
        not dive.velocity_is_filtered
        or dive.velocity is None
        or dive.attitude is None
        or not len(dive.velocity)
    ):
        return dive
    middle = _middle_of(dive)
    rough_s, of_yaw = _rough_delay(middle, file, name)
    lag_s = 0.0
    if of_yaw and rough_s + float(of_yaw[0].timing[0]) > LATE_ENOUGH_S:
        lag_s = _rough_lag(dive, rough_s, file, name)
        if lag_s > 0:
            file, rough_s, of_yaw = _with_lag(file, lag_s), 0.0, []
    rough_late_s, fits = _rough_lateness(middle, rough_s, file, name)
    fits, timing = [*of_yaw, *fits], np.array([rough_late_s, 0.5 * rough_late_s, rough_s])
    best, likeliest, known = -np.inf, timing, fits
    for _ in range(TURNS):
        late_s, smoothing_s, delay_s = timing.tolist()
        early = dated_back(dive, late_s - smoothing_s, smoothing_s)
        fits = _fitted(early, delay_s, file, name, (SURGE, SWAY, YAW), known)
        if (log_posterior := _of_velocity(fits)) < best - APART:
            # Far from where they agree, a step by the slope may lead further off.
            timing = 0.5 * (likeliest + timing)
            continue
        best, likeliest, known = max(best, log_posterior), timing, fits
        further = np.clip(_further(fits), -LONGEST_TURN_S, LONGEST_TURN_S)
        timing = np.clip(timing + further, LEAST, MOST)
        if np.all(np.abs(further) < SETTLED_S):
            break
    late_s, smoothing_s, delay_s = likeliest.tolist()
    found = dated_back(dive, late_s - smoothing_s, smoothing_s)
    return replace(found, thrust_delay_s=delay_s, thrust_lag_s=lag_s)


def _middle_of(dive: Dive) -> Dive:
    start_s, end_s = dive.span_s
    if end_s - start_s < 2 * ROUGH_S:
        return dive
    centre_s = 0.5 * (start_s + end_s)
    return dive.between(centre_s - 0.5 * ROUGH_S, centre_s + 0.5 * ROUGH_S)


def dated_back(dive: Dive, late_s: float, smoothing_s: float) -> Dive:
    """The dive with its velocity late_s earlier, still behind a filter of smoothing_s. It is north-east-down that an
    autopilot tells late and smooths: the body has turned since, on the whole by what it turns in both."""
    velocity, attitude = dive.velocity, dive.attitude
    if velocity is None or attitude is None:
        return dive
    then = attitude_at(attitude, velocity.time_s) * np.array([1.0, -1.0, -1.0, -1.0])
    before = attitude_at(attitude, velocity.time_s - late_s - smoothing_s)
    north_east_down = to_body(then, velocity.value)
    return replace(
        dive,
        velocity=Signal(velocity.time_s - late_s, to_body(before, north_east_down)),
        velocity_late_s=late_s,
        velocity_smoothing_s=smoothing_s,
    )


@dataclass(frozen=True)
class _Fit:
    """An axis alone at the maximum of its posterior: theta, and what its readings alone say of its timing (k,), in s,
    and how sharply."""

    dof: int
    theta: Array
    log_posterior: float
    timing: Array
    precision: Array


def _rough_delay(dive: Dive, file: VehicleFile, name: str) -> tuple[float, list[_Fit]]:
    """The delay of the thrust among DELAYS_S that yaw agrees with best, and yaw's fit there; 0 without yaw."""
    found: list[tuple[float, list[_Fit]]] = []
    fits: list[_Fit] = []
    built, forces = build_axes(dive, file, name, (YAW,)), wrench(dive, file, name)
    for delay_s in DELAYS_S:
        fits = _fits_of(delayed(built, forces, delay_s), file, name, fits)
        if fits:
            found.append((delay_s, fits))
        if _is_past([one.log_posterior for _, (one,) in found]):
            break
    return max(found, key=lambda one: one[1][0].log_posterior, default=(0.0, []))


def _rough_lag(dive: Dive, delay_s: float, file: VehicleFile, name: str) -> float:
    """The lag of the thrusters beyond the vehicle file's that yaw agrees with best; 0 where a delay does as well."""
    later = _settled_on(dive, file, max(LAGS_S))
    fits = _fitted(later, delay_s, file, name, (YAW,), ())
    if not fits:
        return 0.0
    by_delay = fits[0].log_posterior
    found: list[tuple[float, float]] = []
    for lag_s in LAGS_S:
        fits = _fitted(later, 0.0, _with_lag(file, lag_s), name, (YAW,), fits)
        if fits:
            found.append((lag_s, fits[0].log_posterior))
        if _is_past([value for _, value in found]):
            break
    best = max(range(len(found)), key=lambda k: found[k][1], default=-1)
    if best < 0 or found[best][1] < by_delay + LIKELIER:
        return 0.0
    lags_s, values = np.array(found[max(best - 1, 0) : best + 2]).T
    if len(lags_s) < 3:
        return found[best][0]
    bend, slope, _ = np.polyfit(lags_s, values, 2)
    return float(np.clip(-0.5 * slope / bend, lags_s[0], lags_s[-1])) if bend < 0 else found[best][0]


def _with_lag(file: VehicleFile, lag_s: float) -> VehicleFile:
    """With thrusters that follow so much later."""
    curve = replace(file.vehicle.thrust_curve, lag_s=file.vehicle.thrust_curve.lag_s + lag_s)
    return replace(file, vehicle=replace(file.vehicle, thrust_curve=curve))


def _settled_on(dive: Dive, file: VehicleFile, lag_s: float) -> Dive:
    """With rates of turn and angles from when thrusters of that lag no longer know what was before the first command:
    likelihoods of different lags are then of the same readings."""
    if dive.pwm is None or dive.gyro is None:
        return dive
    start_s = float(dive.pwm.time_s[0]) + LAGS_FORGOTTEN * (file.vehicle.thrust_curve.lag_s + lag_s)
    attitude = None if dive.attitude is None else dive.attitude.between(start_s, np.inf)
    return replace(dive, gyro=dive.gyro.between(start_s, np.inf), attitude=attitude)


def _rough_lateness(dive: Dive, delay_s: float, file: VehicleFile, name: str) -> tuple[float, list[_Fit]]:
    """The lateness among LATE_S that surge and sway agree with best under thrust so late, and their fits there."""
    found: list[tuple[float, list[_Fit]]] = []
    fits: list[_Fit] = []
    for late_s in LATE_S:
        early = dated_back(dive, 0.5 * late_s, 0.5 * late_s)
        fits = _fitted(early, delay_s, file, name, (SURGE, SWAY), fits)
        found.append((late_s, fits))
        if _is_past([_of_velocity(one) for _, one in found]):
            break
    return max(found, key=lambda one: _of_velocity(one[1]))


def _is_past(log_posteriors: Sequence[float]) -> bool:
    """Whether the best of a row of them is two back and far above both since."""
    return len(log_posteriors) > 2 and max(log_posteriors[-2:]) < max(log_posteriors) - FAR


def _of_velocity(fits: Sequence[_Fit]) -> float:
    return sum(fit.log_posterior for fit in fits if fit.dof in (SURGE, SWAY))


def _further(fits: Sequence[_Fit]) -> Array:
    """By how much more, in s, the lateness and the smoothing of the velocity, by surge and sway, and the delay of the
    thrust, by yaw, are than these axes were fitted with."""
    found, precision = np.zeros(2), 1e-9 * np.eye(2)
    later_s = 0.0
    for fit in fits:
        if len(fit.timing) == 1:
            later_s = float(fit.timing[0])
        else:
            found, precision = found + fit.precision @ fit.timing, precision + fit.precision
    velocity = np.linalg.solve(precision, found)
    # Thrust that comes later makes the velocity seem less late.
    return np.array([velocity[0] - later_s, velocity[1], later_s])


def _fitted(
    dive: Dive, delay_s: float, file: VehicleFile, name: str, dofs: tuple[int, ...], near: Sequence[_Fit]
) -> list[_Fit]:
    """Each of the axes alone under thrust so late, from where it was `near`; none of those that the recording lacks."""
    curve = replace(file.vehicle.thrust_curve, delay_s=file.vehicle.thrust_curve.delay_s + delay_s)
    late = replace(file, vehicle=replace(file.vehicle, thrust_curve=curve))
    return _fits_of(build_axes(dive, late, name, dofs), file, name, near)


def _fits_of(built: Axes, file: VehicleFile, name: str, near: Sequence[_Fit]) -> list[_Fit]:
    """Each of the axes alone, from where it was `near`; none of those that have no solution."""
    shape = file.vehicle.configurations[name]
    masses = np.array([MASS_RATIO * rigid_mass(shape, dof) for dof in range(6)])
    starts = {fit.dof: fit.theta for fit in near}

    def fit(axis: Axis) -> _Fit | None:
        if not axis.timing:
            own = Timing(by_lateness(axis.force, 0.5 * axis.step_s), DELAY_SPREAD_S)
            axis = replace(axis, timing=(own,))
        problem = likelihood_of(axis, shape, masses, (), "both")
        if axis.dof in starts:
            with suppress(np.linalg.LinAlgError):
                return _climbed(problem, starts[axis.dof])
        try:
            rough = rough_maximum(problem, rigid_mass(shape, axis.dof), shape.model, ENOUGH)
            return _climbed(problem, rough.theta)
        except np.linalg.LinAlgError:
            # An axis without a solution says nothing of timing; the fit of all axes says why.
            return None

    found = side_by_side(fit, built.axes)
    return [one for one in found if one is not None]


def _climbed(problem: AxisLikelihood, near: Array) -> _Fit:
    """The fit of an axis alone from near by; raises LinAlgError where there is none."""
    place = slice(problem.noise_place - len(problem.axis.timing), problem.noise_place)
    theta = near.copy()
    # What was near was as late by its own timing, which the dive is dated by since.
    theta[place] = 0.0
    maximum = climb(problem.slowed(theta), theta, ENOUGH, alone)
    precision = np.linalg.inv(np.linalg.inv(maximum.precision)[place, place])
    told: Array = np.asarray(precision - np.diag(problem.prior_precision[place]), dtype=np.float64)
    pull: Array = np.asarray(precision @ maximum.theta[place], dtype=np.float64)
    timing = np.asarray(np.linalg.solve(told, pull), dtype=np.float64)
    if not np.isfinite(timing).all():
        raise np.linalg.LinAlgError("its readings say nothing of its timing")
    off = maximum.theta - problem.prior_mean
    log_posterior = maximum.log_likelihood - 0.5 * float(problem.prior_precision @ off**2)
    return _Fit(problem.axis.dof, maximum.theta, log_posterior, timing, told)


def lasting_axes(dive: Dive, file: VehicleFile, name: str) -> Axes:
    """Those that were read for long enough to be identified; raises FitError where none was, where nothing was pushed,
    and as `build_axes`."""
    lasting(dive)
    refuse_unpushed(dive, file, name)
    built = build_axes(dated(dive, file, name), file, name)
    short = {axis.dof: reason for axis in built.axes if (reason := too_short(dive, axis.dof))}
    kept = tuple(axis for axis in built.axes if axis.dof not in short)
    return replace(built, axes=kept, missing=built.missing | short)


shared_axes = shared(lasting_axes)
"""Of a dive, a vehicle file and a configuration: its `Axes`, for all methods that hold them."""
