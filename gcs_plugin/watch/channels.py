"""Messages as signals, a channel for each signal (its sender, its rate, its age), and texts joined from STATUSTEXTs.

The signals are those of `bridge.wire.readings`, and: `rates` (3, rad/s), `velocity` (3, m/s, body axes), `velocity_ned`
(3, earth axes, from an autopilot's filter), `depth` (m, as stated). Rank 0 is the best source of a signal.
"""

import math
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final, NamedTuple

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.attitude import quaternion_of_angles
from bridge.text import printable
from bridge.wire.framing import Frame, decode
from bridge.wire.readings import OF_THE_CONTRACT, Reading, Values, Wire
from bridge.wire.status_codes import CrewText, decoded

NAN: Final = math.nan
MILLI_G: Final = 9.80665e-3
SERVOS: Final = 16


class Heard(NamedTuple):
    """The values of a signal in a message."""

    signal: str
    rank: int
    values: Values


def _fields(message: Any, *names: str) -> Callable[[Wire], Values]:
    """Return a function that picks the named fields from the fields in wire order."""
    places = tuple(message.ordered_fieldnames.index(name) for name in names)
    return lambda wire: tuple(wire[place] for place in places)


_EULER = _fields(dialect.MAVLink_attitude_message, "roll", "pitch", "yaw")
_EULER_RATES = _fields(dialect.MAVLink_attitude_message, "rollspeed", "pitchspeed", "yawspeed")
_BATTERY = _fields(dialect.MAVLink_sys_status_message, "voltage_battery", "current_battery")
_RELATIVE = _fields(dialect.MAVLink_global_position_int_message, "relative_alt")
_HUD = _fields(dialect.MAVLink_vfr_hud_message, "alt")
_NED = _fields(dialect.MAVLink_local_position_ned_message, "vx", "vy", "vz")
_INERTIAL = ("xacc", "yacc", "zacc", "xgyro", "ygyro", "zgyro")
_PORT = _fields(dialect.MAVLink_servo_output_raw_message, "port")
_PULSES = _fields(
    dialect.MAVLink_servo_output_raw_message, *(f"servo{number}_raw" for number in range(1, SERVOS + 1))
)


def _attitude(wire: Wire) -> tuple[Heard, ...]:
    angles = _EULER(wire)
    if not all(map(math.isfinite, angles)):
        return (Heard("attitude", 1, (NAN,) * 4), Heard("rates", 1, _EULER_RATES(wire)))
    return Heard("attitude", 1, quaternion_of_angles(*angles)), Heard("rates", 1, _EULER_RATES(wire))


def _inertial(message: Any, rank: int) -> Callable[[Wire], tuple[Heard, ...]]:
    """Decode an IMU in thousandths of g and of rad/s; a second IMU that the board lacks is reported as zeros."""
    take = _fields(message, *_INERTIAL)

    def readings(wire: Wire) -> tuple[Heard, ...]:
        values = take(wire)
        if not any(values):
            return ()
        force, rates = [MILLI_G * v for v in values[:3]], tuple(1e-3 * v for v in values[3:])
        return Heard("imu", rank, (*force, *rates, NAN)), Heard("rates", 1 + rank, rates)

    return readings


def _servos(wire: Wire) -> tuple[Heard, ...]:
    """One value for each output of the first port, up to the first output that is never driven."""
    if _PORT(wire)[0] != 0:
        return ()
    pulses = _PULSES(wire)
    driven = pulses.index(0) if 0 in pulses else SERVOS
    return (Heard("pwm", 1, pulses[:driven]),)


def _sys_status(wire: Wire) -> tuple[Heard, ...]:
    millivolts, centiamperes = _BATTERY(wire)
    volts = NAN if millivolts in (0, 65535) else millivolts * 1e-3
    return (Heard("battery", 1, (volts, NAN if centiamperes < 0 else centiamperes * 1e-2)),)


OF_A_DELTA: Final = 1
"""Rank of a velocity by VISION_POSITION_DELTA."""


def _position_delta(wire: Wire) -> tuple[Heard, ...]:
    """Mean velocity over the step, as DVL drivers for ArduSub send it."""
    step_us, delta_m = wire[1], wire[5:8]
    if step_us <= 0:
        return ()
    velocity = tuple(metres * 1e6 / step_us for metres in delta_m)
    return Heard("dvl", OF_A_DELTA, (*velocity, NAN)), Heard("velocity", OF_A_DELTA, velocity)


_FROM_AUTOPILOT: Final[dict[int, tuple[Any, Callable[[Wire], tuple[Heard, ...]]]]] = {
    message.id: (message, take)
    for message, take in (
        (dialect.MAVLink_attitude_message, _attitude),
        (dialect.MAVLink_scaled_imu2_message, _inertial(dialect.MAVLink_scaled_imu2_message, 1)),
        (dialect.MAVLink_scaled_imu_message, _inertial(dialect.MAVLink_scaled_imu_message, 2)),
        (dialect.MAVLink_raw_imu_message, _inertial(dialect.MAVLink_raw_imu_message, 3)),
        (dialect.MAVLink_servo_output_raw_message, _servos),
        (dialect.MAVLink_sys_status_message, _sys_status),
        (
            dialect.MAVLink_global_position_int_message,
            lambda wire: (Heard("depth", 0, (-1e-3 * _RELATIVE(wire)[0],)),),
        ),
        (dialect.MAVLink_vfr_hud_message, lambda wire: (Heard("depth", 1, (-_HUD(wire)[0],)),)),
        (dialect.MAVLink_local_position_ned_message, lambda wire: (Heard("velocity_ned", 0, _NED(wire)),)),
        (dialect.MAVLink_vision_position_delta_message, _position_delta),
    )
}
TELLING: Final = OF_THE_CONTRACT | _FROM_AUTOPILOT.keys()
FROM_ANYONE: Final = frozenset((dialect.MAVLINK_MSG_ID_VISION_POSITION_DELTA,))
"""Messages that a driver may send under a ground station's name; another vehicle's are its own."""


def heard(frame: Frame, reading: Reading | None) -> tuple[Heard, ...]:
    """Decode the signals in a frame with a checked CRC; empty for a message without any. `reading` is the frame's, if
    it is of the contract."""
    if reading is not None:
        return _of_reading(reading.signal, reading.values)
    entry = _FROM_AUTOPILOT.get(frame.message_id)
    if entry is None:
        return ()
    message, decoder = entry
    size = message.unpacker.size
    return decoder(message.unpacker.unpack(frame.payload[:size].ljust(size, b"\0")))


def _of_reading(signal: str, values: Values) -> tuple[Heard, ...]:
    if signal == "imu":
        return Heard("imu", 0, values), Heard("rates", 0, values[3:6])
    if signal == "dvl":
        return Heard("dvl", 0, values), Heard("velocity", 0, values[:3])
    if signal == "altitude":
        metres = values[0]
        return (Heard("altitude", 0, (metres if metres > 0.0 else NAN,)),)
    return (Heard(signal, 0, values),)


TIMES_KEPT: Final = 64
RATE_OVER_S: Final = 10.0
YIELDS_AFTER_S: Final = 3.0
"""A source silent for this long loses its signal to the next one, even if that is worse."""

Teller = tuple[int, int]
"""Rank and component of a source."""


class Channel:
    """The last values of a signal. `says` tests whether values are valid.

    `said_s` is when they last were, `heard_s` when anything last came, `first_s` when anything first came.
    """

    __slots__ = ("_says", "_times_s", "first_s", "heard_s", "said_s", "teller", "values")

    def __init__(self, says: Callable[[Values], bool]) -> None:
        self._says = says
        self._times_s: deque[float] = deque(maxlen=TIMES_KEPT)
        self.teller: Teller = (0, 0)
        self.values: Values = ()
        self.first_s = math.inf
        self.heard_s = self.said_s = -math.inf

    def take(self, teller: Teller, values: Values, time_s: float) -> bool:
        """Take values from the present source, from a better one, or from any if the present one is silent.

        Return whether the values were taken.
        """
        if teller != self.teller:
            if teller[0] >= self.teller[0] and time_s - self.heard_s < YIELDS_AFTER_S:
                return False
            self.teller = teller
            self._times_s.clear()
        if not self._times_s and self.first_s == math.inf:
            self.first_s = time_s
        self.values, self.heard_s = values, time_s
        self._times_s.append(time_s)
        if self._says(values):
            self.said_s = time_s
        return True

    def age_s(self, now_s: float) -> float:
        """Time since the last values; inf if none ever came."""
        return now_s - self.heard_s

    def mute_s(self, now_s: float) -> float:
        """Time without valid values, even if other values came."""
        return now_s - (self.said_s if self.said_s > -math.inf else self.first_s)

    def rate_hz(self, now_s: float, silent_after_s: float) -> float:
        """Rate over the last seconds; a silence longer than `silent_after_s` lowers it."""
        recent_s = [time_s for time_s in self._times_s if now_s - time_s <= RATE_OVER_S]
        if len(recent_s) < 2:
            return 0.0
        until_s = now_s if now_s - recent_s[-1] > silent_after_s else recent_s[-1]
        return (len(recent_s) - 1) / (until_s - recent_s[0]) if until_s > recent_s[0] else 0.0


PIECE_CHARACTERS: Final = 50
LONGEST_CHARACTERS: Final = 1000
MOST_BEGUN: Final = 256
LOST: Final = " ... "
"""Stands for the pieces of a text that were lost on the way."""

Tell = Callable[[tuple[int, int], int, CrewText], None]
"""Called with (system, component), severity and text."""


@dataclass(slots=True)
class _Begun:
    """A text in pieces, by their place; `is_told` once it was passed on, until the sender's next heartbeat."""

    number: int
    severity: int
    pieces: dict[int, str] = field(default_factory=dict)
    is_told: bool = False

    @property
    def is_whole(self) -> bool:
        """Whether the last piece is there, which is never full, and all before it."""
        last = len(self.pieces) - 1
        return max(self.pieces) == last and len(self.pieces[last]) < PIECE_CHARACTERS

    @property
    def text(self) -> str:
        """The pieces in their order, with LOST in the place of others."""
        text, following = "", 0
        for place, piece in sorted(self.pieces.items()):
            text += piece if place == following else LOST + piece
            following = place + 1
        goes_on = self.number and len(self.pieces[following - 1]) >= PIECE_CHARACTERS
        return text + LOST if goes_on else text


class StatusTexts:
    """Joins long STATUSTEXTs from their pieces, which may come twice or out of their order; printable on a screen.

    Takes every frame of a link; `tell` gets each text once it is complete, or at its sender's next heartbeat or other
    long text.
    """

    def __init__(self, tell: Tell) -> None:
        self._tell = tell
        self._begun: dict[tuple[int, int], _Begun] = {}

    def hear(self, frame: Frame) -> None:
        if frame.message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT:
            self._end((frame.system, frame.component))
        elif frame.message_id == dialect.MAVLINK_MSG_ID_STATUSTEXT:
            self._take(frame)

    def _take(self, frame: Frame) -> None:
        source = (frame.system, frame.component)
        message = decode(frame)
        if message is None:
            return
        if not message.id:
            self._say(source, _Begun(0, message.severity, {0: message.text}))
            return
        begun = self._begun.get(source)
        if begun is None or begun.number != message.id:
            self._end(source)
            if len(self._begun) >= MOST_BEGUN:
                self._end(next(iter(self._begun)))
            begun = self._begun[source] = _Begun(message.id, message.severity)
        if begun.is_told:
            return
        begun.pieces[message.chunk_seq] = message.text
        if begun.is_whole or sum(map(len, begun.pieces.values())) > LONGEST_CHARACTERS:
            self._say(source, begun)

    def _end(self, source: tuple[int, int]) -> None:
        begun = self._begun.pop(source, None)
        if begun is not None:
            self._say(source, begun)

    def _say(self, source: tuple[int, int], begun: _Begun) -> None:
        """Pass a text on, once: late pieces of it may still come."""
        if begun.is_told or not (text := begun.text):
            return
        begun.is_told = True
        self._tell(source, begun.severity, decoded(printable(text)))
