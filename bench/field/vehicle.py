"""Drawn ROVs: the crew's vehicle file, and the true vehicle."""

import hashlib
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from bridge.arrays import Array
from bridge.vehicle.config import Configuration, ThrustCurve, Thruster, Vehicle, VehicleFile
from identify.challenge.vehicles import plain_configuration

CURVE, VOLTAGE_V, LAG_S = "t200.csv", 16.0, 0.03
LIMIT_N = 35.0
LIGHTEST_KG, HEAVIEST_KG = 8.0, 30.0
REFERENCE_KG = 13.5
RIGID = (REFERENCE_KG, REFERENCE_KG, REFERENCE_KG, 0.26, 0.23, 0.37)
ADDED = (6.36, 7.12, 18.68, 0.189, 0.135, 0.222)


@dataclass(frozen=True)
class Drag:
    """Published linear and quadratic damping (6,) each of a BlueROV2 Heavy: N s/m, N s2/m2, and about the axes."""

    linear: tuple[float, ...]
    quadratic: tuple[float, ...]


DRAGS = (
    # von Benzon et al. 2022; zero entries are replaced by small values, because no hull is without damping.
    Drag((13.7, 3.3, 33.0, 0.2, 0.8, 0.05), (141.0, 217.0, 190.0, 1.19, 0.47, 1.5)),
    # Wu 2018; with more linear damping about the axes, without which a model never comes to rest.
    Drag((4.03, 6.22, 5.18, 0.3, 0.3, 0.3), (18.18, 21.66, 36.99, 1.55, 1.55, 1.55)),
)


@dataclass(frozen=True)
class FieldVehicle:
    """The crew's file and its text, and the truth, (6,) each: total mass and inertia, linear and quadratic damping."""

    file: VehicleFile
    text: str
    mass: Array
    linear: Array
    quadratic: Array

    @property
    def configuration(self) -> Configuration:
        return next(iter(self.file.vehicle.configurations.values()))

    @property
    def rigid(self) -> Array:
        """Rigid-body diagonal (6,): dry mass three times, then the inertias."""
        shape = self.configuration
        return np.array([shape.dry_mass_kg] * 3 + list(shape.inertia_kgm2))

    @property
    def share(self) -> float:
        """Dry mass over that of a BlueROV2 Heavy."""
        return self.configuration.dry_mass_kg / REFERENCE_KG

    def drag(self, axis: int, speed: float) -> float:
        """Drag, N or N m, at a steady speed along or about an axis."""
        return float(self.linear[axis] * speed + self.quadratic[axis] * speed * abs(speed))


def draw_vehicle(rng: np.random.Generator, name: str) -> FieldVehicle:
    """Draw a BlueROV2 of another size, with another hull and with six or eight thrusters.

    Masses scale as size^3, drags along the axes as size^2, about them as size^5 (quadratic) and size^4 (linear);
    added masses and drags are drawn within a factor of two of that.
    """
    dry_kg = float(np.exp(rng.uniform(np.log(LIGHTEST_KG), np.log(HEAVIEST_KG))))
    scale = dry_kg / REFERENCE_KG
    size = scale ** (1 / 3)
    drag = DRAGS[int(rng.integers(len(DRAGS)))]
    rigid = np.array(RIGID) * scale * np.array([1, 1, 1, size**2, size**2, size**2])
    rigid[3:] *= np.exp(0.1 * rng.standard_normal(3))
    added = np.array(ADDED) * scale * np.array([1, 1, 1, size**2, size**2, size**2]) * _within_two(rng)
    linear = np.array(drag.linear) * np.array([size**2] * 3 + [size**4] * 3) * _within_two(rng)
    quadratic = np.array(drag.quadratic) * np.array([size**2] * 3 + [size**5] * 3) * _within_two(rng)
    eight = bool(rng.random() < 0.6)
    configuration = Configuration(
        dry_mass_kg=round(dry_kg, 2),
        inertia_kgm2=(round(float(rigid[3]), 4), round(float(rigid[4]), 4), round(float(rigid[5]), 4)),
        thrusters=_thrusters(rng, size, eight),
        centre_of_gravity_below_buoyancy_m=round(rng.uniform(0.03, 0.12), 3),
        net_buoyancy_n=round(rng.uniform(0.0, 2.0) * scale, 3),
        thruster_limit_n=LIMIT_N,
    )
    kind = "rov8" if eight else "rov6"
    vehicle = Vehicle(name, {kind: configuration}, thrust_curve=ThrustCurve("table", CURVE, VOLTAGE_V, LAG_S))
    text = vehicle_text(vehicle)
    digest = hashlib.sha256(text.encode()).hexdigest()
    rigid_body = np.array([configuration.dry_mass_kg] * 3 + list(configuration.inertia_kgm2))
    return FieldVehicle(
        VehicleFile(Path(f"{name}/vehicle.yaml"), vehicle, kind, digest),
        text,
        rigid_body + added,
        linear,
        quadratic,
    )


def _within_two(rng: np.random.Generator) -> Array:
    """Factors (6,) between a half and two; most within a third of 1."""
    return np.asarray(np.exp(np.clip(0.35 * rng.standard_normal(6), -math.log(2), math.log(2))))


def _thrusters(rng: np.random.Generator, size: float, eight: bool) -> tuple[Thruster, ...]:
    """Four level thrusters at about 45 degrees, and two or four upright thrusters."""
    angle = math.radians(45.0 + rng.uniform(-8.0, 8.0))
    cos, sin = round(math.cos(angle), 5), round(math.sin(angle), 5)
    x, y = round(0.156 * size * rng.uniform(0.9, 1.2), 3), round(0.111 * size * rng.uniform(0.9, 1.1), 3)
    level = [(sin, x, -y), (-sin, x, y), (-sin, -x, -y), (sin, -x, y)]
    up_x, up_y = round(0.13 * size, 3), round(0.21 * size, 3)
    places = (
        [(up_x, up_y), (up_x, -up_y), (-up_x, up_y), (-up_x, -up_y)] if eight else [(0.0, up_y), (0.0, -up_y)]
    )
    return (
        *(Thruster((cos, side, 0.0), (at_x, at_y, 0.0)) for side, at_x, at_y in level),
        *(Thruster((0.0, 0.0, 1.0), (at_x, at_y, 0.0)) for at_x, at_y in places),
    )


def vehicle_text(vehicle: Vehicle) -> str:
    """The crew's file of a vehicle, as YAML; it holds no drag and no added mass."""
    curve, water = vehicle.thrust_curve, vehicle.water
    data: dict[str, Any] = {
        "name": vehicle.name,
        "water": {
            "density_kg_m3": water.density_kg_m3,
            "surface_pressure_hpa": water.surface_pressure_hpa,
            "gravity_m_s2": water.gravity_m_s2,
        },
        "thrust_curve": {
            "kind": curve.kind, "file": curve.file, "voltage_v": curve.voltage_v, "lag_s": curve.lag_s,
        },
        "configurations": {
            name: {"veh_cfg": 0, **plain_configuration(shape)}
            for name, shape in vehicle.configurations.items()
        },
    }  # fmt: skip
    return yaml.safe_dump(data, sort_keys=False, default_flow_style=None)
