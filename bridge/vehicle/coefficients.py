"""The only list of hydrodynamic coefficients: name, symbol, unit, bounds and parameter id of each.

Total mass and inertia (rigid body plus added) and linear damping of the six degrees of freedom, in Fossen's notation;
added mass is derived from the total and is no parameter of its own. In addition, quadratic damping for hulls whose
vehicle file declares it.
"""

import math
from dataclasses import dataclass
from typing import Literal

DOFS = ("surge", "sway", "heave", "roll", "pitch", "yaw")

Kind = Literal["mass", "damping", "quadratic"]


def fault_of(name: str, value: float, low: float, high: float) -> str:
    """Why a coefficient's value can't be used, "" if it can. Short enough for a STATUSTEXT of 50 characters."""
    if low <= value <= high:
        return ""
    return f"{name} {value:g} out of bounds" if math.isfinite(value) else f"{name} is {value}"


@dataclass(frozen=True, slots=True)
class Coefficient:
    """A coefficient of the nominal model M nu_dot + C(nu) nu + D nu + D2 |nu| nu + g(eta) = tau.

    `dof` indexes `DOFS`; `low` and `high` bound the values that may be fitted or sent to a vehicle.
    """

    name: str
    symbol: str
    unit: str
    kind: Kind
    dof: int
    low: float
    high: float
    sentence: str

    def parameter_id(self, configuration: int) -> str:
        """The MAVLink parameter id for a configuration index: `FF0_M_U`."""
        return f"FF{configuration}_{self.name.upper()}"


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
