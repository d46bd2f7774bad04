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


@dataclass(frozen=True)
class Motion:
    """NED position, attitude w x y z, body velocity and rate and their derivatives, with a row per moment."""

    time_s: Array
    position: Array
    attitude: Array
    velocity: Array
    rate: Array
    acceleration: Array
    turning: Array

    def earth_velocity(self) -> Array:
        """Velocity of the origin, north and east, shape (k, 2)."""
        w, x, y, z = self.attitude.T
        u, v, down = self.velocity.T
        north = (1 - 2 * (y * y + z * z)) * u + 2 * (x * y - w * z) * v + 2 * (x * z + w * y) * down
        east = 2 * (x * y + w * z) * u + (1 - 2 * (x * x + z * z)) * v + 2 * (y * z - w * x) * down
        return np.stack([north, east], axis=1)

    def velocity_at(self, arm_m: Array) -> Array:
        """Body velocity of the point at `arm_m`, shape (k, 3)."""
        return self.velocity + _cross(self.rate, arm_m)

    def depth_of(self, arm_m: Array) -> Array:
        """Depth of the point at `arm_m`, shape (k,)."""
        return self.position[:, 2] + self._down() @ arm_m

    def specific_force_at(self, arm_m: Array, gravity_m_s2: float) -> Array:
        """Specific force on an accelerometer at `arm_m`, body axes, shape (k, 3)."""
        inner = _cross(self.turning, arm_m) + _cross(self.rate, _cross(self.rate, arm_m))
        return self.acceleration + _cross(self.rate, self.velocity) + inner - gravity_m_s2 * self._down()

    def _down(self) -> Array:
        """The downward vertical in body axes, shape (k, 3)."""
        w, x, y, z = self.attitude.T
        return np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1)


def motion_at(stretch: Stretch, time_s: Array) -> Motion:
    """The body's motion at moments within the stretch, interpolated linearly between physics steps."""
    step = stretch.time_s[1] - stretch.time_s[0]
    place = np.clip((time_s - stretch.time_s[0]) / step, 0, len(stretch.time_s) - 1)
    left = np.minimum(place.astype(int), len(stretch.time_s) - 2)
    share = (place - left)[:, None]
    state = (1 - share) * stretch.state[left] + share * stretch.state[left + 1]
    nu_dot = (1 - share) * stretch.nu_dot[left] + share * stretch.nu_dot[left + 1]
    return Motion(
        time_s, state[:, :3], state[:, 3:7], state[:, 7:10], state[:, 10:13], nu_dot[:, :3], nu_dot[:, 3:]
    )


def moments(stretch: Stretch, rate_hz: float) -> Array:
    """The multiples of the period after the start of the stretch, up to its end."""
    first = math.floor(stretch.time_s[0] * rate_hz + 1e-6) + 1
    last = math.floor(stretch.time_s[-1] * rate_hz + 1e-6)
    return np.arange(first, last + 1) / rate_hz


def _cross(a: Array, b: Array) -> Array:
    """Vector products along the last axis; `np.cross` takes four times as long for a handful of rows."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)
