"""A vehicle in its water before a dive: the parts that a hidden effect may change."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bench.field.dive import EACH, STEP_S
from bench.field.mission import Pilot
from bench.field.vehicle import LAG_S, FieldVehicle
from bridge.arrays import Array
from bridge.vehicle.config import GRAVITY_M_S2
from identify.challenge.equations_of_motion import Body, body
from identify.challenge.hull import Hull, Propellers, bare_hull

FLOOR_M = 60.0


@dataclass
class FieldScenario:
    """A dive's own copy of everything that can hide an effect; a plant changes it in place.

    time_s (n,): of the steps and one more; push (n, 6): wrench that depends on time alone; moved (n, 12): motion of
    the water as `state_derivative` takes it, None for still water; grown: share by which all drag grows per second;
    felt_ohm, felt_fall: as in `dive.Supply`. rigid, added, linear (6, 6).
    """

    vehicle: FieldVehicle
    pilot: Pilot
    time_s: Array
    depth_m: float
    rigid: Array
    added: Array
    linear: Array
    hull: Hull
    prop: Propellers
    push: Array
    moved: Array | None = None
    grown: float = 0.0
    felt_ohm: float = 0.0
    felt_fall: float = 0.0

    def body(self) -> Body:
        shape = self.vehicle.configuration
        centre = np.array([0.0, 0.0, shape.centre_of_gravity_below_buoyancy_m])
        weight_n = shape.dry_mass_kg * GRAVITY_M_S2
        return body(
            self.rigid, self.added, self.linear, centre, weight_n, shape.net_buoyancy_n, shape.dry_mass_kg
        )

    def water(self) -> Array:
        """The array (n, 12) of water motion for a plant to fill; created as still water at the first call."""
        if self.moved is None:
            self.moved = np.zeros((len(self.time_s), 12))
        return self.moved


def scenario_of(vehicle: FieldVehicle, pilot: Pilot, ticks: int, depth_m: float) -> FieldScenario:
    """A vehicle whose only hidden effect is its own quadratic drag."""
    shape = vehicle.configuration
    time_s = STEP_S * np.arange(ticks * EACH + 1, dtype=np.float64)
    k = len(shape.thrusters)
    prop = Propellers(
        np.array([t.direction for t in shape.thrusters]), np.array([t.position_m for t in shape.thrusters]),
        np.ones(k), np.zeros(ticks), np.zeros(1), LAG_S, shape.thruster_limit_n, reverse_n=0.05, wash_n=0.1,
    )  # fmt: skip
    hull = bare_hull(FLOOR_M)._replace(
        drag=vehicle.quadratic.copy(), drag_power=2.0, stall=0.0, rise=0.0, slack_m=1e6, wave_ref=depth_m
    )
    rigid = vehicle.rigid
    return FieldScenario(
        vehicle, pilot, time_s, depth_m, np.diag(rigid), np.diag(vehicle.mass - rigid), np.diag(vehicle.linear),
        hull, prop, np.zeros((len(time_s), 6)),
    )  # fmt: skip


Apply = Callable[[FieldScenario, np.random.Generator], None]


@dataclass(frozen=True)
class Planted:
    """A hidden effect. parameters: planted values, by the names that an answer uses, SI units.

    `apply` adds the effect to a dive's scenario; random parts such as the phases of a sea may differ from dive to dive.
    """

    name: str
    parameters: dict[str, float]
    apply: Apply
