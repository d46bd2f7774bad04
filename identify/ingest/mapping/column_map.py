"""A column map: YAML with the column and unit of each signal of a foreign recording."""

from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from bridge import schema
from bridge.errors import ConfigError
from bridge.vehicle.config import CONFIGS
from identify.ingest.mapping.units import UNITS

NOTHING = "-"
UNKNOWN = (None, "?")
WHOLE = ("quaternion", "euler", "tau_cmd")
"""Signals that need all their columns: an attitude is one rotation, and an unknown force could have any value. So does
an autopilot's velocity, which is moved back in time and rotated, and any velocity in earth axes."""
WIDTHS = {
    "velocity": 3, "gyro": 3, "fog": 1, "specific_force": 3, "quaternion": 4, "euler": 3, "pressure": 1,
    "depth": 1, "altitude": 1, "voltage": 1, "tau_cmd": 6, "armed": 1,
}  # fmt: skip
TIME_UNITS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
PRESSURE_NO_DEPTH = (
    "; it is one of pressure, which the vehicle file's water makes a depth of: name the column under `pressure`, with "
    "the pressure at the surface as its `offset` if it counts from there"
)
BODY, EARTH = "FRD", ("NED", "ENU")
FRAMES = (BODY, "FLU", *EARTH)
"""Axes of a velocity: forward, right or left, down or up, of the body; north, east, down or east, north, up."""
ISO, OF_DAY = "iso", "hhmmss"


@dataclass(frozen=True)
class TimeColumn:
    """The time column and its unit; `iso` for times as words, `2026-07-19T10:15:00.25Z` or `10:15:00.25`;
    `hhmmss` for the time of day as a number, 202459 for 20:24:59."""

    column: str
    unit: str = "s"

    def __post_init__(self) -> None:
        known = (*TIME_UNITS, ISO, OF_DAY)
        if self.unit not in known:
            raise ValueError(f"unit '{self.unit}' is no unit of time; give one of {', '.join(known)}")


@dataclass(frozen=True)
class RunColumn:
    """The column of a single table that names the run of each row, by a number or a word; the clock may start anew with
    each run."""

    column: str


@dataclass(frozen=True)
class Columns:
    """The columns of a signal, in the order of the Dive's; `-` stands for a column of zeros, null (or `?`) for one that
    is unknown.

    value = (cell + offset) * scale, converted from `unit` to SI; `offset` and `scale` are in the file's unit, one per
    column (default: all 0, all 1); a file may give one number for all. frame: axes of a velocity, one of FRAMES; those
    of the earth are turned to the body's by the recorded attitude.
    """

    columns: tuple[str | None, ...]
    unit: str
    offset: tuple[float, ...] = ()
    scale: tuple[float, ...] = ()
    frame: str = BODY

    def __post_init__(self) -> None:
        if self.frame not in FRAMES:
            raise ValueError(f"frame '{self.frame}' is none of {', '.join(FRAMES)}")
        if not any(self.named):
            raise ValueError("every column is unknown; name one, or leave the signal out")
        for name in ("offset", "scale"):
            if len(getattr(self, name)) not in (0, len(self.columns)):
                raise ValueError(
                    f"{name} needs one number for each of the {len(self.columns)} columns, or none"
                )

    @property
    def named(self) -> tuple[str | None, ...]:
        """The columns, None for an unknown one."""
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
    runs: RunColumn | None = None
    velocity_is_filtered: bool = False
    commands_hold: bool = False
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name, columns in self.signals().items():
            if columns.unit not in UNITS[name]:
                hint = PRESSURE_NO_DEPTH if name == "depth" and columns.unit in UNITS["pressure"] else ""
                raise ValueError(f"{name}: unit '{columns.unit}' is none of {', '.join(UNITS[name])}{hint}")
            width = WIDTHS.get(name, len(columns.columns))
            if len(columns.columns) != width:
                raise ValueError(f"{name}: needs {width} columns, {len(columns.columns)} are given")
            if name != "velocity" and columns.frame != BODY:
                raise ValueError(f"{name}: only a velocity has a frame; turn other columns by `scale`")
            is_turned = self.velocity_is_filtered or columns.frame in EARTH
            whole = name in WHOLE or (name == "velocity" and is_turned)
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
    if not Path(name).is_file() and (file := bundled / f"{name}.yaml").exists():
        return file
    if Path(name).exists():
        return Path(name)
    known = ", ".join(sorted(file.stem for file in bundled.glob("*.yaml")))
    raise ConfigError(f"{name}: no such column map; give a YAML file, or one of {known}")


def column_map(name: Path | str) -> ColumnMap:
    """The column map in a file, or the bundled map of that name. Raises ConfigError."""
    file = map_file(name)
    return schema.build(ColumnMap, _with_lists(schema.load_yaml(file)), str(file))


def _with_lists(given: Any) -> Any:
    """The content of a map's file, with a list in place of a lone column, or of one number for all columns."""
    if not isinstance(given, dict):
        return given
    return {name: _signal_with_lists(signal) for name, signal in given.items()}


def _signal_with_lists(signal: Any) -> Any:
    if not isinstance(signal, dict) or "columns" not in signal:
        return signal
    columns = [signal["columns"]] if isinstance(signal["columns"], str) else signal["columns"]
    count = len(columns) if isinstance(columns, list) else 1
    numbers = {
        key: [signal[key]] * count
        for key in ("offset", "scale")
        if isinstance(signal.get(key), int | float | str)
    }
    return {**signal, "columns": columns, **numbers}
