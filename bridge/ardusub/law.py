"""The feed-forward of a vehicle that a pilot flies by ArduSub's sticks.

A stick asks for the velocity at which the vehicle's drag balances the stick's thrust, so a steady stick means the same
with and without the feed-forward. The reference velocity follows it, critically damped. The feed-forward computes the
force that the reference needs (`bridge.vehicle.feedforward`); that force less the stick's own is added to the stick.
In mode BOTH a controller also holds the DVL's velocity at the reference.

In any doubt nothing is added, and the pilot's sticks pass unchanged.
"""

import math
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from bridge.ardusub.hold import VelocityHold
from bridge.ardusub.mixing import Mixer
from bridge.arrays import Array
from bridge.firmware.ardusub import FLOWN_BY_STICKS, MANUAL
from bridge.vehicle.autopilot import Actuation
from bridge.vehicle.coefficients import QUADRATICS
from bridge.vehicle.config import Vehicle
from bridge.vehicle.feedforward import (
    AXES,
    FEEDFORWARD_DOFS,
    LONGEST_TICK_S,
    SLOPE_PER_S,
    Lead,
    Onset,
    Slope,
    feedforward,
    silent,
)
from bridge.vehicle.in_force import FaultTexts, ModelInForce, ParameterProvider
from bridge.vehicle.mode import Mode
from bridge.vehicle.navigation import OLDEST_S, Navigation, known_at
from bridge.vehicle.references import ZERO6, Reference, Six, Trail
from bridge.vehicle.thrusters import Allocator, thrust_curve

REFERENCE_RAD_S: Final = 3.0
"""Natural frequency of the reference: it has half of a stick's velocity after 0.56 s, nine tenths after 1.3 s."""
FULL_STICK: Final = 1000.0
MOST_ADDED: Final = 600.0
"""In units of a stick."""
ADDED_PER_S: Final = SLOPE_PER_S * FULL_STICK
FASTEST: Final = 3.0
"""Bound of the velocity asked for, m/s and rad/s: with a model whose drag is far too small, a touch of the stick would
ask for any speed."""
HELD_S: Final = 0.02
"""Half the time for which a stick is held, at the 25 Hz of a ground station's joystick."""
DOUBT: Final = "a doubt"
PAUSE_S: Final = 0.5
"""After a longer pause of the sticks the reference starts again from rest."""


class StickLaw:
    """Steps at the pace of the pilot's sticks; `parameters` gives the active coefficients."""

    def __init__(
        self,
        vehicle: Vehicle,
        configuration: str,
        parameters: ParameterProvider,
        directory: Path,
        mixer: Mixer,
    ) -> None:
        shape = vehicle.configurations[configuration]
        self._shape, self._mixer = shape, mixer
        self._veh_cfg = vehicle.veh_cfg(configuration)
        allocator = Allocator(shape, thrust_curve(vehicle.thrust_curve, directory))
        self._reach = tuple(float(limit) for limit in allocator.reach())
        self._held = VelocityHold(shape, self._reach)
        self._lead = Lead(vehicle.thrust_curve.lag_s + HELD_S, self._reach)
        self._slope = Slope(self._reach)
        self._model = ModelInForce(parameters, self._veh_cfg, shape, self._reach)
        self._nu, self._nu_dot = [0.0] * 6, [0.0] * 6
        self._trail = Trail(OLDEST_S)
        self._time_s = math.nan
        self._onset, self._sum = Onset(), np.zeros(3)
        self._faults = FaultTexts()

    def step(
        self, now_s: float, sticks: Array, gain: float, mode: Mode, doubt: str, flight_mode: int,
        navigation: Navigation, pwm_us: tuple[float, ...],
    ) -> tuple[Array, Actuation]:  # fmt: skip
        """Return the addition to the sticks x, y, r (3,), in their units, and the forces computed, for the recording.

        `doubt` says why the meaning of the sticks is not known, "" if it is; `pwm_us` are the pulses of the outputs.
        """
        dt_s = now_s - self._time_s
        if not 0 < dt_s <= PAUSE_S:
            self._restart()
            dt_s = 0.0
        self._time_s = now_s
        known = known_at(navigation, now_s)
        if not doubt and flight_mode not in FLOWN_BY_STICKS:
            doubt = f"flight mode {flight_mode} holds by itself"
        pilot = np.zeros(6)
        if math.isfinite(gain):
            pilot[list(FEEDFORWARD_DOFS)] = self._mixer.wrench(gain * sticks / FULL_STICK)
        if self._model.renew():
            self._faults.begin_set()
        flown = FEEDFORWARD_DOFS if flight_mode == MANUAL else FEEDFORWARD_DOFS[:-1]
        reference = self._reference(pilot, flown, known, dt_s)
        term = (
            silent(doubt)
            if doubt
            else feedforward(self._model.coefficients, reference, self._reach, self._model.effects.hull)
        )
        off = {*range(6)} - {*flown} | {*term.off}
        self._trail.add(now_s, reference)
        pid = self._hold(known, reference, pilot, dt_s, mode, off)
        self._faults.report(term.faults if mode is not Mode.OFF else ())
        acts = mode.applies_feedforward and not doubt
        # The feed-forward follows the sticks in every mode, so that it fades in from where it is.
        led = self._lead.step(term.tau, dt_s)
        fed = self._slope.step(_six([t + f for t, f in zip(led, pid, strict=True)]), off, dt_s)
        self._onset.step(acts, dt_s)
        total = np.array([pilot[dof] if dof in off else fed[dof] for dof in range(6)])
        added = self._limited(total, gain, sticks, dt_s, off)
        given = np.zeros(6)
        if len(pwm_us) >= len(self._shape.thrusters):
            given[list(FEEDFORWARD_DOFS)] = self._mixer.wrench_of_pulses(pwm_us[: len(self._shape.thrusters)])
        self._model.judge(mode, DOUBT if doubt else "", dt_s, _six(given.tolist()), term.tau, known)
        nu_fb = (*navigation.velocity, *navigation.rate)
        actuation = Actuation(
            now_s, pid, term.tau, _six(given.tolist()), nu_fb, reference, (), int(mode), self._veh_cfg
        )
        return added, actuation

    @property
    def reference_m_s(self) -> tuple[float, ...]:
        """The velocity that the sticks ask for by now, body axes, m/s and rad/s."""
        return tuple(self._nu)

    def off(self) -> None:
        """Add nothing from now on: the sticks are no longer received."""
        self._restart()

    def disarmed(self) -> None:
        """The vehicle is disarmed, whether sticks come or not: its record in shadow begins anew."""
        self._model.shadow.begin_anew(DOUBT)

    def unproven(self) -> str:
        """See `ModelInForce.unproven`."""
        return self._model.unproven()

    def take_texts(self) -> list[str]:
        """Sentences for the crew since the last call."""
        return [*self._faults.take(), *self._held.take_texts()]

    def _restart(self) -> None:
        self._nu, self._nu_dot = [0.0] * 6, [0.0] * 6
        self._trail = Trail(OLDEST_S)
        self._slope.reset()
        self._lead.reset()
        self._held.reset()
        self._onset.step(False, 0.0)
        self._model.shadow.pause()

    def _reference(self, pilot: Array, flown: tuple[int, ...], known: Navigation, dt_s: float) -> Reference:
        """Follow the velocities that the sticks ask for, critically damped."""
        within_s = min(dt_s, LONGEST_TICK_S)
        for dof, _, damping in AXES:
            target = 0.0
            if dof in flown:
                linear = self._model.coefficients.get(damping, 0.0)
                target = steady_velocity(
                    float(pilot[dof]), linear, self._model.effects.hull.get(QUADRATICS[dof].name, 0.0)
                )
            pull = REFERENCE_RAD_S**2 * (target - self._nu[dof]) - 2 * REFERENCE_RAD_S * self._nu_dot[dof]
            self._nu_dot[dof] += within_s * pull / (1 + 2 * REFERENCE_RAD_S * within_s)
            self._nu[dof] += within_s * self._nu_dot[dof]
        return Reference(_six(self._nu), _six(self._nu_dot), known.heading_rad, known.depth_m)

    def _hold(
        self, known: Navigation, reference: Reference, pilot: Array, dt_s: float, mode: Mode, off: set[int]
    ) -> Six:
        """Force of the velocity hold in surge and sway; zero where it is not asked for.

        A velocity is held against the reference of its own time: that of now would pass for an error of the
        acceleration times the reading's age, 20 mm/s and more.
        """
        if mode is not Mode.BOTH or not dt_s > 0:
            self._held.reset()
            return ZERO6
        of_reading = replace(reference, nu=self._trail.at(known.velocity_time_s).nu)
        return self._held.step(known, of_reading, pilot.tolist(), off, dt_s)

    def _limited(self, total: Array, gain: float, sticks: Array, dt_s: float, off: set[int]) -> Array:
        """The addition (3,) in units of a stick, bounded in size; the sum moves away from both the pilot's stick and
        the sum before by no more than a slope allows. Nothing at once where nothing acts."""
        axes = list(FEEDFORWARD_DOFS)
        if self._onset.share == 0.0:
            self._sum = sticks
            return np.zeros(3)
        fed = np.where(
            [dof in off for dof in axes], sticks, self._mixer.inputs(total[axes]) * FULL_STICK / gain
        )
        wanted = self._onset.between(sticks, fed)
        most = ADDED_PER_S * min(dt_s, LONGEST_TICK_S)
        wanted = np.clip(wanted, np.minimum(self._sum, sticks) - most, np.maximum(self._sum, sticks) + most)
        wanted = np.clip(wanted, sticks - MOST_ADDED, sticks + MOST_ADDED)
        self._sum = np.clip(wanted, -FULL_STICK, FULL_STICK)
        return self._sum - sticks


def steady_velocity(force: float, linear: float, quadratic: float) -> float:
    """Velocity at which drag balances a force: linear v + quadratic |v| v = force; at most `FASTEST`, 0 without any
    drag."""
    size = abs(force)
    if quadratic > 0:
        speed = (math.sqrt(linear * linear + 4 * quadratic * size) - linear) / (2 * quadratic)
    else:
        speed = size / linear if linear > 0 else 0.0
    return math.copysign(min(speed, FASTEST), force) if math.isfinite(speed) else 0.0


def _six(values: "list[float]") -> Six:
    x, y, z, k, m, n = values or ZERO6
    return x, y, z, k, m, n
