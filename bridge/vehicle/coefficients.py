"""The only list of coefficients: name, symbol, unit, bounds and parameter id of each.

Total mass and inertia (rigid body plus added) and linear damping of the six degrees of freedom, in Fossen's notation;
added mass is derived from the total and is no parameter of its own. In addition, quadratic damping for hulls whose
vehicle file declares it, and the coefficients of effects that a crew accepted, which are absent if not set: those of
the hull add to the wrench, those of the thrusters to the thrust asked of each.
"""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from bridge.vehicle.config import Configuration

DOFS = ("surge", "sway", "heave", "roll", "pitch", "yaw")
SURGE, SWAY, HEAVE, ROLL, PITCH, YAW = range(6)

Kind = Literal["mass", "damping", "quadratic"]


def fault_of(name: str, value: float, low: float, high: float) -> str:
    """Why a coefficient's value can't be used, "" if it can. Short enough for a STATUSTEXT of 50 characters."""
    if low <= value <= high:
        return ""
    return f"{name} {value:g} out of bounds" if math.isfinite(value) else f"{name} is {value}"


@dataclass(frozen=True, slots=True)
class _Named:
    name: str

    def parameter_id(self, configuration: int) -> str:
        """The MAVLink parameter id for a configuration index: `FF0_M_U`."""
        return f"FF{configuration}_{self.name.upper()}"


@dataclass(frozen=True, slots=True)
class Coefficient(_Named):
    """A coefficient of the nominal model M nu_dot + C(nu) nu + D nu + D2 |nu| nu + g(eta) = tau.

    `dof` indexes `DOFS`; `low` and `high` bound the values that may be fitted or sent to a vehicle.
    """

    symbol: str
    unit: str
    kind: Kind
    dof: int
    low: float
    high: float
    sentence: str


def _mass(name: str, dof: int) -> Coefficient:
    linear = dof < 3
    return Coefficient(
        name,
        f"{name[0]}_{name[2]}",
        "kg" if linear else "kg m2",
        "mass",
        dof,
        0.1 if linear else 1e-3,
        1e5,
        f"total {'mass' if linear else 'inertia'} in {DOFS[dof]}: rigid body plus added",
    )


def _damping(name: str, dof: int) -> Coefficient:
    linear = dof < 3
    unit = "N/(m/s)" if linear else "N m/(rad/s)"
    return Coefficient(
        name, f"{name[0]}_{name[2]}", unit, "damping", dof, 0.0, 1e5, f"linear damping in {DOFS[dof]}"
    )


def _quadratic(name: str, dof: int) -> Coefficient:
    unit = "N s2/m2" if dof < 3 else "N m s2/rad2"
    return Coefficient(
        name, f"{name[0]}_{name[2:]}", unit, "quadratic", dof, 0.0, 1e7, f"quadratic damping in {DOFS[dof]}"
    )


MASSES = tuple(_mass(name, dof) for dof, name in enumerate(("M_u", "M_v", "M_w", "I_p", "I_q", "I_r")))
DAMPINGS = tuple(_damping(name, dof) for dof, name in enumerate(("D_u", "D_v", "D_w", "D_p", "D_q", "D_r")))
COEFFICIENTS = MASSES + DAMPINGS
BY_NAME = {coefficient.name: coefficient for coefficient in COEFFICIENTS}
"""Coefficients of the linear model, which every vehicle has."""

QUADRATICS = tuple(
    _quadratic(name, dof) for dof, name in enumerate(("X_uu", "Y_vv", "Z_ww", "K_pp", "M_qq", "N_rr"))
)
OF_HULL = {coefficient.name: coefficient for coefficient in (*COEFFICIENTS, *QUADRATICS)}
"""All coefficients that an identification can estimate."""

ADDED_MASS_NAMES = ("X_udot", "Y_vdot", "Z_wdot", "K_pdot", "M_qdot", "N_rdot")


Group = Literal["quadratic_drag", "coupling", "thruster_gain", "reverse_loss", "dead_zone", "voltage"]

LEAST_GAIN, MOST_GAIN = 0.3, 2.0
"""A thruster that gives less than 0.3 of its curve needs repair: asking three times as much would burn it."""
MOST_DEAD_SHARE = 0.25
LEAST_VOLTAGE_V, MOST_VOLTAGE_V = 3.0, 1000.0
MOST_VOLTAGE_SHARE = 2.0
MOST_RESISTANCE_OHM = 1.0
MOST_OFFSET_M = 1.0
STALL_M_S, STALL_RAD_S, STALL_ARM_M = 0.2, 0.1, 1.0
"""Bounds drag so that full thrust still reaches this speed; moments use this lever arm."""


@dataclass(frozen=True, slots=True)
class EffectCoefficient(_Named):
    """A coefficient of an accepted effect; `low` and `high` bound the usable values, 0 means absent."""

    unit: str
    group: Group
    low: float
    high: float
    sentence: str

    @property
    def neutral(self) -> float:
        """The value that changes nothing, which an absent one stands for: 1 of a gain."""
        return 1.0 if self.group in ("thruster_gain", "reverse_loss") else 0.0

    def fault(self, value: float) -> str:
        """Why a value can't be used, "" if it can."""
        return fault_of(self.name, value, self.low, self.high)


QUADRATIC_NAMES = tuple(coefficient.name for coefficient in QUADRATICS)
ASTERN, START, LEAST, VOLTAGE, VOLTAGE_SHARE, RESISTANCE = (
    "T_astern", "T_start", "T_least", "T_volt", "T_vshare", "T_ohm",
)  # fmt: skip


def gain_name(number: int) -> str:
    """Name of a thruster's gain; thrusters are numbered from 1."""
    return f"T{number}_gain"


def effect_coefficients(configuration: "Configuration") -> tuple[EffectCoefficient, ...]:
    """All effect coefficients that a feed-forward of this configuration supports, with bounds for its thrust.

    Wrenches have Fossen's signs: X = -X_uu |u| u, Y = -Y_r r - Y_uv |u| v, N = -N_v v - N_uv |u| v - N_munk u v; S_x,
    S_y are first moments of mass about the origin (his eq. 3.57).
    """
    thrust_n = configuration.thruster_limit_n * sum(abs(t.gain) for t in configuration.thrusters)
    count, limit_n = len(configuration.thrusters), configuration.thruster_limit_n
    return _bounded(thrust_n, limit_n, count, configuration.dry_mass_kg)


def _bounded(
    thrust_n: float, limit_n: float, thrusters: int, mass_kg: float
) -> tuple[EffectCoefficient, ...]:
    moment_nm = thrust_n * STALL_ARM_M
    drag, turn = thrust_n / STALL_M_S**2, moment_nm / STALL_RAD_S**2
    dead_n = MOST_DEAD_SHARE * limit_n
    return (
        *(_drag(coefficient, drag if coefficient.dof < 3 else turn) for coefficient in QUADRATICS),
        _coupling("Y_r", "N s/rad", thrust_n / STALL_RAD_S, "sway force of turning"),
        _coupling("N_v", "N s", moment_nm / STALL_M_S, "yaw moment of drifting sideways"),
        _coupling("Y_uv", "N s2/m2", drag, "sway force of drifting while under way"),
        _coupling("N_uv", "N s2/m", moment_nm / STALL_M_S**2, "yaw moment of drifting while under way"),
        _coupling("N_munk", "kg", moment_nm / STALL_M_S**2, "Munk moment beyond that of the masses"),
        _coupling("S_x", "kg m", mass_kg * MOST_OFFSET_M, "first moment of mass ahead"),
        _coupling("S_y", "kg m", mass_kg * MOST_OFFSET_M, "first moment of mass to starboard"),
        _gain(ASTERN, "reverse_loss", "thrust astern over that of the curve"),
        EffectCoefficient(START, "N", "dead_zone", 0.0, dead_n, "so much is asked before a thruster starts"),
        EffectCoefficient(LEAST, "N", "dead_zone", 0.0, dead_n, "thrust below this can't be had"),
        EffectCoefficient(
            VOLTAGE, "V", "voltage", LEAST_VOLTAGE_V, MOST_VOLTAGE_V, "supply at which the curve holds"
        ),
        EffectCoefficient(
            VOLTAGE_SHARE, "1", "voltage", 0.0, MOST_VOLTAGE_SHARE, "share of thrust that goes as its square"
        ),
        EffectCoefficient(RESISTANCE, "ohm", "voltage", 0.0, MOST_RESISTANCE_OHM, "of supply and cables"),
        *(
            _gain(gain_name(number), "thruster_gain", f"thrust of thruster {number} over that of its curve")
            for number in range(1, thrusters + 1)
        ),
    )


def _drag(of: Coefficient, high: float) -> EffectCoefficient:
    motion = "drag along" if of.dof < 3 else "drag of turns about"
    return EffectCoefficient(
        of.name, of.unit, "quadratic_drag", of.low, high, f"quadratic {motion} {'xyz'[of.dof % 3]}"
    )


def _coupling(name: str, unit: str, most: float, sentence: str) -> EffectCoefficient:
    return EffectCoefficient(name, unit, "coupling", -most, most, sentence)


def _gain(name: str, group: Group, sentence: str) -> EffectCoefficient:
    return EffectCoefficient(name, "1", group, LEAST_GAIN, MOST_GAIN, sentence)


OF_ANY_VEHICLE = {coefficient.name: coefficient for coefficient in _bounded(1e5, 1e4, 58, 1e5)}
"""All coefficient names, with bounds wide enough for any vehicle, for as many thrusters as the telemetry can carry."""


@dataclass(frozen=True)
class AcceptedEffect:
    """An effect of the library by name and label, with its library parameters in SI units; `number`: its thruster,
    from 1, or 0 for all."""

    name: str
    label: str
    parameters: dict[str, float]
    number: int = 0
