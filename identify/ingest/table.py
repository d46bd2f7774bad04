"""Reads a dive from a table (`.csv`) and a column map: YAML with the column and unit of each signal."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bridge import schema
from bridge.errors import ConfigError, LogError
from bridge.vehicle.config import CONFIGS, GRAVITY_M_S2
from identify.dive import Array, Signal
from identify.ingest import rotation
from identify.ingest.clock import iso_s, of_day_s, within_seconds
from identify.ingest.commands import spread
from identify.ingest.text_table import TextTable, no_number, read_text_table

Mask = NDArray[np.bool_]

NOTHING = "-"
UNKNOWN = (None, "?")
WHOLE = ("quaternion", "euler", "tau_cmd")
"""Signals of which no column can be unknown: an attitude is one turn, and an unknown force could be any. Nor can one of
an autopilot's velocity, which is turned to when it was true."""
DEGREE = np.pi / 180

UNITS: dict[str, float] = {
    "1": 1.0, "s": 1.0, "ms": 1e-3, "us": 1.0, "m": 1.0, "cm": 1e-2, "mm": 1e-3,
    "m/s": 1.0, "cm/s": 1e-2, "mm/s": 1e-3, "knot": 1852 / 3600,
    "rad": 1.0, "rad/s": 1.0, "deg": DEGREE,
    "deg/s": DEGREE, "mrad/s": 1e-3, "m/s2": 1.0, "g": GRAVITY_M_S2, "mg": GRAVITY_M_S2 * 1e-3,
    "Pa": 1.0, "hPa": 100.0, "mbar": 100.0, "bar": 1e5, "psi": 6894.757, "V": 1.0, "mV": 1e-3,
    "N": 1.0, "kgf": GRAVITY_M_S2, "lbf": 4.4482216, "rpm": 1.0, "rev/s": 60.0,
}  # fmt: skip
# Units that a signal may have; the Dive holds the first.
KINDS: dict[str, tuple[str, ...]] = {
    "velocity": ("m/s", "cm/s", "mm/s", "knot"),
    "gyro": ("rad/s", "deg/s", "mrad/s"), "fog": ("rad/s", "deg/s"),
    "specific_force": ("m/s2", "g", "mg"), "quaternion": ("1",), "euler": ("rad", "deg"),
    "pressure": ("Pa", "hPa", "mbar", "bar", "psi"),
    "depth": ("m", "cm", "mm"), "altitude": ("m", "cm", "mm"),
    "pwm": ("us", "1", "N", "kgf", "lbf"), "rpm": ("rpm", "rev/s", "rad/s"),
    "voltage": ("V", "mV"), "tau_cmd": ("N", "kgf", "lbf"), "armed": ("1",),
}  # fmt: skip
WIDTHS = {
    "velocity": 3, "gyro": 3, "fog": 1, "specific_force": 3, "quaternion": 4, "euler": 3, "pressure": 1,
    "depth": 1, "altitude": 1, "voltage": 1, "tau_cmd": 6, "armed": 1,
}  # fmt: skip
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
ISO, OF_DAY = "iso", "hhmmss"
SPARSE = 0.5
"""The rows of a table with this share of empty cells hold a part of a sample each."""
COMMANDS = {"us": "pwm", "1": "effort"}
"""The Dive's signal for thruster commands of a unit; forces are its `thrust_cmd`."""
RADIANS_PER_RPM = 2 * np.pi / 60


@dataclass(frozen=True)
class TimeColumn:
    """The time column and its unit; `iso` for dates and times as words, `2026-07-19T10:15:00.25Z`; `hhmmss` for
    the time of day as a number, 202459 for 20:24:59."""

    column: str
    unit: str = "s"

    def __post_init__(self) -> None:
        known = (*TIME_UNITS, ISO, OF_DAY)
        if self.unit not in known:
            raise ValueError(f"unit '{self.unit}' is no unit of time; give one of {', '.join(known)}")


@dataclass(frozen=True)
class Columns:
    """The columns of a signal, in the order of the Dive's; `-` stands for a column of zeros, null (or `?`) for one that
    is unknown.

    value = (cell + offset) * scale, converted from `unit` to SI; `offset` and `scale` are in the file's unit, one per
    column (default: all 0, all 1).
    """

    columns: tuple[str | None, ...]
    unit: str
    offset: tuple[float, ...] = ()
    scale: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if not any(self.named):
            raise ValueError("every column is unknown; name one, or leave the signal out")
        for name in ("offset", "scale"):
            if len(getattr(self, name)) not in (0, len(self.columns)):
                raise ValueError(
                    f"{name} needs one number for each of the {len(self.columns)} columns, or none"
                )

    @property
    def named(self) -> tuple[str | None, ...]:
        """The columns, None for one that is unknown."""
        return tuple(None if name in UNKNOWN else name for name in self.columns)


@dataclass(frozen=True)
class ColumnMap:
    """The column of each signal. Body axes FRD; `euler` is roll, pitch, yaw; `notes` are shown to the user.

    `pwm` in microseconds, as commands from -1 to 1 (unit 1), or as the force of each thruster. `commands_hold`: each
    thruster command, or wrench, holds until the next recorded command, however much later.
    """

    time: TimeColumn
    velocity: Columns | None = None
    gyro: Columns | None = None
    fog: Columns | None = None
    specific_force: Columns | None = None
    quaternion: Columns | None = None
    euler: Columns | None = None
    pressure: Columns | None = None
    depth: Columns | None = None
    altitude: Columns | None = None
    pwm: Columns | None = None
    rpm: Columns | None = None
    voltage: Columns | None = None
    tau_cmd: Columns | None = None
    armed: Columns | None = None
    velocity_is_filtered: bool = False
    commands_hold: bool = False
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name, columns in self.signals().items():
            if columns.unit not in KINDS[name]:
                raise ValueError(f"{name}: unit '{columns.unit}' is none of {', '.join(KINDS[name])}")
            width = WIDTHS.get(name, len(columns.columns))
            if len(columns.columns) != width:
                raise ValueError(f"{name}: needs {width} columns, {len(columns.columns)} are given")
            whole = name in WHOLE or (name == "velocity" and self.velocity_is_filtered)
            if whole and None in columns.named:
                raise ValueError(
                    f"{name}: can't be known in part; name every column, write '{NOTHING}' for one that is zero all "
                    "the dive, or leave the signal out"
                )

    @property
    def names(self) -> set[str]:
        """All columns that a signal is taken from."""
        return {name for source in self.signals().values() for name in source.named if name is not None}

    def signals(self) -> dict[str, Columns]:
        return {
            field.name: value
            for field in fields(self)
            if isinstance(value := getattr(self, field.name), Columns)
        }


def map_file(name: Path | str) -> Path:
    """The column map that `name` means: a file, or a bundled map (configs/columns). Raises ConfigError."""
    bundled = CONFIGS / "columns"
    for file in (Path(name), bundled / f"{name}.yaml"):
        if file.exists():
            return file
    known = ", ".join(sorted(file.stem for file in bundled.glob("*.yaml")))
    raise ConfigError(f"{name}: no such column map; give a YAML file, or one of {known}")


def column_map(name: Path | str) -> ColumnMap:
    """The column map in a file, or the bundled map of that name. Raises ConfigError."""
    file = map_file(name)
    return schema.build(ColumnMap, schema.load_yaml(file), str(file))


def read_table(path: Path, columns: ColumnMap) -> dict[str, Any]:
    """Fields of a Dive (all but its name, source and hash) in a table. Raises LogError.

    A row in which all cells of a signal are empty has no sample of it; a cell `nan` is an unknown value. Rows of the
    same time become one row as far as their cells do not contradict each other.
    """
    table = read_text_table(path)
    header, cells, empty = _cells(path, table, columns)
    used = np.array(sorted({header.index(name) for name in columns.names if name in header}), np.intp)
    time_s, notes = _time_s(path, table, columns.time), table.notes
    apart_s = within_seconds(time_s) if columns.time.unit in ("s", ISO, OF_DAY) else None
    if apart_s is not None and np.mean(empty[:, used] if len(used) else 0.0) < SPARSE:
        time_s = apart_s
        notes += ("Its clock tells whole seconds: the rows of each were spread evenly over it.",)
    rows, taken = _merged(time_s, cells, empty, used)
    if taken < len(time_s):
        notes += (f"{len(time_s) - taken} rows without a time of their own were left out.",)
    signals = {}
    for name, source in columns.signals().items():
        with_sample = rows[_told(header, empty[rows], source)]
        signals[name] = Signal(time_s[with_sample], _values(path, header, cells[with_sample], name, source))
    if columns.pwm is not None:
        signals[COMMANDS.get(columns.pwm.unit, "thrust_cmd")] = signals.pop("pwm")
    euler = signals.pop("euler", None)
    if euler is not None:
        signals["attitude"] = Signal(euler.time_s, rotation.quaternions_from_euler(*euler.value.T))
    quaternion = signals.pop("quaternion", None)
    if quaternion is not None:
        signals["attitude"] = quaternion
    if columns.commands_hold:
        end_s = max((float(signal.time_s[-1]) for signal in signals.values() if len(signal)), default=0.0)
        for name in {*COMMANDS.values(), "thrust_cmd", "tau_cmd"} & signals.keys():
            signals[name] = spread(signals[name], end_s)
    return {
        **signals,
        "velocity_is_filtered": columns.velocity_is_filtered,
        "notes": notes + columns.notes,
        "counts": {"rows": len(rows)},
    }


def _merged(time_s: Array, cells: Array, empty: Mask, used: NDArray[np.intp]) -> tuple[NDArray[np.intp], int]:
    """The first row of every time, sorted by time, and the number of rows that went into these.

    `cells` and `empty` (rows, columns) of the first rows are filled in place from later rows of the same time, in the
    columns `used`. A later row is used only if it adds a value and contradicts none.
    """
    known = np.flatnonzero(np.isfinite(time_s))
    known = known[np.argsort(time_s[known], kind="stable")]
    starts = np.flatnonzero(np.diff(time_s[known], prepend=-np.inf) > 0)
    first = np.repeat(starts, np.diff([*starts, len(known)]))
    place = np.arange(len(known)) - first
    taken = len(starts)
    for k in range(1, int(place.max(initial=0)) + 1):
        to, row = known[first[place == k]], known[place == k]
        (there, had), (here, says) = ((~empty[np.ix_(at, used)], cells[np.ix_(at, used)]) for at in (to, row))
        clash = here & there & (had != says) & ~(np.isnan(had) & np.isnan(says))
        new = here & ~there & ~clash.any(axis=1, keepdims=True)
        which, column = np.nonzero(new)
        cells[to[which], used[column]] = says[which, column]
        empty[to[which], used[column]] = False
        taken += int(new.any(axis=1).sum())
    return known[starts], taken


def _cells(path: Path, table: TextTable, columns: ColumnMap) -> tuple[list[str], Array, Mask]:
    """Names of the columns of numbers, their numbers (rows, columns), mask of empty cells. Raises LogError."""
    for name in columns.names & table.stream.text.keys():
        words = table.stream.text[name]
        row, word = next((i, word) for i, word in enumerate(words) if not _is_number(word))
        raise LogError(f"{path}: row {table.lines[row]} {no_number(word)}; mend it")
    numbers, rows = table.stream.columns, len(table.lines)
    full = np.zeros(rows, np.bool_)
    return (
        list(numbers),
        np.column_stack([np.zeros((rows, 0)), *numbers.values()]),
        np.column_stack([np.zeros((rows, 0), np.bool_), *(table.empty.get(name, full) for name in numbers)]),
    )


def _time_s(path: Path, table: TextTable, time: TimeColumn) -> Array:
    stream = table.stream
    if time.column not in (*stream.columns, *stream.text):
        known = ", ".join((*stream.columns, *stream.text))
        raise LogError(f"{path}: has no column '{time.column}'; it has {known}: mend the column map")
    if time.unit != ISO:
        if time.column in stream.text:
            raise LogError(
                f"{path}: its times in '{time.column}' are words, as '{stream.text[time.column][0]}'; give the time "
                f"the unit {ISO} in the column map if they are dates"
            )
        if time.unit == OF_DAY:
            return _of_day_s(path, stream.columns[time.column], time.column)
        return stream.columns[time.column] * TIME_UNITS[time.unit]
    if time.column not in stream.text:
        raise LogError(f"{path}: its times in '{time.column}' are numbers, not dates; mend their unit, {ISO}")
    try:
        return iso_s(stream.text[time.column])
    except ValueError as error:
        raise LogError(
            f"{path}: '{error}' in '{time.column}' is no time that ISO 8601 knows, as 2026-07-19T10:15:00.25Z; mend it"
        ) from None


def _of_day_s(path: Path, stamps: Array, column: str) -> Array:
    try:
        return of_day_s(stamps)
    except ValueError as error:
        raise LogError(
            f"{path}: {error} in '{column}' is no time of day as a number, 202459 for 20:24:59; mend the time's unit "
            "in the column map"
        ) from None


def _told(header: list[str], empty: Mask, source: Columns) -> Mask:
    """Rows (n,) in which a signal has a non-empty cell."""
    places = [header.index(name) for name in source.named if name in header]
    return np.asarray(~empty[:, places].all(axis=1) if places else np.ones(len(empty), np.bool_))


def _is_number(cell: str) -> bool:
    try:
        float(cell or "nan")
    except ValueError:
        return False
    return True


def _column(path: Path, header: list[str], cells: Array, name: str | None) -> Array:
    if name is None:
        return np.full(len(cells), np.nan)
    if name == NOTHING:
        return np.zeros(len(cells))
    if name not in header:
        raise LogError(f"{path}: has no column '{name}'; it has {', '.join(header)}: mend the column map")
    return cells[:, header.index(name)]


def _values(path: Path, header: list[str], cells: Array, signal: str, source: Columns) -> Array:
    value = np.column_stack([_column(path, header, cells, name) for name in source.named])
    value = (value + np.array(source.offset or 0.0)) * np.array(source.scale or 1.0)
    if source.unit == "rad/s" and signal == "rpm":
        factor = 1 / RADIANS_PER_RPM
    else:
        factor = UNITS[source.unit]
    si: Array = value * factor
    return si
