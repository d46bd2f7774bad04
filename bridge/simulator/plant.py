"""The simulated body: six degrees of freedom, thrusters with lag, a coloured disturbance, a surface above.

Its inner loop is compiled; a test checks that it equals `bridge.vehicle.dynamics`. State (13,): north-east-down
position (m), attitude w x y z (body to NED), body velocity u v w p q r.
"""

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numba import njit

from bridge.arrays import Array
from bridge.attitude import body_to_earth, down_in_body
from bridge.errors import ConfigError
from bridge.simulator.onset import Sea
from bridge.simulator.truth import DELAY, Truth
from bridge.vehicle.accepted_effects import known_effects
from bridge.vehicle.config import GRAVITY_M_S2, Configuration
from bridge.vehicle.thrusters import NEUTRAL_US, Curve, allocation_matrix

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


@njit(cache=True, error_model="numpy")
def _assign(out: Array, values: Array) -> None:
    """Copy values (n,) to `out` (n,): a slice's assignment, with its check of shapes, takes 2 s longer to compile."""
    for i in range(len(values)):
        out[i] = values[i]


@njit(cache=True, error_model="numpy")
def derivative(
    state: Array,
    tau: Array,
    mass: Array,
    damping: Array,
    quadratic: Array,
    weight_arm: float,
    net_up: float,
    surface_stiffness: float,
    out: Array,
) -> None:
    """Write the time derivative of the state under the wrench `tau` (6,) into `out` (13,).

    Fossen (2011), eqs 2.72 and 6.1 to 6.3. Above the surface (depth < 0) buoyancy falls by `surface_stiffness` N/m.
    """
    qw, qx, qy, qz = state[3], state[4], state[5], state[6]
    u, v, w, p, q, r = state[7], state[8], state[9], state[10], state[11], state[12]
    down_x, down_y = 2 * (qx * qz - qw * qy), 2 * (qy * qz + qw * qx)
    down_z = 1 - 2 * (qx * qx + qy * qy)
    up = net_up
    if state[2] < 0.0:
        up += surface_stiffness * state[2]

    out[0] = (1 - 2 * (qy * qy + qz * qz)) * u + 2 * (qx * qy - qw * qz) * v + 2 * (qx * qz + qw * qy) * w
    out[1] = 2 * (qx * qy + qw * qz) * u + (1 - 2 * (qx * qx + qz * qz)) * v + 2 * (qy * qz - qw * qx) * w
    out[2] = down_x * u + down_y * v + down_z * w
    out[3] = 0.5 * (-qx * p - qy * q - qz * r)
    out[4] = 0.5 * (qw * p - qz * q + qy * r)
    out[5] = 0.5 * (qz * p + qw * q - qx * r)
    out[6] = 0.5 * (-qy * p + qx * q + qw * r)

    m_u, m_v, m_w, i_p, i_q, i_r = mass[0], mass[1], mass[2], mass[3], mass[4], mass[5]
    c_x = m_w * w * q - m_v * v * r
    c_y = m_u * u * r - m_w * w * p
    c_z = m_v * v * p - m_u * u * q
    c_k = (m_w - m_v) * v * w + (i_r - i_q) * q * r
    c_m = (m_u - m_w) * u * w + (i_p - i_r) * p * r
    c_n = (m_v - m_u) * u * v + (i_q - i_p) * p * q
    out[7] = (tau[0] - c_x - (damping[0] + quadratic[0] * abs(u)) * u - up * down_x) / m_u
    out[8] = (tau[1] - c_y - (damping[1] + quadratic[1] * abs(v)) * v - up * down_y) / m_v
    out[9] = (tau[2] - c_z - (damping[2] + quadratic[2] * abs(w)) * w - up * down_z) / m_w
    out[10] = (tau[3] - c_k - (damping[3] + quadratic[3] * abs(p)) * p - weight_arm * down_y) / i_p
    out[11] = (tau[4] - c_m - (damping[4] + quadratic[4] * abs(q)) * q + weight_arm * down_x) / i_q
    out[12] = (tau[5] - c_n - (damping[5] + quadratic[5] * abs(r)) * r) / i_r


@njit(cache=True, error_model="numpy")
def advance(
    state: Array,
    thrust: Array,
    disturbance: Array,
    push: Array,
    target: Array,
    matrix: Array,
    noise: Array,
    keep: float,
    mass: Array,
    damping: Array,
    quadratic: Array,
    weight_arm: float,
    net_up: float,
    surface_stiffness: float,
    lag_s: float,
    dt_s: float,
    states: Array,
    rates: Array,
) -> None:
    """Take as many RK4 steps as `noise` (steps, 6) has rows; updates `state`, `thrust` and `disturbance` in place.

    The wrench `push` (6,) is held throughout. The disturbance (6,) is held over a step and is then replaced by `keep`
    times itself plus the noise. Each thrust (n,) follows its target by the exact solution of a first-order lag. Step i
    fills row i + 1 of `states` (steps + 1, 13) and of `rates` (steps + 1, 6: nu_dot); row 0 holds the start.
    """
    k1, k2, k3, k4 = np.empty(13), np.empty(13), np.empty(13), np.empty(13)
    trial = np.empty(13)
    half = np.exp(-0.5 * dt_s / lag_s) if lag_s > 0.0 else 0.0
    _assign(states[0], state)
    for i in range(noise.shape[0]):
        if lag_s <= 0.0:
            _assign(thrust, target)
        middle = target + (thrust - target) * half
        end = target + (middle - target) * half
        tau_start = matrix @ thrust + disturbance + push
        tau_middle = matrix @ middle + disturbance + push
        tau_end = matrix @ end + disturbance + push
        derivative(state, tau_start, mass, damping, quadratic, weight_arm, net_up, surface_stiffness, k1)
        _assign(rates[i], k1[7:])
        _assign(trial, state + 0.5 * dt_s * k1)
        derivative(trial, tau_middle, mass, damping, quadratic, weight_arm, net_up, surface_stiffness, k2)
        _assign(trial, state + 0.5 * dt_s * k2)
        derivative(trial, tau_middle, mass, damping, quadratic, weight_arm, net_up, surface_stiffness, k3)
        _assign(trial, state + dt_s * k3)
        derivative(trial, tau_end, mass, damping, quadratic, weight_arm, net_up, surface_stiffness, k4)
        state += dt_s / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        norm = np.sqrt(state[3] ** 2 + state[4] ** 2 + state[5] ** 2 + state[6] ** 2)
        for j in range(3, 7):
            state[j] /= norm
        _assign(thrust, end)
        _assign(disturbance, keep * disturbance + noise[i])
        _assign(states[i + 1], state)
    derivative(
        state,
        matrix @ thrust + disturbance + push,
        mass,
        damping,
        quadratic,
        weight_arm,
        net_up,
        surface_stiffness,
        k1,
    )
    _assign(rates[noise.shape[0]], k1[7:])


class Plant:
    """A vehicle in the water, from time 0 on; `rng` draws the disturbance, which is stationary from the start.

    `delay_s`: dead time between a command and its thrust, to the length of an advance.
    """

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
        delay_s: float = 0.0,
    ) -> None:
        self._curve = curve
        self._dead_s = delay_s
        self._lag_s = lag_s
        self._rng = rng
        self._rate_hz = rate_hz
        self._matrix = allocation_matrix(configuration)
        self._configuration, self._truth = configuration, truth
        self._commands: deque[tuple[float, tuple[float, ...]]] = deque()
        self._pwm_us: tuple[float, ...] = (NEUTRAL_US,) * self._matrix.shape[1]
        self._sea: Sea | None = None
        self._be(truth.later())  # refused at the start, not in the middle of a dive
        self._be(truth)
        weight = configuration.dry_mass_kg * GRAVITY_M_S2
        self._arm = configuration.centre_of_gravity_below_buoyancy_m * weight
        self._net_up = configuration.net_buoyancy_n
        self._stiffness = weight / HULL_HEIGHT_M
        self._keep = math.exp(-1 / (rate_hz * truth.disturbance_time_s))
        sigma = np.array([truth.disturbance_n] * 3 + [truth.disturbance_nm] * 3)
        self._kick = sigma * math.sqrt(1 - self._keep**2)
        self._disturbance = sigma * rng.standard_normal(6)
        self._calm = np.zeros(6)
        self._thrust = np.zeros(self._matrix.shape[1])
        self._turned = np.zeros(self._matrix.shape[1])
        self._state = np.zeros(13)
        self._state[2] = depth_m
        self._state[3], self._state[6] = math.cos(heading_rad / 2), math.sin(heading_rad / 2)
        self._steps_done = 0

    def _be(self, truth: Truth) -> None:
        """Take over the true values of the vehicle itself."""
        planted = known_effects(truth.effects, self._configuration)
        if planted.faults:
            raise ConfigError(
                f"the truth's effects can't be simulated: {'; '.join(planted.faults)}; mend them"
            )
        self._mass, self._damping = np.array(truth.mass), np.array(truth.damping)
        self._quadratic, self._losses = np.array(truth.quadratic), planted.losses
        self._delay_s = self._dead_s + truth.effects.get(DELAY, 0.0)

    def _set_in(self) -> None:
        """Begin the effects of the truth's onset."""
        if self._losses is None:
            self._turned = self._thrust.copy()
        self._be(self._truth.later())
        rigid = np.array([self._configuration.rigid_body(dof)[0] for dof in range(6)])
        self._sea = Sea(self._truth.onset, self._mass, rigid, self._damping, self._quadratic)

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
        if self._truth.onset and self._sea is None and self.time_s >= self._truth.onset_s:
            self._set_in()
        target = self._curve.thrust(self._arrived(pwm_us))
        if self._losses is not None:
            self._turn(self._losses.turned(target), duration_s)
            target = self._losses.given(target)
        states, rates = np.empty((count + 1, 13)), np.empty((count + 1, 6))
        advance(
            self._state,
            self._thrust,
            self._disturbance,
            self._calm if self._sea is None else self._sea.push(self._state, self.time_s),
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

    def _arrived(self, pwm_us: tuple[float, ...]) -> tuple[float, ...]:
        """The commands that have reached the thrusters."""
        self._commands.append((self.time_s + self._delay_s, pwm_us))
        while self._commands and self._commands[0][0] <= self.time_s + 1e-9:
            self._pwm_us = self._commands.popleft()[1]
        return self._pwm_us

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
        velocity: Array = (body_to_earth(self.attitude) @ self.velocity[:, :, None])[:, :2, 0]
        return velocity

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
        down = np.empty((len(self.attitude), 3))
        down[:, 0], down[:, 1], down[:, 2] = down_in_body(self.attitude.T)
        return down


def motion_at(stretch: Stretch, time_s: Array) -> Motion:
    """The body's motion at moments within the stretch, interpolated linearly between physics steps."""
    step = stretch.time_s[1] - stretch.time_s[0]
    place = np.minimum(np.maximum((time_s - stretch.time_s[0]) / step, 0), len(stretch.time_s) - 1)
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
    """Products of the vectors a (k, 3) with b, (k, 3) or (3,); `np.cross` takes five times as long for few rows."""
    out = np.empty_like(a)
    ax, ay, az = a.T
    bx, by, bz = b.T
    out[:, 0], out[:, 1], out[:, 2] = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    return out
