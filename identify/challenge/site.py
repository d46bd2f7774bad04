"""A vehicle in its water before a dive: the parts that a plant may change."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.config import GRAVITY_M_S2
from identify.challenge.drawn_force import DrawnForce, no_force
from identify.challenge.hull import Hull, bare_hull
from identify.challenge.propellers import Propellers
from identify.challenge.sensors import STEP_S, Faults, honest
from identify.challenge.vehicles import LAG_S, DrawnVehicle
from identify.challenge.world import Body, body

Array = NDArray[np.float64]


@dataclass
class Site:
    """One dive's own copy of everything that can hide something; a plant changes it in place.

    time_s (n,): of the steps and one more; push (n, 6): wrench planted in time alone; water (n, 12): as `world.rates`
    has it, None where it is still; depth_m: at the beginning; fouled, fouled_s: as `dive.Scene` has them; sag, sag_s,
    ripple: of the recorded voltage, by time and by load; drawn: a force of no effect's form.
    """

    vehicle: DrawnVehicle
    time_s: Array
    depth_m: float
    rigid: Array
    added: Array
    damping: Array
    hull: Hull
    prop: Propellers
    faults: Faults
    push: Array
    centre_m: float
    water: Array | None = None
    fouled: float = 0.0
    fouled_s: float = 1.0
    sag: float = 0.02
    sag_s: float = 600.0
    ripple: float = 0.0
    drawn: DrawnForce = field(default_factory=no_force)

    def body(self) -> Body:
        shape = self.vehicle.configuration
        weight_n = shape.dry_mass_kg * GRAVITY_M_S2
        return body(
            self.rigid, self.added, self.damping, np.array([0.0, 0.0, self.centre_m]), weight_n, shape.net_buoyancy_n,
            shape.dry_mass_kg,
        )  # fmt: skip

    def moving_water(self) -> Array:
        """(n, 12) to be filled; still where nothing moved it before."""
        if self.water is None:
            self.water = np.zeros((len(self.time_s), 12))
        return self.water


def site_of(vehicle: DrawnVehicle, ticks: int, tick_steps: int, depth_m: float, floor_m: float) -> Site:
    """A vehicle that hides nothing."""
    shape = vehicle.configuration
    rigid = np.array([shape.dry_mass_kg] * 3 + list(shape.inertia_kgm2))
    time_s = STEP_S * np.arange(ticks * tick_steps + 1, dtype=np.float64)
    k = len(shape.thrusters)
    dvl = vehicle.file.vehicle.sensors.dvl
    arm = np.zeros(3) if dvl is None else np.array(dvl.mounting.position_m)
    prop = Propellers(
        np.array([t.direction for t in shape.thrusters]),
        np.array([t.position_m for t in shape.thrusters]),
        np.ones(k),
        np.zeros(ticks),
        np.zeros(1),
        LAG_S,
        shape.thruster_limit_n,
    )
    return Site(
        vehicle, time_s, depth_m, np.diag(rigid), np.diag(vehicle.mass - rigid), np.diag(vehicle.damping),
        bare_hull(floor_m), prop, honest(arm), np.zeros((len(time_s), 6)), shape.centre_of_gravity_below_buoyancy_m,
    )  # fmt: skip


def sized(low: float, size: float) -> float:
    """`low` at size 0 and ten times it at size 1, evenly in logarithms."""
    return float(low * 10.0**size)


Apply = Callable[[Site, np.random.Generator], None]


@dataclass(frozen=True)
class Planted:
    """One hidden effect. `apply` puts it into a dive's site; what it draws there may differ from dive to dive.

    parameters: the truth in the words of the answer's form, fitted to the library's form where that is another.
    number: which thruster, from 1; 0 for all. size: 0 for the smallest that is drawn, 1 for the largest, ten times it.
    spoils: degrees of freedom whose reading it spoils; empty for a force. needs: `shallow` or `low`, where it acts only
    near the surface or the bottom.
    """

    name: str
    parameters: dict[str, float]
    apply: Apply
    size: float
    number: int = 0
    spoils: tuple[int, ...] = ()
    needs: str = ""
    novel: bool = field(default=False)
