"""A companion beside an autopilot, and the ground that flies it, on simulated or real time alike."""

import math
from collections import defaultdict

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.ardusub.companion import Companion, companion_file
from bridge.ardusub.handover import Holder
from bridge.onboard.orders import Ground
from bridge.onboard.parameters import ParameterServer
from bridge.onboard.service import Bridge
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.mode import Mode
from bridge.vehicle.parameters import COMMIT, MODE, vehicle_table
from bridge.wire.framing import Encoder, Framer, decode
from bridge.wire.status_codes import decoded

FILE = companion_file(load_vehicle("bluerov2"))
STICKS_S = 0.04
NUMBERS = {kind.msgname: number for number, kind in dialect.mavlink_map.items()}


class Aboard:
    """The companion's computer: a bridge with a companion on the autopilot's second link, to which the vehicle file's
    model was `uploaded`, or nothing."""

    def __init__(
        self, autopilot, mode=Mode.OFF, store=None, file=FILE, more_links=(), *, uploaded=True, **options
    ):
        self.parameters = ParameterServer(None, vehicle_table(file.vehicle), component=191)
        if uploaded:
            crc = float(self.parameters.staged_crc)
            assert self.parameters.write(COMMIT, crc, armed=False) is None
        assert self.parameters.write(MODE, float(mode), armed=False) is None
        configuration = next(iter(file.vehicle.configurations))
        ground = options.setdefault("ground", Ground())
        self.companion = Companion(file, configuration, self.parameters, ground, store)
        links = [*more_links, autopilot.aboard]
        self.bridge = Bridge(
            file.vehicle, autopilot.clock, links, self.parameters, companion=self.companion, **options
        )
        self.alive = True

    def __call__(self):
        if self.alive:
            self.bridge.step()

    @property
    def disarmed_within_s(self):
        """How long a firmware may take to disarm once the companion is dead: 2.5 s, or as 4.6 is set, and the while
        until it is heard."""
        after_s = self.companion.settings.fails_after_s
        return (2.5 if math.isnan(after_s) else after_s) + 2.0

    def set_mode(self, mode):
        assert self.parameters.write(MODE, float(mode), armed=False) is None


class Heard:
    """What came, by kind: a frame is decoded when a test asks for its kind."""

    def __init__(self):
        self.frames, self.messages = defaultdict(list), defaultdict(list)

    def take(self, frames):
        for frame in frames:
            self.frames[frame.message_id].append(frame)

    def of(self, kind):
        number, known = NUMBERS[kind], self.messages[kind]
        known += [m for m in map(decode, self.frames.pop(number, ())) if m is not None]
        return known

    def clear(self):
        self.frames.clear()
        self.messages.clear()


class Pilot:
    """A ground station with a joystick: it beats, sends its sticks 25 times a second, and hears all."""

    def __init__(self, autopilot, component=190, system=255):
        self.autopilot, self.encoder, self.framer = autopilot, Encoder(system, component), Framer()
        self.sticks = {"x": 0, "y": 0, "z": 500, "r": 0}
        self.flies = self.beats = True
        self.beat_s = self.sticks_s = 0.0
        self.heard = Heard()

    def __call__(self):
        now_s = self.autopilot.clock.boot_s()
        if self.beats and now_s >= self.beat_s:
            self.beat_s = now_s + 1.0
            self.send(dialect.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))
        if self.flies and now_s >= self.sticks_s:
            self.sticks_s = now_s + STICKS_S
            self.send(dialect.MAVLink_manual_control_message(1, **self.sticks, buttons=0))
        while data := self.autopilot.ground.read(0.0):
            self.heard.take(self.framer.feed(data))

    def send(self, message):
        self.autopilot.ground.write(self.encoder.encode(message))

    def read(self, name, component=1):
        """The newest value of a parameter that a component answers to a separate read."""
        self.heard.clear()
        self.send(dialect.MAVLink_param_request_read_message(1, component, name.encode(), -1))

        def answer():
            return [
                m.param_value for m in self.of("PARAM_VALUE")
                if m.param_id == name and m.get_srcComponent() == component
            ]  # fmt: skip

        answers = self.autopilot.until(answer, 3.0, self)
        return answers[-1] if answers else None

    def write(self, name, value, component=1):
        self.send(dialect.MAVLink_param_set_message(1, component, name.encode(), value, 9))

    def of(self, kind):
        return self.heard.of(kind)

    def beats_of_autopilot(self):
        return [m for m in self.of("HEARTBEAT") if m.get_srcComponent() == 1]

    def sees_armed(self):
        beats = self.beats_of_autopilot()
        return bool(beats) and bool(beats[-1].base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED)

    def texts(self):
        """What was said, the pieces of a long text joined."""
        texts, number = [], 0
        for m in self.of("STATUSTEXT"):
            if m.id and m.id == number:
                texts[-1] += m.text
            else:
                texts.append(m.text)
            number = m.id
        return texts

    def words(self):
        """What was said, without codes."""
        return [decoded(text).words for text in self.texts()]


def orders(pilot, switch):
    """An act: the pilot's ground sends what the switch orders; all that it hears goes to the switch as well."""
    feed = pilot.framer.feed

    def heard(data):
        frames = feed(data)
        for frame in frames:
            switch.on_frame(frame, pilot.autopilot.clock.boot_s())
        return frames

    def order():
        for message in switch.tick(pilot.autopilot.clock.boot_s()):
            pilot.send(message)

    pilot.framer.feed = heard
    return order


def ready(autopilot, *acts):
    """Wait until the autopilot has started: a simulated ArduSub that is ordered about earlier stands still for good.

    One of `acts` is the pilot.
    """
    (pilot,) = (act for act in acts if isinstance(act, Pilot))

    def started():
        beats = pilot.beats_of_autopilot()
        return beats and beats[-1].system_status >= dialect.MAV_STATE_STANDBY

    assert autopilot.until(started, 60.0, *acts)


def arm(autopilot, *acts):
    """Arm, again where it was too early. One of `acts` is the pilot."""
    (pilot,) = (act for act in acts if isinstance(act, Pilot))

    for _ in range(20):
        autopilot.arm()
        if autopilot.until(pilot.sees_armed, 1.5, *acts):
            return
    raise AssertionError(pilot.texts())


def taken(aboard):
    return aboard.companion.handover.holder is Holder.HELD


def given_back(aboard):
    """Whether SYSID_MYGCS was read as the pilot's."""
    handover = aboard.companion.handover
    return handover.holder is Holder.FREE and handover.value == 255
