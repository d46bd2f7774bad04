"""Draws vehicles: the vehicle file that a crew would have, and the true parameters."""

import hashlib
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from bridge.arrays import Array
from bridge.vehicle.config import (
    Configuration,
    Device,
    Mounting,
    Sensors,
    ThrustCurve,
    Thruster,
    Vehicle,
    VehicleFile,
)

LAG_S = 0.03
DISTURBANCE_N_KG = 0.35 / 72.0
"""A force of 0.35 N on 72 kg, per kg; the moment in N m is a sixth of it."""


@dataclass(frozen=True)
class _Shape:
    """Mean of the drawn vehicles. total, damping (6): mass and damping with added mass; angle_deg: of the horizontal
    thrusters from x; level, upright: |x| and |y| of the horizontal and vertical thrusters.
    """

    dry_kg: float
    inertia: tuple[float, float, float]
    total: tuple[float, ...]
    damping: tuple[float, ...]
    angle_deg: float
    level: tuple[float, float]
    upright: tuple[float, float]
    limit_n: float


_SHAPES = {
    "hovering": _Shape(
        72.0, (3.2, 9.5, 10.5), (111.6, 112.4, 134.0, 5.2, 15.5, 16.0), (56.0, 53.0, 95.0, 18.0, 26.0, 26.0),
        34.0, (0.42, 0.32), (0.15, 0.2), 40.0,
    ),
    "survey": _Shape(
        72.0, (2.2, 14.0, 14.8), (96.4, 138.0, 146.0, 3.4, 21.0, 22.5), (42.0, 88.0, 110.0, 14.0, 34.0, 22.0),
        8.0, (0.55, 0.18), (0.15, 0.2), 40.0,
    ),
    "observer": _Shape(
        13.5, (0.26, 0.23, 0.37), (19.9, 20.6, 32.2, 0.45, 0.37, 0.6), (20.0, 27.0, 42.0, 0.9, 0.8, 0.8),
        45.0, (0.156, 0.111), (0.12, 0.218), 35.0,
    ),
}  # fmt: skip
"""A long and a flat shape of a 72 kg vehicle (Vangi et al.), and a vehicle like a BlueROV2 (von Benzon et al. 2022)."""


@dataclass(frozen=True)
class DrawnVehicle:
    """The crew's file and the truth.

    mass, damping, disturbance (6,): total mass and inertia, linear damping, standard deviation of the disturbance;
    disturbance_s, poles: its time constant and its one or two poles. speed, sway, turn: reached in missions, m/s and
    rad/s.
    """

    file: VehicleFile
    text: str
    mass: Array
    damping: Array
    disturbance: Array
    disturbance_s: float
    poles: int
    speed: float
    sway: float
    turn: float

    @property
    def configuration(self) -> Configuration:
        return next(iter(self.file.vehicle.configurations.values()))

    @property
    def crew_arm(self) -> Array:
        """Position (3,) of the DVL in the vehicle's file, m."""
        dvl = self.file.vehicle.sensors.dvl
        return np.zeros(3) if dvl is None else np.array(dvl.mounting.position_m)

    @property
    def share(self) -> float:
        """Ratio of its dry mass to 72 kg; forces scale with it."""
        return self.configuration.dry_mass_kg / 72.0

    @property
    def top_thrust_n(self) -> float:
        """Thrust of a horizontal thruster while the vehicle accelerates to its top speed."""
        ahead = sum(abs(t.direction[0]) for t in self.configuration.thrusters)
        return float((self.damping[0] + self.mass[0] / 2.5) * self.speed / ahead)


def draw_vehicle(rng: np.random.Generator, name: str) -> DrawnVehicle:
    """Draw a shape, scale it and vary its hull; the dry mass in the file is within about 1 % of the true mass."""
    kind = list(_SHAPES)[rng.integers(len(_SHAPES))]
    shape = _SHAPES[kind]
    scale = rng.uniform(0.85, 1.25)
    size = scale ** (1 / 3)

    def spread(values: tuple[float, ...], std: float) -> Array:
        return np.array(values) * np.exp(std * rng.standard_normal(len(values)))

    unit = np.array([scale] * 3 + [scale * size**2] * 3)
    dry_kg = shape.dry_kg * scale
    inertia = np.array(shape.inertia) * scale * size**2
    rigid = np.concatenate([np.full(3, dry_kg), inertia])
    added = (np.array(shape.total) * unit - rigid) * np.exp(0.25 * rng.standard_normal(6))
    mass = rigid + added
    damping = spread(shape.damping, 0.2) * unit ** (2 / 3)
    arm = np.round(size * rng.uniform(-0.25, 0.25, 3), 3) if rng.random() < 0.5 else np.zeros(3)
    configuration = Configuration(
        dry_mass_kg=round(float(dry_kg * (1 + 0.004 * rng.standard_normal())), 2),
        inertia_kgm2=(round(float(inertia[0]), 4), round(float(inertia[1]), 4), round(float(inertia[2]), 4)),
        thrusters=_thrusters(shape, size),
        centre_of_gravity_below_buoyancy_m=round(rng.uniform(0.04, 0.07), 3),
        net_buoyancy_n=round(rng.uniform(0.0, 1.5) * dry_kg / 72.0, 3),
        thruster_limit_n=shape.limit_n,
    )
    vehicle = Vehicle(
        name,
        {kind: configuration},
        thrust_curve=ThrustCurve("table", "t200.csv", 16.0, LAG_S),
        sensors=Sensors(
            dvl=Device(
                "wayfinder", mounting=Mounting(position_m=(float(arm[0]), float(arm[1]), float(arm[2])))
            ),
            imu=Device("mti300"),
            fog=Device("kvh1750"),
            depth=Device("bar30"),
        ),
    )
    text = vehicle_text(vehicle)
    speed = rng.uniform(0.28, 0.48)
    force = DISTURBANCE_N_KG * dry_kg * np.exp(0.2 * rng.standard_normal())
    digest = hashlib.sha256(text.encode()).hexdigest()
    return DrawnVehicle(
        VehicleFile(Path(f"{name}/vehicle.yaml"), vehicle, kind, digest),
        text,
        mass,
        damping,
        force * np.array([1.0, 1.0, 1.0, 1 / 6, 1 / 6, 1 / 6]),
        rng.uniform(0.9, 2.5),
        int(rng.choice([1, 1, 2])),
        speed,
        speed * rng.uniform(0.5, 0.8),
        rng.uniform(0.25, 0.45),
    )


def _thrusters(shape: _Shape, size: float) -> tuple[Thruster, ...]:
    """Four horizontal thrusters, turned in or out, and four vertical ones."""
    cos, sin = math.cos(math.radians(shape.angle_deg)), math.sin(math.radians(shape.angle_deg))
    (x, y), (up_x, up_y) = shape.level, shape.upright
    level = [(1, -1, 1), (1, 1, -1), (-1, -1, -1), (-1, 1, 1)]
    upright = [(1, 1), (1, -1), (-1, 1), (-1, -1)]
    return (
        *(
            Thruster((round(cos, 6), round(way * sin, 6), 0.0), (round(a * x * size, 4), round(b * y * size, 4), 0.0))
            for a, b, way in level
        ),
        *(
            Thruster((0.0, 0.0, 1.0), (round(a * up_x * size, 4), round(b * up_y * size, 4), 0.0))
            for a, b in upright
        ),
    )  # fmt: skip


def vehicle_text(vehicle: Vehicle) -> str:
    curve = vehicle.thrust_curve
    dvl = vehicle.sensors.dvl
    data = {
        "name": vehicle.name,
        "thrust_curve": {
            "kind": curve.kind, "file": curve.file, "voltage_v": curve.voltage_v, "lag_s": curve.lag_s,
        },
        "sensors": {
            name: {"kind": device.kind}
            | ({"mounting": {"position_m": list(device.mounting.position_m)}} if device is dvl else {})
            for name, device in vehicle.sensors.present().items()
        },
        "configurations": {
            name: plain_configuration(shape) for name, shape in vehicle.configurations.items()
        },
    }  # fmt: skip
    return yaml.safe_dump(data, sort_keys=False, default_flow_style=None)


def plain_configuration(shape: Configuration) -> dict[str, Any]:
    """A configuration as a vehicle file has it, without drag and added mass."""
    return {
        "dry_mass_kg": shape.dry_mass_kg,
        "inertia_kgm2": list(shape.inertia_kgm2),
        "centre_of_gravity_below_buoyancy_m": shape.centre_of_gravity_below_buoyancy_m,
        "net_buoyancy_n": shape.net_buoyancy_n,
        "thruster_limit_n": shape.thruster_limit_n,
        "thrusters": [
            {"direction": list(t.direction), "position_m": list(t.position_m)} for t in shape.thrusters
        ],
    }
