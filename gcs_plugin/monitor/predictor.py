"""A model driven by recorded thrust: how far its velocity is from the measured one 5 s after both were equal.

A free-running model would be off by z = nu - y, which obeys M z' = -(D + 2 D2 |nu|) z + f, where f is the force that
the model misses (Fossen 2011, eq. 6.1, less itself along the recording; nonlinear parts at the measured velocity). The
drift since a moment is z now, less the rest of the z of that moment that damping has left. So one recursion gives the
drift of every 5 s without starting anew, and the same recursion, driven by a cause's force, gives the drift which that
cause makes. z is averaged over a second, which takes the noise out of the velocity at both ends.
"""

from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np

from bridge.arrays import Array
from bridge.attitude import body_to_earth
from bridge.vehicle.accepted_effects import Supply
from bridge.vehicle.coefficients import QUADRATICS
from bridge.vehicle.dynamics import coriolis, restoring
from bridge.vehicle.feedforward import hull_wrench
from bridge.vehicle.references import Reference
from gcs_plugin.monitor.model import Model

NUDGE_M_S: Final = 0.05
DRAGGED: Final = (0, 1, 2, 5)
"""Axes in which a hull can grow more drag."""


def names_of(model: Model) -> tuple[str, ...]:
    """Names of the rows of `Drift.causes`: a thruster that gives nothing, water that moves north and east by 1 m/s, a
    pull of 1 N north, east and down, a line of 1 N/m to where the watch began, drag of 1 N s2/m2 in DRAGGED."""
    return (
        *(f"thruster {number}" for number in range(1, len(model.configuration.thrusters) + 1)),
        *("water north", "water east", "pull north", "pull east", "pull down", "line"),
        *(f"drag {dof}" for dof in DRAGGED),
    )


def forces(model: Model, nu: Array, thrust: Array, attitude: Array, places: Array) -> Array:
    """Forces (n, c, 6) of the causes in the order of `names_of`, by velocity (n, 6), thrust (n, k), attitude (n, 4) and
    place (n, 2), north and east of where the watch began, m."""
    axes, at = _axes(attitude), thrust.shape[1]
    out = np.zeros((len(nu), len(names_of(model)), 6))
    out[:, :at] = -thrust[:, :, None] * model.matrix.T
    for axis in (0, 1):
        out[:, at + axis] = _pushed_by(model, nu, NUDGE_M_S * axes[:, axis]) / NUDGE_M_S
    at += 2
    out[:, at : at + 3, :3] = axes
    at += 3
    out[:, at, :3] = -np.einsum("na,nai->ni", places, axes[:, :2])
    at += 1
    for place, dof in enumerate(DRAGGED):
        out[:, at + place, dof] = -np.abs(nu[:, dof]) * nu[:, dof]
    return out


def _pushed_by(model: Model, nu: Array, water: Array) -> Array:
    """Force (n, 6) that a model of the velocity over ground misses if the water moves by (n, 3), body axes: drag,
    Coriolis forces, and inertia of the turning body."""
    through = nu.copy()
    through[:, :3] -= water
    mass = model.mass.tolist()
    turned = np.stack(
        [a - b for a, b in zip(coriolis(mass, tuple(nu.T)), coriolis(mass, tuple(through.T)), strict=True)]
    ).T
    drag = model.damping * (nu - through)
    drag += model.quadratic * (np.abs(nu) * nu - np.abs(through) * through)
    out = turned + drag
    out[:, :3] -= model.mass[:3] * np.cross(nu[:, 3:], water)
    return np.asarray(out)


def _axes(attitude: Array) -> Array:
    """Unit vectors north, east, down (n, 3, 3) in body axes, of quaternions of any length."""
    return body_to_earth(attitude / np.linalg.norm(attitude, axis=1, keepdims=True))


CORRELATED_S: Final = 4.0
"""Drifts over `OVER_S`, taken once a second, are alike for this time, and count as a single independent drift."""
OVER_S: Final = 5
"""Seconds over which the model is on its own."""

SECOND: Final = 20
"""Steps of a second: the rate of commands."""

STEP_S: Final = 1.0 / SECOND
TILTED: Final = (3, 4)
QUICK: Final = 0.5
"""Share of a step's departure of the rates of roll and pitch that its running mean takes up: a tenth of a second. Sea
and trim are slower. The remainder is the gyro's white noise, and the thrust that a weak thruster lacks when the
controller answers the noise of its sensors."""

GUESSED_MASS, GUESSED_RATE_1_S = 2.0, 3.0
"""Where roll or pitch has no mass and damping, as no dive identifies them unless something turned the vehicle in them:
times the rigid body's inertia, and damping over mass. They shape the answer to a loss; its size is then unknown."""

SELF_COMPENSATED: Final = frozenset(coefficient.name for coefficient in QUADRATICS)


@dataclass(frozen=True)
class Second:
    """A second of a dive at SECOND equal steps, the instants at both ends included.

    nu (n + 1, 6), body axes; attitude (n + 1, 4), w x y z; pwm (n, k), held over each step; voltage_v: NaN if unknown.
    """

    nu: Array
    attitude: Array
    pwm: Array
    voltage_v: float = np.nan


@dataclass(frozen=True)
class Quick:
    """Sums over a second of the quick part of the departure of roll's and pitch's rates, and of that which each
    thruster's loss makes. All are less what goes with the moment about the same axis: how strongly a sound vehicle
    answers that is not known well enough, but that it does not answer another axis's is.

    square (2,): of the departure; known (k, 2): of a thruster's; score (k, 2): of both multiplied; rad²/s².
    """

    square: Array
    known: Array
    score: Array


@dataclass(frozen=True)
class Drift:
    """Drift (6,) over OVER_S seconds to now, m/s and rad/s; NaN in axes without a model.

    driven (6,): the same of the thrust alone, which tells how much of it a share of its force would be. causes (c, 6):
    the drift that each cause of `forces.names_of` makes at unit size. place (2,): north and east of where the watch
    began, m.
    """

    drift: Array
    driven: Array
    causes: Array
    place: Array
    quick: Quick


def sums_of(departed: Array, lost: Array) -> Quick:
    """Sums of the quick departure (n, 2) and of that of each thruster's loss (n, k, 2)."""
    moment = lost.sum(axis=1)
    power = (moment**2).sum(axis=0)
    share = moment / np.where(power > 1e-20, power, np.inf)
    departed = departed - share * (departed * moment).sum(axis=0)
    lost = lost - share[:, None] * (lost * moment[:, None]).sum(axis=0)
    return Quick((departed**2).sum(axis=0), (lost**2).sum(axis=0), (lost * departed[:, None]).sum(axis=0))


class Predictor:
    """Takes one second after the other; `reset` after a gap."""

    def __init__(self, model: Model) -> None:
        self._model = model
        self._names = names_of(model)
        self._kept = 1.0 - np.exp(-STEP_S / model.lag_s) if model.lag_s > 0 else 1.0
        self._late = round(model.delay_s / STEP_S)
        self._supply = Supply()
        guessed = [dof for dof in TILTED if dof not in model.dofs]
        self._mass, self._damping = model.mass.copy(), model.damping.copy()
        self._mass[guessed] *= GUESSED_MASS
        self._damping[guessed] = GUESSED_RATE_1_S * self._mass[guessed]
        self.reset()

    @property
    def thrusters(self) -> int:
        return len(self._model.configuration.thrusters)

    def reset(self) -> None:
        count = len(self._names) + 2
        self._z = np.zeros((count, 6))
        self._slow = np.zeros((self.thrusters + 1, 2))
        self._thrust: Array | None = None
        self._position = np.zeros(2)
        self._past: deque[tuple[Array, Array]] = deque(maxlen=OVER_S)
        self._waiting: deque[Array] = deque(maxlen=self._late + 1)

    def step(self, second: Second) -> Drift | None:
        """The drift to this second; None for the first OVER_S seconds after a reset."""
        nu, middle = second.nu, 0.5 * (second.nu[1:] + second.nu[:-1])
        model = self._model
        thrust = self._thrusts(second)
        attitude = 0.5 * (second.attitude[1:] + second.attitude[:-1])
        force = self._force(middle, thrust, attitude, second)
        north_east = STEP_S * np.cumsum(_axes(attitude)[:, :2] @ middle[:, :3, None], axis=0)[..., 0]
        places = self._position + north_east
        self._position = places[-1]
        columns = forces(model, middle, thrust, attitude, places)
        rate = (self._damping + 2.0 * model.quadratic * np.abs(middle)) / self._mass
        left = np.exp(-rate * STEP_S)
        worth = np.where(rate > 1e-9, (1.0 - left) / np.where(rate > 1e-9, rate, 1.0), STEP_S) / self._mass
        driving = np.concatenate([np.zeros((SECOND, 2, 6)), columns], axis=1) * worth[:, None]
        # The force balance of the model gives y; what the measured velocity has beyond it is z.
        balance = force - (self._damping + model.quadratic * np.abs(middle)) * middle
        driving[:, 0] = nu[1:] - left * nu[:-1] - worth * (balance + self._mass * rate * middle)
        driving[:, 1] = worth * (thrust @ model.matrix.T)
        total = np.zeros_like(self._z)
        z, slow = self._z, self._slow
        rates = [0, *range(2, 2 + self.thrusters)]
        quick = np.empty((SECOND, *slow.shape))
        for k in range(SECOND):
            z = left[k] * z + driving[k]
            total += z
            quick[k] = z[rates][:, TILTED] - slow
            slow = slow + QUICK * quick[k]
        self._z, self._slow = z, slow
        mean, fade = total / SECOND, np.prod(left, axis=0)
        before = self._past[0] if len(self._past) == OVER_S else None
        self._past.append((mean, fade))
        if before is None:
            return None
        over = np.prod([each for _, each in self._past], axis=0)
        drift = mean - over * before[0]
        drift[:, [dof for dof in range(6) if dof not in model.dofs]] = np.nan
        return Drift(drift[0], drift[1], drift[2:], self._position, sums_of(quick[:, 0], quick[:, 1:]))

    def _thrusts(self, second: Second) -> Array:
        """Thrust (n, k) of each thruster over each step, N, with lag, delay and accepted losses."""
        model, law = self._model, self._model.effects.voltage
        asked = model.curve.thrust(second.pwm)
        losses = model.effects.losses
        if losses is not None:
            supply = 1.0 if law is None else self._supply.step(law, second.voltage_v, SECOND * STEP_S)
            asked = np.stack([losses.given(row, supply) for row in asked])
        if self._thrust is None:
            self._thrust = asked[0].copy()
            self._waiting.extend([asked[0]] * (self._late + 1))
        out = np.empty_like(asked)
        for k, row in enumerate(asked):
            self._waiting.append(row)
            before = self._thrust
            self._thrust = before + self._kept * (self._waiting[0] - before)
            out[k] = 0.5 * (before + self._thrust)
        return out

    def _force(self, nu: Array, thrust: Array, attitude: Array, second: Second) -> Array:
        """All forces (n, 6) but damping."""
        model = self._model
        turning = np.stack([np.broadcast_to(f, SECOND) for f in coriolis(model.mass.tolist(), tuple(nu.T))]).T
        held = np.stack(
            [np.broadcast_to(f, SECOND) for f in restoring(model.configuration, tuple(attitude.T))]
        ).T
        force = thrust @ model.matrix.T - turning - held
        hull = {name: value for name, value in model.effects.hull.items() if name not in SELF_COMPENSATED}
        if hull:
            nu_dot = np.diff(second.nu, axis=0) / STEP_S
            wrench = hull_wrench(hull, Reference(tuple(nu.T), tuple(nu_dot.T), 0.0, 0.0))
            force = force - np.stack([np.broadcast_to(f, SECOND) for f in wrench]).T
        return np.asarray(force)
