"""The one fake vehicle: a link whose far end is a vehicle with its real parameter server, in simulated time."""

from collections import deque
from pathlib import Path
from typing import NamedTuple

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.errors import LinkLost
from bridge.links.link import Link
from bridge.onboard.parameters import ParameterServer
from bridge.vehicle.config import Configuration, Thruster, Vehicle, load_vehicle
from bridge.vehicle.parameters import COMMIT, MODE, Parameter, vehicle_table
from bridge.wire.framing import Encoder, Framer, decode
from bridge.wire.readings import Reading, encode
from bridge.wire.status_codes import Topic, coded, status_texts

VEHICLE = str(Path(__file__).resolve().parents[1] / "data" / "vehicles" / "hovering.yaml")
NEVER = float("inf")
WIDE = 1e6
"""Bounds of parameters that a test makes up."""

_SHAPE = Configuration(
    dry_mass_kg=72.0,
    inertia_kgm2=(2.0, 14.0, 14.0),
    thrusters=(Thruster((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),),
    model={"M_u": 72.0, "D_u": 40.0},
)
SMALL = Vehicle("test", {"survey": _SHAPE, "hovering": _SHAPE})
"""A vehicle with a model of surge alone, in two configurations."""


class Set(NamedTuple):
    """A PARAM_SET that arrived."""

    time_s: float
    component: int
    name: str
    value: float


class QuietLink(Link):
    """A link that hears nothing and takes all that is written."""

    name, contested = "quiet:", frozenset()

    def read(self, timeout_s):
        del timeout_s
        return b""

    def write(self, data):
        pass

    def close(self):
        pass


class FakeLink(QuietLink):
    """A link with switches: gives what is in `chunks`, raises an exception among them, keeps what is `sent`.

    `reads_fail`, `writes_fail`: the other side has gone. A read lets the time of a `clock` pass.
    """

    def __init__(self, name="fake:", chunks=(), *, reads_fail=False, writes_fail=False, clock=None):
        self.name, self.reads_fail, self.writes_fail, self.clock = name, reads_fail, writes_fail, clock
        self.chunks, self.sent, self.closed = deque(chunks), [], False

    def read(self, timeout_s):
        assert timeout_s >= 0
        if self.clock is not None:
            self.clock.advance_to(self.clock.boot_s() + timeout_s)
        if self.reads_fail:
            raise LinkLost("gone")
        chunk = self.chunks.popleft() if self.chunks else b""
        if isinstance(chunk, Exception):
            raise chunk
        return chunk

    def write(self, data):
        if self.writes_fail:
            raise LinkLost("gone")
        self.sent.append(data)

    def close(self):
        self.closed = True


class FakeVehicle(QuietLink):
    """A link to a vehicle; its faults are attributes.

    With `steps`, a read lets time pass for as long as it waits. The model of a given `vehicle` is in force.
    `holds` are parameters in place of the vehicle's own, all in force; a vehicle with those keeps what is in force when
    it starts anew.

    A write: `drops` are the names of parameters whose writes are ignored, True for all; `stuck`: it is answered with
    the value that stays; `echoes`: with the new value, which is not kept; `stores`: with the new value, and another is
    kept; `refuses`: with the new value, an error, and the old one; `silent`: it is kept and not answered, `coalesces`:
    two of three are; `lacks`: there is no such parameter; `bound`: it takes orders from another ground. `errors`
    False: it knows no PARAM_ERROR. `result` answers COMMAND_LONG. `twin` is heard on the same link.
    """

    name = "memory:vehicle"

    def __init__(
        self, clock=None, source=(1, 1), *, file=VEHICLE, vehicle=None, holds=None, store=None, mode=None, autopilot=0,
        phase_s=0.0, booted_s=None, steps=True, messages_a_read=1000,
    ):  # fmt: skip
        self.clock, self.source = clock or SimulatedClock(), source
        self.holds, self.store, self.autopilot = holds, store, autopilot
        self.kind = dialect.MAV_TYPE_SUBMARINE if autopilot == 0 else dialect.MAV_TYPE_ONBOARD_CONTROLLER
        self.file, self.vehicle, self.steps, self.messages_a_read = file, vehicle, steps, messages_a_read
        self.encoder, self.framer, self.queue = Encoder(*source), Framer(), deque()
        self.armed = self.mute = self.deaf = self.stuck = self.echoes = self.lacks = self.bound = False
        self.drops = self.refuses = self.silent = ()
        self.stores = {}
        self.beats = self.tells_mode = self.errors = True
        self.listens_first = self.chatters = self.closed = self.coalesces = False
        self.dead_until_s = -NEVER
        self.arms_at_s = self.reboots_at_s = self.lost_at_s = NEVER
        self.fails_at_s = deque()
        self.values_a_read = 20
        self.others, self.twin = [], None
        self.sets, self.heard, self.orders = [], [], []
        self.result = dialect.MAV_RESULT_ACCEPTED
        self.boot()
        self.next_beat_s = self.clock.now_s + phase_s
        self.booted_s = self.clock.now_s if booted_s is None else booted_s
        if mode is not None:
            self.server.write("FF_MODE", mode, False)

    def boot(self):
        """Start anew, with what the store kept: without one, all is lost."""
        self.booted_s = self.next_beat_s = self.clock.now_s
        if self.holds is None:
            table = vehicle_table(self.vehicle or load_vehicle(self.file).vehicle)
        else:
            table = [Parameter(name, -WIDE, WIDE, 0.0) for name in self.holds if name != MODE]
        self.server = ParameterServer(self.store, table, system=self.source[0], component=self.source[1])
        for name, value in (self.holds or {}).items():
            self.server.write(name, value, False)
        if self.holds is not None or (self.vehicle is not None and not self.server.active_crc):
            self.server.write(COMMIT, self.server.staged_crc, False)

    def restart(self, silent_s=2.0, *, forgets=True):
        """Start anew and be silent for so long, with what is in force; what is staged alone is lost if it `forgets`."""
        server = self.server
        self.holds = self.flying() | {MODE: float(server.mode)}
        self.boot()
        self.dead_until_s = self.clock.now_s + silent_s
        if not forgets:
            self.server = server

    def flying(self):
        """The set in force."""
        return dict(self.server._active)

    @property
    def values(self):
        """All that a ground would read."""
        return {name: self.server.value(name) for name in self.server.names}

    def give_a_model(self):
        """Put a set in force."""
        self.server.write("FF1_M_U", 99.0, armed=False)
        self.server.write("FF_COMMIT", self.server.staged_crc, armed=False)

    def read(self, timeout_s):
        if self.steps:
            self.clock.advance_to(self.clock.now_s + max(timeout_s, 0.001))
        now_s = self.clock.now_s
        if now_s >= self.lost_at_s or (self.fails_at_s and now_s >= self.fails_at_s[0]):
            if self.fails_at_s:
                self.fails_at_s.popleft()
            raise LinkLost(f"{self.name}: the other side has gone, the cable is out; plug it in")
        if now_s < self.dead_until_s:
            self.queue.clear()
            return b""
        self.armed = self.armed or now_s >= self.arms_at_s
        if now_s >= self.reboots_at_s:
            self.reboots_at_s = NEVER
            self.boot()
        if now_s >= self.next_beat_s and self.beats:
            self.next_beat_s += 1.0
            self.beat()
        if self.chatters:
            self.queue.append(self.encoder.frame(30, bytes(28)))
        for message in self.server.step(self.values_a_read):
            self.say(message)
        if self.mute or self.listens_first:
            self.queue.clear()
        out = [self.queue.popleft() for _ in range(min(len(self.queue), self.messages_a_read))]
        return b"".join(out) + (self.twin.read(timeout_s) if self.twin is not None else b"")

    def beat(self):
        self.say(dialect.MAVLink_system_time_message(0, round((self.clock.now_s - self.booted_s) * 1e3)))
        mode = 128 if self.armed else 0
        self.say(dialect.MAVLink_heartbeat_message(self.kind, self.autopilot, mode, 0, 4, 3))
        if self.tells_mode and not self.lacks:
            reading = Reading("ff_mode", self.clock.now_s - self.booted_s, (float(self.server.mode),))
            self.queue.append(self.encoder.frame(*encode(reading)))
        self.queue += [raw() for raw in self.others]

    def write(self, data):
        for frame in self.framer.feed(data):
            message = decode(frame)
            if message is None or self.deaf or self.clock.now_s < self.dead_until_s:
                continue
            self.heard.append(message.get_type())
            self.listens_first = False
            if (getattr(message, "target_system", 0), getattr(message, "target_component", 0)) != self.source:
                continue
            if message.get_type() == "PARAM_SET":
                component, name = message.target_component, message.param_id
                self.sets.append(Set(self.clock.now_s, component, name, message.param_value))
                self._set(message)
            elif message.get_type() == "COMMAND_LONG":
                self.orders.append(message.param1)
                self.say(dialect.MAVLink_command_ack_message(message.command, self.result, 0, 0, 255, 190))
            elif self.lacks:
                self.say(dialect.MAVLink_param_error_message(255, 190, message.param_id.encode(), -1, 1))
            else:
                self._handle(message)

    def _set(self, message):
        name = message.param_id
        if self.drops is True or name in self.drops:
            return
        if self.bound:
            self.say(*status_texts(coded(Topic.STRANGER, "any words", 255), 4, 1), *self.server.deny(message))
        elif self.lacks:
            self.say(dialect.MAVLink_param_error_message(255, 190, name.encode(), -1, 1))
        elif self.stuck or self.echoes:
            self._echo(name, message.param_value if self.echoes else self.server.value(name))
        elif name in self.refuses:
            self._echo(name, message.param_value)
            self.say(dialect.MAVLink_param_error_message(255, 190, name.encode(), -1, 3))
            self._echo(name, self.server.value(name))
        elif name in self.stores:
            self.server.write(name, self.stores[name], self.armed)
            self._echo(name, message.param_value)
        elif name in self.silent or (self.coalesces and len(self.sets) % 3):
            self.server.handle(message, self.armed)
        else:
            self._handle(message)

    def _echo(self, name, value):
        self.say(dialect.MAVLink_param_value_message(name.encode(), value, 9, 1, 0))

    def _handle(self, message):
        self.say(*self.server.handle(message, self.armed))
        for text in self.server.take_texts():
            self.say(*status_texts(text, 4, 1))

    def say(self, *messages):
        self.queue += [
            self.encoder.encode(message)
            for message in messages
            if self.errors or message.get_type() != "PARAM_ERROR"
        ]

    def close(self):
        self.closed = True
        self.queue.clear()
