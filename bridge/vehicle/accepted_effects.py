"""Sorts the accepted effects among the active coefficients by the place where they act."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bridge.vehicle.config import Configuration
from bridge.vehicle.effect_coefficients import (
    ASTERN,
    LEAST,
    RESISTANCE,
    START,
    VOLTAGE,
    VOLTAGE_SHARE,
    effect_coefficients,
    gain_name,
)
from bridge.vehicle.supply import VoltageLaw
from bridge.vehicle.thruster_losses import Losses


@dataclass(frozen=True)
class Known:
    """Accepted effects by place of action: hull effects by name; losses None if the thrusters follow their curve;
    voltage None if thrust does not depend on it. faults: why a coefficient was left out."""

    hull: Mapping[str, float]
    losses: Losses | None
    voltage: VoltageLaw | None
    faults: tuple[str, ...]


def known_effects(coefficients: Mapping[str, float], configuration: Configuration) -> Known:
    """Return the effects among the active coefficients; a value that is not finite or out of bounds is left out and
    listed in `faults`."""
    fit, faults = {}, []
    for coefficient in effect_coefficients(configuration):
        value = coefficients.get(coefficient.name, 0.0)
        if value == 0.0:
            continue
        fault = coefficient.fault(value)
        if fault:
            faults.append(fault)
        else:
            fit[coefficient.name] = value
    gain = np.array([fit.get(gain_name(i), 1.0) for i in range(1, len(configuration.thrusters) + 1)])
    losses = Losses(
        gain, fit.get(ASTERN, 1.0), fit.get(START, 0.0), fit.get(LEAST, 0.0), fit.get(RESISTANCE, 0.0)
    )
    voltage = VoltageLaw(fit[VOLTAGE], fit[VOLTAGE_SHARE]) if {VOLTAGE, VOLTAGE_SHARE} <= set(fit) else None
    of_thrusters = {
        ASTERN,
        START,
        LEAST,
        RESISTANCE,
        VOLTAGE,
        VOLTAGE_SHARE,
        *map(gain_name, range(1, len(gain) + 1)),
    }
    hull = {name: value for name, value in fit.items() if name not in of_thrusters}
    lossy = voltage is not None or not of_thrusters.isdisjoint(set(fit) - {VOLTAGE, VOLTAGE_SHARE})
    return Known(hull, losses if lossy else None, voltage, tuple(faults))
