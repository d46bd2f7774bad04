"""Proposes a column map for a file from the names and the ranges of its columns, and from physics."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from bridge.errors import LogError
from identify.checks.mapping.first_mapping import mends
from identify.checks.mapping.frames import EAST_FIRST, UP, earth_mends, is_of_earth
from identify.checks.mapping.mend import FLU, Mend
from identify.checks.readings.still_gyro import stillness
from identify.checks.sensors.sensor_pairs import CLEAR, Match, agreeing, turn_match
from identify.dive import Dive, Signal
from identify.ingest.files.streams import Stream, Streams
from identify.ingest.mapping.candidates import (
    Candidate,
    Choice,
    Confidence,
    candidates_in,
    choices_of,
    is_filtered,
)
from identify.ingest.mapping.column_map import (
    BODY,
    EARTH,
    NOTHING,
    TIME_UNITS,
    ColumnMap,
    Columns,
    TimeColumn,
)
from identify.ingest.mapping.names import is_position_z, position_in
from identify.ingest.mapping.profiles import Profile, profiles
from identify.ingest.mapping.signals import NOTHING_IN_COMMON, apart_in_time, dive_fields
from identify.ingest.mapping.time_column import time_column
from identify.ingest.mapping.units import UNITS
from identify.ingest.ros.bags import headers_apart
from identify.ingest.ros.recorded import RECEIVED, STAMP

MOST_OFF = 3.0
"""Ratio of two rates of turn up to which they may be in one unit; degrees and radians are 57 apart."""
NO_SIGNAL = Signal(np.zeros(0), np.zeros((0, 1)))
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
    """No column of a file that has a time is known by its name. `seen`: a map of its time alone, with the profile of
    each column; `untimed`: the columns that are known by their names and have no time."""

    def __init__(self, seen: Proposal, untimed: Sequence[str], path: Path) -> None:
        self.seen = seen
        super().__init__(
            f"{', '.join(untimed)} have no time beside them; save the times with the readings, in one struct or of one "
            "length"
            if untimed
            else "no column but the time is known by its name; write the column map by hand, as "
            "docs/howto/bring_your_own_log.md shows, from the columns above",
            path,
        )


def propose_single(streams: Sequence[Stream], path: Path) -> Proposal:
    """The column map that the streams of a single run suggest, with physical contradictions mended.

    Raises LogError if no column is a time; NothingKnown if no other column is known by its name.
    """
    time, time_reason = time_column(streams, path)
    taken = _chosen_of(streams, time)
    apart = _on_two_clocks(taken, time)
    logged = all(RECEIVED in stream.columns for stream in streams)
    if apart and logged and not _on_two_clocks(taken, TimeColumn(RECEIVED, "s")):
        time_reason = f"By '{time.column}', {apart}; '{RECEIVED}', the log's, is one."
        time = TimeColumn(RECEIVED, "s")
    timed = [stream for stream in streams if time.column in (*stream.columns, *stream.text)]
    candidates = [candidate for stream in timed for candidate in candidates_in(stream, time.column)]
    choices, notes = choices_of(candidates)
    untimed = _untimed(streams, timed, time.column)
    if untimed:
        notes.append(
            f"{', '.join(untimed)}: not used. No '{time.column}' beside them says when they were read."
        )
    if apart and time.column != RECEIVED:
        notes.append(
            f"By '{time.column}', {apart}: no signal was held against another. Name one clock of all."
        )
    elif time.column == STAMP and (old := headers_apart(taken, OLD_S)):
        notes.append(
            f"By '{STAMP}', {old}: taken for the age of its readings; if a clock is off instead, take '{RECEIVED}'."
        )
    if not choices:
        columns = map_of(time, ())
        seen = Proposal(columns, (), profiles(streams, columns), tuple(notes), time_reason)
        raise NothingKnown(seen, untimed, path)
    if not apart:
        notes += _without_common_time(timed, choices, time)
        try:
            dive_fields(Streams(tuple(timed)), map_of(time, choices), path)
        except LogError as error:
            notes.append(f"No signal was held against another, as this map reads no dive. {error}.")
    choices = _agreed_angles(choices, timed, time)
    if still := stillness(_dive(timed, map_of(time, choices), path)):
        gyro = next(each for each in choices if each.signal == "gyro")
        notes.append(f"{', '.join(filter(None, gyro.columns.columns))}: not used for gyro. {still}.")
        choices = tuple(each for each in choices if each is not gyro)
    by_name = choices
    choices = _by_travel(choices, candidates, timed, time)
    of_earth = [choice for choice in choices if choice.columns.frame in EARTH]
    choices = tuple(choice for choice in choices if choice not in of_earth)
    choices = _all_mended(choices, _mends(timed, choices, time, path))
    for choice in of_earth:
        if "attitude" in map(_meant, choices):
            choices = (_turned(choice, choices, timed, time, path, choice not in by_name), *choices)
            choices = _all_mended(choices, _mends(timed, choices, time, path))
        else:
            notes.append(
                f"{', '.join(filter(None, choice.columns.columns))}: not used for velocity. It is in earth axes, and "
                "no attitude was recognised that could turn it to the body's."
            )
    if any(_meant(choice) == "attitude" and FLU in (m.factors for m in choice.mends) for choice in choices):
        notes.append(
            "Where the attitude's earth has x to the east, as in ROS, a current that a diagnosis says to run north "
            "runs east, and one east runs south."
        )
    choices = _borne_out(choices, agreeing(_dive(timed, map_of(time, choices), path)))
    notes += _lacks(choices)
    columns = map_of(time, choices)
    return Proposal(columns, choices, profiles(streams, columns), tuple(notes), time_reason)


def _by_travel(
    choices: Sequence[Choice], candidates: Sequence[Candidate], streams: Sequence[Stream], time: TimeColumn
) -> tuple[Choice, ...]:
    """The choices; a velocity whose topic has a position is in the axes in which that moves as it says. If they are the
    earth's, the attitude of its topic turns it."""
    velocity = next((each for each in choices if each.signal == "velocity"), None)
    if velocity is None or velocity.columns.frame == "FLU":
        return tuple(choices)
    stream = next(each for each in streams if _holds(each, velocity))
    place = position_in(stream.columns)
    of_stream, _ = choices_of([each for each in candidates if each.stream is stream])
    attitudes = [each for each in (*choices, *of_stream) if _meant(each) == "attitude"]
    attitudes.sort(key=lambda each: not _holds(stream, each))
    if place is None or not attitudes:
        return tuple(choices)
    attitude = attitudes[0]

    def read(signal: str, columns: Columns) -> Signal:
        alone = replace(velocity, signal=signal, columns=columns)
        return _dive(streams, map_of(time, (alone,)), Path()).signals().get(_meant(alone), NO_SIGNAL)

    names = tuple(NOTHING if field is None else stream.full_name(field) for field in place)
    evidence_of_earth = is_of_earth(
        # A map has no position; as a velocity it is read as it is.
        read("velocity", Columns(names, "m/s")),
        read("velocity", replace(velocity.columns, frame=BODY)),
        read(attitude.signal, attitude.columns),
    )
    if evidence_of_earth is None or evidence_of_earth[0] is (velocity.columns.frame in EARTH):
        return tuple(choices)
    is_earth, evidence = evidence_of_earth
    words = f"It is in {'earth axes, those of the attitude' if is_earth else 'body axes'}: {evidence}."
    columns = replace(velocity.columns, frame="NED" if is_earth else BODY)
    made = replace(velocity, columns=columns, reasons=(*velocity.reasons[:1], words))
    if not is_earth:
        return tuple(made if each is velocity else each for each in choices)
    others = [each for each in choices if each is not velocity and _meant(each) != "attitude"]
    return (made, attitude, *others)


def _holds(stream: Stream, choice: Choice) -> bool:
    return any(stream.full_name(field) in choice.columns.columns for field in stream.columns)


def _turned(
    choice: Choice,
    others: Sequence[Choice],
    streams: Sequence[Stream],
    time: TimeColumn,
    path: Path,
    is_in_its_axes: bool,
) -> Choice:
    """A velocity in the earth axes that fit the accelerometer; if unclear, those of its name, or of ROS's attitude.

    is_in_its_axes: whether the attitude's are those of the velocity."""
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
    if (choice.columns.frame == "ENU" or is_in_its_axes) and any(
        mend.factors == FLU for mend in attitude.mends
    ):
        columns = mended_columns("velocity", raw.columns, Mend("velocity", FLU, frame="NED"))
        reason = "As the attitude is one of ROS, its earth axes are taken, x east, y south, z down."
        choice = replace(choice, columns=columns, reasons=(*choice.reasons, reason))
    return replace(choice, confidence=Confidence.GUESSED)


def _mends(
    streams: Sequence[Stream], choices: Sequence[Choice], time: TimeColumn, path: Path
) -> tuple[Mend, ...]:
    depth = next((each for each in choices if each.signal == "depth"), None)
    is_position = depth is not None and any(map(is_position_z, filter(None, depth.columns.named)))
    return mends(_dive(streams, map_of(time, choices), path), depth_is_a_position=is_position)


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


def _chosen_of(streams: Sequence[Stream], time: TimeColumn) -> list[Stream]:
    """The topics of which signals are made, by names and ranges alone."""
    candidates = [candidate for stream in streams for candidate in candidates_in(stream, time.column)]
    choices, _ = choices_of(candidates)
    return [stream for stream in streams if any(_holds(stream, choice) for choice in choices)]


def _on_two_clocks(streams: Sequence[Stream], time: TimeColumn) -> str:
    """Evidence that a time column puts topics on several clocks; "" for none."""
    timed = [stream for stream in streams if time.column in stream.columns]
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


def _untimed(streams: Sequence[Stream], timed: Sequence[Stream], time: str) -> list[str]:
    """The columns that are known by their names, of topics without the time column."""
    return [
        candidate.names
        for stream in streams
        if stream not in timed
        for candidate in candidates_in(stream, time)
        if candidate.moves
    ]


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
    """The unit in which attitude and gyro agree; empty if that is unclear."""
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


def _lacks(choices: Sequence[Choice]) -> list[str]:
    """Signals that a diagnosis needs and no column gives."""
    names = {choice.signal for choice in choices}
    notes = []
    if not names & {"pwm", "rpm", "tau_cmd"}:
        notes.append("No thruster command was recognised; name its columns under pwm, rpm or tau_cmd.")
    if not names & {"velocity", "gyro", "fog"} and names & {"euler", "quaternion"}:
        signals = "attitude and depth" if names & {"depth", "pressure"} else "attitude"
        notes.append(
            f"No velocity and no rate of turn was recognised, so that {signals} alone "
            f"tell{'s' * (signals == 'attitude')} the motion; if the log has them, name their columns in the map."
        )
    elif not names & {"velocity", "gyro", "fog"}:
        notes.append("No velocity and no rate of turn was recognised; name their columns in the map.")
    return notes
