"""Lateness and smoothing of an autopilot's own velocity, and a dive's axes dated by them.

Both are fitted until surge and sway agree best with the thrust and with their own turning; yaw, which the gyro
measures directly, gives the delay of the thrust itself.
"""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import SURGE, SWAY, YAW
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive, Signal
from identify.estimators.axes.axis import Axes, Axis
from identify.estimators.axes.build import LAGS_FORGOTTEN, build_axes
from identify.estimators.axes.forces import axes_with_delay
from identify.estimators.likelihood.axis import MASS, AxisLikelihood
from identify.estimators.likelihood.fit import rough_maximum
from identify.estimators.likelihood.priors import MASS_RATIO, likelihood_of
from identify.estimators.likelihood.scoring import climb
from identify.estimators.refusals import lasting, refuse_unmoved, refuse_unpushed, too_short
from identify.estimators.timing.lateness import Timing
from identify.estimators.timing.thrust_delay import DELAYS_S
from identify.ingest.rotation import attitude_at, to_body
from identify.threads import shared, side_by_side
from identify.thrust.wrench import wrench

LATE_S = (0.0, 0.1, 0.2, 0.35, 0.5)
"""Start values of the velocity's delay, half of it from smoothing, to be compared by surge and sway."""

LEAST, MOST = np.array([-0.1, 0.0, 0.0]), np.array([0.8, 0.5, 1.0])
"""Bounds of lateness, smoothing and thrust delay, s. Lateness may be negative, because the stamps of pulses and of
velocities may differ too."""

LAGS_S = (0.05, 0.1, 0.2, 0.3, 0.45)
"""Extra lags of the thrusters beyond the vehicle file, tried if yaw finds the thrust late by LATE_ENOUGH_S. A
filter's smoothing can't be separated from a lag, and only yaw distinguishes a lag from a delay."""

LATE_ENOUGH_S = 0.03
LIKELIER = 3.0
"""A lag must be this much more likely than a delay in yaw, in nats."""


DELAY_SPREAD_S = 0.1
"""Prior standard deviation of the thrust delay about its assumed value."""

ROUGH_S = 150.0
"""Length of the middle part of a dive: enough to choose start values."""

FAR = 30.0
"""A grid search stops after two successive values this many nats below the best."""

ENOUGH = 0.5
"""Convergence limit of the climbs here, in nats."""

APART = 10.0
"""Loss of log posterior, in nats, that a new date may cause by itself, because it divides the same readings into
other steps."""

TURNS, LONGEST_TURN_S, SETTLED_S = 8, 0.2, 0.005
"""Limits of the search. An axis with hardly any information on its timing may ask for any step; none is longer than
LONGEST_TURN_S."""


@dataclass(frozen=True)
class _Fit:
    """Fit of an axis alone at the maximum of its posterior: theta, and the estimate of its timing (k,), in s, and its
    precision, both from its readings alone."""

    dof: int
    theta: Array
    log_posterior: float
    timing: Array
    precision: Array


def dated(dive: Dive, file: VehicleFile, configuration_name: str) -> Dive:
    """Return the dive with an autopilot's filtered velocity dated at the time of the motion, and with its smoothing.

    Lateness and smoothing are those at which surge and sway agree best with the thrust and with their own turning.
    Yaw gives the delay of the thrust itself, which the result carries as `thrust_delay_s`. Remaining timing errors
    are fitted with each axis (`lateness.timing_of`).
    """
    if (
        not dive.velocity_is_filtered
        or dive.velocity is None
        or dive.attitude is None
        or not len(dive.velocity)
    ):
        return dive
    middle = _middle_of(dive)
    rough_s, of_yaw = _rough_delay(middle, file, configuration_name)
    lag_s = 0.0
    if of_yaw and rough_s + float(of_yaw[0].timing[0]) > LATE_ENOUGH_S:
        lag_s = _rough_lag(dive, rough_s, file, configuration_name)
        if lag_s > 0:
            file, rough_s, of_yaw = _with_lag(file, lag_s), 0.0, []
    agreed = _agreed(dive, file, configuration_name, middle, (rough_s, of_yaw), (SURGE, SWAY, YAW))
    if agreed.delay_s > LATE_ENOUGH_S and agreed.late_s < agreed.smoothing_s:
        # No filter tells a velocity before the motion: surge and sway may contradict the delay that yaw seems to show.
        other = _agreed(dive, file, configuration_name, middle, (0.0, []), (SURGE, SWAY))
        agreed = other if other.log_posterior > agreed.log_posterior + FAR else agreed
    result = dated_back(dive, agreed.late_s - agreed.smoothing_s, agreed.smoothing_s)
    return replace(result, thrust_delay_s=agreed.delay_s, thrust_lag_s=lag_s)


@dataclass(frozen=True)
class _Agreed:
    """Lateness, smoothing and thrust delay, and the log posterior of surge and sway there."""

    late_s: float
    smoothing_s: float
    delay_s: float
    log_posterior: float


def _agreed(
    dive: Dive,
    file: VehicleFile,
    configuration_name: str,
    middle: Dive,
    delayed_yaw: tuple[float, list[_Fit]],
    dofs: tuple[int, ...],
) -> _Agreed:
    """Lateness, smoothing and thrust delay at which surge and sway agree best with the thrust, and yaw with its
    delay if it is among `dofs`; delayed_yaw: a rough delay and yaw's fit there; middle: the part of the dive that
    tells rough values."""
    rough_s, of_yaw = delayed_yaw
    rough_late_s, fits = _rough_lateness(middle, rough_s, file, configuration_name)
    fits, timing = [*of_yaw, *fits], np.array([rough_late_s, 0.5 * rough_late_s, rough_s])
    best, likeliest, known = -np.inf, timing, fits
    for _ in range(TURNS):
        late_s, smoothing_s, delay_s = timing.tolist()
        early = dated_back(dive, late_s - smoothing_s, smoothing_s)
        fits = _fitted(early, delay_s, file, configuration_name, dofs, known)
        if (agreement := _of_velocity(fits)) < best - APART:
            # Far from the best agreement, a step along the slope may lead further away.
            timing = 0.5 * (likeliest + timing)
            continue
        best, likeliest, known = max(best, agreement), timing, fits
        further = np.clip(_further(fits, delay_s), -LONGEST_TURN_S, LONGEST_TURN_S)
        timing = np.clip(timing + further, LEAST, MOST)
        if np.all(np.abs(further) < SETTLED_S):
            break
    late_s, smoothing_s, delay_s = likeliest.tolist()
    return _Agreed(late_s, smoothing_s, delay_s, best)


def _middle_of(dive: Dive) -> Dive:
    start_s, end_s = dive.span_s
    if end_s - start_s < 2 * ROUGH_S:
        return dive
    centre_s = 0.5 * (start_s + end_s)
    return dive.between(centre_s - 0.5 * ROUGH_S, centre_s + 0.5 * ROUGH_S)


def dated_back(dive: Dive, late_s: float, smoothing_s: float) -> Dive:
    """Return the dive with its velocity late_s earlier, still behind a filter of smoothing_s. The autopilot delays
    and smooths the velocity in north-east-down, and the body has turned meanwhile, on average over late_s +
    smoothing_s. So the velocity is turned into body axes with the attitude of that earlier time."""
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


def _rough_delay(dive: Dive, file: VehicleFile, configuration_name: str) -> tuple[float, list[_Fit]]:
    """The thrust delay among DELAYS_S that fits yaw best, and yaw's fit there; 0 without yaw."""
    tried: list[tuple[float, list[_Fit]]] = []
    fits: list[_Fit] = []
    built, forces = build_axes(dive, file, configuration_name, (YAW,)), wrench(dive, file, configuration_name)
    for delay_s in DELAYS_S:
        fits = _fits_of(axes_with_delay(built, forces, delay_s), file, configuration_name, fits)
        if fits:
            tried.append((delay_s, fits))
        if _is_past([each.log_posterior for _, (each,) in tried]):
            break
    return max(tried, key=lambda each: each[1][0].log_posterior, default=(0.0, []))


def _rough_lag(dive: Dive, delay_s: float, file: VehicleFile, configuration_name: str) -> float:
    """The extra lag of the thrusters that fits yaw best; 0 if a delay does as well."""
    later = _settled_on(dive, file, max(LAGS_S))
    fits = _fitted(later, delay_s, file, configuration_name, (YAW,), ())
    if not fits:
        return 0.0
    by_delay = fits[0].log_posterior
    tried: list[tuple[float, float]] = []
    for lag_s in LAGS_S:
        fits = _fitted(later, 0.0, _with_lag(file, lag_s), configuration_name, (YAW,), fits)
        if fits:
            tried.append((lag_s, fits[0].log_posterior))
        if _is_past([value for _, value in tried]):
            break
    best = max(range(len(tried)), key=lambda k: tried[k][1], default=-1)
    if best < 0 or tried[best][1] < by_delay + LIKELIER:
        return 0.0
    lags_s, values = np.array(tried[max(best - 1, 0) : best + 2]).T
    if len(lags_s) < 3:
        return tried[best][0]
    bend, slope, _ = np.polyfit(lags_s, values, 2)
    return float(np.clip(-0.5 * slope / bend, lags_s[0], lags_s[-1])) if bend < 0 else tried[best][0]


def _with_lag(file: VehicleFile, lag_s: float) -> VehicleFile:
    """The vehicle file with thrusters whose lag is `lag_s` longer."""
    curve = replace(file.vehicle.thrust_curve, lag_s=file.vehicle.thrust_curve.lag_s + lag_s)
    return replace(file, vehicle=replace(file.vehicle, thrust_curve=curve))


def _settled_on(dive: Dive, file: VehicleFile, lag_s: float) -> Dive:
    """The dive with rates of turn and angles only from the time at which thrusters of that lag have forgotten their
    state before the first command. Likelihoods of different lags then use the same readings."""
    commands = dive.thruster_commands
    if commands is None or dive.gyro is None:
        return dive
    start_s = float(commands.time_s[0]) + LAGS_FORGOTTEN * (file.vehicle.thrust_curve.lag_s + lag_s)
    attitude = None if dive.attitude is None else dive.attitude.between(start_s, np.inf)
    return replace(dive, gyro=dive.gyro.between(start_s, np.inf), attitude=attitude)


def _rough_lateness(
    dive: Dive, delay_s: float, file: VehicleFile, configuration_name: str
) -> tuple[float, list[_Fit]]:
    """The lateness among LATE_S that fits surge and sway best with thrust delayed by `delay_s`, and their fits
    there."""
    tried: list[tuple[float, list[_Fit]]] = []
    fits: list[_Fit] = []
    for late_s in LATE_S:
        early = dated_back(dive, 0.5 * late_s, 0.5 * late_s)
        fits = _fitted(early, delay_s, file, configuration_name, (SURGE, SWAY), fits)
        tried.append((late_s, fits))
        if _is_past([_of_velocity(each) for _, each in tried]):
            break
    return max(tried, key=lambda each: _of_velocity(each[1]))


def _is_past(log_posteriors: Sequence[float]) -> bool:
    """Whether the last two values both lie far below the best before them."""
    return len(log_posteriors) > 2 and max(log_posteriors[-2:]) < max(log_posteriors) - FAR


def _of_velocity(fits: Sequence[_Fit]) -> float:
    return sum(fit.log_posterior for fit in fits if fit.dof in (SURGE, SWAY))


def _further(fits: Sequence[_Fit], delay_s: float) -> Array:
    """Further lateness and smoothing of the velocity, from surge and sway, and further thrust delay, from yaw, in s,
    relative to the values in the fits; `delay_s` (s) is the thrust's delay there, and none is negative."""
    total, precision = np.zeros(2), 1e-9 * np.eye(2)
    later_s = 0.0
    for fit in fits:
        if len(fit.timing) == 1:
            later_s = max(float(fit.timing[0]), -delay_s)
        else:
            total, precision = total + fit.precision @ fit.timing, precision + fit.precision
    velocity = np.linalg.solve(precision, total)
    # Thrust that comes later makes the velocity seem less late.
    return np.array([velocity[0] - later_s, velocity[1], later_s])


def _fitted(
    dive: Dive,
    delay_s: float,
    file: VehicleFile,
    configuration_name: str,
    dofs: tuple[int, ...],
    near: Sequence[_Fit],
) -> list[_Fit]:
    """Fits of each axis alone with thrust delayed by `delay_s`, each started from its fit in `near`; axes that the
    recording lacks are left out."""
    curve = replace(file.vehicle.thrust_curve, delay_s=file.vehicle.thrust_curve.delay_s + delay_s)
    late = replace(file, vehicle=replace(file.vehicle, thrust_curve=curve))
    return _fits_of(build_axes(dive, late, configuration_name, dofs), file, configuration_name, near)


def _fits_of(built: Axes, file: VehicleFile, configuration_name: str, near: Sequence[_Fit]) -> list[_Fit]:
    """Fits of each axis alone, each started from its fit in `near`; axes without a solution are left out."""
    configuration = file.vehicle.configurations[configuration_name]
    masses = np.array([MASS_RATIO * configuration.rigid_body(dof)[0] for dof in range(6)])
    starts = {fit.dof: fit.theta for fit in near}
    for dof, theta in starts.items():
        # A guess would leave a drifting hull's turning (Munk 1924) to yaw, which would take it for another timing.
        if np.isfinite(theta[MASS]):
            masses[dof] = np.exp(theta[MASS])

    def fit(axis: Axis) -> _Fit | None:
        if not axis.timing:
            thrust_timing = Timing(axis.by_lateness(), DELAY_SPREAD_S)
            axis = replace(axis, timing=(thrust_timing,))
        problem = likelihood_of(axis, configuration, masses, (), "both")
        if axis.dof in starts:
            with suppress(np.linalg.LinAlgError):
                return _climbed(problem, starts[axis.dof])
        try:
            rough = rough_maximum(problem, configuration.rigid_body(axis.dof)[0], configuration.model, ENOUGH)
            return _climbed(problem, rough.theta)
        except np.linalg.LinAlgError:
            # An axis without a solution gives no timing; the fit of all axes reports why.
            return None

    fits = side_by_side(fit, built.axes)
    return [fitted for fitted in fits if fitted is not None]


def _climbed(problem: AxisLikelihood, near: Array) -> _Fit:
    """Fit an axis alone from a point nearby; raises LinAlgError if there is no solution."""
    index = slice(problem.noise_index - len(problem.axis.timing), problem.noise_index)
    theta = near.copy()
    # The dive has since been dated with the timing found at `near`, so the remaining timing starts at zero.
    theta[index] = 0.0
    maximum = climb(problem.slowed(theta), theta, ENOUGH)
    precision = np.linalg.inv(np.linalg.inv(maximum.precision)[index, index])
    by_readings: Array = np.asarray(precision - np.diag(problem.prior_precision[index]), dtype=np.float64)
    pull: Array = np.asarray(precision @ maximum.theta[index], dtype=np.float64)
    timing = np.asarray(np.linalg.solve(by_readings, pull), dtype=np.float64)
    if not np.isfinite(timing).all():
        raise np.linalg.LinAlgError("its readings say nothing of its timing")
    off = maximum.theta - problem.prior_mean
    log_posterior = maximum.log_likelihood - 0.5 * float(problem.prior_precision @ off**2)
    return _Fit(problem.axis.dof, maximum.theta, log_posterior, timing, by_readings)


def lasting_axes(dive: Dive, file: VehicleFile, configuration_name: str) -> Axes:
    """The axes that were read for long enough to be identified. Raises FitError if there are none, if nothing was
    pushed, and in the cases of `build_axes`."""
    lasting(dive)
    refuse_unpushed(dive, file, configuration_name)
    refuse_unmoved(dive)
    built = build_axes(dated(dive, file, configuration_name), file, configuration_name)
    short = {axis.dof: reason for axis in built.axes if (reason := too_short(dive, axis.dof))}
    kept = tuple(axis for axis in built.axes if axis.dof not in short)
    return replace(built, axes=kept, missing=built.missing | short)


shared_axes = shared(lasting_axes)
"""The `Axes` of a dive, a vehicle file and a configuration, shared by all methods that hold them."""
