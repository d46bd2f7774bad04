"""Types shared by the simulated devices: the world that they measure, and the data that they return."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from bridge.sensors.samples import PressureSample
from bridge.simulator.noise import NoiseLevels
from bridge.simulator.plant import Stretch
from bridge.vehicle.config import ThrustCurve, Water


@dataclass(frozen=True, slots=True)
class Chunk:
    """Bytes from the device in a slot of the vehicle file; the last byte arrives at `time_s`."""

    slot: str
    time_s: float
    data: bytes


@dataclass(frozen=True)
class Surroundings:
    """The properties of the world that every device may use."""

    noise: NoiseLevels
    water: Water
    thrust_curve: ThrustCurve
    unix_at_boot_s: float


@dataclass(frozen=True, slots=True)
class Measured:
    """A sample of a device on the I2C bus, which the bridge polls instead of listening to it."""

    slot: str
    time_s: float
    sample: PressureSample


Arrival = Chunk | Measured


class SimulatedDevice(Protocol):
    """A simulated device on the vehicle."""

    def arrivals(self, stretch: Stretch) -> Sequence[Arrival]:
        """Return the device's data for the moments after the start of the stretch, up to its end."""
        ...
