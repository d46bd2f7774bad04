"""The meaning of a vehicle's parameter, by its id and value: its coefficient, its unit, the value that it acts by.

Ids are `FF<configuration>_<COEFFICIENT>`, such as FF0_M_U, besides FF_MODE and the other parameters of the server.
"""

import re
from typing import Final

from bridge.vehicle.coefficients import COEFFICIENTS, MASSES, OF_ANY_VEHICLE, Coefficient, EffectCoefficient
from bridge.vehicle.mode import Mode, word_of
from bridge.vehicle.parameters import LEAST_DAMPING_PER_S, MODE
from gcs_plugin.params import float32

MODE_WORDS: Final = ", ".join(f"{mode.value} {mode.word}" for mode in Mode)
NOT_SET: Final = "not set"
_STAGED = re.compile(r"FF(\d+)_(.+)")
_COEFFICIENTS: Final[tuple[Coefficient | EffectCoefficient, ...]] = (*COEFFICIENTS, *OF_ANY_VEHICLE.values())
_BY_ID: Final = {coefficient.name.upper(): coefficient for coefficient in _COEFFICIENTS}


def part_of_set(name: str) -> tuple[int, Coefficient | EffectCoefficient] | None:
    """Configuration (VEH_CFG) and coefficient that a parameter holds, None for other parameters."""
    match = _STAGED.fullmatch(name)
    coefficient = _BY_ID.get(match[2]) if match else None
    return None if match is None or coefficient is None else (int(match[1]), coefficient)


def coefficient_of(name: str) -> Coefficient | EffectCoefficient | None:
    """The coefficient that a parameter holds, None for other parameters."""
    part = part_of_set(name)
    return None if part is None else part[1]


def unit_of(name: str) -> str:
    """The SI unit of a parameter, "1" for a dimensionless number, "" if it holds no coefficient."""
    coefficient = coefficient_of(name)
    return coefficient.unit if coefficient is not None else ""


def acting(name: str, value: float) -> float:
    """The value by which a vehicle with this parameter acts: a gain of 0 is not set, and acts as a gain of 1."""
    coefficient = coefficient_of(name)
    return coefficient.neutral if value == 0.0 and isinstance(coefficient, EffectCoefficient) else value


def acting_text(name: str, value: float | None) -> str:
    """Text of the value that a vehicle acts by; `-` for no value."""
    if value is None:
        return "-"
    return word_for(name, value) or value_text(acting(name, value))


def word_for(name: str, value: float) -> str:
    """The word that stands for a value: of a mode its own, of a mass or damping of 0 that it is not set; else ""."""
    if name == MODE:
        return word_of(value)
    return NOT_SET if is_unset(name, value) else ""


def is_unset(name: str, value: float) -> bool:
    """Whether 0 means that a parameter of the hull has no value: no hull has zero mass or damping."""
    return value == 0.0 and isinstance(coefficient_of(name), Coefficient)


def is_staged(name: str) -> bool:
    """Whether a parameter belongs to the vehicle's staged set, which takes effect with a commit."""
    return coefficient_of(name) is not None


def objection(name: str, value: float) -> str:
    """Why a vehicle must not get this value (not a mode, or out of range), "" if it may."""
    if name == MODE and value not in set(Mode):
        return f"{value:g} is not one of {MODE_WORDS}"
    coefficient = coefficient_of(name)
    if coefficient is None or value == 0.0:
        return ""  # 0 is how the vehicle says "not set": a pre-image may hold it
    low = _least(coefficient)
    if low <= value <= coefficient.high:
        return ""
    unit = "" if coefficient.unit == "1" else f" {coefficient.unit}"
    return f"{value:g} is outside {low:g} to {coefficient.high:g}{unit}"


def _least(coefficient: Coefficient | EffectCoefficient) -> float:
    """Least value of a coefficient on any vehicle, besides 0; for a damping it follows from the least mass."""
    if not isinstance(coefficient, Coefficient) or coefficient.kind != "damping":
        return coefficient.low
    return LEAST_DAMPING_PER_S * MASSES[coefficient.dof].low


def value_text(value: float) -> str:
    """Shortest text of a value as float32; NaN and inf as Python prints them."""
    try:
        return float32.text(value)
    except ValueError:
        return str(value)
