"""A bridge that lives so many times as fast as real time, with its devices on real ports and faults of theirs.

`python fast_bridge.py FOLDER LINK TIMES SEED`; it ends when its standard input does.
"""

import random
import sys
import threading
import time
from contextlib import ExitStack
from pathlib import Path

from plugged_devices import Devices

from bridge.links.open import open_link
from bridge.onboard.parameters import ParameterServer
from bridge.onboard.ports import run_ports
from bridge.onboard.ring import RingSize, ring_in
from bridge.onboard.service import Bridge
from bridge.vehicle.config import Configuration, Thruster, Vehicle
from bridge.vehicle.parameters import vehicle_table

RING = RingSize(total=20_000_000, segment=1_000_000)
FAULT_EVERY_S = 0.3


class FastClock:
    """The computer's clock, so many times as fast."""

    def __init__(self, times: float) -> None:
        self._times, self._began_s, self._began_unix_s = times, time.monotonic(), time.time()

    def boot_s(self) -> float:
        return self._times * (time.monotonic() - self._began_s)

    def unix_s(self) -> float:
        return self._began_unix_s + self.boot_s()


def trouble(devices: Devices, rng: random.Random, stop: threading.Event) -> None:
    """Pull and plug devices, and let them babble, at random; half of them are plugged at a time or more."""
    plugged = dict.fromkeys(devices.fakes, False)
    while not stop.wait(rng.expovariate(1 / FAULT_EVERY_S)):
        slot = rng.choice(list(plugged))
        if plugged[slot] and rng.random() < 0.5:
            devices.babble(slot, rng.randbytes(rng.randrange(1, 2000)))
        elif plugged[slot] and 2 * sum(plugged.values()) > len(plugged):
            devices.unplug(slot)
            plugged[slot] = False
        elif not plugged[slot]:
            devices.plug(slot)
            plugged[slot] = True


def main(folder: Path, spec: str, times: float, seed: int) -> None:
    clock, stop, devices = FastClock(times), threading.Event(), Devices(folder, "network")
    shape = Configuration(
        dry_mass_kg=72.0,
        inertia_kgm2=(2.0, 9.0, 10.0),
        thrusters=tuple(Thruster((1.0, 0.0, 0.0), (0.0, 0.2 * i, 0.0)) for i in range(2)),
    )
    vehicle = Vehicle("fast", {"survey": shape}, sensors=devices.sensors)
    parameters = ParameterServer(folder / "parameters.json", vehicle_table(vehicle))
    ring = ring_in(folder / "ring", RING, clock)
    bridge = Bridge(vehicle, clock, [open_link(spec)], parameters, ring=ring)
    loops = [
        threading.Thread(target=trouble, args=(devices, random.Random(seed), stop)),
        threading.Thread(
            target=run_ports,
            args=(bridge, vehicle, clock, stop),
            kwargs={"open_bus": lambda _: devices.fakes["depth"].bus},
        ),
    ]
    with ExitStack() as stack:
        stack.callback(ring.close)
        stack.enter_context(devices.speaking(times))
        ring.start()
        for loop in loops:
            loop.start()
            stack.callback(loop.join)
        stack.callback(stop.set)
        sys.stdin.read()


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2], float(sys.argv[3]), int(sys.argv[4]))
