"""A bridge in lock-step or in real time, and the messages that the ground hears."""

import math
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import numpy as np

from bridge.clock import SimulatedClock, SystemClock
from bridge.links.link import Link, memory_pair
from bridge.onboard.parameters import ParameterServer
from bridge.onboard.ports import run_ports
from bridge.onboard.service import Bridge
from bridge.sensors.samples import FogBlock, ImuSample
from bridge.vehicle.autopilot import Actuation
from bridge.vehicle.config import Configuration, Device, Mounting, Sensors, Thruster, Vehicle
from bridge.vehicle.parameters import vehicle_table
from bridge.vehicle.references import Reference
from bridge.wire import readings
from bridge.wire.framing import Encoder, Framer, decode
from bridge.wire.readings import Reading

SIX = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)
LEVEL_NORTH_ENU = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))


def vehicle(**sensors: Device) -> Vehicle:
    thrusters = tuple(Thruster((1.0, 0.0, 0.0), (0.0, 0.2 * i, 0.0)) for i in range(2))
    shape = Configuration(dry_mass_kg=72.0, inertia_kgm2=(2.0, 9.0, 10.0), thrusters=thrusters)
    return Vehicle("test", {"survey": shape, "hovering": shape}, sensors=Sensors(**sensors))


ALL = {
    "dvl": Device("wayfinder"),
    "imu": Device("mti300", mounting=Mounting(rotation_deg=(180.0, 0.0, 0.0))),
    "fog": Device("kvh1750"),
    "depth": Device("bar30"),
    "esc": Device("esc"),
}


class Rig:
    """A bridge in lock-step, and the ground's end of its link."""

    def __init__(self, system: int = 1, component: int = 1, **options: Any) -> None:
        self.clock = SimulatedClock()
        self.vehicle = vehicle(**ALL)
        near, self.ground = memory_pair()
        self.links: list[Any] = [near]
        self.parameters = ParameterServer(
            None, vehicle_table(self.vehicle), system=system, component=component
        )
        self.bridge = Bridge(self.vehicle, self.clock, self.links, self.parameters, **options)
        self.encoder = Encoder(255, 190)
        self.framer = Framer()

    def step(self, time_s: float | None = None) -> list[Any]:
        if time_s is not None:
            self.clock.advance_to(time_s)
        self.bridge.step()
        return self.heard()

    def heard(self) -> list[Any]:
        """pymavlink messages that came, with their readings kept in `self.readings`."""
        frames = []
        while data := self.ground.read(0.0):
            frames += self.framer.feed(data)
        self.readings = [r for r in map(readings.decode, frames) if r is not None]
        return [decode(frame) for frame in frames]

    def ask(self, message: Any, encoder: Encoder | None = None) -> list[Any]:
        """The answers to a message, without the beat."""
        self.step(self.clock.now_s)
        self.ground.write((encoder or self.encoder).encode(message))
        return self.step()

    def readings_of(self, signal: str) -> list[Reading]:
        return [r for r in self.readings if r.signal == signal]


@contextmanager
def in_real_time(
    craft: Vehicle, links: Sequence[Link], open_bus: Any, act: Callable[[], None] = lambda: None
) -> Iterator[tuple[Bridge, SystemClock]]:
    """A bridge that reads its devices' ports."""
    clock, stop = SystemClock(), threading.Event()
    bridge = Bridge(craft, clock, links, ParameterServer(None, vehicle_table(craft)))
    options = {"act": act, "open_bus": open_bus}
    loop = threading.Thread(target=run_ports, args=(bridge, craft, clock, stop), kwargs=options)
    loop.start()
    try:
        yield bridge, clock
    finally:
        stop.set()
        loop.join(60.0)
        assert not loop.is_alive()


def imu(time_s: float, force: tuple[float, float, float] = (0.0, 0.0, 9.81)) -> ImuSample:
    return ImuSample(time_s, force, (0.1, -0.2, -0.3), LEVEL_NORTH_ENU, 18.5)


def fog(end_s: float, rates: list[float]) -> FogBlock:
    count = len(rates)
    return FogBlock(end_s - 1e-3 * np.arange(count)[::-1], np.array(rates), np.ones(count, bool))


def acted(time_s: float, pwm: tuple[float, ...] = (1600.0, 1400.0)) -> Actuation:
    return Actuation(time_s, SIX, SIX, SIX, SIX, Reference(SIX, SIX, 7.5, 0.6), pwm, 1, 1)
