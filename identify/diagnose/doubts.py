"""What a recording itself says against values that were fitted to it: the doubts that `identify` has of any fit."""

from bridge.vehicle.coefficients import MASSES
from bridge.vehicle.config import Water
from identify.descent import descent_doubts
from identify.dive import Dive
from identify.fed_velocity import stamp_doubts
from identify.feedback import frozen_doubts
from identify.identification import Doubt
from identify.levelling import levelling_doubts
from identify.turning import turning_doubts


def doubts_of_recording(dive: Dive, water: Water) -> tuple[Doubt, ...]:
    """Sensors that contradict each other, stamps that are late, readings that stood still, velocities that an autopilot
    filtered."""
    return (
        *_filtered(dive),
        *frozen_doubts(dive),
        *stamp_doubts(dive),
        *descent_doubts(dive, water),
        *turning_doubts(dive),
        *levelling_doubts(dive),
    )


def _filtered(dive: Dive) -> tuple[Doubt, ...]:
    """A warning about the masses where the velocity is not the sensor's own."""
    if not dive.velocity_is_filtered:
        return ()
    sentence = (
        "Velocity comes from the autopilot's own filter, which smooths and delays it: the masses in surge, sway and "
        "heave may be off by more than their intervals; record the DVL's own readings."
    )
    return (Doubt(tuple(mass.name for mass in MASSES[:3]), sentence),)
