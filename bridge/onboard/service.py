"""The bridge: device bytes in, frames of the telemetry contract out, answers to the ground.

It has no thread and no clock of its own. The caller (`ports` in real time, the simulator in lock-step) passes in
bytes with their arrival time and calls `step` at the control rate.
"""

from collections import Counter, deque
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import Clock
from bridge.errors import FrameError
from bridge.flight.flight import State
from bridge.flight.orders import COMMANDS
from bridge.links.link import Link
from bridge.onboard import telemetry
from bridge.onboard.device_faults import SensorWatch
from bridge.onboard.flights import HEARD, STICKS, Flights
from bridge.onboard.link_set import Sides
from bridge.onboard.orders import (
    ORDERS,
    Ground,
    MotorTests,
    OrderGate,
    acknowledge,
    answer_command,
    answer_timesync,
    deny_command,
    refuse_file_transfer,
)
from bridge.onboard.parameters import ParameterServer
from bridge.onboard.telemetry import FogMean, ImuMean, ThrustFeedback
from bridge.sensors.drivers import make_parser
from bridge.sensors.mounting import to_body
from bridge.sensors.samples import (
    Arrival,
    DvlSample,
    EscSample,
    FogBlock,
    GnssSample,
    ImuSample,
    Parser,
    PressureSample,
    Sample,
)
from bridge.vehicle.autopilot import Actuation
from bridge.vehicle.config import Vehicle
from bridge.vehicle.navigation import Navigation, Navigator
from bridge.vehicle.references import Reference
from bridge.wire.framing import Encoder, Frame, decode
from bridge.wire.readings import Reading, encode, milliseconds
from bridge.wire.status_codes import status_texts

if TYPE_CHECKING:
    from bridge.ardusub.companion import Companion
    from bridge.onboard.file_server import FileServer, ThreadedFileServer
    from bridge.onboard.ring import RingKeeper

BEAT_S: Final = 1.0
IMU_HZ, FOG_HZ = 50.0, 40.0
OWN_BEATS: Final = 8
"""Sequence numbers of the last heartbeats sent: one with another, from the own address, is another companion's."""
MOST_VALUES_A_STEP: Final = 5  # 100 parameter values a second at 20 Hz: 4 kB/s

_QUESTIONS: Final = frozenset(
    (
        dialect.MAVLINK_MSG_ID_PARAM_REQUEST_LIST,
        dialect.MAVLINK_MSG_ID_PARAM_REQUEST_READ,
        dialect.MAVLINK_MSG_ID_PARAM_SET,
        dialect.MAVLINK_MSG_ID_COMMAND_LONG,
        dialect.MAVLINK_MSG_ID_TIMESYNC,
        dialect.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL,
    )
)
_FTP: Final[int] = dialect.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL
_UNKEPT: Final = frozenset((_FTP, dialect.MAVLINK_MSG_ID_SETUP_SIGNING))
"""Frames that are heard and not kept: questions for the recording itself, and keys."""
_FTP_TARGET_BYTES: Final = 3  # network, system, component


class Bridge:
    """Bridge of one vehicle. It takes orders (parameter writes, arming, motor tests) only from `ground`.

    `ring` keeps the sent frames, with or without a link; None keeps nothing. `files` answers MAVLink FTP; None refuses
    FTP requests. Neither waits for the disk. `companion`: an autopilot flies the vehicle, and arms it. `motor_tests` is
    set by the program that drives the thrusters while no mission runs, `flights` by one that can fly manoeuvres, or the
    companion's; both stay None if no program does. `counts`: "unfit" (readings that fit no message), "refused" (orders
    from strangers), "too fast" (dropped parameter writes).
    """

    def __init__(
        self,
        vehicle: Vehicle,
        clock: Clock,
        links: Sequence[Link],
        parameters: ParameterServer,
        *,
        veh_cfg: int | None = None,
        ground: Ground = Ground(),  # noqa: B008 (frozen)
        ring: "RingKeeper | None" = None,
        files: "FileServer | ThreadedFileServer | None" = None,
        companion: "Companion | None" = None,
    ) -> None:
        self.counts: Counter[str] = Counter()
        self.parsers: dict[str, Parser] = {}
        self.armed = False
        self.motor_tests: MotorTests | None = None
        self.flights: Flights | None = None if companion is None else companion.flights
        self._vehicle = vehicle
        self._clock = clock
        self._sides = Sides(links, self.say)
        self._parameters = parameters
        self._gate = OrderGate(ground, self.counts, self.say, clock.boot_s())
        self._ring, self._files = ring, files
        self._companion = companion
        self._beats = deque[int](maxlen=OWN_BEATS)
        self._overheard: list[bytes] = []
        self._withheld: list[bytes] = []
        # The ring's stamps run on the boot clock: setting the date in mid-dive can't turn them back.
        self._unix_at_boot_s = clock.unix_s() - clock.boot_s()
        self._encoder = Encoder(parameters.system, parameters.component)
        self._knocker = self._encoder if companion is None else Encoder(*companion.knocks_as)
        self._devices = vehicle.sensors.present()
        self._navigator = Navigator(vehicle)
        self._imu_mean, self._fog_mean = ImuMean(IMU_HZ), FogMean(FOG_HZ)
        self._feedback = ThrustFeedback()
        self._watch = SensorWatch(self._devices, clock.boot_s())
        self._veh_cfg = vehicle.veh_cfg(next(iter(vehicle.configurations))) if veh_cfg is None else veh_cfg
        self._attitude: ImuSample | None = None
        self._queue: list[bytes] = []
        self._aside: list[bytes] = []
        self._unsaid: list[tuple[str, int]] = []
        self._beat_due_s = clock.boot_s()
        self._text_number = 0
        thrusters = max(len(shape.thrusters) for shape in vehicle.configurations.values())
        for slot, device in self._devices.items():
            parser = make_parser(device, thrusters)
            if parser is not None:
                self.parsers[slot] = parser

    @property
    def navigation(self) -> Navigation:
        """Latest values of all sensors."""
        battery = self._feedback if self._companion is None else self._companion
        voltage_v, time_s = battery.voltage_v(self._clock.boot_s()), battery.voltage_time_s
        return replace(self._navigator.navigation, voltage_v=voltage_v, voltage_time_s=time_s)

    @property
    def link_faults(self) -> dict[str, str]:
        """Why links do not work, by link name."""
        return self._sides.faults

    @property
    def device_faults(self) -> dict[str, str]:
        """Faults of devices by slot as of the last `step`, a sentence each: no port, silent, or senseless bytes."""
        return self._watch.faults

    @property
    def unread_ports(self) -> frozenset[str]:
        """Slots whose device's port can't be read, and of which nothing ever came."""
        return self._watch.unread

    def take(self, arrival: Arrival) -> None:
        """Take whatever came from a device."""
        if arrival.fault is not None:
            self.port_fault(arrival.slot, arrival.fault)
        elif arrival.sample is not None:
            self.accept(arrival.slot, (arrival.sample,))
        else:
            self.receive(arrival.slot, arrival.data, arrival.time_s)

    def port_fault(self, slot: str, fault: str) -> None:
        """Note why the port of the device in `slot` can't be read and what to do; "" once it can be read."""
        if fault:
            self._watch.port_failed(slot, fault)
        else:
            self._watch.port_opened(slot, self._clock.boot_s())

    def receive(self, slot: str, data: bytes, time_s: float) -> None:
        """Take bytes of the device in `slot` (dvl, imu, fog, esc, gnss); the last byte arrived at `time_s`."""
        self._watch.bytes_came(slot, time_s)
        self.accept(slot, self.parsers[slot].feed(data, time_s))

    def accept(self, slot: str, samples: Iterable[Sample]) -> None:
        """Take samples of the device in `slot`, in the device's own axes."""
        mounting = self._devices[slot].mounting
        for sample in samples:
            # A gyro that calls all its rates invalid, or bytes read as such, give no rate: as if nothing made sense.
            if not isinstance(sample, FogBlock) or sample.valid.any():
                self._watch.sample_came(slot, self._clock.boot_s())
            self._take(to_body(sample, mounting))

    def publish(self, actuation: Actuation) -> None:
        """Send the controller's actuation of this tick."""
        self._veh_cfg = actuation.veh_cfg
        self._feedback.command(actuation.pwm_us)
        for reading in telemetry.actuation_readings(actuation):
            self._send(reading)

    def rest(self) -> tuple[float, ...]:
        """Return the pulse widths (us) of a tick without a mission, neutral or for a motor test, and send them.

        Needs `motor_tests`.
        """
        assert self.motor_tests is not None
        now_s = self._clock.boot_s()
        pwm_us = self.motor_tests.pwm_us(self.armed, now_s)
        self._feedback.command(pwm_us)
        self._send(Reading("pwm", now_s, pwm_us))
        return pwm_us

    def fly(self) -> Reference | None:
        """Return the reference of a flight's tick, None while none steers; disarm at its end. Needs `flights`."""
        assert self.flights is not None
        now_s, flight = self._clock.boot_s(), self.flights.flight
        doubt = obstacle = ""
        if self._companion is not None:
            doubt, obstacle = self._companion.control_doubt(now_s), self._companion.obstacle(now_s)
            self._companion.tell_lost_sticks(doubt)
        reference = self.flights.step(
            self.navigation, armed=self.armed, now_s=now_s, in_command=not doubt, autopilot_ready=not obstacle
        )
        if flight.disarms:
            flight.disarms = False
            self.arm(False)
        reading = self.flights.reading(now_s)
        if reading is not None:
            self._send(reading)
        return reference

    @property
    def _stands_back(self) -> bool:
        """Whether to say nothing from the own address, from which another companion may speak."""
        return self._companion is not None and self._companion.stands_back(self._clock.boot_s())

    def say(self, text: str, severity: int = dialect.MAV_SEVERITY_WARNING) -> None:
        """Send the crew a text (STATUSTEXT)."""
        if self._stands_back:
            self._unsaid.append((text, severity))
            return
        self._text_number = self._text_number % 65535 + 1
        for message in status_texts(text, severity, self._text_number):
            self._queue.append(self._encoder.encode(message))

    def arm(self, wanted: bool) -> bool:
        """Arm or disarm. If arming is refused, send the reason to the crew and return False."""
        if self._companion is not None:
            if self._companion.arm(wanted):
                return True
            self.say("the autopilot arms this vehicle: ask it")
            return False
        if wanted and self._parameters.mode.applies_feedforward and not self._parameters.active_crc:
            self.say("arming refused: FF_MODE needs an active set")
            return False
        self.armed = wanted
        return True

    def step(self) -> None:
        """Read the links, answer, and send everything that is due. Call at the control rate."""
        now_s = self._clock.boot_s()
        for number, frame in self._sides.heard(now_s):
            self._hear(number, frame)
        # Before the companion's law says what a new set lacks: a set told of later would take that back.
        for text in self._parameters.take_news():
            self.say(text, dialect.MAV_SEVERITY_NOTICE)
        if self._companion is not None:
            self._accompany(self._companion, now_s)
        for message in self._parameters.step(MOST_VALUES_A_STEP):
            self._queue.append(self._encoder.encode(message))
        if self._attitude is not None:
            reading = telemetry.attitude_reading(self._attitude)
            self._attitude = None
            if reading is not None:
                self._send(reading)
        rpm = self._feedback.rpm_reading()
        if rpm is not None:
            self._send(rpm)
        if now_s >= self._beat_due_s:
            self._beat_due_s = max(self._beat_due_s + BEAT_S, now_s)
            self._beat(now_s)
        ring_texts = self._ring.take_texts() if self._ring else ()
        for text in (*self._parameters.take_texts(), *self._watch.texts(now_s), *ring_texts):
            self.say(text)
        for text in self.flights.take_texts() if self.flights else ():
            self.say(text, dialect.MAV_SEVERITY_NOTICE)
        self._flush()

    def _take(self, sample: Sample) -> None:
        if isinstance(sample, ImuSample):
            self._navigator.take_imu(sample)
            if sample.attitude is not None:
                self._attitude = sample
            mean = self._imu_mean.take(sample)
            if mean is not None:
                self._send(telemetry.imu_reading(mean))
        elif isinstance(sample, FogBlock):
            for middle_s, rate in self._fog_mean.take(sample):
                self._navigator.take_yaw_rate(middle_s, rate)
                self._send(Reading("fog", middle_s, (rate,)))
        elif isinstance(sample, DvlSample):
            self._navigator.take_dvl(sample)
            if self._companion is not None:
                navigation, now_s = self._navigator.navigation, self._clock.boot_s()
                self._to_autopilot(self._companion.take_dvl(sample, navigation, now_s))
            for reading in telemetry.dvl_readings(sample):
                self._send(reading)
        elif isinstance(sample, PressureSample):
            self._navigator.take_pressure(sample)
            self._send(telemetry.pressure_reading(sample))
        elif isinstance(sample, EscSample):
            self._feedback.take(sample)
        elif isinstance(sample, GnssSample):
            self._send(telemetry.gnss_reading(sample))

    def _send(self, reading: Reading) -> None:
        try:
            number, payload = encode(reading)
        except FrameError:
            self.counts["unfit"] += 1
            return
        withheld = self._companion is not None and number == dialect.MAVLINK_MSG_ID_ODOMETRY
        (self._withheld if withheld else self._queue).append(self._encoder.frame(number, payload))

    def _beat(self, now_s: float) -> None:
        if self._companion is None or self._companion.beats(now_s):
            self._beats.append(self._encoder.sequence)
            self._send(Reading("alive", now_s, (float(self.armed), *self._kind())))
        self._send(Reading("clock", now_s, (self._clock.unix_s(),)))
        self._send(Reading("ff_mode", now_s, (float(self._parameters.mode),)))
        self._send(Reading("veh_cfg", now_s, (float(self._veh_cfg),)))
        if self._ring is not None:
            boot_id = dialect.MAVLink_named_value_int_message(
                milliseconds(now_s), b"BOOT_ID", self._ring.identity
            )
            self._queue.append(self._encoder.encode(boot_id))
        battery = self._feedback.battery_reading(now_s)
        if battery is not None:
            self._send(battery)

    def _kind(self) -> tuple[float, float]:
        if self._encoder.component == dialect.MAV_COMP_ID_ONBOARD_COMPUTER:
            return float(dialect.MAV_TYPE_ONBOARD_CONTROLLER), float(dialect.MAV_AUTOPILOT_INVALID)
        return float(dialect.MAV_TYPE_SUBMARINE), float(dialect.MAV_AUTOPILOT_GENERIC)

    def _hear(self, number: int, frame: Frame) -> None:
        """Handle a frame that arrived on the link with this number."""
        own_address = (self._encoder.system, self._encoder.component)
        if self._companion is not None and (frame.system, frame.component) == own_address:
            if frame.message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT:
                self._companion.hear_own_address(frame.sequence in self._beats, self._clock.boot_s())
        elif self._companion is not None:
            now_s = self._clock.boot_s()
            # The sticks go on at once, before anything else is answered.
            self._to_autopilot(self._companion.hear(number, frame, now_s, lambda: self.navigation))
            if frame.message_id not in _UNKEPT:
                self._overheard.append(frame.raw)
        if self._stands_back:
            return
        if self.flights is not None and frame.message_id in HEARD:
            ground = self._gate.ground
            # The autopilot takes sticks by their system alone, and so a flight ends by them: any pilot's hand counts.
            by_sticks = frame.message_id in STICKS and frame.system == ground.system
            heeded = by_sticks or ground.gives(frame.system, frame.component)
            word = decode(frame) if heeded else None
            target = getattr(word, "target", getattr(word, "target_system", own_address[0]))
            if word is not None and target == own_address[0]:
                self.flights.hear(word, self._clock.boot_s())
            return
        if frame.message_id not in _QUESTIONS or (frame.system, frame.component) == own_address:
            return
        message = decode(frame)
        if message is None:
            return
        if message.get_type() == "TIMESYNC":
            # Only the link that asked can use the answer: it measures the round trip.
            answers = answer_timesync(message, self._clock.boot_s())
            self._sides.write(number, [self._encoder.encode(answer) for answer in answers])
        elif message.get_type() == "FILE_TRANSFER_PROTOCOL" and self._files is not None:
            if (message.target_system, message.target_component) == own_address:
                peer = (number, frame.system, frame.component)
                self._files.hear(peer, frame.payload[_FTP_TARGET_BYTES:], self._clock.boot_s())
        else:
            self._queue += [self._encoder.encode(answer) for answer in self._answers(message)]

    def _accompany(self, companion: "Companion", now_s: float) -> None:
        """The companion's part of a step: its messages and texts, and the autopilot's motion."""
        self._aside += [self._knocker.encode(question) for question in companion.knock(now_s)]
        self._to_autopilot(companion.step(now_s))
        self.armed = companion.armed
        for sample in companion.take_samples():
            if isinstance(sample, ImuSample):
                self._navigator.take_imu(sample)
            else:
                self._navigator.take_pressure(sample)
        if companion.take_tick(now_s):
            self._to_autopilot(companion.steer(now_s, self.fly(), self.navigation))
        for actuation in companion.take_actuations():
            for reading in telemetry.actuation_readings(actuation):
                self._send(reading)
        for text in companion.take_texts():
            self.say(text)

    def _to_autopilot(self, messages: Sequence[Any]) -> None:
        """Send to the autopilot, on the link on which it is heard alone, and keep it in the recording."""
        if not messages or self._companion is None or self._companion.link < 0:
            return
        frames = [self._encoder.encode(message) for message in messages]
        self._sides.write(self._companion.link, frames)
        self._overheard += frames

    def _answers(self, message: Any) -> list[Any]:
        kind = message.get_type()
        target = message.target_system, message.target_component
        mine = target == (self._encoder.system, self._encoder.component)
        now_s = self._clock.boot_s()
        if kind in ORDERS and mine and self._gate.is_stranger(message):
            if not self._gate.may_deny(message, now_s):
                return []
            return self._parameters.deny(message) if kind == "PARAM_SET" else deny_command(message)
        if kind == "PARAM_SET" and mine and not self._gate.may_write(message, now_s):
            return []
        if kind == "COMMAND_LONG" and mine and self.flights is not None and message.command in COMMANDS:
            obstacle = "" if self._companion is None else self._companion.no_flight(now_s)
            flight = self.flights.order(
                message, self.navigation, armed=self.armed, now_s=now_s, obstacle=obstacle
            )
            return acknowledge(message, *flight)
        if kind == "COMMAND_LONG":
            tests = self.motor_tests
            test = None if tests is None else partial(tests.ask, armed=self.armed, now_s=now_s)
            return answer_command(message, self.arm, test) if mine else []
        if kind == "FILE_TRANSFER_PROTOCOL":
            return refuse_file_transfer(message) if mine else []
        in_flight = self.flights is not None and self.flights.flight.state is not State.IDLE
        return self._parameters.handle(message, self._may_be_armed(now_s), in_flight=in_flight)

    def _may_be_armed(self, now_s: float) -> bool:
        """Whether the vehicle is armed, or nothing says that it is not: an autopilot that is not heard may be."""
        return self.armed or (self._companion is not None and not self._companion.heard.is_there(now_s))

    def _flush(self) -> None:
        self._say_unsaid()
        aside, self._aside = self._aside, []
        queue, self._queue = self._queue, []
        overheard, self._overheard = self._overheard, []
        withheld, self._withheld = self._withheld, []
        if self._ring is not None:
            now_s = self._clock.boot_s()
            self._ring.put(
                round((self._unix_at_boot_s + now_s) * 1e6), now_s, [*overheard, *withheld, *aside, *queue]
            )
        self._sides.write_all(aside)
        if not self._stands_back:
            self._sides.write_all(queue)
            if self._companion is not None and self._companion.link >= 0:
                # ArduSub fuses an ODOMETRY in these frames as a velocity north and east, and bends its heading to it.
                self._sides.write_all(withheld, but=self._companion.link)
            self._send_files()
        self._sides.end_step(self._clock.boot_s())

    def _say_unsaid(self) -> None:
        """Say the texts that waited while it listened for another companion; beside one, as `knocks_as`."""
        if self._companion is None or self._companion.listens(self._clock.boot_s()):
            return
        unsaid, self._unsaid = self._unsaid, []
        for text, severity in unsaid:
            if not self._stands_back:
                self.say(text, severity)
                continue
            self._text_number = self._text_number % 65535 + 1
            texts = status_texts(text, severity, self._text_number)
            self._aside += [self._knocker.encode(message) for message in texts]

    def _send_files(self) -> None:
        """Send FTP answers only to the link that asked, never into the ring, which would fill with itself."""
        if self._files is None:
            return
        by_link: dict[int, list[bytes]] = {}
        for (number, *target), payload in self._files.due(self._clock.boot_s()):
            frame = self._encoder.frame(_FTP, bytes((0, *target)) + payload)
            by_link.setdefault(number, []).append(frame)
        for number, frames in by_link.items():
            self._sides.write(number, frames)
