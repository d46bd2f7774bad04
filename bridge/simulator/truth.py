"""What is true of a simulated vehicle: coefficients and disturbance, from `<vehicle file>.truth.yaml`, and noise."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from bridge import schema
from bridge.errors import ConfigError
from bridge.simulator.onset import EAST, HEIGHT, NORTH, OF_THE_SEA, PERIOD, TETHER
from bridge.vehicle.coefficients import (
    ASTERN,
    BY_NAME,
    DAMPINGS,
    LEAST,
    MASSES,
    OF_ANY_VEHICLE,
    QUADRATIC_NAMES,
    START,
    gain_name,
)
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.references import Six

DISTURBANCE_N_PER_KG = 0.35 / 72.0
DELAY = "delay"
"""Dead time between a command and its thrust beyond the vehicle file's, s."""
PLANTED = (*QUADRATIC_NAMES, ASTERN, START, LEAST, DELAY)
BOUNDS = {
    **{name: (0.0, each.high) for name, each in OF_ANY_VEHICLE.items()},
    DELAY: (0.0, 5.0),
    NORTH: (-5.0, 5.0),
    EAST: (-5.0, 5.0),
    TETHER: (0.0, 1e4),
    HEIGHT: (0.0, 20.0),
    PERIOD: (1.0, 60.0),
}
"""Least and largest value of each effect that can be simulated, those of the sea beyond any that a vehicle dives in."""
GAIN = re.compile(r"T\d+_gain")


@dataclass(frozen=True)
class Truth:
    """The true coefficients by name (all twelve), and a stationary first-order coloured disturbance.

    `disturbance_n` and `disturbance_nm` are its standard deviations in every force and every moment. `effects`:
    effects beyond the linear model, by the names of `vehicle/effect_coefficients`; coupling and supply effects are
    not supported. `onset`: effects, likewise and of the sea (`simulator/onset`), that set in `onset_s` after boot and
    replace those of the same name.
    """

    model: dict[str, float]
    disturbance_n: float
    disturbance_nm: float
    disturbance_time_s: float = 1.5
    effects: dict[str, float] = field(default_factory=dict)
    onset: dict[str, float] = field(default_factory=dict)
    onset_s: float = 0.0

    def __post_init__(self) -> None:
        missing = [name for name in BY_NAME if name not in self.model]
        unknown = [name for name in self.model if name not in BY_NAME]
        if missing or unknown:
            lacks = f"lacks {', '.join(missing)}" if missing else ""
            strange = f"does not know {', '.join(unknown)}" if unknown else ""
            problem = " and ".join(filter(None, (lacks, strange)))
            raise ValueError(
                f"model {'is empty' if not self.model else problem}; give each of {', '.join(BY_NAME)}"
            )
        for name, value in self.model.items():
            if not BY_NAME[name].low <= value <= BY_NAME[name].high:
                raise ValueError(
                    f"model: {name} is {value:g}; give {BY_NAME[name].low:g} to {BY_NAME[name].high:g}"
                )
        _check("effects", self.effects, PLANTED)
        _check("onset", self.onset, (*PLANTED, *OF_THE_SEA))
        if min(self.disturbance_n, self.disturbance_nm) < 0 or self.disturbance_time_s <= 0:
            raise ValueError("disturbance: standard deviations can't be negative, its time must be positive")

    @property
    def mass(self) -> Six:
        """Total mass and inertia, kg and kg m2."""
        a, b, c, d, e, f = (self.model[coefficient.name] for coefficient in MASSES)
        return a, b, c, d, e, f

    @property
    def damping(self) -> Six:
        """Linear damping, N/(m/s) and N m/(rad/s)."""
        a, b, c, d, e, f = (self.model[coefficient.name] for coefficient in DAMPINGS)
        return a, b, c, d, e, f

    @property
    def quadratic(self) -> Six:
        """Quadratic drag, N s2/m2 and N m s2/rad2."""
        a, b, c, d, e, f = (self.effects.get(name, 0.0) for name in QUADRATIC_NAMES)
        return a, b, c, d, e, f

    def later(self) -> "Truth":
        """The truth once the effects of `onset` have set in."""
        of_vehicle = {name: value for name, value in self.onset.items() if name not in OF_THE_SEA}
        return replace(self, effects=self.effects | of_vehicle)

    def calm(self) -> "Truth":
        """The same vehicle in still water."""
        return replace(self, disturbance_n=0.0, disturbance_nm=0.0)


def _check(part: str, effects: Mapping[str, float], known: tuple[str, ...]) -> None:
    for name, value in effects.items():
        if name not in known and not GAIN.fullmatch(name):
            raise ValueError(f"{part}: '{name}' can't be simulated; known: {', '.join(known)}, T1_gain ...")
        low, high = BOUNDS.get(name, BOUNDS[gain_name(1)])
        if not low <= value <= high:
            raise ValueError(f"{part}: {name} is {value:g}; give {low:g} to {high:g}")


def load_truth(file: VehicleFile, configuration: str) -> Truth:
    """Load the truth file next to the vehicle file; if it does not exist, use the vehicle file's own complete
    `model`.

    The disturbance is then in proportion to dry mass. Raises ConfigError if neither exists.
    """
    shape = file.vehicle.configurations[file.vehicle.configuration_named(configuration)]
    path = file.path.with_suffix(".truth.yaml")
    if path.exists():
        data = schema.load_yaml(path)
        if not isinstance(data, dict) or configuration not in data:
            raise ConfigError(f"{path}: has no '{configuration}'; add what that configuration truly is")
        return schema.build(Truth, data[configuration], f"{path}: {configuration}")
    force = DISTURBANCE_N_PER_KG * shape.dry_mass_kg
    try:
        linear = {name: value for name, value in shape.model.items() if name in BY_NAME}
        effects = {name: value for name, value in shape.model.items() if name not in linear}
        return Truth(linear, force, force / 6, effects=effects)
    except ValueError as error:
        raise ConfigError(
            f"{file.path}: '{configuration}' can't be simulated: there is no {path.name}, and its own {error}"
        ) from None


@dataclass(frozen=True)
class NoiseLevels:
    """Standard deviations of white noise per sample, constant biases, and the rate at which bottom lock is lost.

    The defaults follow the makers' data sheets: MTi-300 60 ug/sqrt(Hz) and 0.01 deg/s/sqrt(Hz) at 50 Hz of bandwidth,
    DSP-1750 0.013 deg/sqrt(h) at 500 Hz, Bar30 2 mm of resolution; the DVL's level is an assumption.
    """

    dvl_m_s: float = 0.004
    dvl_range_m: float = 0.01
    dvl_dropout: float = 0.01
    accelerometer_m_s2: float = 0.0042
    gyro_rad_s: float = 0.0012
    gyro_bias_rad_s: float = 0.00005
    attitude_rad: float = 0.0003
    fog_rad_s: float = 0.000085
    fog_bias_rad_s: float = 5e-7
    pressure_pa: float = 15.0
    rpm_share: float = 0.002
    gnss_m: float = 1.0
    gnss_m_s: float = 0.05


TYPICAL = NoiseLevels()
QUIET = NoiseLevels(**dict.fromkeys(NoiseLevels.__dataclass_fields__, 0.0))
