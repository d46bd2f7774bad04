"""What the name of a column says: the signal, the axis or the thruster, and the unit.

Names as in ROS, MAVROS, PX4 and ArduPilot logs, and as people write them in tables. ROS writes quaternions x y z w; a
Dive holds w x y z.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass

_TIME = {"s": "s", "sec": "s", "secs": "s", "seconds": "s", "ms": "ms", "msec": "ms", "millis": "ms", "us": "us",
         "usec": "us", "micros": "us", "ns": "ns", "nsec": "ns", "nanos": "ns"}  # fmt: skip
_SPEED: dict[str, str] = {
    "m_s": "m/s", "mps": "m/s", "ms": "m/s", "cm_s": "cm/s", "cms": "cm/s",
    "mm_s": "mm/s", "kn": "kn", "kt": "kn", "kts": "kn", "knot": "kn", "knots": "kn",
    "kmh": "km/h", "km_h": "km/h", "kph": "km/h", "ft_s": "ft/s", "fps": "ft/s",
    "in_s": "in/s", "ips": "in/s",
}  # fmt: skip
_ANGLE: dict[str, str] = {
    "deg": "deg", "degs": "deg", "degree": "deg", "degrees": "deg",
    "rad": "rad", "rads": "rad", "radians": "rad",
}  # fmt: skip
_TURN: dict[str, str] = {
    "deg_s": "deg/s", "dps": "deg/s", "deg": "deg/s", "degs": "deg/s",
    "rad_s": "rad/s", "rads": "rad/s", "rad": "rad/s", "rps": "rad/s",
    "mrad_s": "mrad/s", "deg_h": "deg/h", "deg_hr": "deg/h",
}  # fmt: skip
_LENGTH: dict[str, str] = {
    "m": "m", "meter": "m", "meters": "m", "metres": "m", "cm": "cm",
    "mm": "mm", "ft": "ft", "feet": "ft", "foot": "ft", "in": "in",
    "inch": "in", "inches": "in",
}  # fmt: skip
EARTH_VELOCITY = "velocity in earth axes"
UNITS: dict[str, dict[str, str]] = {
    "time": _TIME,
    "velocity": _SPEED, EARTH_VELOCITY: _SPEED, "gyro": _TURN, "fog": _TURN, "euler": _ANGLE, "quaternion": {},
    "specific_force": {
        "m_s2": "m/s2", "ms2": "m/s2", "mps2": "m/s2", "m_s_2": "m/s2",
        "m_ss": "m/s2", "g": "g", "mg": "mg", "ft_s2": "ft/s2",
    },
    "pressure": {
        "pa": "Pa", "kpa": "kPa", "hpa": "hPa", "mbar": "mbar", "bar": "bar",
        "k_pa": "kPa", "h_pa": "hPa", "m_bar": "mbar", "dbar": "dbar", "dbars": "dbar", "d_bar": "dbar", "psi": "psi",
        "psia": "psi",
    },
    "depth": _LENGTH, "altitude": _LENGTH,
    "pwm": {
        "us": "us", "usec": "us", "ms": "ms", "n": "N", "kgf": "kgf", "lbf": "lbf",
    },
    "rpm": {"rpm": "rpm", "rev_s": "rev/s", "rps": "rev/s", "rad_s": "rad/s"},
    "voltage": {"v": "V", "volt": "V", "volts": "V", "mv": "mV", "m_v": "mV"},
    "tau_cmd": {"n": "N", "nm": "N", "n_m": "N", "kgf": "kgf", "lbf": "lbf"},
    "armed": {},
}  # fmt: skip
"""By signal, the unit that a word at the end of a name means."""

_SIGNS = {"°": "deg", "º": "deg", "µ": "u", "μ": "u", "²": "2", "^": "", "·": "", "*": ""}
_NO_MEASUREMENT = re.compile(
    r"desired|setpoint|set_point|target|reference|(^|_)(ref|des|goal|err|error|cmd|command|covariance|cov|std|stddev|"
    r"sigma|var|variance|bias|offset|min|max|temperature|temp|diff|differential|quality|valid|count|id|seq|status|flags?)(_|$)"
)
_WANTED = re.compile(r"desired|setpoint|set_point|target|reference|(^|_)(ref|des|goal|cmd|command)(_|$)")
"""Topics of orders to a vehicle, not of its motion."""
_COMMANDS = ("pwm", "rpm", "tau_cmd")
_SIDE = "(left|port|right|starboard|stbd)"
_ALONG = "front|rear|fore|aft|back|bow|mid|middle|vert|vertical|upper|lower|top|bottom"
_PAIR = rf"(?!.*(?:^|_)(?:{_ALONG})(?:_|$))(?:.*_)?"
"""Begins the rule of a pair of thrusters: names that say more than a side are of more than two."""
_OF_MOTION = r"^(?!.*(?:acc|joy|teleop|key|attitude))"
"""Topics whose `linear` and `angular` are a velocity and rates: no Accel of ROS, no pilot's order, no angles."""
_PUSHES = "(?:pwm|servo|esc|motor|thruster|thrusters|thr|throttle|prop|propeller)"

_RULES: tuple[tuple[str, str, str], ...] = (
    ("velocity", r"(?:.*_)?twist_linear_([xyz])", ""),
    ("velocity",
     r"(?:.*_)?(?:v|vel|velocity|speed)_(ahead|forward|fwd|starboard|stbd|right|left|port)", ""),
    ("velocity",
     r"(ahead|forward|fwd|starboard|stbd|right|left|port)_(?:vel|velocity|speed)", ""),
    (EARTH_VELOCITY, r"v([nedu])|(?:.*_)?(?:v|vel|velocity)_([ned])", ""),
    (EARTH_VELOCITY, r"(?:.*_)?(?:v|vel|velocity|speed)_?(north|east|down|up)", ""),
    (EARTH_VELOCITY, r"(?:.*_)?local_position_(?:ned_)?v_?([xyz])", ""),
    (EARTH_VELOCITY, r"(north|east|down|up)_(?:vel|velocity|speed)", ""),
    (EARTH_VELOCITY, r"(?:.*_)?(?:v|vel|velocity)_(?:ned|enu)_([xyz012])", ""),
    ("gyro", r"(?:.*_)?(?:angular_velocity|angular_rate|ang_vel|gyroscope|gyro|gyr|rates?|omega)_?([xyz012])", ""),
    ("velocity", r"(?:.*_)?(?:linear_velocity|body_velocity|velocity_body|velocity|vel)_([xyz012])", ""),
    ("velocity", r"([uvw])(?:_dvl|_body|_b)?|dvl_([uvwxyz])|dvl_v([xyz])", ""),
    ("velocity", r"(surge|sway|heave)(?:_(?:velocity|speed|vel))?", ""),
    ("velocity", r"v_?([xyz])(?:_body|_b)?", ""),
    ("velocity", r"(?:vel|velocity|speed)_([uvw])", ""),
    ("velocity", r"(?:uvw|nu)_([012])", ""),
    ("gyro", r"(?:.*_)?twist_angular_([xyz])", ""),
    ("gyro", r"xyz_([012])|([xyz])", r"angular_velocity|gyro"),
    ("gyro", r"([pqr])(?:_(?:imu|body|b))?", ""),
    ("gyro", r"(?:.*_)?(roll|pitch|yaw)_?(?:rate|speed|vel)", ""),
    ("gyro", r"(?:.*_)?(turn|heading)_?(?:rate|speed)|rate_of_(turn)", ""),
    ("gyro", r"w_?([xyz])|w_(row|roll|pitch|yaw)|(?:.*_)?([xyz])_?gyro", ""),
    ("gyro", r"(?:vel|velocity|rate|omega)_([pqr])|as_?([xyz])", ""),
    ("gyro", r"pqr_([012])|nu_([345])", ""),
    ("fog", r"fog|fog_(?:rate|z|r|yaw_rate)", ""),
    ("specific_force",
     r"(?:.*_)?(?:linear_acceleration|accelerometer|acceleration|accel|acc|specific_force)_?([xyz012])", ""),
    ("specific_force", r"xyz_([012])|([xyz])", r"(?:vehicle_)?acceleration|accel"),
    ("specific_force", r"a_?([xyz])(?:_imu|_body)?|(?:.*_)?([xyz])_?acc(?:el)?", ""),
    ("tau_cmd", r"(?:.*_)?wrench_(surge|sway|heave|roll|pitch|yaw)", ""),
    ("quaternion", r"(?:.*_)?(?:orientation|quaternion|quat|attitude|q)_([wxyz0-4])|(?:.*_)?q([wxyz0-4])", ""),
    ("euler", r"(?:.*_)?(roll|pitch|yaw|heading|hdg)(?:_angle)?", ""),
    ("euler", r"(phi|theta|psi)", ""),
    ("euler", r"ang(?:le)?_?([xyz])", ""),
    ("euler", r"(?:.*_)?(?:euler(?:_angles?)?|eul|rpy)_([xyz012])|eta_([345])", ""),
    ("euler", r"(?:vector_)?([xyz])", r"(^|_)(rpy|euler)(_|$)"),
    ("euler", r"angular_([xyz])", r"^(?!.*(?:rate|vel|speed|gyro)).*attitude"),
    ("pressure", r"(?:.*_)?(?:fluid_)?(?:pressure|press|baro)(?:_abs)?|abs_pressure", ""),
    ("pressure", r"data", r"^(?!.*(?:intern|inner|inside|hull|housing|tube|air|diff|tank)).*(?:pressure|baro)"),
    ("altitude", r"(?:.*_)?(?:altitude|range|distance|height_above_bottom)", r"^(?!.*(?:usbl|lbl|beacon|acoustic))"),
    ("altitude", r"data", r"altitude|altimeter|range"),
    ("depth", r"(?:.*_)?depth", ""),
    ("depth", r"data", r"depth|rel_alt"),
    ("depth", r"(?:.*_)?(?:position|pos)_z|z", ""),
    ("rpm", r"(?:.*_)?(?:rpm|rps)_?(\d+)", ""),
    ("rpm", r"(?:.*_)?(?:esc|motor|thruster|prop|propeller)_?(\d+)(?:_.*)?_(?:rpm|speed|rps)", ""),
    ("pwm", r"(?:.*_)?(?:pwm|servo|output|out|channels|control|effort|esc|motor|thruster|actuator|act)_?(\d+)"
            r"(?:_(?:raw|pwm|command|cmd|output))?", ""),
    ("pwm", r"(?:.*_)?(?:force|thrust)s?_?(\d+)|(?:.*_)?(?:motor|thruster|prop|propeller)_?(\d+)_(?:force|thrust)", ""),
    ("pwm", r"(?:.*_)?(?:positive|pulse)_width_?(?:us_?)?(\d+)", ""),
    ("pwm", r"(?:t|m|c|ch|u)(\d+)", ""),
    ("pwm", r"(?:u_)?(?:thr|cmds?|commands?)_?(\d+)", ""),
    ("pwm", r"data_(\d+)", r"thruster|pwm|motor|servo|actuator|command|output"),
    ("rpm", rf"{_PAIR}(?:rpm|rps)_{_SIDE}", ""),
    ("rpm", rf"{_PAIR}{_SIDE}_(?:.*_)?(?:rpm|rps)", ""),
    ("pwm", rf"{_PAIR}{_PUSHES}_{_SIDE}(?:_(?:raw|pwm|command|cmd|output))?", ""),
    ("pwm", rf"{_PAIR}{_SIDE}_{_PUSHES}(?:_(?:raw|pwm|command|cmd|output))?", ""),
    ("pwm", rf"{_PAIR}(?:force|thrust)_{_SIDE}(?:_(?:command|cmd))?", ""),
    ("pwm", rf"{_PAIR}{_SIDE}_(?:force|thrust)(?:_(?:command|cmd))?", ""),
    ("tau_cmd", r"(?:.*_)?(force_[xyz]|torque_[xyz])", ""),
    ("tau_cmd", r"(?:.*_)?f_?([xyz])", ""),
    ("tau_cmd", r"(?:.*_)?(surge|sway|heave)_(?:force|thrust)", ""),
    ("tau_cmd", r"tau_?(?:cmd_?)?([xyzkmn0-5])", ""),
    ("velocity", r"linear_([xyz])", _OF_MOTION),
    ("gyro", r"angular_([xyz])", _OF_MOTION),
    ("voltage", r"(?:.*_)?(?:voltage|volt|volts|vbat|battery|batt)", ""),
    ("armed", r"(?:.*_)?armed", ""),
)  # fmt: skip
"""Signal, the whole field, and what the topic must hold. A group is the axis, or the number of the thruster."""

_AXES: dict[str, dict[str, int]] = {
    "velocity": {
        "u": 0, "v": 1, "w": 2, "surge": 0, "sway": 1, "heave": 2, "ahead": 0, "forward": 0, "fwd": 0, "starboard": 1,
        "stbd": 1, "right": 1, "left": 1, "port": 1,
    },
    EARTH_VELOCITY: {"n": 0, "north": 0, "e": 1, "east": 1, "d": 2, "down": 2, "u": 2, "up": 2},
    "gyro": {
        "row": 0, "p": 0, "q": 1, "r": 2, "roll": 0, "pitch": 1, "yaw": 2, "turn": 2, "heading": 2, "3": 0, "4": 1,
        "5": 2,
    },
    "specific_force": {},
    "euler": {"roll": 0, "pitch": 1, "yaw": 2, "heading": 2, "hdg": 2, "phi": 0, "theta": 1, "psi": 2, "3": 0,
              "4": 1, "5": 2},
    "quaternion": {"w": 0, "x": 1, "y": 2, "z": 3, **{str(k): k for k in range(5)}},
    "tau_cmd": {
        **{f"force_{axis}": k for k, axis in enumerate("xyz")},
        **{f"torque_{axis}": 3 + k for k, axis in enumerate("xyz")},
        **{axis: k for k, axis in enumerate("xyzkmn")}, **{str(k): k for k in range(6)},
        "surge": 0, "sway": 1, "heave": 2, "roll": 3, "pitch": 4, "yaw": 5,
    },
}  # fmt: skip
_IN_MILLIRADIANS = re.compile(r"(?:^|_)(?:raw|scaled)_imu\d?_[xyz]gyro$")
"""Rates of turn of MAVLink's RAW_IMU and SCALED_IMU, in mrad/s."""
_UP = ("u", "up")
_LEFT = ("left", "port")
_SIDES = {"left": 1, "port": 1, "right": 2, "starboard": 2, "stbd": 2}
_XYZ = {"x": 0, "y": 1, "z": 2, "0": 0, "1": 1, "2": 2}

_BRACKETED = re.compile(r"(.*?)\s*[\[(]\s*([^\d\])][^\])]*)[\])]\s*")
_TIMES = re.compile(
    r"(?:(?:field_)?header_)?stamp|t|(?:.*_)?time(?:_?stamp)?(?:_boot|_since_boot|_sample|_abs(?:olute)?|_rel(?:ative)?)?|timestamp_sample|received|clock|elapsed|ts|"
    r"time_of_validity"
)


@dataclass(frozen=True)
class Named:
    """What a name says.

    place: axis, or number of the thruster. family: the name without the place, which the columns of a set share.
    unit: of a column map; None if the name has none. rank: of the rule; 0 is the most telling. frame: of a velocity
    along an axis of the earth (0 north, 1 east, 2 down or up), NED, or ENU if it points up; FLU of one to the left;
    else empty.
    """

    signal: str
    place: int
    family: str
    unit: str | None
    rank: int
    frame: str = ""


def snake(name: str) -> str:
    """`linearVelocity.X[0]` as `linear_velocity_x_0`."""
    parted = re.sub(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])", "_", name)
    return re.sub(r"[^a-z0-9]+", "_", parted.lower()).strip("_")


def named(topic: str, field: str) -> Named | None:
    """What a column of a topic (`""` for a single table) holds by its name; None for a name that says nothing."""
    room = snake(topic)
    for plain, unit_word in _readings(field):
        for rank, (signal, rule, about) in enumerate(_RULES):
            unit = UNITS[signal].get(unit_word)
            if (unit_word and unit is None) or (about and not re.search(about, room)):
                continue
            if signal == "gyro" and _IN_MILLIRADIANS.search(f"{room}_{plain}"):
                unit = "mrad/s"
            match = re.fullmatch(rule, plain)
            is_measured = signal not in _COMMANDS
            if match is None or (is_measured and (_NO_MEASUREMENT.search(plain) or _WANTED.search(room))):
                continue
            span = next((k for k in range(1, len(match.groups()) + 1) if match[k] is not None), None)
            if span is None:
                return Named(signal, 0, plain, unit, rank)
            start, end = match.span(span)
            word = match[span]
            if signal in ("pwm", "rpm"):
                place = _SIDES.get(word) or int(word)
            else:
                place = _AXES[signal].get(word, _XYZ.get(word, -1))
            family = f"{rank}:{plain[:start]}*{plain[end:]}"
            if signal == EARTH_VELOCITY:
                if "_enu_" in plain:
                    return Named("velocity", (1, 0, 2)[place], family, unit, rank, "ENU")
                return Named("velocity", place, family, unit, rank, "ENU" if word in _UP else "NED")
            return Named(signal, place, family, unit, rank, "FLU" if is_measured and word in _LEFT else "")
    return None


def time_unit(field: str) -> tuple[bool, str | None]:
    """Whether a name is one of a time, and the unit that it names, s, ms, us or ns."""
    for plain, unit_word in _readings(field):
        unit = UNITS["time"].get(unit_word)
        if (unit or not unit_word) and _TIMES.fullmatch(plain):
            return True, unit
    return False, None


def ends_in_time_unit(field: str) -> str | None:
    """The unit of time that a name ends in, whatever it begins with: `MonoS`, `t_boot_ms`; None for any other name."""
    words = snake(field).split("_")
    return UNITS["time"].get(words[-1]) if len(words) > 1 else None


_LONG = frozenset(("min", "mins", "minutes", "h", "hr", "hrs", "hours", "d", "day", "days"))


def long_time_unit(field: str) -> str:
    """The word of a unit of time that no map knows, minutes, hours or days, in a name of a time; "" without."""
    *words, last = snake(field).split("_")
    return last if last in _LONG and time_unit("_".join(words))[0] else ""


_PLACE = re.compile(r"((?:.*_)?(?:position|pos|p)_?|)([xyz012])")


def position_in(fields: Iterable[str]) -> tuple[str, str, str | None] | None:
    """The fields of one stream that are its position x, y and, if there is one, z, in the earth's axes."""
    places: dict[str, dict[int, str]] = {}
    for field in fields:
        if match := _PLACE.fullmatch(snake(field)):
            places.setdefault(match[1], {})[_XYZ[match[2]]] = field
    return next(((of[0], of[1], of.get(2)) for of in places.values() if of.keys() >= {0, 1}), None)


def is_by_side(name: str) -> bool:
    """Whether a thruster's name says on which side it is, and no number."""
    words = snake(name).split("_")
    return any(word in _SIDES for word in words) and not any(word.isdigit() for word in words)


_VALID = re.compile(r"(?:.*_)?(?:velocity|vel|dvl|bottom|bottom_track)_(?:is_)?(?:valid|lock(?:ed)?)")


def tells_valid_velocity(topic: str, field: str) -> bool:
    """Whether a column says, by 1 or 0, that the velocity of its row is one; of a table plain `valid` may be about
    anything."""
    plain = snake(field)
    return _VALID.fullmatch(plain) is not None or (bool(topic) and plain in ("valid", "is_valid"))


def is_position_z(name: str) -> bool:
    """Whether a column that is taken for the depth is a position, which may count from anywhere."""
    return f"_{snake(name)}".endswith("_z")


def with_unit(field: str, unit: str) -> str:
    """A name with the unit in which its cells are; as it is if it ends in that. Raises ValueError if it is no unit, or
    if the name says another."""
    word = snake(_plain(unit))
    bracketed = _BRACKETED.fullmatch(field)
    said = snake(_plain(bracketed[2])) if bracketed else ""
    is_unit = unit == "%" or any(word in units for units in UNITS.values())
    if not is_unit or said not in ("", word):
        raise ValueError
    return field if said or snake(field).endswith(f"_{word}") else f"{field} [{unit}]"


def _plain(unit: str) -> str:
    """A unit in letters: `°/s` as `deg/s`, `µs` as `us`, `m/s²` as `m/s2`."""
    for sign, letters in _SIGNS.items():
        unit = unit.replace(sign, letters)
    return unit


def _readings(field: str) -> list[tuple[str, str]]:
    """Ways to read a name as one without its unit, and the unit's word; last the name as it is, without."""
    bracketed = _BRACKETED.fullmatch(field)
    if bracketed:
        return [(snake(bracketed[1]), snake(_plain(bracketed[2])))]
    words = snake(field).split("_")
    ways = []
    for length in (3, 2, 1):
        if len(words) > length:
            ways.append(("_".join(words[:-length]), "_".join(words[-length:])))
        if len(words) > length + 1:  # as in gyro_rad[0]
            ways.append(("_".join([*words[: -length - 1], words[-1]]), "_".join(words[-length - 1 : -1])))
    known = {word for units in UNITS.values() for word in units}
    return [*((plain, word) for plain, word in ways if word in known), ("_".join(words), "")]
