"""What a recording itself says against values that were fitted to it: the doubts that `identify` has of any fit."""

from bridge.vehicle.config import Water
from identify.descent import descent_doubts
from identify.dive import Dive
from identify.fed_velocity import stamp_doubts
from identify.feedback import frozen_doubts
from identify.identification import Doubt
from identify.levelling import levelling_doubts
from identify.turning import turning_doubts


def doubts_of_recording(dive: Dive, water: Water) -> tuple[Doubt, ...]:
    """Sensors that contradict each other, stamps that are late, readings that stood still."""
    return (
        *frozen_doubts(dive),
        *stamp_doubts(dive),
        *descent_doubts(dive, water),
        *turning_doubts(dive),
        *levelling_doubts(dive),
    )
