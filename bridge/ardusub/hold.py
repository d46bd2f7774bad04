"""The velocity hold of BOTH beside a pilot's sticks: surge and sway are held to the reference, with little force.

What speaks against a measured velocity ends the hold rather than the pilot's say: silence, or a reading far off the
reference. A stick at rest leaves a snagged vehicle alone.
"""

import math
from collections.abc import Collection, Sequence
from typing import Final

from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import Configuration
from bridge.vehicle.controller import GAINS, Controller, load_gains
from bridge.vehicle.in_force import FaultTexts
from bridge.vehicle.navigation import Navigation
from bridge.vehicle.references import Reference, Six

HOLD_SHARE: Final = 0.1
"""Most that the hold pushes, of the vehicle's reach: 10 N of a BlueROV2, its drag at 0.6 m/s."""
HELD_WITHIN_M_S: Final = 0.5
"""A velocity further off the reference is not held: either it is wrong, or something else holds the vehicle."""
AT_REST_M_S: Final = 0.01
AT_REST_N: Final = 0.1
"""With the stick and the reference at rest the hold remembers nothing: it may have pushed against a snag."""
HELD: Final = (0, 1)


class VelocityHold:
    """Steps with the law; `reach` (6,) is the vehicle's largest wrench, N and N m."""

    def __init__(self, shape: Configuration, reach: Sequence[float]) -> None:
        most = tuple(HOLD_SHARE * limit for limit in reach)
        self._controller = Controller(load_gains(shape.gains, GAINS), shape, most)
        self._faults = FaultTexts()

    def reset(self) -> None:
        """Remember nothing."""
        self._controller.reset(range(6))
        self._faults.report(())

    def step(
        self,
        known: Navigation,
        reference: Reference,
        pilot: Sequence[float],
        off: Collection[int],
        dt_s: float,
    ) -> Six:
        """Force (6,), N, that holds the measured velocity to that of `reference`, which is of the reading's time; zero
        in the degrees of freedom `off`. `pilot` (6,) is the force of the sticks, N and N m."""
        velocity, nu = known.velocity, reference.nu
        astray = [dof for dof in HELD if dof not in off and abs(velocity[dof] - nu[dof]) > HELD_WITHIN_M_S]
        held = [dof for dof in HELD if dof not in off and dof not in astray and math.isfinite(velocity[dof])]
        at_rest = [dof for dof in held if abs(pilot[dof]) < AT_REST_N and abs(nu[dof]) < AT_REST_M_S]
        unheld = [dof for dof in range(6) if dof not in held]
        self._controller.reset((*unheld, *at_rest))
        force = self._controller.step(known, reference, dt_s, False)
        self._controller.reset(unheld)
        words = f"not held: velocity off by over {HELD_WITHIN_M_S:g} m/s"
        self._faults.report(tuple(f"FF {DOFS[dof]} {words}" for dof in astray))
        x, y = (force[dof] if dof in held else 0.0 for dof in HELD)
        return x, y, 0.0, 0.0, 0.0, 0.0

    def take_texts(self) -> list[str]:
        """Sentences for the crew since the last call."""
        return self._faults.take()
