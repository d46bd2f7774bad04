"""All simulated devices of a vehicle together: the data that arrive at the bridge in each tick, in order."""

import heapq
from collections.abc import Callable, Mapping
from dataclasses import fields
from itertools import count

import numpy as np

from bridge.simulator.ancillary import SimulatedBar30, SimulatedEscs, SimulatedUblox
from bridge.simulator.devices import SimulatedImu, a50, dsp1750, dsp1760, wayfinder
from bridge.simulator.plant import Stretch
from bridge.simulator.world import Arrival, SimulatedDevice, Surroundings
from bridge.vehicle.config import Device, DeviceKind, Sensors

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
