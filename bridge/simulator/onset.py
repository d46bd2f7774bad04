"""Effects that set in during a simulated dive: a fouled propeller, another drag, a current, waves, a snagged tether."""

import math
from collections.abc import Mapping
from typing import Final

import numpy as np

from bridge.arrays import Array
from bridge.attitude import body_to_earth
from bridge.vehicle.config import GRAVITY_M_S2
from bridge.vehicle.dynamics import coriolis

NORTH, EAST, TETHER = "current_n", "current_e", "tether"
HEIGHT, PERIOD = "wave_height", "wave_period"
OF_THE_SEA: Final = (NORTH, EAST, TETHER, HEIGHT, PERIOD)
"""A current towards north and east, m/s; a line, N/m, from the place at which it snags; waves that run north, from
trough to crest, m, and their period, s."""
USUAL_PERIOD_S: Final = 5.0


class Sea:
    """A level current, waves of deep water and a snagged line.

    `mass`, `damping` and `quadratic` (6,) are the vehicle's, `rigid` (6,) the part of its mass that isn't water.
    """

    def __init__(
        self, effects: Mapping[str, float], mass: Array, rigid: Array, damping: Array, quadratic: Array
    ) -> None:
        self._current = np.array([effects.get(NORTH, 0.0), effects.get(EAST, 0.0), 0.0])
        self._amplitude_m = 0.5 * effects.get(HEIGHT, 0.0)
        self._rate = 2 * math.pi / effects.get(PERIOD, USUAL_PERIOD_S)
        self._moves = bool(self._current.any()) or self._amplitude_m > 0.0
        self._line_n_m = effects.get(TETHER, 0.0)
        self._added, self._damping, self._quadratic = mass - rigid, damping, quadratic
        self._carried = self._added[:3] + rigid[:3]
        self._snagged_at: Array | None = None

    def water(self, state: Array, time_s: float) -> tuple[Array, Array]:
        """Velocity and acceleration of the water at the body, north-east-down (3,) each."""
        if not self._amplitude_m:
            return self._current, np.zeros(3)
        k = self._rate**2 / GRAVITY_M_S2
        fast = self._amplitude_m * self._rate * math.exp(-k * max(state[2], 0.0))
        phase = k * state[0] - self._rate * time_s
        c, s = fast * math.cos(phase), fast * math.sin(phase)
        return self._current + np.array([c, 0.0, -s]), self._rate * np.array([s, 0.0, c])

    def push(self, state: Array, time_s: float) -> Array:
        """Wrench (6,) on a body of this state (13,), N and N m, in addition to that of still water.

        Moving water changes the drag, the Coriolis forces of the added mass, and, as the body turns in it, their
        inertia (Fossen 2011, eqs 8.4 to 8.8); as it speeds up it pushes the volume that the body takes, too (Newman
        1977, section 4.13). The line pulls at the origin, level, in proportion to the distance from where it was
        caught.
        """
        to_body = body_to_earth(state[3:7]).T
        out = np.zeros(6)
        if self._moves:
            velocity, acceleration = self.water(state, time_s)
            water, rate, nu = to_body @ velocity, state[10:13], state[7:13]
            through = nu.copy()
            through[:3] -= water
            added = self._added.tolist()
            out[:3] += self._added[:3] * -np.cross(rate, water) + self._carried * (to_body @ acceleration)
            out += np.array(coriolis(added, nu.tolist())) - np.array(coriolis(added, through.tolist()))
            out += self._drag(nu) - self._drag(through)
        if self._line_n_m:
            if self._snagged_at is None:
                self._snagged_at = state[:2].copy()
            pull = self._line_n_m * (self._snagged_at - state[:2])
            out[:3] += to_body[:, :2] @ pull
        return out

    def _drag(self, nu: Array) -> Array:
        return np.asarray((self._damping + self._quadratic * np.abs(nu)) * nu)
