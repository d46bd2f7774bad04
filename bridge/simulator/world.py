"""The world that the simulated devices measure: its noise, its water, and the data that devices return."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from bridge.sensors.samples import PressureSample
from bridge.simulator.plant import Stretch
from bridge.vehicle.config import ThrustCurve, Water


@dataclass(frozen=True)
class NoiseLevels:
    """Standard deviations of white noise per sample, constant biases, and the rate at which bottom lock is lost.

    The defaults follow the makers' data sheets: MTi-300 60 ug/sqrt(Hz) and 0.01 deg/s/sqrt(Hz) at 50 Hz of bandwidth,
    DSP-1750 0.013 deg/sqrt(h) at 500 Hz, Bar30 2 mm of resolution; the DVL's level is an assumption.
    """

    dvl_m_s: float = 0.004
    dvl_range_m: float = 0.01
    dvl_dropout: float = 0.01
    accelerometer_m_s2: float = 0.0042
    gyro_rad_s: float = 0.0012
    gyro_bias_rad_s: float = 0.00005
    attitude_rad: float = 0.0003
    fog_rad_s: float = 0.000085
    fog_bias_rad_s: float = 5e-7
    pressure_pa: float = 15.0
    rpm_share: float = 0.002
    gnss_m: float = 1.0
    gnss_m_s: float = 0.05


TYPICAL = NoiseLevels()
QUIET = NoiseLevels(**dict.fromkeys(NoiseLevels.__dataclass_fields__, 0.0))


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
