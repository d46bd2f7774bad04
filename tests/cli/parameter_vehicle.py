"""A vehicle's real parameter server at the end of a link, in simulated time, and a ground that can be killed."""

from contextlib import contextmanager
from pathlib import Path

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.framing import Encoder, Framer, decode
from bridge.parameters import ParameterServer, vehicle_table
from bridge.vehicle.config import load_vehicle

VEHICLE = str(Path(__file__).resolve().parents[1] / "data" / "vehicles" / "hovering.yaml")


class VehicleAtTheEnd:
    """A link whose far end is a parameter server; reading it lets simulated time pass."""

    name = "memory:vehicle"

    def __init__(self, store=None):
        self.clock, self.store = SimulatedClock(), store
        self.boot()
        self.armed = False
        self.mute = False
        self.stuck = set()
        self._framer, self._encoder = Framer(), Encoder(1, 1)
        self._out = []
        self._beat_s = 0.0

    def boot(self):
        """Start anew, with what the store kept: without one, all is lost."""
        self.server = ParameterServer(self.store, vehicle_table(load_vehicle(VEHICLE).vehicle))

    def read(self, timeout_s):
        self.clock.advance_to(self.clock.now_s + max(timeout_s, 0.001))
        if self.mute:
            return b""
        if self.clock.now_s >= self._beat_s:
            self._beat_s += 1.0
            self._out.append(dialect.MAVLink_heartbeat_message(12, 0, 128 if self.armed else 0, 0, 4, 3))
        messages, self._out = self._out + self.server.step(20), []
        return b"".join(self._encoder.encode(message) for message in messages)

    def write(self, data):
        for frame in self._framer.feed(data):
            message = decode(frame)
            if message.get_type() == "PARAM_SET" and message.param_id in self.stuck:
                continue
            self._out += self.server.handle(message, self.armed)

    def close(self):
        pass


def at_any_link(monkeypatch, store=None):
    """A vehicle at the end of whatever link is opened from now on."""
    vehicle = VehicleAtTheEnd(store)
    monkeypatch.setattr("bridge.link.open.open_link", lambda _: vehicle)
    monkeypatch.setattr("bridge.clock.SystemClock", lambda: vehicle.clock)
    return vehicle


class GroundKilledError(BaseException):
    """What nothing catches, in place of a kill."""


@contextmanager
def dying_at(vehicle, message, kinds=()):
    """Meanwhile the ground dies as it sends that many messages, of these kinds or of any; yields what it sent."""
    write, sent = vehicle.write, []

    def dies(data):
        told = [decode(frame).get_type() for frame in Framer().feed(data)]
        sent.extend(kind for kind in told if not kinds or kind in kinds)
        if len(sent) >= message:
            raise GroundKilledError
        write(data)

    vehicle.write = dies
    try:
        yield sent
    finally:
        vehicle.write = write
