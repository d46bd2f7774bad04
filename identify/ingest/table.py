"""Makes a dive of streams and a column map: YAML with the column and unit of each signal."""

import csv
import difflib
import io
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bridge import schema
from bridge.errors import ConfigError, LogError
from bridge.vehicle.config import CONFIGS, GRAVITY_M_S2
from bridge.wire.tlog import load_bytes
from identify.dive import Array, Signal
from identify.ingest import rotation
from identify.ingest.commands import spread
from identify.ingest.streams import MOST_NAMED, Mask, Stream, Streams, some_of

NOTHING = "-"
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
    "pwm": ("us",), "rpm": ("rpm", "rev/s", "rad/s"), "voltage": ("V", "mV"), "tau_cmd": ("N", "kgf", "lbf"),
    "armed": ("1",),
}  # fmt: skip
WIDTHS = {
    "velocity": 3, "gyro": 3, "fog": 1, "specific_force": 3, "quaternion": 4, "euler": 3, "pressure": 1,
    "depth": 1, "altitude": 1, "voltage": 1, "tau_cmd": 6, "armed": 1,
}  # fmt: skip
NEAR = 0.4
"""Likeness, 0 to 1, from which a name is near another."""
ANOTHER_CLOCK_S = 86_400.0
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6}
RADIANS_PER_RPM = 2 * np.pi / 60


@dataclass(frozen=True)
class TimeColumn:
    """The time column and its unit: a field that each topic has of which a signal is made."""

    column: str
    unit: str = "s"

    def __post_init__(self) -> None:
        if self.unit not in TIME_UNITS:
            raise ValueError(f"unit '{self.unit}' is no unit of time; give one of {', '.join(TIME_UNITS)}")


@dataclass(frozen=True)
class Columns:
    """The columns of a signal, in the order of the Dive's; `-` stands for a column of zeros.

    In a recording of several topics they are named `TOPIC.FIELD`, and all are of one topic.

    value = (cell + offset) * scale, converted from `unit` to SI; `offset` and `scale` are in the file's unit, one per
    column (default: all 0, all 1).
    """

    columns: tuple[str, ...]
    unit: str
    offset: tuple[float, ...] = ()
    scale: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        for name in ("offset", "scale"):
            if len(getattr(self, name)) not in (0, len(self.columns)):
                raise ValueError(
                    f"{name} needs one number for each of the {len(self.columns)} columns, or none"
                )


@dataclass(frozen=True)
class ColumnMap:
    """The column of each signal. Body axes FRD; `euler` is roll, pitch, yaw; `notes` are shown to the user.

    `commands_hold`: each thruster command, or wrench, holds until the next recorded command, however much later.
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


def read_table(path: Path) -> Streams:
    """The table in a `.csv`. Raises LogError."""
    stream, empty, notes = _cells(path)
    return Streams((stream,), notes, empty)


def dive_fields(recorded: Streams, columns: ColumnMap, path: Path) -> dict[str, Any]:
    """Fields of a Dive (all but its name, source and hash) that a column map makes of streams. Raises LogError.

    Each signal has the times of its stream. A row in which all cells of a signal are empty has no sample of it; a NaN
    is an unknown value. Rows of the same time become one row as far as their cells do not contradict each other.
    """
    names = _Names(recorded.streams, path)
    wanted = {name: names.of_signal(name, source) for name, source in columns.signals().items()}
    notes: list[str] = []
    tables: dict[str, _Rows] = {}
    for stream in recorded.streams:
        used = {field for at, fields_used in wanted.values() if at is stream for field in fields_used} - {
            NOTHING
        }
        if any(at is stream for at, _ in wanted.values()):
            tables[stream.name] = _rows(
                stream, recorded.empty, used, names.time_of(stream, columns.time), notes
            )
    signals = {}
    for name, source in columns.signals().items():
        stream, fields_used = wanted[name]
        signals[name] = tables[stream.name].signal(name, source, fields_used)
    notes += _clocks(tables, path)
    euler = signals.pop("euler", None)
    if euler is not None:
        signals["attitude"] = Signal(euler.time_s, rotation.quaternions_from_euler(*euler.value.T))
    quaternion = signals.pop("quaternion", None)
    if quaternion is not None:
        signals["attitude"] = quaternion
    if columns.commands_hold:
        end_s = max((float(signal.time_s[-1]) for signal in signals.values() if len(signal)), default=0.0)
        for name in {"pwm", "tau_cmd"} & signals.keys():
            signals[name] = spread(signals[name], end_s)
    return {
        **signals,
        "velocity_is_filtered": columns.velocity_is_filtered,
        "notes": (*recorded.notes, *notes, *columns.notes),
        "counts": {f"rows of {name}" if name else "rows": len(rows.time_s) for name, rows in tables.items()},
    }


class _Names:
    """Finds the columns that a column map names."""

    def __init__(self, streams: tuple[Stream, ...], path: Path) -> None:
        self._streams, self._path = streams, path
        self._places: dict[str, tuple[Stream, str]] = {}
        for stream in streams:
            for field in (*stream.columns, *stream.text):
                self._places.setdefault(stream.full_name(field), (stream, field))

    def of_signal(self, signal: str, source: Columns) -> tuple[Stream, tuple[str, ...]]:
        """The stream of a signal, and the fields of its columns, `-` where there is none. Raises LogError."""
        places = {name: self._place(name) for name in source.columns if name != NOTHING}
        topics = list(dict.fromkeys(stream.name for stream, _ in places.values()))
        if len(topics) > 1:
            raise LogError(
                f"{self._path}: {signal} is made of columns of {' and '.join(topics)}, which have times of their own: "
                "take all of one topic in the column map"
            )
        if not topics and len(self._streams) > 1:
            raise LogError(
                f"{self._path}: {signal} names no column, so that no topic gives it times: name one in the column map"
            )
        stream = next(iter(places.values()))[0] if places else self._streams[0]
        return stream, tuple(NOTHING if name == NOTHING else places[name][1] for name in source.columns)

    def time_of(self, stream: Stream, time: TimeColumn) -> Array:
        """Times of a stream's rows, s. Raises LogError."""
        if time.column not in stream.columns:
            of = f"topic {stream.name} " if stream.name else ""
            raise LogError(f"{self._path}: {of}{_lacks(time.column, stream.columns)}: mend the column map")
        return stream.columns[time.column] * TIME_UNITS[time.unit]

    def _place(self, name: str) -> tuple[Stream, str]:
        if name not in self._places:
            raise LogError(f"{self._path}: {_lacks(name, self._places)}: mend the column map")
        stream, field = self._places[name]
        if field in stream.text:
            raise LogError(
                f"{self._path}: column '{name}' holds words, and a signal is numbers: mend the column map"
            )
        return stream, field


def _lacks(name: str, names: Iterable[str]) -> str:
    names = list(names)
    near = difflib.get_close_matches(name, names, MOST_NAMED, NEAR) if len(names) > MOST_NAMED else []
    return f"has no column '{name}'; " + (
        f"near it are {some_of(near)}" if near else f"it has {some_of(names)}"
    )


@dataclass(frozen=True)
class _Rows:
    """Rows (n,) of a stream, one of each time, sorted: the columns used, and the rows in which one is empty."""

    time_s: Array
    cells: Mapping[str, Array]
    empty: Mapping[str, Mask]

    def signal(self, name: str, source: Columns, used: tuple[str, ...]) -> Signal:
        fields_used = [field for field in used if field != NOTHING]
        told = np.ones(len(self.time_s), np.bool_)
        if fields_used and all(field in self.empty for field in fields_used):
            told = ~np.logical_and.reduce([self.empty[field] for field in fields_used])
        zeros = np.zeros(len(self.time_s))
        value = np.column_stack([zeros if field == NOTHING else self.cells[field] for field in used])
        return Signal(self.time_s[told], _in_si(value[told], name, source))


def _rows(
    stream: Stream, empty: Mapping[str, Mask], used: set[str], time_s: Array, notes: list[str]
) -> _Rows:
    """The rows of a stream, as columns `used`; `notes` get a sentence on those whose times are no good."""
    names = sorted(used)
    of = f" of {stream.name}" if stream.name else ""
    steps = np.diff(time_s)
    if (steps > 0).all() and np.isfinite(time_s).all():
        return _Rows(
            time_s, {name: stream.columns[name] for name in names}, {n: empty[n] for n in names if n in empty}
        )
    backwards = int(np.count_nonzero(steps < 0))
    if backwards:
        notes.append(f"The times{of} run backwards {backwards} times: the rows were sorted.")
    cells = np.column_stack([np.zeros((len(time_s), 0)), *(stream.columns[name] for name in names)])
    nothing = np.zeros(cells.shape, np.bool_)
    for k, name in enumerate(names):
        if name in empty:
            nothing[:, k] = empty[name]
    rows, taken = _merged(time_s, cells, nothing)
    if taken < len(time_s):
        notes.append(f"{len(time_s) - taken} rows{of} without a time of their own were left out.")
    return _Rows(
        time_s[rows],
        {name: cells[rows, k] for k, name in enumerate(names)},
        {name: nothing[rows, k] for k, name in enumerate(names)},
    )


def _clocks(tables: Mapping[str, _Rows], path: Path) -> list[str]:
    """A note on topics that have no time in common. Raises LogError if they can't be of one clock."""
    spans = sorted(
        (float(rows.time_s[0]), float(rows.time_s[-1]), name)
        for name, rows in tables.items()
        if len(rows.time_s)
    )
    notes = []
    for (start_s, end_s, name), (next_s, next_end_s, other) in pairwise(spans):
        if next_s <= end_s:
            continue
        said = f"{name} runs from {start_s:.1f} to {end_s:.1f} s and {other} from {next_s:.1f} to {next_end_s:.1f} s"
        if next_s - end_s > ANOTHER_CLOCK_S:
            raise LogError(
                f"{path}: {said}: they are on two clocks; name a time column that is on one clock in both topics, as "
                "`received` is in a bag"
            )
        notes.append(f"{said}: they have no time in common, and may be on two clocks.")
    return notes


def _merged(time_s: Array, cells: Array, empty: Mask) -> tuple[NDArray[np.intp], int]:
    """The first row of every time, sorted by time, and the number of rows that went into these.

    `cells` and `empty` (rows, columns) of the first rows are filled in place from later rows of the same time. A later
    row is used only if it adds a value and contradicts none.
    """
    known = np.flatnonzero(np.isfinite(time_s))
    known = known[np.argsort(time_s[known], kind="stable")]
    starts = np.flatnonzero(np.diff(time_s[known], prepend=-np.inf) > 0)
    first = np.repeat(starts, np.diff([*starts, len(known)]))
    place = np.arange(len(known)) - first
    taken = len(starts)
    by_place = np.argsort(place, kind="stable")
    for later in np.split(by_place, np.cumsum(np.bincount(place)))[1:-1]:
        to, row = known[first[later]], known[later]
        (there, had), (here, says) = ((~empty[at], cells[at]) for at in (to, row))
        clash = here & there & (had != says) & ~(np.isnan(had) & np.isnan(says))
        new = here & ~there & ~clash.any(axis=1, keepdims=True)
        which, column = np.nonzero(new)
        cells[to[which], column] = says[which, column]
        empty[to[which], column] = False
        taken += int(new.any(axis=1).sum())
    return known[starts], taken


def _cells(path: Path) -> tuple[Stream, dict[str, Mask], tuple[str, ...]]:
    """The columns of a `.csv`, NaN for empty cells; by column, the rows with an empty cell; notes on omitted rows."""
    data, _ = load_bytes(path)
    try:
        lines = list(csv.reader(io.StringIO(data.decode("utf-8-sig"))))
    except (UnicodeDecodeError, csv.Error):
        raise LogError(f"{path}: is no table of text; give a .csv with a line of names first") from None
    lines = [line for line in lines if line]
    if len(lines) < 2:
        raise LogError(f"{path}: holds no rows; give a .csv with a line of names and a line for each sample")
    header, body = [name.strip() for name in lines[0]], lines[1:]
    notes: tuple[str, ...] = ()
    if len(body[-1]) < len(header):
        body, notes = body[:-1], ("The last row is cut off and was left out.",)
    rows = []
    for number, line in enumerate(body, start=2):
        if len(line) != len(header):
            raise LogError(
                f"{path}: row {number} has {len(line)} cells, the first line names {len(header)}; mend it"
            )
        try:
            rows.append([float(cell) if cell.strip() else np.nan for cell in line])
        except ValueError:
            wrong = next(cell for cell in line if not _is_number(cell))
            raise LogError(f"{path}: row {number} holds '{wrong}', which is no number; mend it") from None
    shape = -1, len(header)
    nothing = np.array([[not cell.strip() for cell in line] for line in body], np.bool_).reshape(shape)
    numbers = np.array(rows, np.float64).reshape(shape)
    places = {name: header.index(name) for name in header}
    empty = {name: nothing[:, k] for name, k in places.items() if nothing[:, k].any()}
    return Stream("", {name: numbers[:, k] for name, k in places.items()}, {}), empty, notes


def _is_number(cell: str) -> bool:
    try:
        float(cell or "nan")
    except ValueError:
        return False
    return True


def _in_si(value: Array, signal: str, source: Columns) -> Array:
    """Cells (n, k) of a signal in the units of the Dive."""
    value = (value + np.array(source.offset or 0.0)) * np.array(source.scale or 1.0)
    if source.unit == "rad/s" and signal == "rpm":
        factor = 1 / RADIANS_PER_RPM
    else:
        factor = UNITS[source.unit]
    si: Array = value * factor
    return si
