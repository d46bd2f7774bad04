"""Effects that set in during a simulated dive: a fouled propeller, another drag, a current, a snagged tether."""

from collections.abc import Mapping
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.dynamics import coriolis

Array = NDArray[np.float64]

NORTH, EAST, TETHER = "current_n", "current_e", "tether"
OF_THE_SEA: Final = (NORTH, EAST, TETHER)
"""A current towards north and east, m/s; a line, N/m, from the place at which it snags."""


class Sea:
    """A level current and a snagged line; `mass`, `damping` and `quadratic` (6,) are the vehicle's, `rigid` (6,) the
    part of its mass that isn't water."""

    def __init__(
        self, effects: Mapping[str, float], mass: Array, rigid: Array, damping: Array, quadratic: Array
    ) -> None:
        self._current = np.array([effects.get(NORTH, 0.0), effects.get(EAST, 0.0), 0.0])
        self._line_n_m = effects.get(TETHER, 0.0)
        self._added, self._damping, self._quadratic = mass - rigid, damping, quadratic
        self._snagged_at: Array | None = None

    def push(self, state: Array) -> Array:
        """Wrench (6,) on a body of this state (13,), N and N m, in addition to that of still water.

        A current is the water's own velocity (Fossen 2011, eqs 8.4 to 8.8): it changes the drag, the Coriolis forces
        of the added mass, and, as the body turns in it, their inertia. The line pulls at the origin, level, in
        proportion to the distance from where it was caught.
        """
        to_body = _to_body(state)
        out = np.zeros(6)
        if self._current.any():
            water, rate, nu = to_body @ self._current, state[10:13], state[7:13]
            through = nu.copy()
            through[:3] -= water
            added = self._added.tolist()
            out[:3] += self._added[:3] * -np.cross(rate, water)
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


def _to_body(state: Array) -> Array:
    """Matrix (3, 3) from north-east-down to body axes."""
    w, x, y, z = state[3:7]
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
            [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
            [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
