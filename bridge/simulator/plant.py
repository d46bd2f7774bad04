"""The simulated body: six degrees of freedom, thrusters with lag, a coloured disturbance, a surface above."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.errors import ConfigError
from bridge.simulator.kernel import advance
from bridge.simulator.truth import Truth
from bridge.vehicle.accepted_effects import known_effects
from bridge.vehicle.config import GRAVITY_M_S2, Configuration
from bridge.vehicle.thrusters import Curve, allocation_matrix

Array = NDArray[np.float64]
RATE_HZ = 200.0
HULL_HEIGHT_M = 0.3


@dataclass(frozen=True)
class Stretch:
    """The body's motion during an advance: rows at both ends and at every physics step between.

    `time_s` (k,); `state` (k, 13) is NED position, attitude w x y z, body velocity; `nu_dot` (k, 6); `thrust_n` (n,)
    is each thruster's true thrust at the end, `turned_n` (n,) the thrust that its shaft speed indicates.
    """

    time_s: Array
    state: Array
    nu_dot: Array
    thrust_n: Array
    turned_n: Array

    @property
    def nu(self) -> Array:
        return self.state[:, 7:]


class Plant:
    """A vehicle in the water, from time 0 on; `rng` draws the disturbance, which is stationary from the start."""

    def __init__(
        self,
        configuration: Configuration,
        curve: Curve,
        lag_s: float,
        truth: Truth,
        rng: np.random.Generator,
        *,
        depth_m: float = 0.0,
        heading_rad: float = 0.0,
        rate_hz: float = RATE_HZ,
    ) -> None:
        self._curve = curve
        self._lag_s = lag_s
        self._rng = rng
        self._rate_hz = rate_hz
        self._matrix = allocation_matrix(configuration)
        self._mass, self._damping = np.array(truth.mass), np.array(truth.damping)
        self._quadratic = np.array(truth.quadratic)
        planted = known_effects(truth.effects, configuration)
        if planted.faults:
            raise ConfigError(
                f"the truth's effects can't be simulated: {'; '.join(planted.faults)}; mend them"
            )
        self._losses = planted.losses
        weight = configuration.dry_mass_kg * GRAVITY_M_S2
        self._arm = configuration.centre_of_gravity_below_buoyancy_m * weight
        self._net_up = configuration.net_buoyancy_n
        self._stiffness = weight / HULL_HEIGHT_M
        self._keep = math.exp(-1 / (rate_hz * truth.disturbance_time_s))
        sigma = np.array([truth.disturbance_n] * 3 + [truth.disturbance_nm] * 3)
        self._kick = sigma * math.sqrt(1 - self._keep**2)
        self._disturbance = sigma * rng.standard_normal(6)
        self._thrust = np.zeros(self._matrix.shape[1])
        self._turned = np.zeros(self._matrix.shape[1])
        self._state = np.zeros(13)
        self._state[2] = depth_m
        self._state[3], self._state[6] = math.cos(heading_rad / 2), math.sin(heading_rad / 2)
        self._steps_done = 0

    @property
    def time_s(self) -> float:
        return self._steps_done / self._rate_hz

    @property
    def state(self) -> Array:
        """A copy of the state (13,)."""
        return self._state.copy()

    def wrench(self, thrust_n: Array) -> Array:
        """Wrench (6,) of these thrusts, N and N m."""
        return self._matrix @ thrust_n

    def advance(self, pwm_us: tuple[float, ...], duration_s: float) -> Stretch:
        """Advance under constant thruster commands.

        Raises ValueError if the duration isn't a whole number of physics steps.
        """
        count = round(duration_s * self._rate_hz)
        if count < 1 or abs(count - duration_s * self._rate_hz) > 1e-6:
            raise ValueError(f"{duration_s} s is no whole number of physics steps at {self._rate_hz} Hz")
        target = self._curve.thrust(pwm_us)
        if self._losses is not None:
            self._turn(self._losses.turned(target), duration_s)
            target = self._losses.given(target)
        states, rates = np.empty((count + 1, 13)), np.empty((count + 1, 6))
        advance(
            self._state,
            self._thrust,
            self._disturbance,
            target,
            self._matrix,
            self._kick * self._rng.standard_normal((count, 6)),
            self._keep,
            self._mass,
            self._damping,
            self._quadratic,
            self._arm,
            self._net_up,
            self._stiffness,
            self._lag_s,
            1 / self._rate_hz,
            states,
            rates,
        )
        time_s = (self._steps_done + np.arange(count + 1)) / self._rate_hz
        self._steps_done += count
        turned = self._thrust if self._losses is None else self._turned
        return Stretch(time_s, states, rates, self._thrust.copy(), turned.copy())

    def _turn(self, target: Array, duration_s: float) -> None:
        """Let the shafts follow with the same lag as the thrust."""
        keep = math.exp(-duration_s / self._lag_s) if self._lag_s > 0 else 0.0
        self._turned = target + keep * (self._turned - target)
