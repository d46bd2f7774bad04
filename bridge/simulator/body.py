"""The simulated part under water: the body with its thrusters, and the devices that measure its motion."""

import heapq
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from itertools import count

import numpy as np

from bridge.sensors.samples import Arrival
from bridge.simulator.devices import (
    SimulatedBar30,
    SimulatedDevice,
    SimulatedEscs,
    SimulatedImu,
    SimulatedUblox,
    Surroundings,
    a50,
    dsp1750,
    dsp1760,
    wayfinder,
)
from bridge.simulator.plant import Plant, Stretch
from bridge.simulator.truth import TYPICAL, NoiseLevels, Truth, load_truth
from bridge.vehicle.config import Device, DeviceKind, Sensors, VehicleFile
from bridge.vehicle.thrusters import NEUTRAL_US, thrust_curve

Maker = Callable[[str, Device, Surroundings, np.random.Generator], SimulatedDevice]

MAKERS: Mapping[DeviceKind, Maker] = {
    "wayfinder": wayfinder,
    "a50": a50,
    "mti300": SimulatedImu,
    "kvh1750": dsp1750,
    "kvh1760": dsp1760,
    "bar30": SimulatedBar30,
    "esc": SimulatedEscs,
    "ublox": SimulatedUblox,
}


class Instruments:
    """The devices of a vehicle file; each draws from its own generator, so that an added device changes none of the
    others."""

    def __init__(self, sensors: Sensors, world: Surroundings, rng: np.random.Generator) -> None:
        slots = [field.name for field in fields(Sensors)]
        generators = dict(zip(slots, rng.spawn(len(slots)), strict=True))
        self._devices = [
            MAKERS[device.kind](slot, device, world, generators[slot])
            for slot, device in sensors.present().items()
        ]
        self._order = count()
        self._on_the_wire: list[tuple[float, int, Arrival]] = []

    def arrivals(self, stretch: Stretch) -> list[Arrival]:
        """Return the data that arrive up to the end of the stretch, earliest first; later data stay on the wire."""
        for device in self._devices:
            for arrival in device.arrivals(stretch):
                heapq.heappush(self._on_the_wire, (arrival.time_s, next(self._order), arrival))
        end_s = float(stretch.time_s[-1]) + 1e-9
        arrived = []
        while self._on_the_wire and self._on_the_wire[0][0] <= end_s:
            arrived.append(heapq.heappop(self._on_the_wire)[2])
        return arrived


@dataclass(frozen=True)
class Start:
    """Start conditions of a dive: place, time and water. `truth` None means the truth file next to the vehicle file."""

    seed: int
    depth_m: float = 0.6
    heading_rad: float = 0.0
    unix_at_boot_s: float = 1_790_000_000.0
    noise: NoiseLevels = TYPICAL
    truth: Truth | None = None


class SimulatedBody:
    """A body at rest at time 0, idle until `pwm_us` is set; the seed draws its water and its sensors' noise."""

    def __init__(self, file: VehicleFile, configuration: str, start: Start) -> None:
        vehicle = file.vehicle
        shape = vehicle.configurations[vehicle.configuration_named(configuration)]
        water, devices = np.random.default_rng(start.seed).spawn(2)
        self._plant = Plant(
            shape,
            thrust_curve(vehicle.thrust_curve, file.path.parent),
            vehicle.thrust_curve.lag_s,
            start.truth or load_truth(file, configuration),
            water,
            depth_m=start.depth_m,
            heading_rad=start.heading_rad,
        )
        world = Surroundings(start.noise, vehicle.water, vehicle.thrust_curve, start.unix_at_boot_s)
        self._instruments = Instruments(vehicle.sensors, world, devices)
        self._thrusters = len(shape.thrusters)
        self.pwm_us: tuple[float, ...] = ()
        self.idle()

    @property
    def time_s(self) -> float:
        return self._plant.time_s

    def idle(self) -> None:
        self.pwm_us = (NEUTRAL_US,) * self._thrusters

    def move(self, duration_s: float) -> tuple[Stretch, Sequence[Arrival]]:
        """Advance under the present commands; return the body's motion and the device data that arrived by its end."""
        stretch = self._plant.advance(self.pwm_us, duration_s)
        return stretch, self._instruments.arrivals(stretch)
