"""A vehicle in lock-step whose bridge keeps a ring, on a bad or cut link, and a ground that records."""

import random

import numpy as np
from fakes.lossy import Lossy
from fakes.recordings import ring_raws
from fakes.vehicle import QuietLink

from bridge.clock import SimulatedClock
from bridge.links.link import memory_pair
from bridge.onboard.file_server import FileServer, Segments
from bridge.onboard.parameters import ParameterServer
from bridge.onboard.ring import RingFiles, RingKeeper, RingSize
from bridge.onboard.service import Bridge
from bridge.sensors.samples import ImuSample
from bridge.vehicle.config import Configuration, Device, Sensors, Thruster, Vehicle
from bridge.vehicle.parameters import vehicle_table
from bridge.wire.framing import Framer

STEP_S = 0.05
AHEAD_S = 40.0
"""By how much the ground's clock is ahead of the vehicle's."""
BAD = {"loss": 0.3, "duplicate": 0.2, "reorder": 0.2, "delay_s": 0.2}
SHAPE = Configuration(
    dry_mass_kg=72.0, inertia_kgm2=(2.0, 9.0, 10.0), thrusters=(Thruster((1.0, 0.0, 0.0), (0.0, 0.2, 0.0)),)
)
VEHICLE = Vehicle("test", {"hovering": SHAPE}, sensors=Sensors(imu=Device("mti300")))


_RINGS = []


def switch_all_off():
    """Close the rings of all vehicles: of those of each boot that was cut short, too."""
    while _RINGS:
        _RINGS.pop().close()


class Boot:
    """The vehicle's clock: boot time from when it was switched on, and a Unix time of its own."""

    def __init__(self, world, unix_s):
        self.world, self.began_s, self.unix_at_boot_s = world, world.now_s, unix_s

    def boot_s(self):
        return self.world.now_s - self.began_s

    def unix_s(self):
        return self.unix_at_boot_s + self.boot_s()


class Dive(QuietLink):
    """Vehicle, link and ground. It is a link itself: whose read lets time pass, as the ground's real one does."""

    name = "memory:vehicle"

    def __init__(self, folder, seed=0, bounds=None, **faults):
        self.world, self.folder, self.boots = SimulatedClock(), folder, 0
        self.bounds, self.rng, self.given = bounds or RingSize(1_000_000, 4000), random.Random(seed), faults
        self.noise = np.random.default_rng(seed)
        self.sent, self.heard = [], []
        self.switch_on()

    def switch_on(self):
        """It starts anew: another boot, on the clock that it last had."""
        self.boots += 1
        clock = Boot(self.world, 1_790_000_000.0 + self.world.now_s - 5.0 * self.boots)
        identity = 1000 + self.boots
        self.ring = RingKeeper(RingFiles(self.folder, self.bounds, identity), clock)
        _RINGS.append(self.ring)
        near, far = memory_pair()
        self.link = Lossy(far, self.rng, self.world, **self.given)
        server = ParameterServer(None, vehicle_table(VEHICLE), system=1, component=191)
        files = FileServer(Segments(self.folder), lambda _: 200_000.0)
        self.bridge = Bridge(VEHICLE, clock, [self.on_board(near)], server, ring=self.ring, files=files)

    def on_board(self, link):
        """The vehicle's end of the link."""
        return link

    def cut(self, away):
        self.link.outgoing.cut = self.link.incoming.cut = away

    def step(self):
        """A tick on board; the bytes that the ground hears."""
        self.world.advance_to(round(self.world.now_s + STEP_S, 6))
        force = tuple(float(x) for x in self.noise.normal(size=3))
        now_s = self.bridge._clock.boot_s()
        self.bridge.accept("imu", (ImuSample(now_s, force, (0.1, -0.2, -0.3), (1.0, 0.0, 0.0, 0.0), 18.5),))
        self.bridge.step()
        self.ring.write_waiting()
        data = b""
        while more := self.link.read(0.0):
            data += more
        return data

    def dive(self, seconds, framer=None):
        """Go on for so long, recorded by the ground."""
        framer = framer or Framer()
        for _ in range(round(seconds / STEP_S)):
            stamp_us = round((1_790_000_000.0 + AHEAD_S + self.world.now_s) * 1e6)
            self.heard += [(stamp_us, frame.raw) for frame in framer.feed(self.step())]

    def read(self, timeout_s):
        del timeout_s
        return self.step()

    def write(self, data):
        self.link.write(data)

    def kept(self):
        """All frames of the ring, oldest first."""
        return ring_raws(self.folder)
