"""Proposes a column map for a file from the names and the ranges of its columns, and from physics."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any

import numpy as np

from bridge.errors import LogError
from identify.checks.mends import CLEAR, Match, Mend, agreeing, mends, turn_match
from identify.dive import Array, Dive
from identify.ingest.column_map import (
    ISO,
    NOTHING,
    OF_DAY,
    WHOLE,
    WIDTHS,
    ColumnMap,
    Columns,
    RunColumn,
    TimeColumn,
)
from identify.ingest.names import Scaled, named, snake, time_unit
from identify.ingest.profiles import Profile, profiles
from identify.ingest.ranges import Guess, time_unit_of, unit_of
from identify.ingest.run_column import longest_run, run_column_in
from identify.ingest.signals import dive_fields
from identify.ingest.streams import Stream, Streams

SIGNALS = (
    "velocity", "gyro", "fog", "specific_force", "quaternion", "euler", "pressure", "depth", "altitude", "pwm", "rpm",
    "voltage", "tau_cmd", "armed",
)  # fmt: skip
FAVOURED = {
    "velocity": "dvl", "gyro": "imu|gyro|angular_velocity", "specific_force": "imu|accel", "quaternion": "imu|attitude",
    "altitude": "dvl|range|altimeter|ping", "depth": "depth", "voltage": "battery",
}  # fmt: skip
"""Topics that are taken first where several hold a signal."""

EARTH = re.compile(r"(local_position|global_position|velocity_local|vehicle_odometry)(?!.*body)")
"""Topics whose velocity is in earth axes, in PX4 and MAVROS."""

FILTERED = re.compile(r"filtered|ekf|estimat|odom|local_position")
WRENCH = "XYZKMN"
LEAST_RISING = 0.95
TIME_FIRST = ("header_stamp", "stamp", "timestamp", "time", "t")


class Confidence(Enum):
    """How a unit and a column were found."""

    NAMED = "named"
    LIKELY = "likely"
    GUESSED = "guessed"


@dataclass(frozen=True)
class Choice:
    """Columns that a signal is proposed to be made of, and the reasons, in sentences. mends: those of physics."""

    signal: str
    columns: Columns
    confidence: Confidence
    reasons: tuple[str, ...]
    mends: tuple[Mend, ...] = ()


@dataclass(frozen=True)
class Proposal:
    """A column map, the choices in it, and a profile of each column of the file.

    notes: what the user should check, in sentences. time_reason: why a time was taken for what it is; empty if its
    name says so.
    """

    columns: ColumnMap
    choices: tuple[Choice, ...]
    profiles: tuple[Profile, ...]
    notes: tuple[str, ...]
    time_reason: str = ""

    def taken_for(self, column: str) -> tuple[str, str]:
        """The signal and the unit that a column is taken for; `("", "")` if it is not used."""
        if column == self.columns.time.column or column.endswith(f".{self.columns.time.column}"):
            return "time", self.columns.time.unit
        if self.columns.runs is not None and column == self.columns.runs.column:
            return "run", "-"
        for choice in self.choices:
            if column in choice.columns.columns:
                place = choice.columns.columns.index(column)
                word = choice.signal if len(choice.columns.columns) == 1 else f"{choice.signal} {place + 1}"
                return word, choice.columns.unit
        return "", ""


@dataclass(frozen=True)
class _Candidate:
    """Columns of one stream that may be a signal: by place, the field; and the unit in their names."""

    signal: str
    stream: Stream
    fields: dict[int, str]
    unit: Scaled | None
    rank: int

    @property
    def values(self) -> Array:
        return np.column_stack([self.stream.columns[self.fields[place]] for place in sorted(self.fields)])

    @property
    def worth(self) -> tuple[bool, bool, float, int, int]:
        """Larger is better: moves, is complete, is of a favoured topic, is well named, has more rows."""
        known = self.values[np.isfinite(self.values).all(axis=1)]
        moves = len(known) > 1 and bool(np.ptp(known, axis=0).any())
        complete = len(self.fields) >= WIDTHS.get(self.signal, 1)
        favoured = bool(re.search(FAVOURED.get(self.signal, "^$"), snake(self.stream.name)))
        return moves, complete, float(favoured), -self.rank, len(known)


def propose(streams: Sequence[Stream], path: Path) -> Proposal:
    """The column map that the streams of a file suggest, mended where physics contradicts it.

    Of a table that holds several runs, the longest counts. Raises LogError if no column is a time, or no column is
    known by its name.
    """
    if run := run_column_in(streams):
        proposal = _of_single_run([longest_run(streams[0], run)], path)
        time, reason = _time_of_runs(streams[0], proposal)
        columns = replace(proposal.columns, time=time, runs=RunColumn(run))
        # Ranges are those of all runs; a rate is known within one.
        shown = zip(profiles(streams, columns), proposal.profiles, strict=True)
        note = f"'{run}' changes where the clock starts anew, so it is taken for the number of the run."
        return replace(
            proposal,
            columns=columns,
            profiles=tuple(replace(whole, rate_hz=of_run.rate_hz) for whole, of_run in shown),
            notes=(note, *proposal.notes),
            time_reason=reason,
        )
    return _of_single_run(streams, path)


def _of_single_run(streams: Sequence[Stream], path: Path) -> Proposal:
    time, time_reason = _time(streams, path)
    timed = [stream for stream in streams if time.column in (*stream.columns, *stream.text)]
    candidates = [candidate for stream in timed for candidate in _candidates(stream, time.column)]
    choices, notes = _choices(candidates)
    if not choices:
        names = [stream.full_name(field) for stream in streams for field in stream.columns]
        raise LogError(
            f"{path}: no column is known by its name ({', '.join(names[:12])}{', ...' if len(names) > 12 else ''}); "
            "write the column map by hand, as docs/howto/bring_your_own_log.md shows"
        )
    choices = _agreed_angles(choices, timed, time)
    columns = _map(time, choices)
    for mend in mends(_dive(timed, columns, path)):
        choices = tuple(_mended(choice, mend) for choice in choices)
    borne_out = agreeing(_dive(timed, _map(time, choices), path))
    choices = tuple(_borne_out(choice) if _meant(choice) in borne_out else choice for choice in choices)
    return Proposal(
        _map(time, choices), choices, profiles(streams, columns), (*notes, *_lacks(choices)), time_reason
    )


def _dive(streams: Sequence[Stream], columns: ColumnMap, path: Path) -> Dive:
    """The dive of a map, for the checks of physics; without signals if its topics are on two clocks, or its time is
    none."""
    try:
        fields = dive_fields(Streams(tuple(streams)), columns, path)
    except LogError:
        fields = {}
    return Dive(path.name, path, "", **fields)


def mended_columns(signal: str, columns: Columns, mend: Mend) -> Columns:
    """The columns of a signal with a mend: in its order, and with its factors in their scale."""
    size = len(columns.columns)
    factors = mend.factors
    if signal == "quaternion":
        # Half a turn about x on either side of the rotation turns y and z of a quaternion round.
        factors = (1.0, *mend.factors)
    factors = factors[:1] * size if len(factors) != size else factors
    order = mend.order if len(mend.order) == size else tuple(range(size))
    offset, scale = columns.offset or (0.0,) * size, columns.scale or (1.0,) * size
    scale = tuple(scale[k] * factor for k, factor in zip(order, factors, strict=True))
    return replace(
        columns,
        columns=tuple(columns.columns[k] for k in order),
        offset=tuple(offset[k] for k in order) if columns.offset else (),
        scale=scale if any(factor != 1.0 for factor in scale) else (),
    )


def _mended(choice: Choice, mend: Mend) -> Choice:
    if mend.signal != _meant(choice):
        return choice
    columns = mended_columns(choice.signal, choice.columns, mend)
    return replace(choice, columns=columns, mends=(*choice.mends, mend))


def _borne_out(choice: Choice) -> Choice:
    """The choice, whose unit is no guess any more since another signal agrees with it."""
    is_whole = not {NOTHING, None} & {*choice.columns.named}
    if choice.confidence is not Confidence.GUESSED or not is_whole:
        return choice
    return replace(
        choice,
        confidence=Confidence.LIKELY,
        reasons=(*choice.reasons, "Another signal of the file agrees with it."),
    )


def _meant(choice: Choice) -> str:
    """The signal of a Dive that a choice gives."""
    return "attitude" if choice.signal in ("euler", "quaternion") else choice.signal


def _time(streams: Sequence[Stream], path: Path) -> tuple[TimeColumn, str]:
    """The time column that most streams have, with its unit, and why if its name doesn't say."""
    counts: dict[str, int] = {}
    for stream in streams:
        for field in (*stream.columns, *stream.text):
            is_time, _ = time_unit(field)
            if is_time and (field in stream.text or _rises(stream.columns[field])):
                counts[field] = counts.get(field, 0) + 1
    if not any(len(cells) for stream in streams for cells in stream.columns.values()):
        raise LogError(f"{path}: holds no rows of numbers; give a log with samples")
    if not counts:
        names = sorted({field for stream in streams for field in stream.columns})
        back = [name for name in names if time_unit(name)[0]]
        if back:
            raise LogError(
                f"{path}: its times in '{back[0]}' do not rise, as where several runs stand in one table; give each "
                "run a file of its own, or a column with its number"
            )
        raise LogError(
            f"{path}: no column is a rising time ({', '.join(names[:12])}); name one `time`, in seconds"
        )

    def worth(field: str) -> tuple[int, int]:
        plain = snake(field)
        return counts[field], -TIME_FIRST.index(plain) if plain in TIME_FIRST else -len(TIME_FIRST)

    column = max(counts, key=worth)
    unit = time_unit(column)[1]
    values = [stream.columns[column] for stream in streams if column in stream.columns]
    if not values:
        return TimeColumn(column, ISO), ""
    if unit:
        return TimeColumn(column, unit), ""
    longest = max(values, key=len)
    if _is_time_of_day(longest):
        return _of_day(column)
    unit, is_telling = time_unit_of(longest)
    return TimeColumn(
        column, unit
    ), "" if is_telling else f"By the steps of '{column}', its unit is {unit}; check it."


def _time_of_runs(stream: Stream, of_longest: Proposal) -> tuple[TimeColumn, str]:
    """As `_time`, of a table of several runs: a single one is too short to show that its clock counts minutes."""
    time = of_longest.columns.time
    cells = stream.columns.get(time.column)
    if cells is not None and not time_unit(time.column)[1] and _is_time_of_day(cells):
        return _of_day(time.column)
    return time, of_longest.time_reason


def _of_day(column: str) -> tuple[TimeColumn, str]:
    return TimeColumn(column, OF_DAY), f"'{column}' counts to 59 and on from 100, so it is the time of day."


def _is_time_of_day(time: Array) -> bool:
    """Whether times are hours, minutes and seconds as one number, which steps from 59 to 100."""
    known = time[np.isfinite(time)]
    sixty = (known % 100 < 60).all() and (known // 100 % 100 < 60).all()
    return bool(sixty and (known == np.rint(known)).all() and np.isin(np.diff(known), (41, 4041)).any())


def _rises(time: Array) -> bool:
    known = time[np.isfinite(time)]
    steps = np.diff(known)
    return len(steps) > 0 and float(np.mean(steps >= 0)) >= LEAST_RISING and known[-1] > known[0]


def _candidates(stream: Stream, time: str) -> Iterable[_Candidate]:
    sets: dict[tuple[str, str], dict[int, str]] = {}
    about: dict[tuple[str, str], tuple[Scaled | None, int]] = {}
    for field in stream.columns:
        name = named(stream.name, field)
        if name is None or field == time or name.place < 0 or not np.isfinite(stream.columns[field]).any():
            continue
        key = name.signal, name.family
        sets.setdefault(key, {}).setdefault(name.place, field)
        about.setdefault(key, (name.unit, name.rank))
    if {"N"} < {field for field in stream.columns if field in tuple(WRENCH)}:
        sets[("tau_cmd", WRENCH)] = {k: axis for k, axis in enumerate(WRENCH) if axis in stream.columns}
        about[("tau_cmd", WRENCH)] = None, 0
    for (signal, family), fields in sets.items():
        yield _Candidate(signal, stream, fields, *about[(signal, family)])


def _choices(candidates: Sequence[_Candidate]) -> tuple[tuple[Choice, ...], tuple[str, ...]]:
    """The best candidate of each signal, and notes on those that can't be used."""
    choices: list[Choice] = []
    notes: list[str] = []
    for signal in SIGNALS:
        usable: list[_Candidate] = []
        for candidate in candidates:
            if candidate.signal != signal:
                continue
            if signal == "velocity" and EARTH.search(snake(candidate.stream.name)):
                notes.append(
                    f"{candidate.stream.name}: its velocity is in earth axes, which a column map does not turn; give "
                    "the velocity in body axes as columns of their own."
                )
            elif signal != "quaternion" or len(candidate.fields) == 4:
                usable.append(candidate)
        for candidate in sorted(usable, key=lambda each: each.worth, reverse=True):
            choice, note = _choice(candidate)
            if choice is not None:
                if choice.signal not in {each.signal for each in choices}:
                    choices.append(choice)
                break
            notes.append(note)
    names = {choice.signal for choice in choices}
    if "quaternion" in names:
        choices = [choice for choice in choices if choice.signal != "euler"]
    return tuple(choices), tuple(notes)


def _choice(candidate: _Candidate) -> tuple[Choice | None, str]:
    """A choice of a candidate's columns, or None and a note that says why it can't be used."""
    candidate = replace(candidate, fields=_used(candidate))
    signal, stream, fields = candidate.signal, candidate.stream, candidate.fields
    width = WIDTHS.get(signal)
    places = list(range(width)) if width else sorted(fields)
    # An attitude and a filtered velocity are known whole or not at all; of any other vector a part may be unknown.
    whole = signal in WHOLE or (signal == "velocity" and _filtered(map(stream.full_name, fields.values())))
    missing = NOTHING if whole else None
    names = tuple(stream.full_name(fields[place]) if place in fields else missing for place in places)
    values = candidate.values
    named_unit = candidate.unit
    guess = Guess(named_unit[0], "", scale=named_unit[1]) if named_unit else unit_of(signal, values)
    if not guess.unit:
        return None, f"{', '.join(filter(None, names))}: not used for {signal}. {guess.reason}"
    confidence = (
        Confidence.NAMED if named_unit else Confidence.LIKELY if guess.is_telling else Confidence.GUESSED
    )
    reasons = [guess.reason] if guess.reason else []
    if signal == "altitude" and np.nanmedian(values) < 0:
        signal, reasons = "depth", ["It is mostly below 0, so it is taken for a height, not for an altitude."]
    lacking = ", ".join(str(k + 1) for k, name in enumerate(names) if name == missing)
    if lacking:
        taken = "0" if whole else "unknown"
        reasons.append(f"Nothing is named for column {lacking}, which is taken for {taken}.")
        confidence = Confidence.GUESSED
    offset = (guess.offset,) * len(names) if guess.offset else ()
    scale = (guess.scale,) * len(names) if guess.scale != 1.0 else ()
    return Choice(signal, Columns(names, guess.unit, offset, scale), confidence, tuple(reasons)), ""


def _used(candidate: _Candidate) -> dict[int, str]:
    """The fields of a candidate; of thrusters, without outputs that nothing is connected to."""
    if candidate.signal not in ("pwm", "rpm"):
        return candidate.fields
    driven = {
        place: field
        for place, field in candidate.fields.items()
        if np.nan_to_num(candidate.stream.columns[field]).any()
    }
    return driven or candidate.fields


def _agreed_angles(
    choices: Sequence[Choice], streams: Sequence[Stream], time: TimeColumn
) -> tuple[Choice, ...]:
    """The choices, with angles whose unit is a guess in the unit by which they turn as the gyro does."""
    made = []
    for choice in choices:
        if choice.signal == "euler" and choice.confidence is not Confidence.NAMED:
            in_unit = {
                unit: turn_match(_dive(streams, _map(time, (*choices, _with_unit(choice, unit))), Path()))
                for unit in ("rad", "deg")
            }
            unit = _likelier(in_unit)
            if unit and unit != choice.columns.unit:
                reason = f"In {unit}, the angles turn as the gyro says."
                choice = replace(_with_unit(choice, unit), confidence=Confidence.LIKELY, reasons=(reason,))
        made.append(choice)
    return tuple(made)


def _with_unit(choice: Choice, unit: str) -> Choice:
    return replace(choice, columns=replace(choice.columns, unit=unit))


def _likelier(by_unit: dict[str, Match | None]) -> str:
    """The unit in which attitude and gyro turn alike; empty if that is unclear."""
    known = {unit: match for unit, match in by_unit.items() if match is not None}
    if len(known) < 2:
        return ""
    alike = {unit: abs(match.correlation) for unit, match in known.items()}
    best, other = sorted(known, key=lambda unit: -alike[unit])
    if alike[best] > CLEAR and alike[other] < alike[best] - 0.3:
        return best
    if alike[other] > CLEAR:
        return min(known, key=lambda unit: abs(np.log(abs(known[unit].ratio))))
    return ""


def _map(time: TimeColumn, choices: Sequence[Choice]) -> ColumnMap:
    signals: dict[str, Any] = {choice.signal: choice.columns for choice in choices}
    velocity = signals.get("velocity")
    filtered = velocity is not None and _filtered(filter(None, velocity.named))
    return ColumnMap(time, velocity_is_filtered=filtered, **signals)


def _filtered(names: Iterable[str]) -> bool:
    """Whether the names of a velocity's columns say that it comes from a filter."""
    return any(FILTERED.search(snake(name)) for name in names)


def _lacks(choices: Sequence[Choice]) -> tuple[str, ...]:
    """What a diagnosis needs and no column was taken for."""
    names = {choice.signal for choice in choices}
    notes = []
    if not names & {"pwm", "rpm", "tau_cmd"}:
        notes.append("No thruster command was recognised; name its columns under pwm, rpm or tau_cmd.")
    if not names & {"velocity", "gyro", "fog"}:
        notes.append("No velocity and no rate of turn was recognised; name their columns in the map.")
    return tuple(notes)
