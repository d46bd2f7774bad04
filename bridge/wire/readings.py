"""Table of signals and their MAVLink messages, for encoding and decoding. Every time is boot time, of validity.

Message ids and fields are MAVLink's common.xml. The struct layouts are pymavlink's own; packing them directly takes a
fifth of the time of building its message objects, and a test checks that the bytes are equal.
"""

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import FrameError
from bridge.wire.framing import Frame

CONTRACT_VERSION: Final = 1
ARRAY_ID: Final = 256 * CONTRACT_VERSION

NAN: Final = math.nan
Wire = tuple[Any, ...]
Values = tuple[float, ...]


@dataclass(frozen=True, slots=True)
class Reading:
    """A signal at one instant, SI units, body axes (FRD). `time_s` is NaN if the message carries no time.

    Values that a device does not report are NaN; a pressure sensor's temperature, for which MAVLink has no such value,
    arrives as 0. The values, by signal:

        imu                        specific force (3), rates (3), temperature (deg C)
        fog                        mean yaw rate since the previous reading, dated at the middle of that interval
        dvl                        velocity at the transducer (3; NaN without bottom lock), sigma
        altitude, pressure         m; Pa, temperature (deg C)
        attitude                   w x y z, rates (3)
        pwm, rpm                   us, one per thruster; rev/min, one per thruster and then zeros, 58 in all
        tau_pid, tau_ff, tau_cmd   X Y Z K M N
        nu_fb, nu_ref              u v w p q r; the same, their six derivatives, heading, depth
        ff_mode, veh_cfg           one number
        flight                     State and End of `bridge.flight.flight`, last order, s left, m north and east of its
                                   beginning
        battery                    V, A
        gnss                       fix type, latitude and longitude (deg), altitude and sigma (m), speed,
                                   course (rad), satellites
        alive, clock               armed (0 or 1), MAV_TYPE, MAV_AUTOPILOT; Unix time (s)
    """

    signal: str
    time_s: float
    values: Values


@dataclass(frozen=True, slots=True)
class Signal:
    """A row of the table: the message that carries a signal, and the conversions between its fields and values.

    `selects` are the payload bytes, at `SELECTOR`'s place, that distinguish the signal from others of the same
    message.
    """

    name: str
    message: Any
    selects: bytes
    to_wire: Callable[[float, Values], Wire]
    from_wire: Callable[[Wire], tuple[float, Values]]


# The payload bytes that identify the signal in a message that can carry several.
SELECTOR: Final = {
    dialect.MAVLINK_MSG_ID_HIGHRES_IMU: slice(62, 63),  # id
    dialect.MAVLINK_MSG_ID_DISTANCE_SENSOR: slice(12, 13),  # orientation
    dialect.MAVLINK_MSG_ID_ODOMETRY: slice(228, 230),  # frame_id, child_frame_id
    dialect.MAVLINK_MSG_ID_BATTERY_STATUS: slice(32, 33),  # id
    dialect.MAVLINK_MSG_ID_DEBUG_FLOAT_ARRAY: slice(8, 20),  # array_id, name
    dialect.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT: slice(8, 18),  # name
}
_NOWHERE: Final = slice(0, 0)


def microseconds(time_s: float) -> int:
    """Boot time as MAVLink's time_usec."""
    return max(0, round(time_s * 1e6))


def milliseconds(time_s: float) -> int:
    """Boot time as MAVLink's time_boot_ms, which wraps after 49.7 days."""
    return max(0, round(time_s * 1e3)) & 0xFFFFFFFF


def _whole(value: float, high: int, unknown: int) -> int:
    """Round to a whole number in 0 to `high`; `unknown` for NaN."""
    return unknown if math.isnan(value) else round(min(max(value, 0.0), high))


def _centidegrees(celsius: float) -> int:
    return 0 if math.isnan(celsius) else round(min(max(celsius * 100, -32768.0), 32767.0))


_ACC_GYRO, _TEMPERATURE, _Z_GYRO = 63, 4096, 32


def _imu_to_wire(time_s: float, v: Values) -> Wire:
    has_temperature = v[6] == v[6]
    fields = _ACC_GYRO | _TEMPERATURE if has_temperature else _ACC_GYRO
    return (microseconds(time_s), *v[:6], 0, 0, 0, 0, 0, 0, v[6] if has_temperature else 0.0, fields, 0)


def _imu_from_wire(w: Wire) -> tuple[float, Values]:
    return w[0] / 1e6, (*w[1:7], w[13] if w[14] & _TEMPERATURE else NAN)


_ZEROS = (0.0,) * 20
_WORST_SIGMA_M_S = (
    0.4  # figure of merit of a Water Linked A50 at which its BlueOS driver reports 0 % confidence
)


def _dvl_to_wire(time_s: float, v: Values) -> Wire:
    locked = not any(math.isnan(c) for c in v[:3])
    velocity = v[:3] if locked else (NAN, NAN, NAN)
    variance = v[3] * v[3]
    if not locked:
        quality = -1
    elif math.isnan(v[3]):
        quality = 0
    else:
        quality = max(1, round(100 * (1 - min(v[3] / _WORST_SIGMA_M_S, 1.0))))
    covariance = (variance, 0, 0, 0, 0, 0, variance, 0, 0, 0, 0, variance, 0, 0, 0, 0, 0, 0, 0, 0, 0)
    head = (microseconds(time_s), NAN, NAN, NAN, 1, 0, 0, 0, *velocity, NAN, NAN, NAN)
    return (*head, NAN, *_ZEROS, *covariance, _LOCAL_FRD, _BODY_FRD, 0, 0, quality)


def _dvl_from_wire(w: Wire) -> tuple[float, Values]:
    velocity = w[8:11] if w[60] != -1 else (NAN, NAN, NAN)
    variance = w[35]
    return w[0] / 1e6, (*velocity, math.sqrt(variance) if variance >= 0 else NAN)


_LOCAL_FRD, _BODY_FRD = dialect.MAV_FRAME_LOCAL_FRD, dialect.MAV_FRAME_BODY_FRD
_DOWN = dialect.MAV_SENSOR_ROTATION_PITCH_270


def _battery_to_wire(time_s: float, v: Values) -> Wire:
    del time_s  # BATTERY_STATUS carries none
    volts = _whole(v[0] * 1000, 65534, 65535)
    amperes = -1 if math.isnan(v[1]) else round(min(max(v[1] * 100, 0.0), 32767.0))
    return (-1, -1, 32767, volts, *(65535,) * 9, amperes, 0, 0, 0, -1, 0, 0, 0, 0, 0, 0, 0, 0)


def _battery_from_wire(w: Wire) -> tuple[float, Values]:
    # An autopilot may list the cells, whose sum is the pack's voltage.
    cells = [cell for cell in w[3:13] if cell != 65535]
    return NAN, (sum(cells) / 1000 if cells else NAN, NAN if w[13] < 0 else w[13] / 100)


def _gnss_to_wire(time_s: float, v: Values) -> Wire:
    fix, latitude, longitude, altitude, sigma, speed, course, satellites = v
    degrees = math.degrees(course) % 360.0
    head = (microseconds(time_s), *(0 if math.isnan(a) else round(a * 1e7) for a in (latitude, longitude)))
    height = 0 if math.isnan(altitude) else round(altitude * 1e3)
    speed_cm_s, course_cdeg = _whole(speed * 100, 65534, 65535), _whole(degrees * 100, 35999, 65535)
    seen = _whole(satellites, 254, 255)
    accuracy = _whole(sigma * 1e3, 0xFFFFFFFF, 0)
    return (*head, height, 65535, 65535, speed_cm_s, course_cdeg, int(fix), seen, 0, accuracy, 0, 0, 0, 0)


def _gnss_from_wire(w: Wire) -> tuple[float, Values]:
    fixed = w[8] >= dialect.GPS_FIX_TYPE_2D_FIX
    place = (w[1] / 1e7, w[2] / 1e7, w[3] / 1e3) if fixed else (NAN, NAN, NAN)
    sigma = w[11] / 1e3 if w[11] else NAN
    speed = NAN if w[6] == 65535 else w[6] / 100
    course = NAN if w[7] == 65535 else math.radians(w[7] / 100)
    return w[0] / 1e6, (float(w[8]), *place, sigma, speed, course, NAN if w[9] == 255 else float(w[9]))


def _alive_to_wire(time_s: float, v: Values) -> Wire:
    del time_s  # HEARTBEAT carries none
    armed, kind, autopilot = v
    mode = dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (dialect.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0)
    state = dialect.MAV_STATE_ACTIVE if armed else dialect.MAV_STATE_STANDBY
    return 0, int(kind), int(autopilot), mode, state, 3


def _alive_from_wire(w: Wire) -> tuple[float, Values]:
    return NAN, (float(bool(w[3] & dialect.MAV_MODE_FLAG_SAFETY_ARMED)), float(w[1]), float(w[2]))


def _array(signal: str, name: str, width: int) -> Signal:
    """A signal in a DEBUG_FLOAT_ARRAY of `width` values under the contract's version."""
    wire_name = name.encode()

    def to_wire(time_s: float, v: Values) -> Wire:
        return (microseconds(time_s), ARRAY_ID, wire_name, *v, *(0.0,) * (58 - len(v)))

    def from_wire(w: Wire) -> tuple[float, Values]:
        return w[0] / 1e6, w[3 : 3 + width]

    selects = ARRAY_ID.to_bytes(2, "little") + wire_name.ljust(10, b"\0")
    return Signal(signal, dialect.MAVLink_debug_float_array_message, selects, to_wire, from_wire)


def _named(signal: str, name: str) -> Signal:
    wire_name = name.encode()

    def to_wire(time_s: float, v: Values) -> Wire:
        return milliseconds(time_s), v[0], wire_name

    def from_wire(w: Wire) -> tuple[float, Values]:
        return w[0] / 1e3, (w[1],)

    selects = wire_name.ljust(10, b"\0")
    return Signal(signal, dialect.MAVLink_named_value_float_message, selects, to_wire, from_wire)


_NO_DISTANCE: Final = 65535
_FARTHEST_CM: Final = _NO_DISTANCE - 1
"""A recording's reader takes a distance beyond the device's farthest for none: devices here reach from 30 to 150 m."""

TABLE: Final = (
    Signal("imu", dialect.MAVLink_highres_imu_message, b"\0", _imu_to_wire, _imu_from_wire),
    Signal(
        "fog",
        dialect.MAVLink_highres_imu_message,
        b"\1",
        lambda time_s, v: (microseconds(time_s), *(0,) * 5, v[0], *(0,) * 7, _Z_GYRO, 1),
        lambda w: (w[0] / 1e6, (w[6],)),
    ),
    Signal(
        "dvl", dialect.MAVLink_odometry_message, bytes((_LOCAL_FRD, _BODY_FRD)), _dvl_to_wire, _dvl_from_wire
    ),
    Signal(
        "altitude",
        dialect.MAVLink_distance_sensor_message,
        bytes((_DOWN,)),
        lambda time_s, v: (
            *(milliseconds(time_s), 5, _FARTHEST_CM, _whole(v[0] * 100, _FARTHEST_CM, _NO_DISTANCE)),
            *(dialect.MAV_DISTANCE_SENSOR_ULTRASOUND, 0, _DOWN, 255, *(0,) * 7),
        ),
        lambda w: (w[0] / 1e3, (NAN if w[3] == _NO_DISTANCE else w[3] / 100,)),
    ),
    Signal(
        "pressure",
        dialect.MAVLink_scaled_pressure2_message,
        b"",
        lambda time_s, v: (milliseconds(time_s), v[0] / 100, 0, _centidegrees(v[1]), 0),
        lambda w: (w[0] / 1e3, (w[1] * 100, w[3] / 100)),
    ),
    Signal(
        "attitude",
        dialect.MAVLink_attitude_quaternion_message,
        b"",
        lambda time_s, v: (milliseconds(time_s), *v, 0, 0, 0, 0),
        lambda w: (w[0] / 1e3, w[1:8]),
    ),
    Signal(
        "pwm",
        dialect.MAVLink_actuator_output_status_message,
        b"",
        lambda time_s, v: (microseconds(time_s), (1 << len(v)) - 1, *v, *(0.0,) * (32 - len(v))),
        lambda w: (w[0] / 1e6, w[2 : 2 + w[1].bit_length()]),
    ),
    Signal("battery", dialect.MAVLink_battery_status_message, b"\0", _battery_to_wire, _battery_from_wire),
    Signal("gnss", dialect.MAVLink_gps_raw_int_message, b"", _gnss_to_wire, _gnss_from_wire),
    Signal("alive", dialect.MAVLink_heartbeat_message, b"", _alive_to_wire, _alive_from_wire),
    Signal(
        "clock",
        dialect.MAVLink_system_time_message,
        b"",
        lambda time_s, v: (round(v[0] * 1e6), milliseconds(time_s)),
        lambda w: (w[1] / 1e3, (w[0] / 1e6,)),
    ),
    _array("tau_pid", "TAU_PID", 6),
    _array("tau_ff", "TAU_FF", 6),
    _array("tau_cmd", "TAU_CMD", 6),
    _array("nu_fb", "NU_FB", 6),
    _array("nu_ref", "NU_REF", 14),
    _array("rpm", "RPM", 58),
    _array("flight", "FLIGHT", 6),
    _named("ff_mode", "FF_MODE"),
    _named("veh_cfg", "VEH_CFG"),
)

_BY_NAME: Final = {row.name: row for row in TABLE}
_BY_WIRE: Final = {(row.message.id, row.selects): row for row in TABLE}
OF_THE_CONTRACT: Final = frozenset(row.message.id for row in TABLE)


def encode(reading: Reading) -> tuple[int, bytes]:
    """Return message id and payload of a reading, for `Encoder.frame`.

    Raises FrameError if a value does not fit its field.
    """
    row = _BY_NAME[reading.signal]
    try:
        payload: bytes = row.message.unpacker.pack(*row.to_wire(reading.time_s, reading.values))
    except (struct.error, OverflowError, ValueError) as error:
        raise FrameError(
            f"{reading.signal}: {reading.values} does not fit {row.message.msgname} ({error})"
        ) from None
    return row.message.id, payload


def decode(frame: Frame) -> Reading | None:
    """Return the reading that a frame carries; None if the contract has no such signal."""
    number = frame.message_id
    if number not in OF_THE_CONTRACT or not frame.known:
        return None
    message = dialect.mavlink_map[number]
    size = message.unpacker.size
    payload = frame.payload[:size].ljust(size, b"\0")
    row = _BY_WIRE.get((number, payload[SELECTOR.get(number, _NOWHERE)]))
    if row is None:
        return None
    time_s, values = row.from_wire(message.unpacker.unpack(payload))
    return Reading(row.name, time_s, values)
