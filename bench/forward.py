"""Predict where a vehicle gets to by its commands alone: the model run forward from measured states, in many
windows."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DAMPINGS, MASSES
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.dynamics import acceleration, restoring
from identify.dive import Dive
from identify.forces import wrench
from identify.ingest.rotation import attitude_at

Array = NDArray[np.float64]

STEP_S = 0.02
WINDOW_S = 10.0
REST_M_S = 0.02
RUNAWAY = 20.0
"""m/s or rad/s: a model that reaches this has run away, as a model with negative damping does."""


@dataclass(frozen=True)
class Starts:
    """Measured states at the times `time_s` (n,): `attitude` (n, 4) w x y z, `nu` (n, 6)."""

    time_s: Array
    attitude: Array
    nu: Array

    def __len__(self) -> int:
        return len(self.time_s)


def starts(dive: Dive, file: VehicleFile, window_s: float = WINDOW_S) -> Starts:
    """A start at a velocity reading every `window_s`, for windows that end within the dive.

    The velocity is a single DVL reading, carried to the origin by the rates; rates and attitude are interpolated to
    its time. Windows in which the vehicle stays at rest are left out.
    """
    if dive.velocity is None or dive.gyro is None or dive.attitude is None or dive.pwm is None:
        return Starts(np.zeros(0), np.zeros((0, 4)), np.zeros((0, 6)))
    known = np.isfinite(dive.velocity.value).all(axis=1)
    time_s, velocity = dive.velocity.time_s[known], dive.velocity.value[known]
    speed = np.linalg.norm(velocity, axis=1)
    begin = max(float(s.time_s[0]) for s in (dive.velocity, dive.gyro, dive.attitude, dive.pwm))
    chosen = []
    for wanted in np.arange(begin, float(time_s[-1]) - window_s, window_s):
        first = int(np.searchsorted(time_s, wanted))
        last = int(np.searchsorted(time_s, time_s[first] + window_s))
        if last < len(time_s) and speed[first:last].mean() > REST_M_S:
            chosen.append(first)
    time_s, velocity = time_s[chosen], velocity[chosen]
    rates = dive.gyro.at(time_s)
    if dive.fog is not None:
        rates[:, 2] = dive.fog.at(time_s)[:, 0]
    dvl = file.vehicle.sensors.dvl
    arm = np.zeros(3) if dvl is None else np.asarray(dvl.mounting.position_m)
    nu = np.column_stack((velocity - np.cross(rates, arm), rates))
    return Starts(time_s, attitude_at(dive.attitude, time_s), nu)


def run_forward(
    begin: Starts,
    dive: Dive,
    file: VehicleFile,
    configuration: str,
    model: Mapping[str, float],
    trim: Array,
    window_s: float = WINDOW_S,
) -> Array:
    """NED displacement (n, 3) after `window_s`, by the commands that the dive recorded and nothing else.

    `model` names all twelve coefficients; `trim` (6,) is a constant wrench in N and N m. NaN in windows in which the
    model runs away. Runge-Kutta of order 4.
    """
    shape = file.vehicle.configurations[configuration]
    mass, damping = ([model[c.name] for c in group] for group in (MASSES, DAMPINGS))
    history = wrench(dive, file, configuration)
    state = np.column_stack((np.zeros((len(begin), 3)), begin.attitude, begin.nu))

    def rate(value: Array, tau: Array) -> Array:
        attitude, nu = value[:, 3:7], value[:, 7:]
        g = restoring(shape, list(attitude.T))
        nu_dot = acceleration(mass, damping, list(nu.T), list((tau + trim).T), g)
        return np.column_stack((earth(attitude, nu[:, :3]), turning(attitude, nu[:, 3:]), *nu_dot))

    steps = round(window_s / STEP_S)
    for step in range(steps):
        now_s = begin.time_s + step * STEP_S
        before, middle, after = (history.at(now_s + share * STEP_S) for share in (0.0, 0.5, 1.0))
        k1 = rate(state, before)
        k2 = rate(state + 0.5 * STEP_S * k1, middle)
        k3 = rate(state + 0.5 * STEP_S * k2, middle)
        k4 = rate(state + STEP_S * k3, after)
        state = state + STEP_S / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        state[np.abs(state[:, 7:]).max(axis=1) > RUNAWAY] = np.nan
        state[:, 3:7] /= np.linalg.norm(state[:, 3:7], axis=1)[:, None]
    return state[:, :3]


def earth(attitude: Array, vector: Array) -> Array:
    """Body vectors (n, 3) in earth axes, by attitudes (n, 4) w x y z from body to earth."""
    w, axis = attitude[:, :1], attitude[:, 1:]
    across = 2.0 * np.cross(axis, vector)
    turned: Array = vector + w * across + np.cross(axis, across)
    return turned


def turning(attitude: Array, rates: Array) -> Array:
    """Derivative (n, 4) of the attitude (Fossen 2011, eq. 2.68)."""
    w, axis = attitude[:, :1], attitude[:, 1:]
    scalar = -0.5 * np.sum(axis * rates, axis=1, keepdims=True)
    return np.column_stack((scalar, 0.5 * (w * rates + np.cross(axis, rates))))


def moved(time_s: Array, position: Array, begin_s: Array, window_s: float = WINDOW_S) -> Array:
    """True displacement (n, 3) in the windows, from true positions (m, 3) at the times (m,)."""
    ends = [
        np.column_stack([np.interp(at, time_s, position[:, k]) for k in range(3)])
        for at in (begin_s, begin_s + window_s)
    ]
    displacement: Array = ends[1] - ends[0]
    return displacement
