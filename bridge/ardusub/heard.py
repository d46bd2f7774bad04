"""The last words of a companion's autopilot, on one vehicle's links.

Only frames of the vehicle's own autopilot component count: every other component may speak under the same system id.
"""

import math
import struct
from dataclasses import dataclass, field
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.firmware.ardusub import ARDUSUB
from bridge.firmware.description import AUTOPILOT
from bridge.vehicle.parameters import MODE
from bridge.wire.framing import Frame, decode

BEAT_WITHIN_S: Final = 3.0
"""A heartbeat comes each second; after as many lost the autopilot counts as silent."""
FRESH_S: Final = 0.5
SWITCH_FRESH_S: Final = 3.0
"""The joystick's gain and switches are asked for at 2 Hz."""

_ANSWERS: Final = (
    dialect.MAVLINK_MSG_ID_PARAM_VALUE,
    dialect.MAVLINK_MSG_ID_COMMAND_ACK,
    dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION,
)
_NO_VOLTAGE_MV: Final = 65535
_DEPTH_SENSOR: Final = dialect.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE
_SWITCHES: Final = {b"PilotGain": "gain", b"InputHold": "input_hold", b"RollPitch": "roll_pitch"}
_NAMED: Final = struct.Struct("<If10s")


@dataclass(slots=True)
class Heard:
    """The autopilot's last words. Times are the companion's; NaN and -inf before the first.

    `link` is the number of the one on which it beats; where it is heard on several, the first keeps it until it beats
    there no more.
    `gain` is the joystick gain, `input_hold` whether the sticks are held, `roll_pitch` whether they tilt instead of
    move, each NaN before it was heard. `is_other`: another autopilot than ArduSub beat there; `elsewhere`: the system
    of an ArduSub that beats as another vehicle, 0 for none. `applet_s`: when a script of ours in the autopilot beat.
    `pwm_us` are the pulses of outputs 1 to 16, `pressure_pa` the second barometer's, which is the one in the water.
    `depth_fails`: that one has failed by SYS_STATUS (ArduSub/GCS_Sub.cpp); ArduSub goes on sending its last pressure.
    """

    system: int
    link: int = -1
    beat_s: float = -math.inf
    armed: bool = False
    mode: int = -1
    is_other: bool = False
    elsewhere: int = 0
    applet_s: float = -math.inf
    gain: float = math.nan
    input_hold: float = math.nan
    roll_pitch: float = math.nan
    switches_s: dict[str, float] = field(default_factory=dict)
    pwm_us: tuple[float, ...] = ()
    pwm_s: float = -math.inf
    attitude: tuple[float, float, float] = (math.nan, math.nan, math.nan)
    rate: tuple[float, float, float] = (math.nan, math.nan, math.nan)
    attitude_s: float = -math.inf
    pressure_pa: float = math.nan
    pressure_s: float = -math.inf
    depth_fails: bool = False
    voltage_v: float = math.nan
    voltage_s: float = -math.inf

    def hear(self, link: int, frame: Frame, now_s: float) -> Any | None:
        """Take a frame; return its message if it is an answer that somebody may wait for."""
        number = frame.message_id
        if (frame.system, frame.component) != (self.system, AUTOPILOT):
            if (number, frame.component) == (dialect.MAVLINK_MSG_ID_HEARTBEAT, AUTOPILOT):
                self._beat_elsewhere(frame)
            return None
        if number == dialect.MAVLINK_MSG_ID_HEARTBEAT:
            self._beat(link, decode(frame), now_s)
        elif number == dialect.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT:
            self._switch(frame.payload, now_s)
        elif number == dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW:
            self._servos(decode(frame), now_s)
        elif number == dialect.MAVLINK_MSG_ID_ATTITUDE:
            self._turn(decode(frame), now_s)
        elif number == dialect.MAVLINK_MSG_ID_SCALED_PRESSURE2:
            message = decode(frame)
            if message is not None and not self.depth_fails:
                self.pressure_pa, self.pressure_s = 100.0 * message.press_abs, now_s
        elif number == dialect.MAVLINK_MSG_ID_SYS_STATUS:
            message = decode(frame)
            if message is not None:
                failed = message.onboard_control_sensors_enabled & ~message.onboard_control_sensors_health
                self.depth_fails = bool(failed & _DEPTH_SENSOR)
                if 0 < message.voltage_battery < _NO_VOLTAGE_MV:
                    self.voltage_v, self.voltage_s = 1e-3 * message.voltage_battery, now_s
        elif number in _ANSWERS:
            return decode(frame)
        return None

    def is_there(self, now_s: float) -> bool:
        """Whether it beats: until then nothing is sent to it."""
        return now_s - self.beat_s <= BEAT_WITHIN_S

    def has_applet(self, now_s: float) -> bool:
        """Whether a script of ours in the autopilot beats."""
        return now_s - self.applet_s <= SWITCH_FRESH_S

    def has_switches(self, now_s: float) -> bool:
        """Whether the joystick's gain and switches come."""
        return all(
            now_s - self.switches_s.get(name, -math.inf) <= SWITCH_FRESH_S for name in _SWITCHES.values()
        )

    def sticks_doubt(self, now_s: float) -> str:
        """Why the meaning of a stick is not known now, "" if it is."""
        if not self.has_switches(now_s):
            return "no joystick gain heard"
        if self.input_hold:
            return "the sticks are held (InputHold)"
        if self.roll_pitch:
            return "the sticks tilt the vehicle (RollPitch)"
        return "" if 0.0 < self.gain <= 1.0 else f"joystick gain of {self.gain:g}"

    def _beat(self, link: int, message: Any, now_s: float) -> None:
        if message is None:
            return
        if (message.autopilot, message.type) != (ARDUSUB.autopilot, ARDUSUB.kind):
            self.is_other = True
            return
        if not self.is_there(now_s):
            self.link = link
        if link != self.link:
            return
        self.beat_s = now_s
        self.armed = bool(message.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED)
        self.mode = message.custom_mode

    def _beat_elsewhere(self, frame: Frame) -> None:
        message = decode(frame)
        if message is not None and (message.autopilot, message.type) == (ARDUSUB.autopilot, ARDUSUB.kind):
            self.elsewhere = frame.system

    def _turn(self, message: Any, now_s: float) -> None:
        """Take attitude and rates; one that is no number is as good as none."""
        if message is None:
            return
        attitude = message.roll, message.pitch, message.yaw
        rate = message.rollspeed, message.pitchspeed, message.yawspeed
        if all(map(math.isfinite, (*attitude, *rate))):
            self.attitude, self.rate, self.attitude_s = attitude, rate, now_s

    def _switch(self, payload: bytes, now_s: float) -> None:
        _, value, raw = _NAMED.unpack(payload.ljust(_NAMED.size, b"\0")[: _NAMED.size])
        named = raw.rstrip(b"\0")
        if named == MODE.encode():
            self.applet_s = now_s
        if name := _SWITCHES.get(named):
            setattr(self, name, value)
            self.switches_s[name] = now_s

    def _servos(self, message: Any, now_s: float) -> None:
        if message is None or message.port != 0:
            return
        self.pwm_us = tuple(float(getattr(message, f"servo{n}_raw")) for n in range(1, 17))
        self.pwm_s = now_s
