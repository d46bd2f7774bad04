"""Signals of a dive from the streams of a foreign recording, by a column map."""

import difflib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array, Mask
from bridge.errors import LogError
from identify.checks.readings.impossible import LONGEST_DIVE_S, refuse_years, tame
from identify.dive import Signal
from identify.ingest import rotation
from identify.ingest.commands import spread
from identify.ingest.files.clock import iso_s, of_day_s, within_seconds
from identify.ingest.files.streams import MOST_NAMED, Stream, Streams, some_of
from identify.ingest.files.text_table import no_number
from identify.ingest.mapping.column_map import (
    EARTH,
    ISO,
    NOTHING,
    OF_DAY,
    TIME_UNITS,
    ColumnMap,
    Columns,
    TimeColumn,
)
from identify.ingest.mapping.lost_lock import without_zeros
from identify.ingest.mapping.names import tells_valid_velocity
from identify.ingest.mapping.units import UNITS
from identify.ingest.ros.bags import headers_apart
from identify.ingest.ros.recorded import RECEIVED, STAMP

SPARSE = 0.5
"""The rows of a table with this share of empty cells hold a part of a sample each, be they empty or written as NaN."""
COMMANDS = {"us": "pwm", "ms": "pwm", "1": "effort"}
"""The Dive's signal for thruster commands of a unit; forces are its `thrust_cmd`."""
NEAR = 0.4
"""Likeness, 0 to 1, from which a name is near another."""
ANEW_S = 5.0
"""A clock that falls back by more begins anew, where it tells those times for the second time."""

ANOTHER_CLOCK_S = 86_400.0
NOTHING_IN_COMMON = "they have no time in common, and may be on two clocks"


def dive_fields(recorded: Streams, columns: ColumnMap, path: Path) -> dict[str, Any]:
    """Fields of a Dive (all but its name, source and hash) that a column map makes of streams. Raises LogError.

    Each signal has the times of its stream. A row in which all cells of a signal are empty has no sample of it, and a
    signal without a sample is left out; a NaN is an unknown value, unless most cells of the table are NaN. Rows of the
    same time become one row as far as their cells do not contradict each other.
    """
    names = _Names(recorded, path)
    wanted = {name: names.of_signal(name, source) for name, source in columns.signals().items()}
    notes: list[str] = []
    tables: dict[str, _Rows] = {}
    flags: dict[str, str] = {}
    for stream in recorded.streams:
        used = {
            field
            for at, fields_used in wanted.values()
            if at is stream
            for field in fields_used
            if field is not None and field != NOTHING
        }
        if "velocity" in wanted and wanted["velocity"][0] is stream and (flag := _validity(stream)):
            flags[stream.name] = flag
            used.add(flag)
        if any(at is stream for at, _ in wanted.values()):
            empty = _empty_cells(recorded, stream, used)
            clock = clock_of(stream, columns.time, path, {name: empty.get(name) for name in used})
            if clock.is_spread:
                notes.append(
                    f"The clock{_of(stream)} tells whole seconds: the rows of each were spread evenly over it."
                )
            unread = _unread_times(stream, columns.time, clock.time_s)
            if unread:
                kind = "are no time of day" if columns.time.unit == OF_DAY else "ISO 8601 does not know"
                notes.append(f"Times{_of(stream)} that {kind}, first {unread[0]}: {_left_out(len(unread))}")
            time_s = _possible(clock.time_s, stream, recorded, notes)
            _refuse_anew(time_s, stream, path)
            noted = len(unread) + int(np.count_nonzero(np.isfinite(clock.time_s) & np.isnan(time_s)))
            tables[stream.name] = _rows(stream, empty, used, time_s, noted, notes)
    signals = {}
    for name, source in columns.signals().items():
        stream, fields_used = wanted[name]
        signals[name] = tables[stream.name].signal(name, source, fields_used)
    if flags:
        stream, fields_used = wanted["velocity"]
        signals["velocity"] = _valid(
            signals["velocity"],
            tables[stream.name],
            flags[stream.name],
            stream.full_name(flags[stream.name]),
            notes,
        )
    if "velocity" in signals:
        signals["velocity"] = without_zeros(signals["velocity"], notes)
    if columns.pwm is not None:
        signals[COMMANDS.get(columns.pwm.unit, "thrust_cmd")] = signals.pop("pwm")
    notes += _clocks(tables, path)
    used_here = [stream for stream in recorded.streams if stream.name in tables]
    if columns.time.column == STAMP and (apart := headers_apart(used_here)):
        notes.append(f"By '{STAMP}', {apart}: they may be on two clocks; '{RECEIVED}', the log's, is one.")
    euler = signals.pop("euler", None)
    if euler is not None:
        signals["attitude"] = Signal(euler.time_s, rotation.quaternions_from_euler(*euler.value.T))
    quaternion = signals.pop("quaternion", None)
    if quaternion is not None:
        # A filter that does not run yet tells zeros, which turn nothing.
        value = np.where(quaternion.value.any(axis=1, keepdims=True), quaternion.value, np.nan)
        signals["attitude"] = Signal(quaternion.time_s, value)
    if columns.velocity is not None and columns.velocity.frame in EARTH:
        signals["velocity"] = _turned(signals, columns.velocity.frame, path, notes)
    signals = {name: signal for name, signal in signals.items() if len(signal)}
    start_s = min((float(signal.time_s[0]) for signal in signals.values()), default=0.0)
    end_s = max((float(signal.time_s[-1]) for signal in signals.values()), default=0.0)
    refuse_years((start_s, end_s), path)
    if columns.commands_hold:
        for name in {*COMMANDS.values(), "thrust_cmd", "tau_cmd"} & signals.keys():
            signals[name] = spread(signals[name], end_s)
    return {
        **signals,
        "commands_hold": columns.commands_hold or None,
        "velocity_is_filtered": columns.velocity_is_filtered,
        "notes": (*recorded.notes, *notes, *columns.notes),
        "counts": {f"rows of {name}" if name else "rows": len(rows.time_s) for name, rows in tables.items()},
    }


def _validity(stream: Stream) -> str:
    """The column of a stream that says where its velocity is none; "" without."""
    for field, cells in stream.columns.items():
        if tells_valid_velocity(stream.name, field) and {*np.unique(cells[np.isfinite(cells)])} == {0.0, 1.0}:
            return field
    return ""


def _valid(velocity: Signal, rows: "_Rows", flag: str, name: str, notes: list[str]) -> Signal:
    """The velocity, unknown where its column `flag` says that it is none."""
    none = np.isin(velocity.time_s, rows.time_s[rows.cells[flag] == 0.0])
    notes.append(
        f"Left out by {name}: {np.count_nonzero(none)} of {len(velocity)} velocities, which are no reading."
    )
    return Signal(velocity.time_s, np.where(none[:, None], np.nan, velocity.value))


def _turned(signals: Mapping[str, Signal], frame: str, path: Path, notes: list[str]) -> Signal:
    """The velocity in body axes, of one in earth axes. Raises LogError without an attitude."""
    if "attitude" not in signals:
        raise LogError(
            f"velocity is in earth axes ({frame}), which the attitude turns to the body's: name `euler` or "
            "`quaternion` in the column map",
            path,
        )
    velocity = signals["velocity"]
    if frame == "ENU":
        velocity = Signal(velocity.time_s, velocity.value[:, [1, 0, 2]] * np.array([1.0, 1.0, -1.0]))
    turned = rotation.in_body(velocity, signals["attitude"])
    if len(turned) < len(velocity):
        notes.append(
            f"{len(velocity) - len(turned)} of {len(velocity)} velocities are from before or after the attitude, which "
            "turns them to the body's axes: they were left out."
        )
    return turned


class _Names:
    """Finds the columns that a column map names."""

    def __init__(self, recorded: Streams, path: Path) -> None:
        self._recorded, self._path = recorded, path
        self._places: dict[str, tuple[Stream, str]] = {}
        for stream in recorded.streams:
            for field in (*stream.columns, *stream.text):
                self._places.setdefault(stream.full_name(field), (stream, field))

    def of_signal(self, signal: str, source: Columns) -> tuple[Stream, tuple[str | None, ...]]:
        """The stream of a signal, and the fields of its columns: `-` for zeros, None for an unknown one.

        Raises LogError.
        """
        places = {name: self._place(name) for name in source.named if name is not None and name != NOTHING}
        topics = list(dict.fromkeys(stream.name for stream, _ in places.values()))
        if len(topics) > 1:
            raise LogError(
                f"{signal} is made of columns of {' and '.join(topics)}, which have times of their own: "
                "take all of one topic in the column map",
                self._path,
            )
        if not topics and len(self._recorded.streams) > 1:
            raise LogError(
                f"{signal} names no column, so that no topic gives it times: name one in the column map",
                self._path,
            )
        stream = next(iter(places.values()))[0] if places else self._recorded.streams[0]
        return stream, tuple(
            name if name is None or name == NOTHING else places[name][1] for name in source.named
        )

    def _place(self, name: str) -> tuple[Stream, str]:
        if name not in self._places:
            raise LogError(f"{_lacks(name, self._places)}: mend the column map", self._path)
        stream, field = self._places[name]
        if field in stream.text:
            raise LogError(self._word_in(stream.text[field], name), self._path)
        return stream, field

    def _word_in(self, words: tuple[str, ...], name: str) -> str:
        if self._recorded.lines is None:
            return f"column '{name}' holds words, and a signal is numbers: mend the column map"
        row, word = next((i, word) for i, word in enumerate(words) if not _is_number(word))
        return f"row {self._recorded.lines[row]} {no_number(word)}; mend it"


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

    def signal(self, name: str, source: Columns, used: tuple[str | None, ...]) -> Signal:
        fields_used = [field for field in used if field is not None and field != NOTHING]
        stated = np.ones(len(self.time_s), np.bool_)
        if fields_used and all(field in self.empty for field in fields_used):
            stated = ~np.logical_and.reduce([self.empty[field] for field in fields_used])
        value = np.column_stack([self._column(field) for field in used])
        return Signal(self.time_s[stated], _in_si(value[stated], name, source))

    def _column(self, field: str | None) -> Array:
        if field is None:
            return np.full(len(self.time_s), np.nan)
        return np.zeros(len(self.time_s)) if field == NOTHING else self.cells[field]


def _possible(time_s: Array, stream: Stream, recorded: Streams, notes: list[str]) -> Array:
    """The times of a stream (n,), NaN for those that no dive can hold; `notes` get a sentence on them."""
    known = np.flatnonzero(np.isfinite(time_s))
    if not len(known) or np.ptp(time_s[known]) <= LONGEST_DIVE_S:
        return time_s
    wild = known[~tame(time_s[known])]
    if not len(wild):
        return time_s
    first = f"{time_s[wild[0]]:.3g} s"
    where = first if recorded.lines is None else f"row {recorded.lines[wild[0]]}, {first}"
    notes.append(f"Times{_of(stream)} far from those around them, first {where}: {_left_out(len(wild))}")
    return np.where(np.isin(np.arange(len(time_s)), wild), np.nan, time_s)


def _left_out(count: int) -> str:
    return "1 row was left out." if count == 1 else f"{count} rows were left out."


def _refuse_anew(time_s: Array, stream: Stream, path: Path) -> None:
    """Raise LogError if a clock (n,) begins anew: it runs as usual, falls back by more than ANEW_S, and runs on there
    as usual, through times that it told before. Rows that come late, or a wild time, do not."""
    known = np.flatnonzero(np.isfinite(time_s))
    steps = np.diff(time_s[known])
    usual = (steps >= 0) & (steps < ANEW_S)
    for step in np.flatnonzero((steps[1:-1] < -ANEW_S) & usual[:-2] & usual[2:]) + 1:
        row, before_s = known[step + 1], float(time_s[known[step]])
        again = (time_s >= time_s[row]) & (time_s <= time_s[row] + ANEW_S)
        if np.count_nonzero(again[:row]) < 0.5 * np.count_nonzero(again[row:]):
            continue
        raise LogError(
            f"its clock{_of(stream)} falls back from {before_s:.2f} to {time_s[row]:.2f} s and goes on from "
            "there, as where several runs stand one below another; give each run a file of its own, or a column with "
            "its number, which `runs` of the column map names",
            path,
        )


def _empty_cells(recorded: Streams, stream: Stream, used: set[str]) -> Mapping[str, Mask]:
    """By column, the rows (n,) without a cell there. In a table most of whose cells are NaN, as where logs of several
    sensors were joined by their times, a NaN is no reading that failed but none."""
    unknown = {name: np.isnan(stream.columns[name]) for name in used if name in stream.columns}
    shares = [float(np.mean(rows)) for rows in unknown.values() if not rows.all()]
    blank = {
        name: recorded.empty[full] for name in used if (full := stream.full_name(name)) in recorded.empty
    }
    if len(recorded.streams) > 1 or not shares or np.mean(shares) < SPARSE:
        return blank
    return {**blank, **unknown}


def _rows(
    stream: Stream, empty: Mapping[str, Mask], used: set[str], time_s: Array, noted: int, notes: list[str]
) -> _Rows:
    """The rows of a stream, as columns `used`; `notes` get a sentence on those whose times are no good, but for as
    many as are `noted` already."""
    names = sorted(used)
    of = _of(stream)
    steps = np.diff(time_s)
    if (steps > 0).all() and np.isfinite(time_s).all():
        return _Rows(
            time_s, {name: stream.columns[name] for name in names}, {n: empty[n] for n in names if n in empty}
        )
    backwards = int(np.count_nonzero(steps < 0))
    if backwards:
        times = "once" if backwards == 1 else f"{backwards} times"
        notes.append(f"The times{of} run backwards {times}: the rows were sorted.")
    cells = np.column_stack([np.zeros((len(time_s), 0)), *(stream.columns[name] for name in names)])
    nothing = np.zeros(cells.shape, np.bool_)
    for k, name in enumerate(names):
        if name in empty:
            nothing[:, k] = empty[name]
    rows, taken = _merged(time_s, cells, nothing)
    if (lost := len(time_s) - taken - noted) > 0:
        rows_were = (
            f"1 row{of} without a time of its own was"
            if lost == 1
            else f"{lost} rows{of} without a time of their own were"
        )
        notes.append(f"{rows_were} left out.")
    return _Rows(
        time_s[rows],
        {name: cells[rows, k] for k, name in enumerate(names)},
        {name: nothing[rows, k] for k, name in enumerate(names)},
    )


def _clocks(tables: Mapping[str, _Rows], path: Path) -> list[str]:
    """A note on topics that have no time in common. Raises LogError if they can't be of one clock."""
    spans = [
        (float(rows.time_s[0]), float(rows.time_s[-1]), name)
        for name, rows in tables.items()
        if len(rows.time_s)
    ]
    notes = []
    for said, are_two in apart_in_time(spans):
        if are_two:
            raise LogError(
                f"{said}: they are on two clocks; name a time column that is on one clock in both topics, as "
                "`received` is in a bag",
                path,
            )
        notes.append(f"{said}: {NOTHING_IN_COMMON}.")
    return notes


def apart_in_time(spans: Sequence[tuple[float, float, str]]) -> Iterator[tuple[str, bool]]:
    """What neighbouring topics without a common time span from and to, in words, and whether they must be on two
    clocks. `spans`: start and end, s, and name of each topic."""
    for (start_s, end_s, name), (next_s, next_end_s, other) in pairwise(sorted(spans)):
        if next_s > end_s:
            other_runs = f"{other} from {next_s:.1f} to {next_end_s:.1f} s"
            yield (
                f"{name} runs from {start_s:.1f} to {end_s:.1f} s and {other_runs}",
                next_s - end_s > ANOTHER_CLOCK_S,
            )


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


def _is_number(cell: str) -> bool:
    try:
        float(cell or "nan")
    except ValueError:
        return False
    return True


def _of(stream: Stream) -> str:
    return f" of {stream.name}" if stream.name else ""


def _dates(path: Path, column: str, words: tuple[str, ...] | None) -> Array:
    if words is None:
        raise LogError(f"its times in '{column}' are numbers, not dates; mend their unit, {ISO}", path)
    try:
        return iso_s(words)
    except ValueError as error:
        raise LogError(
            f"'{error}' in '{column}' is no time that ISO 8601 knows, as 2026-07-19T10:15:00.25Z or "
            "10:15:00.25; mend it",
            path,
        ) from None


def _times_of_day(path: Path, column: str, stamps: Array) -> Array:
    try:
        return of_day_s(stamps)
    except ValueError as error:
        raise LogError(
            f"{error} in '{column}' is no time of day as a number, 202459 for 20:24:59; mend the time's unit "
            "in the column map",
            path,
        ) from None


def _unread_times(stream: Stream, time: TimeColumn, time_s: Array) -> list[str]:
    """The dates or stamps that became no time (n,), as they stand in the file."""
    if time.unit == OF_DAY:
        stamps = stream.columns[time.column]
        return [f"{at:.10g}" for at in stamps[np.isfinite(stamps) & np.isnan(time_s)]]
    if time.unit == ISO:
        words = zip(stream.text[time.column], np.isnan(time_s), strict=True)
        return [f"'{word}'" for word, unread in words if word and unread]
    return []


@dataclass(frozen=True)
class Clock:
    """Times (n,) of a stream's rows, s, and whether whole seconds were spread."""

    time_s: Array
    is_spread: bool


def clock_of(stream: Stream, time: TimeColumn, path: Path, used: Mapping[str, Mask | None]) -> Clock:
    """The times of a stream by a map's time column. Raises LogError.

    Rows of a clock of whole seconds are spread over each, but for a table in which each row has a part of a sample.
    used: the columns that signals are made of, with the rows in which each is empty.
    """
    known = (*stream.columns, *stream.text)
    if time.column not in known:
        of = f"topic {stream.name} " if stream.name else ""
        raise LogError(f"{of}{_lacks(time.column, known)}: mend the column map", path)
    words = stream.text.get(time.column)
    if time.unit == ISO:
        time_s = _dates(path, time.column, words)
    elif words is not None:
        raise LogError(
            f"its times in '{time.column}' are words, as '{words[0]}'; give the time the unit {ISO} in the "
            "column map if they are dates",
            path,
        )
    elif time.unit == OF_DAY:
        time_s = _times_of_day(path, time.column, stream.columns[time.column])
    else:
        time_s = stream.columns[time.column] * TIME_UNITS[time.unit]
    apart_s = within_seconds(time_s) if time.unit in ("s", ISO, OF_DAY) else None
    shares = [0.0 if empty is None else float(np.mean(empty)) for empty in used.values()]
    if apart_s is None or (shares and np.mean(shares) >= SPARSE):
        return Clock(time_s, False)
    return Clock(apart_s, True)


def _in_si(value: Array, signal: str, source: Columns) -> Array:
    """Cells (n, k) of a signal in the units of the Dive."""
    value = (value + np.array(source.offset or 0.0)) * np.array(source.scale or 1.0)
    si: Array = value * UNITS[signal][source.unit]
    return si * np.array([1.0, -1.0, -1.0]) if source.frame == "FLU" else si
