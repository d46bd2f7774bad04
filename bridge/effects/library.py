"""All effects that are tried on a vehicle."""

from bridge.effects import actuators, environment, hydrodynamics, rigid_body, sensors
from bridge.effects.effect import Effect
from bridge.vehicle.config import Configuration


def library(configuration: Configuration, lag_s: float) -> tuple[Effect, ...]:
    """The effects for a configuration whose thrusters have a nominal lag of `lag_s`."""
    return (
        *hydrodynamics.EFFECTS,
        *actuators.EFFECTS,
        actuators.thruster_lag(lag_s),
        *actuators.of_each_thruster(configuration),
        *environment.EFFECTS,
        *sensors.EFFECTS,
        *rigid_body.EFFECTS,
    )
