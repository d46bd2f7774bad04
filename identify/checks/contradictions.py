"""Runs the checks for contradictions within a recording, the same for identification and for diagnosis."""

from collections.abc import Collection

from bridge.vehicle.config import VehicleFile
from identify.checks.actuation.controller import (
    depthless_doubts,
    filtered_doubts,
    frozen_doubts,
    stamp_doubts,
    steered_doubts,
)
from identify.checks.actuation.motors import miswired_doubts
from identify.checks.fit.at_the_surface import surface_doubts
from identify.checks.sensors.descent import descent_doubts
from identify.checks.sensors.descent_timing import descent_timing_doubts
from identify.checks.sensors.heading import turning_doubts
from identify.checks.sensors.levelling import levelling_doubts
from identify.dive import Dive
from identify.doubt import Doubt


def contradictions(
    dive: Dive, file: VehicleFile, configuration: str, fitted: Collection[str]
) -> tuple[Doubt, ...]:
    """Doubts about coefficients that were fitted to a recording, where the recording contradicts itself.

    fitted: names of the coefficients, without those that rest on the righting moment instead of on thrust.
    """
    return (
        *(steered_doubts(dive, file, configuration, fitted) or filtered_doubts(dive)),
        *frozen_doubts(dive),
        *stamp_doubts(dive),
        *descent_doubts(dive, file.vehicle.water),
        *descent_timing_doubts(dive, file.vehicle.water),
        *surface_doubts(dive, file, configuration, fitted),
        *turning_doubts(dive),
        *levelling_doubts(dive),
        *miswired_doubts(dive, file, configuration),
        *depthless_doubts(dive, file, configuration, fitted),
    )
