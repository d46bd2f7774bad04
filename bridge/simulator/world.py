"""What the simulated devices share: the world they measure, and what they give."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from bridge.sensors.samples import PressureSample
from bridge.simulator.noise import NoiseLevels
from bridge.simulator.plant import Stretch
from bridge.vehicle.config import ThrustCurve, Water


@dataclass(frozen=True, slots=True)
class Chunk:
    """Bytes of the device in a slot of the vehicle file, the last of which arrives at `time_s`."""

    slot: str
    time_s: float
    data: bytes


@dataclass(frozen=True)
class Surroundings:
    """What every device may know of the world."""

    noise: NoiseLevels
    water: Water
    thrust_curve: ThrustCurve
    unix_at_boot_s: float


@dataclass(frozen=True, slots=True)
class Measured:
    """A sample of a device on the I2C bus, which the bridge asks instead of listening to it."""

    slot: str
    time_s: float
    sample: PressureSample


Arrival = Chunk | Measured


class SimulatedDevice(Protocol):
    """One device aboard."""

    def arrivals(self, stretch: Stretch) -> Sequence[Arrival]:
        """What it gives of what it saw after the start of the stretch, up to its end."""
        ...
