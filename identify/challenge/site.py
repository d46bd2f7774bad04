"""A vehicle in its water before a dive, with everything that a planted effect may change."""

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
    """Everything of one dive that can hide an effect; a plant changes it in place.

    time_s (n,): times of the steps, and one more. push (n, 6): planted wrench that depends on time alone. water (n,
    12): see `world.rates`, None for still water. depth_m: at the beginning. fouled, fouled_s: see `dive.Scene`. sag,
    sag_s, ripple: drop of the recorded voltage with time and with load. drawn: a force of no effect's form.
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
        """Water motion (n, 12), to be added to; zeros if nothing has moved the water yet."""
        if self.water is None:
            self.water = np.zeros((len(self.time_s), 12))
        return self.water


def site_of(vehicle: DrawnVehicle, ticks: int, tick_steps: int, depth_m: float, floor_m: float) -> Site:
    """A site in which the vehicle hides nothing."""
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
    """`low` at size 0 and ten times `low` at size 1, linear in the logarithm."""
    return float(low * 10.0**size)


Apply = Callable[[Site, np.random.Generator], None]


@dataclass(frozen=True)
class Planted:
    """A hidden effect. `apply` plants it in the site of a dive; random values drawn there may differ from dive to dive.

    parameters: the truth in the form of an answer, converted to the library's form if the planted form differs.
    number: of the thruster, from 1; 0 for all. size: 0 for the smallest that is drawn, 1 for the largest, which is
    ten times larger. spoils: degrees of freedom whose reading it falsifies; empty for a force. needs: `shallow` or
    `low` if it acts only near the surface or the bottom.
    """

    name: str
    parameters: dict[str, float]
    apply: Apply
    size: float
    number: int = 0
    spoils: tuple[int, ...] = ()
    needs: str = ""
    novel: bool = field(default=False)
