"""Limits of a plan, and trials of a plan in simulation."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bridge.arrays import Array
from bridge.simulator.direct import QUIET, simulate_truth
from bridge.simulator.truth import Truth
from bridge.vehicle.coefficients import BY_NAME
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.legs import Leg, Mission
from bridge.vehicle.thrusters import Allocator, thrust_curve
from identify.planning.knowledge import Knowledge

START_DEPTH_M = 1.5
REST_S = 5.0
NOTHING_N = 0.01


@dataclass(frozen=True)
class Limits:
    """Space across and up and down, speed (half of it up and down), yaw rate, share of each thruster's limit.

    `depth_space_m` None means as much as across.
    """

    space_m: float = 6.0
    speed_m_s: float = 0.5
    turn_rad_s: float = math.radians(20)
    thrust_share: float = 0.5
    depth_space_m: float | None = None

    @property
    def heave_m_s(self) -> float:
        return 0.5 * self.speed_m_s

    @property
    def heave_m(self) -> float:
        """Room up and down: at most the start depth, so that the vehicle does not reach the surface."""
        return min(self.space_m if self.depth_space_m is None else self.depth_space_m, START_DEPTH_M)


@dataclass(frozen=True)
class Trial:
    """Result of a mission in still water.

    `nu` (n, 6): body velocity at every control tick. `across_m`: space that it takes along its first heading (north)
    or abeam, whichever is more; `depth_m`: up and down. `thrust_share`: used share of the limit, of the thruster that
    works hardest.
    """

    nu: Array
    across_m: float
    depth_m: float
    thrust_share: float

    def over(self, limits: Limits) -> float:
        """Largest ratio of a used quantity to its limit; up to 1 is allowed."""
        u, v, w, r = (self.nu[:, dof] for dof in (0, 1, 2, 5))
        return float(
            max(
                np.max(np.hypot(u, v)) / limits.speed_m_s,
                np.max(np.abs(w)) / limits.heave_m_s,
                np.max(np.abs(r)) / limits.turn_rad_s,
                self.across_m / limits.space_m,
                self.depth_m / limits.heave_m,
                self.thrust_share / limits.thrust_share,
            )
        )


class Tank:
    """Simulated still water for trials of plans, with the vehicle at its presumed coefficients."""

    def __init__(self, file: VehicleFile, configuration_name: str, knowledge: Knowledge) -> None:
        self.file, self.configuration_name, self.knowledge = file, configuration_name, knowledge
        model = {name: value for name, value in knowledge.values.items() if name in BY_NAME}
        quadratic = {name: value for name, value in knowledge.values.items() if name not in BY_NAME}
        self._truth = Truth(model, 0.0, 0.0, effects=quadratic)
        self._curve = thrust_curve(file.vehicle.thrust_curve, file.path.parent)
        self._allocator = Allocator(file.vehicle.configurations[configuration_name], self._curve)

    def force(self, dof: int, share: float) -> float:
        """Force or moment (N, N m) along an axis at which the first thruster to saturate reaches this share of its
        limit; 0 if the thrusters can't push along that axis alone.
        """
        unit = np.eye(6)[dof]
        thrust, _, _ = self._allocator.allocate(unit)
        made = self._allocator.matrix @ thrust
        worst = self._share(thrust)
        return share / worst if worst > 0 and np.allclose(made, unit, atol=1e-6) else 0.0

    def pulses(self, wrench: Sequence[float]) -> tuple[float, ...]:
        """Pulse width (us) of each thruster for a wrench (6,)."""
        thrust, _, _ = self._allocator.allocate(wrench)
        return tuple(self._curve.pwm(np.where(np.abs(thrust) < NOTHING_N, 0.0, thrust)).tolist())

    def dive(self, legs: list[Leg]) -> Trial:
        """Simulate the legs between two rests."""
        pause = [Leg(REST_S, "rest", "rest")]
        run = simulate_truth(
            self.file,
            self.configuration_name,
            Mission("trial", (*pause, *legs, *pause), START_DEPTH_M),
            seed=0,
            noise=QUIET,
            truth=self._truth,
        )
        north, east, down = np.ptp(run.state[:, :3], axis=0)
        inverse = np.linalg.pinv(self._allocator.matrix, rcond=1e-6)
        worst = max(self._share(thrust) for thrust in run.column("tau_cmd") @ inverse.T)
        return Trial(run.nu, float(max(north, east)), float(down), worst)

    def _share(self, thrust: Array) -> float:
        return float(np.max(np.maximum(thrust / self._allocator.high_n, thrust / self._allocator.low_n)))
