"""What the name of a column says: the signal, the axis or the thruster, and the unit.

Names as in ROS, MAVROS, PX4 and ArduPilot logs, and as people write them in tables. ROS writes quaternions x y z w; a
Dive holds w x y z.
"""

import re
from dataclasses import dataclass

Scaled = tuple[str, float]
"""A unit of a column map, and the factor from the column's own unit to it."""

_TIME = {"s": "s", "sec": "s", "secs": "s", "seconds": "s", "ms": "ms", "msec": "ms", "millis": "ms", "us": "us",
         "usec": "us", "micros": "us", "ns": "ns", "nsec": "ns", "nanos": "ns"}  # fmt: skip
_SPEED: dict[str, Scaled] = {
    "m_s": ("m/s", 1.0), "mps": ("m/s", 1.0), "ms": ("m/s", 1.0), "cm_s": ("cm/s", 1.0), "cms": ("cm/s", 1.0),
    "mm_s": ("mm/s", 1.0), "kn": ("knot", 1.0), "kt": ("knot", 1.0), "kts": ("knot", 1.0), "knots": ("knot", 1.0),
    "ft_s": ("m/s", 0.3048),
}  # fmt: skip
_ANGLE: dict[str, Scaled] = {
    "deg": ("deg", 1.0), "degs": ("deg", 1.0), "degree": ("deg", 1.0), "degrees": ("deg", 1.0),
    "rad": ("rad", 1.0), "rads": ("rad", 1.0), "radians": ("rad", 1.0),
}  # fmt: skip
_TURN: dict[str, Scaled] = {
    "deg_s": ("deg/s", 1.0), "dps": ("deg/s", 1.0), "deg": ("deg/s", 1.0), "degs": ("deg/s", 1.0),
    "rad_s": ("rad/s", 1.0), "rads": ("rad/s", 1.0), "rad": ("rad/s", 1.0), "rps": ("rad/s", 1.0),
    "mrad_s": ("mrad/s", 1.0),
}  # fmt: skip
_LENGTH: dict[str, Scaled] = {
    "m": ("m", 1.0), "meter": ("m", 1.0), "meters": ("m", 1.0), "metres": ("m", 1.0), "cm": ("cm", 1.0),
    "mm": ("mm", 1.0), "ft": ("m", 0.3048), "feet": ("m", 0.3048),
}  # fmt: skip
UNITS: dict[str, dict[str, Scaled]] = {
    "time": {word: (unit, 1.0) for word, unit in _TIME.items()},
    "velocity": _SPEED, "gyro": _TURN, "fog": _TURN, "euler": _ANGLE, "quaternion": {},
    "specific_force": {
        "m_s2": ("m/s2", 1.0), "ms2": ("m/s2", 1.0), "mps2": ("m/s2", 1.0), "m_s_2": ("m/s2", 1.0),
        "m_ss": ("m/s2", 1.0), "g": ("g", 1.0), "mg": ("mg", 1.0),
    },
    "pressure": {
        "pa": ("Pa", 1.0), "kpa": ("Pa", 1000.0), "hpa": ("hPa", 1.0), "mbar": ("mbar", 1.0), "bar": ("bar", 1.0),
        "dbar": ("bar", 0.1), "psi": ("psi", 1.0),
    },
    "depth": _LENGTH, "altitude": _LENGTH,
    "pwm": {
        "us": ("us", 1.0), "usec": ("us", 1.0), "n": ("N", 1.0), "kgf": ("kgf", 1.0), "lbf": ("lbf", 1.0),
    },
    "rpm": {"rpm": ("rpm", 1.0), "rev_s": ("rev/s", 1.0), "rps": ("rev/s", 1.0), "rad_s": ("rad/s", 1.0)},
    "voltage": {"v": ("V", 1.0), "volt": ("V", 1.0), "volts": ("V", 1.0), "mv": ("mV", 1.0)},
    "tau_cmd": {"n": ("N", 1.0), "nm": ("N", 1.0), "n_m": ("N", 1.0), "kgf": ("kgf", 1.0), "lbf": ("lbf", 1.0)},
    "armed": {},
}  # fmt: skip
"""By signal, the unit that a word at the end of a name means."""

_NO_MEASUREMENT = re.compile(
    r"desired|setpoint|set_point|target|reference|(^|_)(ref|des|goal|err|error|cmd|command|covariance|cov|std|stddev|"
    r"sigma|var|variance|bias|offset|min|max|temperature|temp|diff|differential|quality|valid|count|id|seq|status|flags?)(_|$)"
)
_COMMANDS = ("pwm", "rpm", "tau_cmd")

_RULES: tuple[tuple[str, str, str], ...] = (
    ("velocity", r"(?:.*_)?twist_linear_([xyz])", ""),
    ("gyro", r"(?:.*_)?(?:angular_velocity|angular_rate|ang_vel|gyroscope|gyro|gyr|rates?|omega)_?([xyz012])", ""),
    ("velocity", r"(?:.*_)?(?:linear_velocity|body_velocity|velocity_body|velocity|vel)_([xyz012])", ""),
    ("velocity", r"([uvw])(?:_dvl|_body|_b)?|dvl_([uvwxyz])|dvl_v([xyz])", ""),
    ("velocity", r"(surge|sway|heave)(?:_(?:velocity|speed|vel))?", ""),
    ("velocity", r"v_?([xyz])(?:_body|_b)?", ""),
    ("gyro", r"(?:.*_)?twist_angular_([xyz])", ""),
    ("gyro", r"xyz_([012])|([xyz])", r"angular_velocity|gyro"),
    ("gyro", r"([pqr])(?:_(?:imu|body|b))?", ""),
    ("gyro", r"(?:.*_)?(roll|pitch|yaw)_?(?:rate|speed|vel)", ""),
    ("gyro", r"w_?([xyz])|w_(row|roll|pitch|yaw)", ""),
    ("fog", r"fog|fog_(?:rate|z|r|yaw_rate)", ""),
    ("specific_force",
     r"(?:.*_)?(?:linear_acceleration|accelerometer|acceleration|accel|acc|specific_force)_?([xyz012])", ""),
    ("specific_force", r"xyz_([012])|([xyz])", r"(?:vehicle_)?acceleration|accel"),
    ("specific_force", r"a_?([xyz])(?:_imu|_body)?", ""),
    ("quaternion", r"(?:.*_)?(?:orientation|quaternion|quat|attitude|q)_([wxyz0123])|q([wxyz0123])", ""),
    ("euler", r"(?:.*_)?(roll|pitch|yaw|heading|hdg)(?:_angle)?", ""),
    ("euler", r"(phi|theta|psi)", ""),
    ("pressure", r"(?:.*_)?(?:fluid_)?(?:pressure|press|baro)(?:_abs)?|abs_pressure", ""),
    ("altitude", r"(?:.*_)?(?:altitude|range|distance|height_above_bottom)", ""),
    ("altitude", r"data", r"altitude|altimeter|range"),
    ("depth", r"(?:.*_)?depth", ""),
    ("depth", r"data", r"depth|rel_alt"),
    ("depth", r"(?:.*_)?(?:position|pos)_z|z", ""),
    ("rpm", r"(?:.*_)?(?:rpm|rps)_?(\d+)", ""),
    ("rpm", r"(?:.*_)?(?:esc|motor|thruster|prop|propeller)_?(\d+)(?:_.*)?_(?:rpm|speed|rps)", ""),
    ("pwm", r"(?:.*_)?(?:pwm|servo|output|out|channels|control|effort|esc|motor|thruster|actuator|act)_?(\d+)"
            r"(?:_(?:raw|pwm|command|cmd|output))?", ""),
    ("pwm", r"(?:t|m|c|ch|u)(\d+)", ""),
    ("pwm", r"data_(\d+)", r"thruster|pwm|motor|servo|actuator|command|output"),
    ("tau_cmd", r"(?:.*_)?(force_[xyz]|torque_[xyz])", ""),
    ("tau_cmd", r"tau_?(?:cmd_?)?([xyzkmn0-5])", ""),
    ("voltage", r"(?:.*_)?(?:voltage|volt|volts|vbat|battery|batt)", ""),
    ("armed", r"(?:.*_)?armed", ""),
)  # fmt: skip
"""Signal, the whole field, and what the topic must hold. A group is the axis, or the number of the thruster."""

_AXES: dict[str, dict[str, int]] = {
    "velocity": {"u": 0, "v": 1, "w": 2, "surge": 0, "sway": 1, "heave": 2},
    "gyro": {"row": 0, "p": 0, "q": 1, "r": 2, "roll": 0, "pitch": 1, "yaw": 2},
    "specific_force": {},
    "euler": {"roll": 0, "pitch": 1, "yaw": 2, "heading": 2, "hdg": 2, "phi": 0, "theta": 1, "psi": 2},
    "quaternion": {"w": 0, "x": 1, "y": 2, "z": 3, "0": 0, "1": 1, "2": 2, "3": 3},
    "tau_cmd": {
        **{f"force_{axis}": k for k, axis in enumerate("xyz")},
        **{f"torque_{axis}": 3 + k for k, axis in enumerate("xyz")},
        **{axis: k for k, axis in enumerate("xyzkmn")}, **{str(k): k for k in range(6)},
    },
}  # fmt: skip
_XYZ = {"x": 0, "y": 1, "z": 2, "0": 0, "1": 1, "2": 2}

_TIMES = re.compile(
    r"(?:header_)?stamp|t|(?:.*_)?time(?:_?stamp)?(?:_boot|_since_boot|_sample)?|timestamp_sample|received|clock|elapsed"
)


@dataclass(frozen=True)
class Named:
    """What a name says.

    place: axis, or number of the thruster. family: the name without the place, which the columns of a set share.
    unit: of a column map, with the factor to it; None if the name has none. rank: of the rule; 0 is the most telling.
    """

    signal: str
    place: int
    family: str
    unit: Scaled | None
    rank: int


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
            match = re.fullmatch(rule, plain)
            if match is None or (signal not in _COMMANDS and _NO_MEASUREMENT.search(plain)):
                continue
            span = next((k for k in range(1, len(match.groups()) + 1) if match[k] is not None), None)
            if span is None:
                return Named(signal, 0, plain, unit, rank)
            start, end = match.span(span)
            word = match[span]
            if signal in ("pwm", "rpm"):
                place = int(word)
            else:
                place = _AXES[signal].get(word, _XYZ.get(word, -1))
            return Named(signal, place, f"{rank}:{plain[:start]}*{plain[end:]}", unit, rank)
    return None


def time_unit(field: str) -> tuple[bool, str | None]:
    """Whether a name is one of a time, and the unit that it names, s, ms, us or ns."""
    for plain, unit_word in _readings(field):
        unit = UNITS["time"].get(unit_word)
        if (unit or not unit_word) and _TIMES.fullmatch(plain):
            return True, unit[0] if unit else None
    return False, None


def _readings(field: str) -> list[tuple[str, str]]:
    """Ways to read a name as one without its unit, and the unit's word; last the name as it is, without."""
    bracketed = re.fullmatch(r"(.*?)\s*[\[(]\s*([^\d\])][^\])]*)[\])]\s*", field)
    if bracketed:
        return [(snake(bracketed[1]), snake(bracketed[2].replace("²", "2").replace("^", "")))]
    words = snake(field).split("_")
    ways = []
    for length in (3, 2, 1):
        if len(words) > length:
            ways.append(("_".join(words[:-length]), "_".join(words[-length:])))
        if len(words) > length + 1:  # as in gyro_rad[0]
            ways.append(("_".join([*words[: -length - 1], words[-1]]), "_".join(words[-length - 1 : -1])))
    known = {word for units in UNITS.values() for word in units}
    return [*((plain, word) for plain, word in ways if word in known), ("_".join(words), "")]
