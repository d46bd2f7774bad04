"""A bridge of system 2 without any device: a vehicle that beats, and keeps parameters."""

import dataclasses
import threading

from fakes.ports import free_port

from bridge.clock import SystemClock
from bridge.links.open import open_link
from bridge.onboard.parameters import ParameterServer
from bridge.onboard.service import Bridge
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.parameters import vehicle_table

STEP_S = 0.05


class SecondVehicle:
    """A bridge of system 2 without any device, in a thread; a `master` of MAVProxy's. Use it as a context."""

    def __init__(self):
        port = free_port()
        self.master = f"tcp:127.0.0.1:{port}"
        vehicle = dataclasses.replace(load_vehicle("ruvifist").vehicle, system_id=2)
        self.server = ParameterServer(None, vehicle_table(vehicle), system=2)
        self.link = open_link(f"tcpin:127.0.0.1:{port}")
        self.bridge = Bridge(vehicle, SystemClock(), [self.link], self.server)
        self.stop = threading.Event()
        self.thread = threading.Thread(target=self.run, daemon=True)

    def __enter__(self):
        self.thread.start()
        return self

    def run(self):
        while not self.stop.wait(STEP_S):
            self.bridge.step()

    def __exit__(self, *_):
        self.stop.set()
        self.thread.join()
        self.link.close()
