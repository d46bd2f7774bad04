"""Reads a dive from ArduPilot's DataFlash log (`.BIN`), by means of the format messages in the log itself.

A record is the bytes A3 95, a type, and a body laid out as in the FMT record of that type. The format letters mark
types scaled by 0.01 and degrees scaled by 1e-7 (ArduPilot, libraries/AP_Logger/LogStructure.h).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.arrays import Array
from bridge.errors import LogError
from bridge.firmware.ardusub import ARDUSUB
from bridge.wire.tlog import load_bytes
from identify.checks.readings.impossible import WILD_S, tame
from identify.dive import Signal
from identify.ingest import rotation
from identify.ingest.commands import driven_outputs, holding_of_a_loop, samples_of_a_loop
from identify.ingest.mavlink import held_pressure, step_velocity
from identify.ingest.mavlink.low_pass import before_low_pass

MAGIC = b"\xa3\x95"
FMT, FMT_BYTES = 0x80, 89
HEADER_BYTES = 3
DEGREE = np.pi / 180
FIX_2D = 2
DOWNWARD, IN_RANGE = 25, 4
BAROMETERS, RECEIVERS, SOUNDERS = range(3), range(2), range(10)
FEWEST_PRESSURES = 20
PA_PER_M = 9810.0
ASKED_WITHIN_S = 60.0
"""Our companion has asked at least so often in any log: it asks twice as often, and a link may lose half of that."""
RISE_OFF = 0.5
"""How far the rise of a pressure with the autopilot's depth may be off that of fresh water: that depth is smoothed, and
its steps were up to 43 % too large where thrust came late."""
LEAST_ALIKE = 0.7
"""Least correlation of both: that of the air in a hull is far lower."""

_LETTERS: dict[str, tuple[str, float]] = {
    "b": ("i1", 1), "B": ("u1", 1), "h": ("<i2", 1), "H": ("<u2", 1), "i": ("<i4", 1), "I": ("<u4", 1),
    "q": ("<i8", 1), "Q": ("<u8", 1), "f": ("<f4", 1), "d": ("<f8", 1), "g": ("<f2", 1), "M": ("u1", 1),
    "c": ("<i2", 0.01), "C": ("<u2", 0.01), "e": ("<i4", 0.01), "E": ("<u4", 0.01), "L": ("<i4", 1e-7),
    "n": ("S4", 1), "N": ("S16", 1), "Z": ("S64", 1), "a": ("V64", 1),
}  # fmt: skip
_NO_NUMBERS = "nNZa"  # text, and arrays


@dataclass(frozen=True)
class _Format:
    """Layout of the body of a record type; `scales` of the numeric columns."""

    name: str
    layout: np.dtype[Any]
    scales: dict[str, float]


@dataclass(frozen=True)
class _Table:
    """All records of a name: `time_s` (n,), strictly increasing boot time, and their bodies."""

    time_s: Array
    body: NDArray[Any]
    scales: dict[str, float]

    def columns(self, *names: str) -> Array:
        """Scaled columns, (n, k)."""
        return np.column_stack([self.body[name].astype(np.float64) * self.scales[name] for name in names])


def read_dataflash(path: Path) -> tuple[dict[str, Any], dict[str, float]]:
    """Fields of a Dive (all but its name, source and hash) in a `.BIN`, and the autopilot's parameters as the log first
    states them. Raises LogError.
    """
    log, skipped = _opened(path)
    parameters = _parameters(log)
    signals = before_low_pass(_signals(log), ARDUSUB.corners, parameters)
    if not signals:
        raise LogError("holds no attitude, motion or thruster records; log more with LOG_BITMASK", path)
    counts = {log.formats[kind].name: len(positions) for kind, positions in log.starts.items()}
    notes = (f"{skipped} of {len(log.data)} bytes are damaged and were skipped.",) if skipped else ()
    steps = _steps(log)
    fields = {
        **signals,
        "velocity_is_filtered": "velocity" in signals and steps is None,
        "velocity_at_origin": steps is not None and _are_of_our_companion(log, steps),
        "commands_hold": holding_of_a_loop(signals.get("pwm"), parameters.get(ARDUSUB.loop, math.nan)),
        "motors": ARDUSUB.motors_of(parameters.get(ARDUSUB.frame, math.nan)),
        "counts": counts,
        "notes": notes,
    }
    return fields, parameters


def dataflash_parameters(path: Path) -> dict[str, float]:
    """The autopilot's parameters as a `.BIN` last states them, by name. Raises LogError."""
    return _parameters(_opened(path)[0], last=True)


def _opened(path: Path) -> tuple["_Log", int]:
    """A log's records, and the number of damaged bytes. Raises LogError if it has no record."""
    data, _ = load_bytes(path)
    if not data:
        raise LogError("is empty; nothing was recorded in it", path)
    formats, starts, skipped = _index(data)
    if not starts:
        raise LogError("holds no DataFlash records; give a .BIN from an ArduPilot vehicle", path)
    return _Log(np.frombuffer(data, np.uint8), formats, starts), skipped


def _index(data: bytes) -> tuple[dict[int, _Format], dict[int, list[int]], int]:
    """Formats, starts of the bodies by type, and the number of bytes that belong to no record."""
    formats: dict[int, _Format] = {}
    lengths = {FMT: FMT_BYTES}
    starts: dict[int, list[int]] = {}
    position, end, skipped = 0, len(data), 0
    while position + HEADER_BYTES <= end:
        kind = data[position + 2]
        length = lengths.get(kind, 0)
        is_record = data.startswith(MAGIC, position) and 0 < length <= end - position
        following = position + length
        # The magic of the next record distinguishes a record from a chance match in damaged bytes.
        if not is_record or (following + 2 <= end and not data.startswith(MAGIC, following)):
            next_magic = data.find(MAGIC, position + 1)
            next_magic = end if next_magic < 0 else next_magic
            skipped += next_magic - position
            position = next_magic
            continue
        if kind == FMT:
            _learn(data[position + HEADER_BYTES : following], formats, lengths)
        elif kind in formats:
            starts.setdefault(kind, []).append(position + HEADER_BYTES)
        position = following
    return formats, starts, skipped


def _learn(body: bytes, formats: dict[int, _Format], lengths: dict[int, int]) -> None:
    kind, length = body[0], body[1]
    name, letters, columns = (
        part.split(b"\0")[0].decode("ascii", "replace") for part in (body[2:6], body[6:22], body[22:86])
    )
    if lengths.setdefault(kind, length) != length:
        return
    names = columns.split(",") if columns else []
    if len(names) != len(letters) or any(letter not in _LETTERS for letter in letters):
        return
    if len(set(names)) < len(names) or "" in names:
        return
    layout = np.dtype([(column, _LETTERS[letter][0]) for column, letter in zip(names, letters, strict=True)])
    if layout.itemsize == length - HEADER_BYTES:
        scales = {
            column: _LETTERS[letter][1]
            for column, letter in zip(names, letters, strict=True)
            if letter not in _NO_NUMBERS
        }
        formats[kind] = _Format(name, layout, scales)


@dataclass(frozen=True)
class _Log:
    data: NDArray[np.uint8]
    formats: dict[int, _Format]
    starts: dict[int, list[int]]

    def bodies(self, name: str) -> tuple[NDArray[Any], dict[str, float]] | None:
        """All bodies of the records called `name`, unscaled, and their scales; None if the log has no such records."""
        kind = next((k for k in self.starts if self.formats[k].name == name), None)
        if kind is None:
            return None
        layout, scales = self.formats[kind].layout, self.formats[kind].scales
        index = np.array(self.starts[kind])[:, None] + np.arange(layout.itemsize)
        return np.ascontiguousarray(self.data[index]).view(layout)[:, 0], scales

    def table(
        self, name: str, kept: Callable[[Array], NDArray[np.bool_]] = tame, /, **equal: int
    ) -> _Table | None:
        """The records called `name` in which the given fields, if present, have the given values; kept: which of their
        times (n,) in recording order are believed."""
        bodies = self.bodies(name)
        if bodies is None:
            return None
        body, scales = bodies
        for field, value in equal.items():
            if field in scales:
                body = body[body[field] == value]
        if "TimeUS" not in scales:
            return None
        stated_s = body["TimeUS"].astype(np.float64) * 1e-6
        among = kept(stated_s)
        body, stated_s = body[among], stated_s[among]
        if len(body) == 0:
            return None
        time_s, first = np.unique(stated_s, return_index=True)
        return _Table(time_s, body[first], scales)

    def signal(self, name: str, columns: tuple[str, ...], scale: float = 1.0, **equal: int) -> Signal | None:
        table = self.table(name, **equal)
        if table is None or any(column not in table.scales for column in columns):
            return None
        return Signal(table.time_s, table.columns(*columns) * scale)


def _parameters(log: _Log, last: bool = False) -> dict[str, float]:
    """First or last value of each parameter: a later change is written again."""
    bodies = log.bodies("PARM")
    if bodies is None:
        return {}
    body, scales = bodies
    if (
        not {"Name", "Value"} <= set(body.dtype.names or ())
        or "Value" not in scales
        or body["Name"].dtype.kind != "S"
    ):
        return {}
    values: dict[str, float] = {}
    rows = zip(body["Name"].tolist(), body["Value"].tolist(), strict=True)
    for name, value in rows if last else reversed(list(rows)):
        values[name.decode("ascii", "replace")] = float(value)
    return values


def _signals(log: _Log) -> dict[str, Signal]:
    attitude = _attitude(log)
    gyro = log.signal("IMU", ("GyrX", "GyrY", "GyrZ"), I=0)
    specific_force = log.signal("IMU", ("AccX", "AccY", "AccZ"), I=0)
    steps = _steps(log)
    dvl = steps and step_velocity.dated(steps, gyro, specific_force, attitude)
    depth = log.signal("CTUN", ("Alt",), -1.0)
    pressure = _pressure(log, depth)
    candidates = {
        "attitude": attitude,
        "velocity": dvl or _velocity(log, attitude),
        "gyro": gyro,
        "specific_force": specific_force,
        "pressure": pressure and held_pressure.dated(pressure, dvl, attitude),
        "depth": depth if pressure is None else None,
        "altitude": _altitude(log),
        "pwm": _pwm(log),
        "voltage": log.signal("BAT", ("Volt",), Instance=0, Inst=0) or log.signal("CURR", ("Volt",)),
        "armed": _armed(log),
        "gnss": _gnss(log),
    }
    return {name: signal for name, signal in candidates.items() if signal is not None}


def _attitude(log: _Log) -> Signal | None:
    quaternion = log.signal("XKQ", ("Q1", "Q2", "Q3", "Q4"), C=0)
    if quaternion is not None:
        return quaternion
    angles = log.signal("ATT", ("Roll", "Pitch", "Yaw"), DEGREE)
    return angles and Signal(angles.time_s, rotation.quaternions_from_euler(*angles.value.T))


def _velocity(log: _Log, attitude: Signal | None) -> Signal | None:
    """Velocity of the first core of the newest estimator, turned into body axes."""
    ned = log.signal("XKF1", ("VN", "VE", "VD"), C=0) or log.signal("NKF1", ("VN", "VE", "VD"), C=0)
    if ned is None or attitude is None or len(attitude) < 2:
        return None
    return rotation.in_body(ned, attitude)


def _steps(log: _Log) -> Signal | None:
    """Duration and way (n, 4) of each step that a DVL's driver sent; None where none of them lasts."""
    steps = log.signal("VISO", ("dt", "PosDX", "PosDY", "PosDZ"))
    return steps if steps is not None and (steps.value[:, 0] > 0).any() else None


def _are_of_our_companion(log: _Log, steps: Signal) -> bool:
    """Whether these steps are of our companion, which asks the autopilot for its version twice a minute (MAVC); other
    programs with its component ask once."""
    bodies = log.bodies("MAVC")
    if bodies is None or not {"SC", "Cmd", "P1"} <= bodies[1].keys():
        return False
    body = bodies[0]
    asks = (body["Cmd"] == dialect.MAV_CMD_REQUEST_MESSAGE) & (
        body["P1"] == dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION
    )
    count = np.count_nonzero(asks & (body["SC"] == dialect.MAV_COMP_ID_ONBOARD_COMPUTER))
    return bool(count >= max((steps.time_s[-1] - steps.time_s[0]) / ASKED_WITHIN_S, 1.0))


def _pressure(log: _Log, depth: Signal | None) -> Signal | None:
    """Absolute pressure of the barometer in the water: one that rises with the autopilot's depth as water does.

    The autopilot's own depth is smoothed, takes all water for fresh, and was 4.5 % off in simulated sea water.
    """
    for instance in BAROMETERS:
        pressure = log.signal("BARO", ("Press",), I=instance)
        if pressure is not None and depth is not None and _is_water(pressure, depth):
            return pressure
    return None


def _is_water(pressure: Signal, depth: Signal) -> bool:
    deep, read = depth.at(pressure.time_s)[:, 0], pressure.value[:, 0]
    known = np.isfinite(deep) & np.isfinite(read)
    if np.count_nonzero(known) < FEWEST_PRESSURES:
        return False
    (of_depth, both), (_, of_pressure) = np.cov(deep[known], read[known])
    like = both > LEAST_ALIKE * np.sqrt(of_depth * of_pressure)
    return bool(like and abs(both / of_depth / PA_PER_M - 1) < RISE_OFF)


def _altitude(log: _Log) -> Signal | None:
    """Distance to the bottom by the first sounder that looks down; NaN where it had no echo in its range: it then stays
    the last one, or is 0."""
    for number in SOUNDERS:
        of = {"Orient": DOWNWARD, "Instance": number, "Inst": number}
        read = log.signal("RFND", ("Dist", "Stat"), **of)
        if read is not None:
            return Signal(read.time_s, np.where(read.value[:, 1:] == IN_RANGE, read.value[:, :1], np.nan))
        if (distance := log.signal("RFND", ("Dist",), **of)) is not None:
            return distance
    return None


def _pwm(log: _Log) -> Signal | None:
    table = log.table("RCOU")
    if table is None:
        return None
    outputs = [f"C{i}" for i in range(1, 15) if f"C{i}" in table.scales]
    if not outputs:
        return None
    return samples_of_a_loop(driven_outputs(table.time_s, table.columns(*outputs)), ARDUSUB.loop_s)


def _armed(log: _Log) -> Signal | None:
    """Armed state from ARM records; before the first of them the vehicle was in the opposite state.

    They are minutes apart, so that none agrees with those around it: those within the IMU's times are believed.
    """
    imu = log.table("IMU")
    if imu is None:
        return None
    first_s, last_s = float(imu.time_s[0]), float(imu.time_s[-1])
    changes = log.table("ARM", lambda time_s: (time_s > first_s - WILD_S) & (time_s < last_s + WILD_S))
    if changes is None or "ArmState" not in changes.scales:
        return None
    state = changes.columns("ArmState")
    before_s = min(first_s, float(changes.time_s[0]) - 1.0)
    return Signal(np.append(before_s, changes.time_s), np.vstack((1.0 - state[:1], state)))


def _gnss(log: _Log) -> Signal | None:
    """The fixes of the first receiver that has any."""
    for number in RECEIVERS:
        fixes = log.signal("GPS", ("Lat", "Lng", "Spd", "GCrs", "Status"), I=number)
        if fixes is not None and (good := fixes.value[:, 4] >= FIX_2D).any():
            return Signal(fixes.time_s[good], fixes.value[good, :4] * np.array([1, 1, 1, DEGREE]))
    return None
