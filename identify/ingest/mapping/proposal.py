"""Proposes a column map for a file from the names and the ranges of its columns, and from physics."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bridge.arrays import Array
from bridge.errors import LogError
from identify.checks.mapping.first_mapping import mends
from identify.checks.mapping.frames import EAST_FIRST, UP, earth_mends
from identify.checks.mapping.mend import FLU, Mend
from identify.checks.sensors.correlation import CLEAR, Match
from identify.checks.sensors.sensor_pairs import agreeing, turn_match
from identify.dive import Dive
from identify.ingest.files.clock import iso_s
from identify.ingest.files.streams import Stream, Streams
from identify.ingest.mapping.candidates import Choice, Confidence, candidates_in, choices_of, is_filtered
from identify.ingest.mapping.column_map import (
    BODY,
    EARTH,
    ISO,
    NOTHING,
    OF_DAY,
    TIME_UNITS,
    ColumnMap,
    Columns,
    TimeColumn,
)
from identify.ingest.mapping.names import ends_in_time_unit, snake, time_unit
from identify.ingest.mapping.profiles import Profile, profiles
from identify.ingest.mapping.ranges import time_unit_of
from identify.ingest.mapping.signals import NOTHING_IN_COMMON, apart_in_time, dive_fields
from identify.ingest.mapping.units import UNITS
from identify.ingest.ros.bags import RECEIVED, STAMP, headers_apart
from identify.words import listed

LEAST_RISING = 0.95
MOST_OFF = 3.0
"""Ratio of two rates of turn up to which they may be in one unit; degrees and radians are 57 apart."""
TIME_FIRST = ("header_stamp", "stamp", "timestamp", "time", "t")
COARSEST_FIRST = ("s", "ms", "us", "ns")
OLD_S = 0.2
"""Headers of a topic that are older than those of another by this much raise a question."""


@dataclass(frozen=True)
class Proposal:
    """A column map, the choices in it, and a profile of each column of the file.

    notes: sentences for the user to check. time_reason: the reason for the time column; empty if its name says so.
    """

    columns: ColumnMap
    choices: tuple[Choice, ...]
    profiles: tuple[Profile, ...]
    notes: tuple[str, ...]
    time_reason: str = ""

    def taken_for(self, column: str) -> tuple[str, str]:
        """Signal and unit of a column in the map; `("", "")` if it is not used."""
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


class NothingKnown(LogError):
    """No column of a file is known by its name. `seen`: a map of its time alone, with the profile of each column."""

    def __init__(self, seen: Proposal, path: Path) -> None:
        self.seen = seen
        super().__init__(
            "no column but the time is known by its name; write the column map by hand, as "
            "docs/howto/bring_your_own_log.md shows, from the columns above",
            path,
        )


def propose_single(streams: Sequence[Stream], path: Path) -> Proposal:
    """The column map that the streams of a single run suggest, with physical contradictions mended.

    Raises LogError if no column is a time; NothingKnown if no other column is known by its name.
    """
    time, time_reason = _time(streams, path)
    apart = _on_two_clocks(streams, time)
    logged = all(RECEIVED in stream.columns for stream in streams)
    if apart and logged and not _on_two_clocks(streams, TimeColumn(RECEIVED, "s")):
        time, time_reason = (
            TimeColumn(RECEIVED, "s"),
            f"By '{time.column}', {apart}; '{RECEIVED}', the log's, is one.",
        )
    timed = [stream for stream in streams if time.column in (*stream.columns, *stream.text)]
    candidates = [candidate for stream in timed for candidate in candidates_in(stream, time.column)]
    choices, notes = choices_of(candidates)
    if apart and time.column != RECEIVED:
        notes = (
            *notes,
            f"By '{time.column}', {apart}: no signal was held against another. Name one clock of all.",
        )
    elif time.column == STAMP and (old := headers_apart(timed, OLD_S)):
        notes = (
            *notes,
            f"By '{STAMP}', {old}: taken for the age of its readings; if a clock is off instead, take '{RECEIVED}'.",
        )
    if not choices:
        columns = map_of(time, ())
        raise NothingKnown(Proposal(columns, (), profiles(streams, columns), notes, time_reason), path)
    if not apart:
        notes = (*notes, *_without_common_time(timed, choices, time))
    if not apart and (unreadable := _unreadable(timed, map_of(time, choices), path)):
        notes = (*notes, f"No signal was held against another, as this map reads no dive. {unreadable}.")
    choices = _agreed_angles(choices, timed, time)
    columns = map_of(time, choices)
    of_earth = [choice for choice in choices if choice.columns.frame in EARTH]
    choices = tuple(choice for choice in choices if choice not in of_earth)
    choices = _all_mended(choices, mends(_dive(timed, map_of(time, choices), path)))
    for choice in of_earth:
        if "attitude" in map(_meant, choices):
            choices = (_turned(choice, choices, timed, time, path), *choices)
            choices = _all_mended(choices, mends(_dive(timed, map_of(time, choices), path)))
        else:
            notes = (
                *notes,
                f"{_listed(choice)}: not used for velocity. It is in earth axes, and {_NO_ATTITUDE}.",
            )
    if any(_meant(choice) == "attitude" and FLU in (m.factors for m in choice.mends) for choice in choices):
        notes = (*notes, _EAST_IS_NORTH)
    choices = _borne_out(choices, agreeing(_dive(timed, map_of(time, choices), path)))
    return Proposal(
        map_of(time, choices), choices, profiles(streams, columns), (*notes, *_lacks(choices)), time_reason
    )


_NO_ATTITUDE = "no attitude was recognised that could turn it to the body's"


_EAST_IS_NORTH = (
    "Where the attitude's earth has x to the east, as in ROS, a current that a diagnosis says to run north runs east, "
    "and one east runs south."
)


def _listed(choice: Choice) -> str:
    return ", ".join(filter(None, choice.columns.columns))


def _turned(
    choice: Choice, others: Sequence[Choice], streams: Sequence[Stream], time: TimeColumn, path: Path
) -> Choice:
    """A velocity in the earth axes that fit the accelerometer; if unclear, those of its name, or of ROS's attitude."""
    raw = replace(choice, columns=replace(choice.columns, frame=BODY))
    dive = _dive(streams, map_of(time, (raw, *others)), path)
    attitude = next(each for each in others if _meant(each) == "attitude")
    for mend in earth_mends(dive):
        columns = mended_columns("velocity", raw.columns, mend)
        by_name = choice.columns
        if by_name.frame == "ENU":
            by_name = mended_columns(
                "velocity", raw.columns, Mend("velocity", UP, order=EAST_FIRST, frame="NED")
            )
        return choice if by_name == columns else replace(choice, columns=columns, mends=(mend,))
    if choice.columns.frame == "ENU" and any(mend.factors == FLU for mend in attitude.mends):
        columns = mended_columns("velocity", raw.columns, Mend("velocity", FLU, frame="NED"))
        reason = "As the attitude is one of ROS, its earth axes are taken, x east, y south, z down."
        choice = replace(choice, columns=columns, reasons=(*choice.reasons, reason))
    return replace(choice, confidence=Confidence.GUESSED)


def _unreadable(streams: Sequence[Stream], columns: ColumnMap, path: Path) -> str:
    """The error by which a map makes no dive of a file; "" if it does."""
    try:
        dive_fields(Streams(tuple(streams)), columns, path)
    except LogError as error:
        return str(error)
    return ""


def _dive(streams: Sequence[Stream], columns: ColumnMap, path: Path) -> Dive:
    """The dive of a map, for the checks of physics; without signals if its topics are on two clocks or have no time."""
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
    unit = UNITS[signal][columns.unit]
    offset = tuple(offset[k] + mend.offset / (factor * unit) for k, factor in zip(order, scale, strict=True))
    name, scale = _in_named_unit(signal, columns.unit, scale)
    return replace(
        columns,
        columns=tuple(columns.columns[k] for k in order),
        unit=name,
        offset=offset if any(offset) else (),
        scale=scale if any(factor != 1.0 for factor in scale) else (),
        frame=mend.frame or columns.frame,
    )


def _in_named_unit(signal: str, unit: str, scale: tuple[float, ...]) -> tuple[str, tuple[float, ...]]:
    """Unit and scale of columns; a scale that equals another unit is replaced by that unit."""
    sizes = {abs(factor) for factor in scale}
    for name, si in UNITS[signal].items():
        size = si / UNITS[signal][unit]
        if signal != "pwm" and name != unit and np.allclose(list(sizes), size, rtol=1e-6, atol=0.0):
            return name, tuple(factor / size for factor in scale)
    return unit, scale


def _all_mended(choices: Sequence[Choice], made: Sequence[Mend]) -> tuple[Choice, ...]:
    for mend in made:
        choices = [_mended(choice, mend) for choice in choices]
    return tuple(choices)


def _mended(choice: Choice, mend: Mend) -> Choice:
    if mend.signal != _meant(choice):
        return choice
    columns = mended_columns(choice.signal, choice.columns, mend)
    # A mend of the unit contradicts the reason of the unit.
    reasons = choice.reasons if columns.unit == choice.columns.unit else ("", *choice.reasons[1:])
    return replace(choice, columns=columns, reasons=reasons, mends=(*choice.mends, mend))


def _borne_out(choices: Sequence[Choice], pairs: Collection[tuple[str, str]]) -> tuple[Choice, ...]:
    """The choices; a guess that agrees with a choice that is none is confirmed. Two guesses may share an error."""
    firm = {_meant(choice) for choice in choices if choice.confidence is not Confidence.GUESSED}
    while more := {name for pair in pairs if firm & {*pair} for name in pair} - firm:
        firm |= more
    return tuple(_as_known(choice) if _meant(choice) in firm else choice for choice in choices)


def _as_known(choice: Choice) -> Choice:
    """A choice with its unit confirmed by another signal."""
    is_whole = not {NOTHING, None} & {*choice.columns.named}
    # Of earth axes, depth bears out the vertical alone.
    if choice.confidence is not Confidence.GUESSED or not is_whole or choice.columns.frame in EARTH:
        return choice
    return replace(
        choice,
        confidence=Confidence.LIKELY,
        reasons=(*choice.reasons, "Another signal of the file agrees with it."),
    )


def _meant(choice: Choice) -> str:
    """The signal of a Dive that a choice gives."""
    return "attitude" if choice.signal in ("euler", "quaternion") else choice.signal


def _on_two_clocks(streams: Sequence[Stream], time: TimeColumn) -> str:
    """Evidence that a time column puts the topics with signals on several clocks; "" for none."""
    timed = [
        stream
        for stream in streams
        if time.column in stream.columns and any(True for _ in candidates_in(stream, time.column))
    ]
    apart = headers_apart(timed) if time.column == STAMP else ""
    return next((said for said, are_two in apart_in_time(_spans(timed, time)) if are_two), apart)


def _spans(streams: Sequence[Stream], time: TimeColumn) -> list[tuple[float, float, str]]:
    """Start and end, s, and name of each topic with a known time."""
    spans = []
    for stream in streams:
        known = stream.columns[time.column] * TIME_UNITS.get(time.unit, np.nan)
        known = known[np.isfinite(known)]
        spans += [(float(known.min()), float(known.max()), stream.name)] if len(known) else []
    return spans


def _without_common_time(
    streams: Sequence[Stream], choices: Sequence[Choice], time: TimeColumn
) -> Iterator[str]:
    """A sentence on each pair of topics of chosen signals without a common time."""
    chosen = {column for choice in choices for column in choice.columns.columns}
    used = [
        stream
        for stream in streams
        if time.column in stream.columns and chosen & {*map(stream.full_name, stream.columns)}
    ]
    for said, _ in apart_in_time(_spans(used, time)):
        yield f"{said}: {NOTHING_IN_COMMON}. No signal of one was held against one of the other."


def _time(streams: Sequence[Stream], path: Path) -> tuple[TimeColumn, str]:
    """The time column of most streams, with its unit, and the reason if its name doesn't say."""
    counts: dict[str, int] = {}
    for stream in streams:
        for field in (*stream.columns, *stream.text):
            is_time, _ = time_unit(field)
            if is_time and (field in stream.text or _rises(stream.columns[field])):
                counts[field] = counts.get(field, 0) + 1
    if not any(len(cells) for stream in streams for cells in stream.columns.values()):
        raise LogError("holds no rows of numbers; give a log with samples", path)
    if not counts:
        names = sorted({field for stream in streams for field in stream.columns})
        back = [name for name in names if time_unit(name)[0]]
        if back and (still := _of_one_moment(streams, back[0])):
            raise LogError(still, path)
        if back:
            raise LogError(
                f"its times in '{back[0]}' do not rise, as where several runs stand in one table; give each "
                "run a file of its own, or a column with its number",
                path,
            )
        dates = [field for stream in streams for field, words in stream.text.items() if _are_dates(words)]
        if dates:
            return TimeColumn(dates[0], ISO), f"No column is named a time; '{dates[0]}' holds dates."
        rising = [
            (-_evenness(stream.columns[field]), COARSEST_FIRST.index(unit), field)
            for stream in streams
            for field in stream.columns
            if (unit := ends_in_time_unit(field)) and _rises(stream.columns[field])
        ]
        if rising:
            # Of names for m/s, some end as milliseconds do.
            _, coarseness, field = min(rising, key=lambda each: each[:2])
            unit = COARSEST_FIRST[coarseness]
            reason = f"No column is named a time; '{field}' rises throughout, and ends in {unit}."
            return TimeColumn(field, unit), reason
        raise LogError(
            f"no column is a rising time ({', '.join(names[:12])}); name one `time`, in seconds, or write the column "
            "map by hand, as docs/howto/bring_your_own_log.md shows",
            path,
        )

    def worth(field: str) -> tuple[int, int]:
        plain = snake(field)
        return counts[field], -TIME_FIRST.index(plain) if plain in TIME_FIRST else -len(TIME_FIRST)

    column = max(counts, key=worth)
    back = [s.name for s in streams if STAMP in s.columns and _falls_back(s.columns[STAMP])]
    if column == RECEIVED and back:
        return TimeColumn(RECEIVED, "s"), (
            f"The header times of {listed(back)} fall back from message to message, so the log's are taken, which are "
            f"later by what the way takes; if messages only overtook each other, '{STAMP}' is right."
        )
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


def _are_dates(words: Sequence[str]) -> bool:
    """Whether a column of words holds times that rise, as ISO 8601 writes them."""
    try:
        return _rises(iso_s(words))
    except ValueError:
        return False


def _of_one_moment(streams: Sequence[Stream], time: str) -> str:
    """Fault of a file in which time stands still, and the remedy; "" if time passes in a stream."""
    clocks = [stream.columns[time] for stream in streams if time in stream.columns]
    if any(np.ptp(known) > 0 for cells in clocks if len(known := cells[np.isfinite(cells)])):
        return ""
    rows = max(map(len, clocks))
    if rows < 2:
        held = "one message of each topic" if streams[0].name else "one row alone"
        return f"holds {held}, and a motion takes many; if it was cut short, give the whole recording"
    return f"its clock '{time}' stands still in all {rows} rows; name the column that is the time `time`, in seconds"


def of_day(streams: Sequence[Stream], time: TimeColumn) -> tuple[TimeColumn, str] | None:
    """The time column of several runs if it is the time of day, and the reason; one run may be too short to tell."""
    clocks = [stream.columns[time.column] for stream in streams if time.column in stream.columns]
    if not clocks or time_unit(time.column)[1] or not all(map(_is_time_of_day, clocks)):
        return None
    return _of_day(time.column)


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


def _falls_back(time: Array) -> bool:
    """Whether times fall so often that they do not rise; times that stand still, or a single one, fall nowhere."""
    return not _rises(time) and bool(np.any(np.diff(time[np.isfinite(time)]) < 0))


def _evenness(time: Array) -> float:
    """Share of the steps of rising times (n,) that are the usual one or nearly, in tenths: clocks stumble at times."""
    steps = np.diff(time[np.isfinite(time)])
    usual = float(np.median(steps))
    return round(float(np.mean(np.abs(steps - usual) < 0.5 * usual)), 1)


def _agreed_angles(
    choices: Sequence[Choice], streams: Sequence[Stream], time: TimeColumn
) -> tuple[Choice, ...]:
    """The choices; angles with a guessed unit get the unit in which they turn as the gyro does."""
    made = []
    for choice in choices:
        if choice.signal == "euler" and choice.confidence is not Confidence.NAMED:
            in_unit = {
                unit: turn_match(_dive(streams, map_of(time, (*choices, _with_unit(choice, unit))), Path()))
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
        off = {unit: abs(np.log(abs(match.ratio))) for unit, match in known.items()}
        nearest = min(off, key=off.__getitem__)
        return nearest if off[nearest] < np.log(MOST_OFF) else ""
    return ""


def map_of(time: TimeColumn, choices: Sequence[Choice]) -> ColumnMap:
    signals: dict[str, Any] = {choice.signal: choice.columns for choice in choices}
    velocity = signals.get("velocity")
    filtered = velocity is not None and is_filtered(filter(None, velocity.named))
    return ColumnMap(time, velocity_is_filtered=filtered, **signals)


def _lacks(choices: Sequence[Choice]) -> tuple[str, ...]:
    """Signals that a diagnosis needs and no column gives."""
    names = {choice.signal for choice in choices}
    notes = []
    if not names & {"pwm", "rpm", "tau_cmd"}:
        notes.append("No thruster command was recognised; name its columns under pwm, rpm or tau_cmd.")
    if not names & {"velocity", "gyro", "fog"} and names & {"euler", "quaternion"}:
        notes.append(
            "No velocity and no rate of turn was recognised, so that attitude and depth alone tell the motion; if the "
            "log has them, name their columns in the map."
        )
    elif not names & {"velocity", "gyro", "fog"}:
        notes.append("No velocity and no rate of turn was recognised; name their columns in the map.")
    return tuple(notes)
