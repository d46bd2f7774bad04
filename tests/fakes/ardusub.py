"""A fake ArduSub for CI: a component 1/1 on two links, as the firmware was seen to behave, each trait with a switch.

It keeps no physics. `Ardusub` is the fake behind the same few words as `firmware.Firmware`, so that tests of both run
the same.
"""

from collections import deque
from dataclasses import dataclass, field
from functools import lru_cache

from fakes.scripting import FUNCTIONS, Scripting
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import SimulatedClock
from bridge.links.link import memory_pair
from bridge.wire import ftp
from bridge.wire.framing import Encoder, Framer, decode

TICK_S = 0.01
MANUAL, ALT_HOLD, POSHOLD = 19, 2, 16
NEVER_SENT = (105, 331, 375, 69, 230)
"""HIGHRES_IMU, ODOMETRY, ACTUATOR_OUTPUT_STATUS, MANUAL_CONTROL, ESTIMATOR_STATUS: denied."""
WIND = 168
DISARM_BUTTON = 1 << 4
"""As ArduSub binds the buttons by default (joystick.cpp): a press is obeyed as its message arrives."""
MESSAGES_REQUESTED_FROM = (4, 0, 0)
UNASKED = {0: 1.0, 36: 0.5, 30: 0.1}
"""Seconds between two of a message on a link that asked for nothing."""
VECTORED = ((-1, 1, 1), (-1, -1, -1), (1, 1, -1), (1, -1, 1), (0, 0, 0), (0, 0, 0))


def parameters():
    return {
        "SYSID_MYGCS": 255.0, "FRAME_CONFIG": 1.0, "FS_GCS_ENABLE": 2.0, "FS_PILOT_INPUT": 2.0,
        "FS_PILOT_TIMEOUT": 3.0, "JS_GAIN_DEFAULT": 0.5, "JS_THR_GAIN": 1.0, "PSC_ACCZ_FF": 0.0, "PSC_VELXY_FF": 0.0,
        "VISO_TYPE": 1.0, "EK3_SRC1_POSXY": 0.0, "EK3_SRC1_VELXY": 6.0, "SCR_ENABLE": 0.0,
        "INS_GYRO_FILTER": 20.0, "INS_ACCEL_FILTER": 20.0,
        "MOT_FV_CPLNG_K": 0.0,
        **{f"MOT_{n}_DIRECTION": 1.0 for n in range(1, 7)},
        **{f"SERVO{n}_FUNCTION": 32.0 + n if n <= 6 else 0.0 for n in range(1, 17)},
    }  # fmt: skip


INT8 = ("FRAME_CONFIG", "FS_GCS_ENABLE", "FS_PILOT_INPUT", "VISO_TYPE", "SCR_ENABLE")


@dataclass
class Quirks:
    """Each was seen in the firmware; a test switches off or on what it is about."""

    answers_unknown: bool = False
    checks_range: bool = False
    merges_echoes: bool = True
    echo_s: float = 0.006
    read_s: float = 0.1
    executes_for_strangers: bool = True
    dies_on_wind: bool = True
    late: tuple[str, ...] = ()
    """Parameters that are there only once `late_s` has passed since boot, as a script's are."""
    late_s: float = 5.0
    boot_s: float = 2.9
    disarms_without_ground: bool = True
    ground_timeout_s: float = 2.5
    checks_pilot: bool = True
    """Whether the pilot's silence disarms: in the simulated firmware that check is not compiled."""


@lru_cache
def mix(*pulses_us):
    """The motors' pulses of those of forward, lateral and yaw: the same for many ticks, and asked for at each."""
    inputs = [max(-1.0, min(1.0, (pulse_us - 1500) / 400)) for pulse_us in pulses_us]
    sums = [sum(f * i for f, i in zip(row, inputs, strict=True)) for row in VECTORED]
    return tuple(int(1500 + 400 * max(-1.0, min(1.0, s))) for s in sums)


@dataclass
class Ardusub:
    """Both ends of two links: `ground` (SERIAL0) and `aboard` (SERIAL1) are what a program holds."""

    quirks: Quirks = field(default_factory=Quirks)
    is_firmware = False

    def __post_init__(self):
        self.clock = SimulatedClock()
        pairs = [memory_pair(), memory_pair()]
        self.ends = [near for near, _ in pairs]
        self.ground, self.aboard = (far for _, far in pairs)
        self.framers = [Framer(), Framer()]
        self.encoder = Encoder(1, 1)
        self.parameters = parameters()
        self.routes = set()
        self.armed, self.mode, self.dead = False, MANUAL, False
        self.sticks, self.gain = (0, 0, 500, 0), 0.5
        self.input_hold = self.roll_pitch = 0.0
        self.scripting = Scripting(self)
        self.pwm = self.mixed()
        self.booted_s = 0.0
        self.depth_m, self.voltage_v = 2.0, 16.0
        # One that fails leaves its last pressure in SCALED_PRESSURE2; SYS_STATUS alone tells.
        self.depth_fails = False
        # A link without streams: the joystick's switches (251) come only with the stream that carries them.
        self.intervals = dict(UNASKED)
        self.says_switches = True
        self.version = (4, 5, 7)
        self.kind = (dialect.MAV_TYPE_SUBMARINE, dialect.MAV_AUTOPILOT_ARDUPILOTMEGA)
        self.due = dict.fromkeys(self.intervals, 0.0)
        self.waiting = deque()
        self.mygcs_s = self.pilot_s = None
        self.writes = []
        self.texts = []

    def another_link(self):
        """The program's end of one more link."""
        near, far = memory_pair()
        self.ends.append(near)
        self.framers.append(Framer())
        return far

    def run(self, seconds, *acts):
        """Let time pass; each of `acts` is called at every tick."""
        for _ in range(round(seconds / TICK_S)):
            self.clock.advance_to(self.clock.now_s + TICK_S)
            self.step()
            for act in acts:
                act()

    def until(self, look, seconds, *acts):
        """Let time pass until `look()`; its result, or False after `seconds`."""
        for _ in range(round(seconds / TICK_S)):
            if result := look():
                return result
            self.run(TICK_S, *acts)
        return look()

    def arm(self, wanted=True):
        self.armed = wanted

    def set_mode(self, mode):
        self.mode = mode

    def close(self):
        pass

    def step(self):
        now_s = self.clock.now_s
        if self.dead or now_s < self.booted_s:
            return
        for number, end in enumerate(self.ends):
            while data := end.read(0.0):
                for frame in self.framers[number].feed(data):
                    self.hear(number, frame, now_s)
        while self.waiting and self.waiting[0][0] <= now_s:
            self.send(self.waiting.popleft()[1]())
        self.fail_safe(now_s)
        self.scripting.step(now_s)
        self.stream(now_s)

    def hear(self, number, frame, now_s):
        message = decode(frame)
        source = (frame.system, frame.component)
        self.routes.add((source, number))
        system, component = getattr(message, "target_system", 0), getattr(message, "target_component", 0)
        if message.get_type() == "MANUAL_CONTROL":
            system, component = message.target, 0
        routes = [
            (address, link) for address, link in self.routes
            if (system in (0, address[0])) and (component in (0, address[1])) and link != number
        ]  # fmt: skip
        # A heartbeat goes to every link on which somebody was heard, but to none from which the same component speaks.
        same = {link for address, link in self.routes if address == source}
        for link in {link for _, link in routes} - (same if message.get_type() == "HEARTBEAT" else set()):
            self.ends[link].write(frame.raw)
        known = any(address == (system, component) for address, _ in self.routes)
        strangers = self.quirks.executes_for_strangers and system == 1 and not known
        if system in (0, 1) and (component in (0, 1) or strangers):
            self.obey(message, frame, now_s)

    def obey(self, message, frame, now_s):
        kind = message.get_type()
        mine = frame.system == self.parameters.get("SYSID_MYGCS", 255.0)
        if kind == "HEARTBEAT" and mine:
            self.mygcs_s = now_s
        elif kind == "MANUAL_CONTROL" and mine:
            self.mygcs_s = self.pilot_s = now_s
            self.sticks = (message.x, message.y, message.z, message.r)
            self.armed = self.armed and not message.buttons & DISARM_BUTTON
        elif kind == "COMMAND_LONG" and message.command == dialect.MAV_CMD_SET_MESSAGE_INTERVAL:
            self.interval(int(message.param1), message.param2, frame, now_s)
        elif kind == "COMMAND_LONG":
            self.ordered(message, now_s)
        elif kind == "FILE_TRANSFER_PROTOCOL":
            answer = self.scripting.answer(ftp.decode(bytes(message.payload)))
            payload = list(answer.encode().ljust(ftp.PAYLOAD_BYTES, b"\0"))
            source = frame.system, frame.component
            self.send(dialect.MAVLink_file_transfer_protocol_message(0, *source, payload))
        elif kind == "REQUEST_DATA_STREAM" and message.req_stream_id == 2:
            self.intervals[251], self.due[251] = 1 / message.req_message_rate, now_s
        elif kind == "PARAM_SET":
            self.write(message.param_id, message.param_value, now_s)
        elif kind == "PARAM_REQUEST_READ":
            names = list(self.parameters)
            index = message.param_index
            name = names[index] if 0 <= index < len(names) else message.param_id
            if self.knows(name):
                self.later(now_s + self.quirks.read_s, name, max(index, -1) % 65536)
        elif kind == "PARAM_REQUEST_LIST":
            for index, name in enumerate(self.parameters):
                self.later(now_s + 0.01, name, index)

    def ordered(self, message, now_s):
        command, first = message.command, message.param1
        if command == dialect.MAV_CMD_COMPONENT_ARM_DISARM:
            self.armed = bool(first)
            return
        if command == dialect.MAV_CMD_DO_SET_MODE:
            self.mode = int(message.param2)
            return
        asks = (
            command == dialect.MAV_CMD_REQUEST_MESSAGE and first == dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION
        )
        asks_as_before = command == dialect.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES and first == 1.0
        if asks_as_before or (asks and self.version >= MESSAGES_REQUESTED_FROM):
            number = int.from_bytes((*self.version, 255), "big")
            self.send(
                dialect.MAVLink_autopilot_version_message(
                    0, number, 0, 0, 0, (0,) * 8, (0,) * 8, (0,) * 8, 0, 0, 0
                )
            )
            return
        restarts = command == dialect.MAV_CMD_SCRIPTING and first == 3.0
        reboots = command == dialect.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN and first == 1.0 and not self.armed
        refused = dialect.MAV_RESULT_DENIED if self.armed else dialect.MAV_RESULT_UNSUPPORTED
        result = dialect.MAV_RESULT_ACCEPTED if restarts or reboots else refused
        self.send(dialect.MAVLink_command_ack_message(command, result))
        if restarts:
            self.scripting.restart(now_s)
        elif reboots:
            self.booted_s = now_s + self.quirks.boot_s
            self.waiting.clear()
            self.intervals = dict(UNASKED)
            self.due = dict.fromkeys(self.intervals, self.booted_s)
            self.scripting.boot(self.booted_s)

    def interval(self, number, micros, frame, now_s):
        if number == WIND and self.quirks.dies_on_wind:
            self.dead = True
            return
        denied = number in NEVER_SENT
        if not denied:
            self.intervals[number], self.due[number] = micros * 1e-6, now_s
        result = dialect.MAV_RESULT_DENIED if denied else dialect.MAV_RESULT_ACCEPTED
        asker = frame.system, frame.component
        self.send(
            dialect.MAVLink_command_ack_message(dialect.MAV_CMD_SET_MESSAGE_INTERVAL, result, 0, 0, *asker)
        )

    def knows(self, name):
        if name in self.quirks.late and self.clock.now_s < self.quirks.late_s:
            return False
        return name in self.parameters or self.quirks.answers_unknown

    def write(self, name, value, now_s):
        if not self.knows(name) or value != value or value in (float("inf"), float("-inf")):
            return
        if name in INT8:
            value = float(max(-128, min(127, int(value))))
        if not (self.quirks.checks_range and abs(value) > 1e6):
            self.parameters[name] = value
        self.writes.append((name, value))
        waiting = any(getattr(make, "name", None) == name for _, make in self.waiting)
        if not (self.quirks.merges_echoes and waiting):
            self.later(now_s + self.quirks.echo_s, name)

    def later(self, at_s, name, index=65535):
        def make():
            return dialect.MAVLink_param_value_message(
                name.encode(), self.parameters.get(name, 0.0), 9, len(self.parameters), index
            )

        make.name = name
        self.waiting.append((at_s, make))
        self.waiting = deque(sorted(self.waiting, key=lambda item: item[0]))

    def send(self, message):
        raw = self.encoder.encode(message)
        for end in self.ends:
            end.write(raw)

    def fail_safe(self, now_s):
        if not self.armed:
            return
        ground_gone = self.mygcs_s is not None and now_s - self.mygcs_s > self.quirks.ground_timeout_s
        pilot_gone = self.pilot_s is not None and now_s - self.pilot_s > self.parameters["FS_PILOT_TIMEOUT"]
        if ground_gone and self.quirks.disarms_without_ground and self.parameters["FS_GCS_ENABLE"] == 2:
            self.say(f"MYGCS: {self.parameters['SYSID_MYGCS']:g}, heartbeat lost")
            self.armed = False
        elif pilot_gone and self.quirks.checks_pilot and self.parameters["FS_PILOT_INPUT"] == 2:
            self.say("Lost manual control")
            self.armed = False

    def say(self, text):
        self.texts.append(text)
        self.send(dialect.MAVLink_statustext_message(4, text.encode()))

    def mixed(self):
        """The pulses of all outputs by their functions; those of no motor are off."""
        motors = dict(enumerate(self.mix(), 33))
        return [motors.get(self.parameters[name], 0) for name in FUNCTIONS]

    def rc(self, channel):
        """The pulse of an input, in whole microseconds: 4 yaw, 5 forward, 6 lateral."""
        x, y, _, r = self.sticks
        return int(1500 + 0.4 * self.gain * {4: r, 5: x, 6: y}[channel])

    def mix(self):
        return mix(*(self.rc(channel) for channel in (5, 6, 4))) if self.armed else (1500,) * 6

    def stream(self, now_s):
        self.pwm = self.scripting.overridden(self.mixed())
        boot_ms = round((now_s - self.booted_s) * 1e3)
        for number, every_s in self.intervals.items():
            if now_s < self.due[number]:
                continue
            self.due[number] = now_s + every_s
            if number == 0:
                flags = 1 | (dialect.MAV_MODE_FLAG_SAFETY_ARMED if self.armed else 0)
                self.send(dialect.MAVLink_heartbeat_message(*self.kind, flags, self.mode, 4, 3))
            elif number == 36:
                self.send(dialect.MAVLink_servo_output_raw_message(boot_ms * 1000, 0, *self.pwm))
            elif number == 2:
                self.send(dialect.MAVLink_system_time_message(0, boot_ms))
            elif number == 137:
                hpa = 1013.25 + 1000.0 * 9.81 * self.depth_m / 100
                self.send(dialect.MAVLink_scaled_pressure2_message(boot_ms, hpa, 0.0, 1000))
            elif number == 1:
                volts = round(1e3 * self.voltage_v)
                water = dialect.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
                health = 0 if self.depth_fails else water
                self.send(dialect.MAVLink_sys_status_message(water, water, health, 0, volts, *(0,) * 8))
            elif number == 30:
                self.send(dialect.MAVLink_attitude_message(boot_ms, 0.0, 0.0, 0.3, 0.0, 0.0, 0.0))
            elif number == 251 and self.says_switches:
                switches = (
                    ("PilotGain", self.gain),
                    ("InputHold", self.input_hold),
                    ("RollPitch", self.roll_pitch),
                )
                for name, value in switches:
                    self.send(dialect.MAVLink_named_value_float_message(boot_ms, name.encode(), value))
