"""All effects that are tried on a vehicle."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import replace

from bridge.vehicle.coefficients import AcceptedEffect
from bridge.vehicle.config import Configuration
from identify.effects import (
    actuators,
    environment,
    hydrodynamics,
    rigid_body,
    sensors,
    supply,
    wake,
)
from identify.effects.effect import SIMULATED, Effect


def library(configuration: Configuration, lag_s: float) -> tuple[Effect, ...]:
    """Return the effects for a configuration whose thrusters have a nominal lag of `lag_s`.

    Several effects may share a name: forms of the same cause, or one for each thruster. `label` is unique.
    """
    effects = (
        *hydrodynamics.EFFECTS,
        *actuators.EFFECTS,
        *actuators.thruster_lag(lag_s),
        *supply.EFFECTS,
        *wake.EFFECTS,
        *actuators.of_each_thruster(configuration),
        *environment.EFFECTS,
        *sensors.EFFECTS,
        *rigid_body.EFFECTS,
    )
    forms = Counter(effect.name for effect in effects)
    # A sea's periods count by what it has to save.
    return tuple(effect if effect.sea else replace(effect, one_of=forms[effect.name]) for effect in effects)


def accepted_library(configuration: Configuration, lag_s: float) -> tuple[Effect, ...]:
    """The library with each further form in which a cause may have been accepted; arguments as for `library`."""
    return (*library(configuration, lag_s), actuators.shaft_lag(lag_s))


def not_simulated(effects: Iterable[AcceptedEffect], configuration: Configuration, lag_s: float) -> list[str]:
    """Labels of the accepted effects that the simulated vehicle can't have; arguments as for `library`."""
    held = {effect.label for effect in library(configuration, lag_s) if effect.feedforward in SIMULATED}
    return [effect.label for effect in effects if effect.label not in held]
