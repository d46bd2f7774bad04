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
from identify.ingest.commands import spread
from identify.ingest.streams import Mask, cells_of

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
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
RADIANS_PER_RPM = 2 * np.pi / 60


@dataclass(frozen=True)
class TimeColumn:
    """The time column and its unit."""

    column: str
    unit: str = "s"

    def __post_init__(self) -> None:
        if self.unit not in TIME_UNITS:
            raise ValueError(f"unit '{self.unit}' is no unit of time; give one of {', '.join(TIME_UNITS)}")


@dataclass(frozen=True)
class Columns:
    """The columns of a signal, in the order of the Dive's; `-` stands for a column of zeros.

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

    @property
    def names(self) -> set[str]:
        """All columns that a signal is taken from."""
        return {name for source in self.signals().values() for name in source.columns}

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
    header, cells, empty, notes = cells_of(path)
    time_s = _column(path, header, cells, columns.time.column) * TIME_UNITS[columns.time.unit]
    used = np.array(sorted({header.index(name) for name in columns.names if name in header}), np.intp)
    rows, taken = _merged(time_s, cells, empty, used)
    if taken < len(time_s):
        notes += (f"{len(time_s) - taken} rows without a time of their own were left out.",)
    signals = {}
    for name, source in columns.signals().items():
        with_sample = rows[_told(header, empty[rows], source)]
        signals[name] = Signal(time_s[with_sample], _values(path, header, cells[with_sample], name, source))
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


def _told(header: list[str], empty: Mask, source: Columns) -> Mask:
    """Rows (n,) in which a signal has a non-empty cell."""
    places = [header.index(name) for name in source.columns if name in header]
    return np.asarray(~empty[:, places].all(axis=1) if places else np.ones(len(empty), np.bool_))


def _column(path: Path, header: list[str], cells: Array, name: str) -> Array:
    if name == NOTHING:
        return np.zeros(len(cells))
    if name not in header:
        raise LogError(f"{path}: has no column '{name}'; it has {', '.join(header)}: mend the column map")
    return cells[:, header.index(name)]


def _values(path: Path, header: list[str], cells: Array, signal: str, source: Columns) -> Array:
    value = np.column_stack([_column(path, header, cells, name) for name in source.columns])
    value = (value + np.array(source.offset or 0.0)) * np.array(source.scale or 1.0)
    if source.unit == "rad/s" and signal == "rpm":
        factor = 1 / RADIANS_PER_RPM
    else:
        factor = UNITS[source.unit]
    si: Array = value * factor
    return si
