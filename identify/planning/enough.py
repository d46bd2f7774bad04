"""How well a dive tells each coefficient: the widths by which a flight stops as soon as it knows enough."""

import math

from identify.identification import Identification
from identify.planning.knowledge import NAMES


def widths(identified: Identification) -> dict[str, float]:
    """Half of the 95 % interval over the value, given the vehicle file's thrust; inf if not identifiable."""
    return {
        parameter.name: (ends.high95 - ends.low95) / 2 / parameter.value
        if parameter.identifiable
        else math.inf
        for parameter in identified.parameters
        if parameter.name in NAMES
        for ends in [parameter.at_thrust]
    }
