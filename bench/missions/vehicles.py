"""A vehicle drawn at random: the file that a crew would have written, and the true coefficients."""

import hashlib
import math
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.config import (
    GRAVITY_M_S2,
    Configuration,
    Device,
    Mounting,
    Sensors,
    ThrustCurve,
    VehicleFile,
    load_vehicle,
)
from bridge.vehicle.thrusters import Allocator, thrust_curve

TEMPLATES = (
    "ruvifist:survey",
    "ruvifist:hovering",
    "bluerov2_heavy:heavy",
    "ardusub_vectored:vectored",
    "bolt:bolt",
)
LIGHTEST_KG, HEAVIEST_KG = 11.0, 120.0
STEADY_SPEED_M_S = 0.6
"""Up to at least this speed the righting moment outweighs the Munk moment."""

SHORTEST_COAST_S = 0.3
"""Least mass over damping, s: in this time a vehicle without thrust loses 63 % of its speed."""

LEAST_REACH = 0.1
"""An axis is driven if the thrusters reach it without the others, with this share of the thrust of surge."""


@dataclass(frozen=True)
class DrawnVehicle:
    """The vehicle file, and the truth, SI units, (6,) each.

    name: of the file's configuration. mass: total mass and inertia. damping: linear. trim: constant force.
    disturbance_std, disturbance_time_s: of a first-order Gauss-Markov force on every axis. reach: the largest wrench.
    driven: the degrees of freedom that the thrusters reach independently.
    """

    file: VehicleFile
    name: str
    mass: Array
    damping: Array
    trim: Array
    disturbance_std: Array
    disturbance_time_s: Array
    reach: Array
    driven: tuple[int, ...]

    @property
    def configuration(self) -> Configuration:
        return self.file.vehicle.configurations[self.name]

    @property
    def righting_nm(self) -> float:
        """Weight times the lever of the centre of gravity: restoring moment per sine of the tilt."""
        shape = self.configuration
        return shape.centre_of_gravity_below_buoyancy_m * shape.dry_mass_kg * GRAVITY_M_S2

    @property
    def steady_to_m_s(self) -> float:
        """The speed at which the largest Munk moment equals the righting moment.

        The Munk moment per tilt is u^2 times the difference between the largest and the least of the three total
        masses.
        """
        return math.sqrt(self.righting_nm / float(np.ptp(self.mass[:3])))


@cache
def _template(name: str) -> VehicleFile:
    return load_vehicle(name)


def draw_vehicle(rng: np.random.Generator, label: str) -> DrawnVehicle:
    """A template of configs/vehicles at another size, with drawn thrusters, hydrodynamics and disturbance."""
    template = _template(TEMPLATES[rng.integers(len(TEMPLATES))])
    name = str(template.configuration)
    shape = template.vehicle.configurations[name]
    dry_kg = log_uniform(rng, LIGHTEST_KG, HEAVIEST_KG)
    size = (dry_kg / shape.dry_mass_kg) ** (1 / 3)
    curve = _curve(rng, dry_kg)
    static = thrust_curve(curve, template.path.parent)
    limit_n = rng.uniform(0.6, 0.95) * min(static.max_n, -static.min_n)
    thrusters = tuple(
        replace(t, position_m=tuple(size * rng.uniform(0.9, 1.1) * c for c in t.position_m))
        for t in shape.thrusters
    )
    inertia = np.array(shape.inertia_kgm2) * (dry_kg / shape.dry_mass_kg) * size**2
    inertia = inertia * np.exp(0.15 * rng.standard_normal(3))
    shape = replace(
        shape,
        dry_mass_kg=dry_kg,
        inertia_kgm2=tuple(inertia.tolist()),
        thrusters=thrusters,
        thruster_limit_n=limit_n,
        model={},
        damping="linear",
        net_buoyancy_n=0.0,
    )
    allocator = Allocator(shape, static)
    reach = allocator.reach()
    mass = np.concatenate(
        [
            dry_kg * (1.0 + np.array([rng.uniform(0.05, 0.6), rng.uniform(0.3, 1.2), rng.uniform(0.4, 1.5)])),
            inertia * (1.0 + rng.uniform(0.2, 1.0, 3)),
        ]
    )
    damping = _damping(rng, mass, reach)
    righting_nm = float(np.ptp(mass[:3])) * STEADY_SPEED_M_S**2 * rng.uniform(1.0, 2.5)
    shape = replace(
        shape,
        centre_of_gravity_below_buoyancy_m=righting_nm / (dry_kg * GRAVITY_M_S2),
        net_buoyancy_n=rng.uniform(0.0, 0.06) * float(reach[2]),
    )
    # A tilting moment in proportion to the righting moment: a share of the thrust would roll a light vehicle over.
    scale = np.array([reach[0]] * 3 + [min(reach[5], righting_nm)] * 2 + [reach[5]])
    spread = log_uniform(rng, 0.003, 0.03) * np.exp(0.2 * rng.standard_normal(6))
    sensors = _sensors(rng, size)
    vehicle = replace(
        template.vehicle,
        name=f"bench-{label}",
        thrust_curve=curve,
        configurations={name: shape},
        sensors=sensors,
    )
    digest = hashlib.sha256(repr(vehicle).encode()).hexdigest()
    return DrawnVehicle(
        VehicleFile(template.path, vehicle, name, digest),
        name,
        mass,
        damping,
        0.003 * scale * rng.standard_normal(6),
        scale * np.clip(spread, 0.003, 0.03),
        np.array([log_uniform(rng, 0.5, 10.0) for _ in range(6)]),
        reach,
        _driven(allocator, reach),
    )


def log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return math.exp(rng.uniform(math.log(low), math.log(high)))


def _curve(rng: np.random.Generator, dry_kg: float) -> ThrustCurve:
    """The T200's table, or a quadratic law sized to the vehicle; dead band known, lag 0.05 to 0.25 s."""
    lag_s = rng.uniform(0.05, 0.25)
    if rng.random() < 0.5:
        return ThrustCurve("table", "t200.csv", rng.uniform(12.0, 18.0), lag_s)
    max_n = 25.0 * (dry_kg / 20.0) ** 0.6 * rng.uniform(0.8, 1.3)
    return ThrustCurve(
        "quadratic", lag_s=lag_s, max_n=max_n, dead_band_us=float(rng.choice([0.0, 15.0, 25.0]))
    )


def _damping(rng: np.random.Generator, mass: Array, reach: Array) -> Array:
    """Linear damping: in surge and yaw from a plausible top speed, elsewhere in proportion.

    It is limited so that no axis stops faster than SHORTEST_COAST_S.
    """
    surge = reach[0] / log_uniform(rng, 1.2, 4.0)
    yaw = reach[5] / log_uniform(rng, 1.0, 3.0)
    tilt = mass[3:5] / rng.uniform(0.25, 1.0, 2)
    damping = np.array([surge, surge * rng.uniform(1.0, 2.2), surge * rng.uniform(1.0, 2.5), *tilt, yaw])
    return np.asarray(np.minimum(damping, mass / SHORTEST_COAST_S), dtype=np.float64)


def _driven(allocator: Allocator, reach: Array) -> tuple[int, ...]:
    matrix = allocator.matrix
    alone = np.diag(matrix @ np.linalg.pinv(matrix, rcond=1e-6)) > 0.99
    enough = reach > LEAST_REACH * np.array([reach[0]] * 3 + [0.1 * reach[5]] * 3)
    return tuple(int(dof) for dof in np.flatnonzero(alone & enough))


def _sensors(rng: np.random.Generator, size: float) -> Sensors:
    """DVL off the origin, IMU, depth; a fibre-optic gyro in half of the vehicles."""
    x, y, z = size * rng.uniform(-0.2, 0.2, 3)
    dvl = Device("a50", latency_s=0.01 * int(rng.integers(0, 11)), mounting=Mounting(position_m=(x, y, z)))
    fog = Device("kvh1750") if rng.random() < 0.5 else None
    return Sensors(dvl=dvl, imu=Device("mti300"), fog=fog, depth=Device("bar30"))
