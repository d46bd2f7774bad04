"""The simulated devices that speak TCP, each at its own port, for another program to read: a companion under trial."""

from dataclasses import fields
from typing import Final

import numpy as np

from bridge.links.addresses import LOOPBACK, NAMED_LOOPBACK, of_link, parse_link
from bridge.links.descriptor import open_tcpin
from bridge.sensors.drivers import speaks_tcp
from bridge.simulator.body import Instruments
from bridge.simulator.devices import Surroundings
from bridge.simulator.plant import Stretch
from bridge.vehicle.config import Sensors

HERE: Final = (LOOPBACK, *NAMED_LOOPBACK)


class ServedDevices:
    """Writes the bytes of the devices whose port is a TCP one of this computer to whoever connects there.

    `absent`: the slots of the other devices. Raises LinkError for a port that is taken.
    """

    def __init__(self, sensors: Sensors, world: Surroundings, rng: np.random.Generator) -> None:
        places = {
            slot: parse_link(device.port) for slot, device in sensors.present().items() if speaks_tcp(device)
        }
        served = {slot: (LOOPBACK, port) for slot, (_, host, port) in places.items() if host in HERE}
        self.absent = tuple(slot for slot in sensors.present() if slot not in served)
        self._servers = {slot: open_tcpin(*place) for slot, place in served.items()}
        kept = {
            field.name: getattr(sensors, field.name) if field.name in served else None
            for field in fields(Sensors)
        }
        self._instruments = Instruments(Sensors(**kept), world, rng)

    @property
    def sockets(self) -> list[str]:
        """Sentences on the open ports."""
        return [
            sentence
            for slot, server in self._servers.items()
            for sentence in of_link(server.name, f"the simulated {slot}")
        ]

    def __call__(self, stretch: Stretch) -> None:
        """Write the devices' readings of a stretch of the body's motion."""
        for arrival in self._instruments.arrivals(stretch):
            self._servers[arrival.slot].write(arrival.data)

    def close(self) -> None:
        for server in self._servers.values():
            server.close()
