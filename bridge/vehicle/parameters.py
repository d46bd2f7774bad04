"""The table of a vehicle's parameters: name, bounds and default of each, and the checksum of a set of them."""

import math
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from bridge.errors import ConfigError
from bridge.vehicle.coefficients import COEFFICIENTS, Coefficient, EffectCoefficient, effect_coefficients
from bridge.vehicle.config import Configuration, Vehicle

MODE: Final = "FF_MODE"
COMMIT: Final = "FF_COMMIT"
ACTIVE: Final = "FF_ACTIVE"
VERSION: Final = "FF_VERSION"

# Limits of total mass and inertia for any vehicle, as fractions of its dry mass and rigid-body inertia. They are wide:
# the added mass of a slender hull in heave, or the added inertia of a flat hull in pitch, is several times that of the
# rigid body, and the dry mass in a vehicle file may be a guess.
TOTAL_MASS_PARTS: Final = (0.3, 30.0)
TOTAL_INERTIA_PARTS: Final = (0.1, 100.0)
# Least damping, as a fraction of dry mass or inertia. With less, the rigid body alone would coast for hours, which is
# never meant: the feed-forward would fly half a model. A damping that is left out is 0.
LEAST_DAMPING_PER_S: Final = 1e-4
# A damping is too large if all thrusters together, each on an arm of ARM_M, couldn't keep up this crawl.
CRAWL_M_S: Final = 0.05
CRAWL_RAD_S: Final = 0.02
ARM_M: Final = 1.0

FLOAT = struct.Struct("<f")


def to_float32(value: float) -> float:
    """Return `value` as the wire carries it: infinity if it is too large, and never -0."""
    try:
        return float(FLOAT.unpack(FLOAT.pack(value))[0]) + 0.0
    except OverflowError:
        return math.copysign(math.inf, value)


@dataclass(frozen=True, slots=True)
class Parameter:
    """One row of the vehicle's parameter table. The value 0.0 means not set, whatever the bounds."""

    name: str
    low: float
    high: float
    default: float
    veh_cfg: int = 0
    coefficient: str = ""

    def admits(self, value: float) -> bool:
        return value == 0.0 or self.low <= value <= self.high


def set_crc(values: Mapping[str, float]) -> int:
    """Checksum of a set of parameters: 24 bits, so that a float32 carries it exactly; never 0.

    The low 24 bits of the CRC-32 over every name, "=" and its value's float32 bits (little-endian), sorted by name.
    """
    text = b"".join(name.encode() + b"=" + FLOAT.pack(values[name] + 0.0) for name in sorted(values))
    return zlib.crc32(text) & 0xFFFFFF or 1


def vehicle_table(vehicle: Vehicle) -> tuple[Parameter, ...]:
    """Parameter table of a vehicle: the model coefficients of every configuration, then those of the effects.

    The default of a coefficient is its value in the vehicle file's model; 0, absent, if that has none. The
    bounds of a model coefficient are narrowed to values that a vehicle of this mass and thrust can have. Raises
    ConfigError if the vehicle file's model is out of bounds.
    """
    shapes = [(vehicle.veh_cfg(name), shape) for name, shape in vehicle.configurations.items()]
    model = [_row(coefficient, veh_cfg, shape) for veh_cfg, shape in shapes for coefficient in COEFFICIENTS]
    effects = [
        _row(effect, veh_cfg, shape) for veh_cfg, shape in shapes for effect in effect_coefficients(shape)
    ]
    for row in (*model, *effects):
        if not row.admits(row.default):
            raise ConfigError(
                f"vehicle '{vehicle.name}': model: {row.coefficient} is {row.default:g}; "
                f"give a value from {row.low:g} to {row.high:g}"
            )
    return (*model, *effects)


def _row(of: Coefficient | EffectCoefficient, veh_cfg: int, shape: Configuration) -> Parameter:
    if isinstance(of, Coefficient):
        low, high = bounds(of, shape)
    else:
        low, high = to_float32(of.low), to_float32(of.high)
    default = to_float32(shape.model.get(of.name, 0.0))
    return Parameter(of.parameter_id(veh_cfg), low, high, default, veh_cfg, of.name)


def bounds(coefficient: Coefficient, shape: Configuration) -> tuple[float, float]:
    """Return the least and the greatest value of a coefficient for a vehicle of this configuration."""
    if coefficient.kind == "mass" and coefficient.dof < 3:
        low, high = (part * shape.dry_mass_kg for part in TOTAL_MASS_PARTS)
    elif coefficient.kind == "mass":
        low, high = (part * shape.inertia_kgm2[coefficient.dof - 3] for part in TOTAL_INERTIA_PARTS)
    else:
        thrust_n = shape.thruster_limit_n * sum(abs(thruster.gain) for thruster in shape.thrusters)
        low = LEAST_DAMPING_PER_S * shape.rigid_body(coefficient.dof)[0]
        high = thrust_n / CRAWL_M_S if coefficient.dof < 3 else thrust_n * ARM_M / CRAWL_RAD_S
    return to_float32(max(low, coefficient.low)), to_float32(min(high, coefficient.high))
