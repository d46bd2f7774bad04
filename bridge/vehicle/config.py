"""The vehicle file, read from YAML into frozen dataclasses: all that a crew knows of its vehicle before a dive."""

import difflib
import hashlib
import math
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Literal

from bridge import schema
from bridge.arrays import Vector3
from bridge.errors import ConfigError
from bridge.vehicle.coefficients import BY_NAME, OF_HULL

MARK_DIGITS = 16
CONFIGS = Path(__file__).resolve().parents[2] / "configs"
GRAVITY_M_S2 = 9.80665
DRY_MASS_SHARE, INERTIA_SHARE = 0.01, 0.05
"""Default relative standard deviations of the rigid body, if the vehicle file gives none."""


def _above_zero(**values: float) -> None:
    for name, value in values.items():
        if not value > 0:
            raise ValueError(f"{name} must be above 0, it is {value:g}")


def _not_negative(**values: float) -> None:
    for name, value in values.items():
        if not value >= 0:
            raise ValueError(f"{name} can't be negative, it is {value:g}")


@dataclass(frozen=True)
class Water:
    """The water of the dive; the surface pressure is zeroed before every dive."""

    density_kg_m3: float = 998.2
    surface_pressure_hpa: float = 1013.25
    gravity_m_s2: float = GRAVITY_M_S2

    def __post_init__(self) -> None:
        _above_zero(density_kg_m3=self.density_kg_m3, gravity_m_s2=self.gravity_m_s2)

    @property
    def weight_n_m3(self) -> float:
        """Pressure per depth, Pa/m."""
        return self.density_kg_m3 * self.gravity_m_s2

    def depth_m(self, pressure_pa: Any) -> Any:
        """Depth at an absolute pressure; of floats or arrays."""
        return (pressure_pa - 100.0 * self.surface_pressure_hpa) / self.weight_n_m3

    def pressure_pa(self, depth_m: Any) -> Any:
        """Absolute pressure at a depth; of floats or arrays."""
        return 100.0 * self.surface_pressure_hpa + self.weight_n_m3 * depth_m


@dataclass(frozen=True)
class Thruster:
    """A thruster's position and the direction in which positive thrust pushes, in body axes (FRD) from the origin."""

    direction: Vector3
    position_m: Vector3
    gain: float = 1.0

    def __post_init__(self) -> None:
        length = math.sqrt(sum(c * c for c in self.direction))
        if not 0.99 < length < 1.01:
            raise ValueError(f"direction must have length 1, this one has {length:.3f}")


LONGEST_DELAY_S = 2.0
"""Twice the longest delay that is ever fitted."""


@dataclass(frozen=True)
class ThrustCurve:
    """The curve from PWM to thrust: a table under configs/thrusters (or next to the vehicle file), or a formula.

    - kind `table`: `file` with the columns voltage_v, pwm_us, thrust_n, read at `voltage_v`.
    - kind `quadratic`: thrust = max_n * o |o| with o = (pwm - neutral_us) / span_us, zero within `dead_band_us`.
    - `neutral_us`: the pulse of a thruster at rest. `one_way`: pulses below it give no thrust.
    - `delay_s` is the dead time between a command and the onset of its thrust, `lag_s` the first-order lag after it;
      `max_n` also scales the quadratic formula.
    - `scale_std`: relative standard deviation of a common factor on all thrust. 0.1 is the geometric middle of the 5
      to 20 % by which published curves are off; a bollard pull of the vehicle's own thrusters makes it about 0.02.
    - `forward_n_s2`, `reverse_n_s2`: T = k n |n| with n in rev/s, for conversions to shaft speed.
    """

    kind: Literal["table", "quadratic"] = "table"
    file: str = "t200.csv"
    voltage_v: float = 16.0
    lag_s: float = 0.0
    delay_s: float = 0.0
    max_n: float = 50.0
    span_us: float = 400.0
    dead_band_us: float = 0.0
    forward_n_s2: float = 0.01427
    reverse_n_s2: float = 0.01135
    scale_std: float = 0.1
    neutral_us: float = 1500.0
    one_way: bool = False

    def __post_init__(self) -> None:
        _above_zero(max_n=self.max_n, span_us=self.span_us, neutral_us=self.neutral_us)
        _above_zero(forward_n_s2=self.forward_n_s2, reverse_n_s2=self.reverse_n_s2)
        _not_negative(
            lag_s=self.lag_s, delay_s=self.delay_s, dead_band_us=self.dead_band_us, scale_std=self.scale_std
        )
        if self.delay_s > LONGEST_DELAY_S:
            raise ValueError(
                f"delay_s is in seconds and at most {LONGEST_DELAY_S:g}, it is {self.delay_s:g}: no thruster answers "
                "so late"
            )


def dive_mark(sha256: str) -> str:
    """Return the first 16 digits of a recording's SHA-256, as priors list it."""
    return sha256[:MARK_DIGITS]


@dataclass(frozen=True)
class Prior:
    """Knowledge of a coefficient before a dive: `value` and standard deviation `std` in its unit, and its `source`.

    `rests_on`: the kind of force that it was measured with. `weight` (weighed, towed, a hung weight) is independent
    of the thrusters; `thrust` (identified in a dive) carries the error of this vehicle file's thrust. `dive_sha256`:
    the recording that it was identified from; `dive_opening`: the SHA-256 of that recording's beginning, which a cut
    copy shares; `earlier_dives`: the dives behind the priors of that identification, in the form of `dives`. The
    prior must not be combined with any of these dives again.
    """

    value: float
    std: float
    source: str = ""
    rests_on: Literal["weight", "thrust"] = "weight"
    dive_sha256: str = ""
    earlier_dives: tuple[str, ...] = ()
    dive_opening: str = ""

    def __post_init__(self) -> None:
        _above_zero(value=self.value, std=self.std)

    @property
    def dives(self) -> tuple[str, ...]:
        """All dives that the prior rests on, each in the form of `dive_mark`, newest first."""
        marks = filter(None, map(dive_mark, (self.dive_sha256, self.dive_opening)))
        return tuple(dict.fromkeys((*marks, *self.earlier_dives)))


Damping = Literal["linear", "quadratic", "both"]

MOST_APART = 12.0
"""Times by which the reach of the thrusters may differ from the hull's radius of gyration, either way: thrusters sit on
the hull, and grams for kilograms make a factor of 32 of it."""

MOST_VEH_CFG = 99_999
"""With more digits a parameter's name would have more than the 16 characters of MAVLink's: `FF99999_T_VSHARE`."""


@dataclass(frozen=True)
class Configuration:
    """One physical setup of the vehicle. `veh_cfg` is its VEH_CFG value (its place in the list if left out).

    `inertia_kgm2`: rigid body, about x y z. `model` holds coefficients by name (`M_u` ... `D_r`) from which the
    feed-forward starts, each known to the share `model_std`; `priors` holds values with standard deviations, known
    before a dive is identified.
    `dry_mass_std_kg`, `inertia_std_kgm2`: uncertainty of the rigid body; 1 % and 5 % by default, the accuracy of a
    hanging scale and a drawing. `gains` names the controller's gain table. `damping`: the drag terms of the hull's
    own model; drag that this model lacks but a dive shows is diagnosed as a cause. Quadratic damping (`X_uu` ...
    `N_rr`) may be in `model` and have priors only if the hull's model has it.
    """

    dry_mass_kg: float
    inertia_kgm2: Vector3
    thrusters: tuple[Thruster, ...]
    centre_of_gravity_below_buoyancy_m: float = 0.0
    net_buoyancy_n: float = 0.0
    thruster_limit_n: float = 40.0
    veh_cfg: int | None = None
    damping: Damping = "linear"
    model: dict[str, float] = field(default_factory=dict)
    model_std: float = 0.1
    gains: str = "conservative"
    priors: dict[str, Prior] = field(default_factory=dict)
    dry_mass_std_kg: float | None = None
    inertia_std_kgm2: Vector3 | None = None

    def __post_init__(self) -> None:
        _above_zero(dry_mass_kg=self.dry_mass_kg, thruster_limit_n=self.thruster_limit_n)
        _not_negative(dry_mass_std_kg=self.dry_mass_std_kg or 0.0)
        if min(self.inertia_std_kgm2 or (0.0,)) < 0:
            raise ValueError(f"inertia_std_kgm2 can't be negative, it is {list(self.inertia_std_kgm2 or ())}")
        if min(self.inertia_kgm2) <= 0:
            raise ValueError(
                f"inertia_kgm2 must be positive about every axis, it is {list(self.inertia_kgm2)}"
            )
        _above_zero(model_std=self.model_std)
        self._check_units()
        if not 0 <= (self.veh_cfg or 0) <= MOST_VEH_CFG:
            raise ValueError(
                f"veh_cfg is a number from 0 to {MOST_VEH_CFG}, which stands in parameters' names; it is {self.veh_cfg}"
            )
        known = BY_NAME if self.damping == "linear" else OF_HULL
        for key, names in (("model", self.model), ("priors", self.priors)):
            for name in names:
                if name not in OF_HULL:
                    raise ValueError(f"{key}: unknown coefficient '{name}'; known: {', '.join(known)}")
                if name not in known:
                    raise ValueError(
                        f"{key}: {name} is quadratic drag, which a hull with damping: linear does not have; write "
                        "damping: both, or quadratic"
                    )

    def _check_units(self) -> None:
        """Raise ValueError if the hull's radius of gyration is far smaller or larger than the reach of its thrusters:
        mass or inertia is then in other units, as a mass in grams."""
        reach_m = max((math.hypot(*thruster.position_m) for thruster in self.thrusters), default=0.0)
        radius_m = math.sqrt(max(self.inertia_kgm2) / self.dry_mass_kg)
        if reach_m > 0 and not reach_m / MOST_APART < radius_m < reach_m * MOST_APART:
            raise ValueError(
                f"dry_mass_kg {self.dry_mass_kg:g} and inertia_kgm2 {list(self.inertia_kgm2)} make a radius of "
                f"gyration of {radius_m:.2g} m, and the thrusters reach {reach_m:.2g} m: give the mass in kg, the "
                "inertia in kg m2 and positions in m"
            )

    def rigid_body(self, dof: int) -> tuple[float, float]:
        """Dry mass (kg) or rigid-body inertia (kg m2) of a degree of freedom, and its standard deviation."""
        if dof < 3:
            std_kg = self.dry_mass_std_kg
            return self.dry_mass_kg, DRY_MASS_SHARE * self.dry_mass_kg if std_kg is None else std_kg
        inertia, std = self.inertia_kgm2[dof - 3], self.inertia_std_kgm2
        return inertia, INERTIA_SHARE * inertia if std is None else std[dof - 3]


@dataclass(frozen=True)
class Mounting:
    """A device's mounting: body = R(rotation) * signs * device axes, rotation Rz(yaw) Ry(pitch) Rx(roll)."""

    rotation_deg: Vector3 = (0.0, 0.0, 0.0)
    signs: Vector3 = (1.0, 1.0, 1.0)
    position_m: Vector3 = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if any(abs(sign) != 1.0 for sign in self.signs):
            raise ValueError(f"signs are 1 or -1 each, not {list(self.signs)}")


DeviceKind = Literal["wayfinder", "a50", "mti300", "kvh1750", "kvh1760", "esc", "ublox", "bar30"]


@dataclass(frozen=True)
class Device:
    """A device on the vehicle: its kind, its port (`bus:address` for I2C) and the latency of its readings.

    `rate_hz` 0 means the device's usual rate. `poles` is the number of magnets of a motor, for speed controllers.
    """

    kind: DeviceKind
    port: str = ""
    baud: int = 115200
    latency_s: float = 0.0
    mounting: Mounting = field(default_factory=Mounting)
    rate_hz: float = 0.0
    poles: int = 14

    def __post_init__(self) -> None:
        _above_zero(baud=self.baud, poles=self.poles)
        _not_negative(rate_hz=self.rate_hz)


@dataclass(frozen=True)
class Sensors:
    """The vehicle's sensors; each may be absent."""

    dvl: Device | None = None
    imu: Device | None = None
    fog: Device | None = None
    depth: Device | None = None
    esc: Device | None = None
    gnss: Device | None = None

    def present(self) -> dict[str, Device]:
        slots = (slot.name for slot in fields(self))
        return {name: device for name in slots if (device := getattr(self, name)) is not None}


@dataclass(frozen=True)
class Vehicle:
    """A vehicle: water, thrust curve, sensors and configurations by name, in the order of the file."""

    name: str
    configurations: dict[str, Configuration]
    water: Water = field(default_factory=Water)
    thrust_curve: ThrustCurve = field(default_factory=ThrustCurve)
    sensors: Sensors = field(default_factory=Sensors)
    system_id: int = 1
    component_id: int = 1

    def __post_init__(self) -> None:
        for name, number in (("system_id", self.system_id), ("component_id", self.component_id)):
            if not 1 <= number <= 255:
                raise ValueError(f"{name} must lie in 1 to 255, it is {number}")
        if not self.configurations:
            raise ValueError("configurations: a vehicle needs at least one")
        indices = [self.veh_cfg(name) for name in self.configurations]
        if len(set(indices)) != len(indices):
            raise ValueError(
                f"configurations: two share a VEH_CFG value ({indices}); give each its own veh_cfg"
            )

    def veh_cfg(self, name: str) -> int:
        given = self.configurations[name].veh_cfg
        return list(self.configurations).index(name) if given is None else given

    @property
    def by_veh_cfg(self) -> dict[int, str]:
        """Names of the configurations by their VEH_CFG values."""
        return {self.veh_cfg(name): name for name in self.configurations}

    @property
    def listed(self) -> str:
        """The configurations in words: `0 survey, 1 hovering`."""
        return ", ".join(f"{number} {name}" for number, name in self.by_veh_cfg.items())

    def configuration_named(self, name: str) -> str:
        """Return `name`, checked. Raises ConfigError if the vehicle has no such configuration."""
        if name not in self.configurations:
            raise ConfigError(
                f"vehicle '{self.name}' has no configuration '{name}'; it has {', '.join(self.configurations)}"
            )
        return name

    def configuration_at(self, veh_cfg: int | None) -> str:
        """Return the name of the configuration with this VEH_CFG value. Raises ConfigError if there is none.

        None (a recording without VEH_CFG) means the vehicle's only configuration.
        """
        if veh_cfg in self.by_veh_cfg:
            return self.by_veh_cfg[veh_cfg]
        if veh_cfg is None and len(self.configurations) == 1:
            return next(iter(self.configurations))
        said = "says no VEH_CFG" if veh_cfg is None else f"says VEH_CFG {veh_cfg}"
        file_hint = "" if veh_cfg is None else "give the file of the vehicle that was recorded, or "
        raise ConfigError(
            f"the recording {said}, vehicle '{self.name}' has {self.listed}; {file_hint}name one: --vehicle "
            "FILE:CONFIGURATION"
        )


@dataclass(frozen=True)
class VehicleFile:
    """A loaded vehicle file: path, vehicle, the configuration that the user named (or None), and the file's hash."""

    path: Path
    vehicle: Vehicle
    configuration: str | None
    sha256: str

    def configuration_of(self, index: int | None) -> str:
        """The configuration that was named, or else that of a recording's `index` (VEH_CFG).

        Raises ConfigError if neither tells it.
        """
        return self.configuration or self.vehicle.configuration_at(index)

    def configuration_chosen(self, otherwise: str = "") -> str:
        """The configuration that was named; or else `otherwise`, if the vehicle has it, or the vehicle's only one.

        Raises ConfigError if several are left to choose from.
        """
        configurations = self.vehicle.configurations
        chosen = self.configuration or (otherwise if otherwise in configurations else None)
        if chosen is None and len(configurations) > 1:
            raise ConfigError(
                f"vehicle '{self.vehicle.name}' has {', '.join(configurations)}; name one: --vehicle FILE:CONFIGURATION"
            )
        return chosen or next(iter(configurations))


def shipped_vehicles() -> list[str]:
    """The names of the vehicle files in configs/vehicles."""
    return sorted(p.stem for p in (CONFIGS / "vehicles").glob("*.yaml") if not p.stem.endswith(".truth"))


def load_vehicle(argument: str) -> VehicleFile:
    """Load the vehicle of `FILE[:CONFIGURATION]`; a bare name is looked up in configs/vehicles.

    Raises ConfigError with the file, the key and the nearest known key.
    """
    try:
        path, configuration = _named(argument)
    except OSError as error:
        raise ConfigError(f"{argument}: {schema.why_unread(error)}; give another file") from None
    data = schema.load_yaml(path)
    vehicle = schema.build(Vehicle, data, str(path))
    if configuration is not None:
        vehicle.configuration_named(configuration)
    return VehicleFile(path, vehicle, configuration, hashlib.sha256(path.read_bytes()).hexdigest())


def _named(argument: str) -> tuple[Path, str | None]:
    """The file and the configuration that `FILE[:CONFIGURATION]` names. Raises ConfigError if there is none, OSError
    where nobody may look."""
    text, configuration = argument, None
    head, _, tail = argument.rpartition(":")
    if head and not Path(argument).exists() and "/" not in tail and "\\" not in tail:
        text, configuration = head, tail
    path = Path(text)
    bundled = CONFIGS / "vehicles" / f"{text}.yaml"
    # A folder of that name, as a crew has for its dives, hides no bundled file.
    if not path.is_file() and bundled.exists():
        path = bundled
    if not path.exists():
        raise ConfigError(f"{text}: no such file; {_nearest(path.stem)}")
    return path, configuration


def _nearest(name: str) -> str:
    """Suggest a name in place of a vehicle file that does not exist."""
    names = shipped_vehicles()
    near = difflib.get_close_matches(name, names, n=1)
    if near:
        return f"did you mean '{near[0]}'?"
    return f"give a file, or one of {', '.join(names)}"
