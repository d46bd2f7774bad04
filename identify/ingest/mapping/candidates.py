"""Candidates for each signal among the columns of a file, by names and ranges, and the best of them."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from bridge.arrays import Array
from identify.checks.mapping.mend import Mend
from identify.ingest.files.streams import Stream
from identify.ingest.mapping.column_map import BODY, EARTH, NOTHING, WHOLE, WIDTHS, Columns
from identify.ingest.mapping.names import is_by_side, is_position_z, named, position_in, snake
from identify.ingest.mapping.ranges import Guess, from_surface, unit_of
from identify.words import listed

SIGNALS = (
    "velocity", "gyro", "fog", "specific_force", "quaternion", "euler", "pressure", "depth", "altitude", "pwm", "rpm",
    "voltage", "tau_cmd", "armed",
)  # fmt: skip
PITCH_ANGLE, HEADING = 1, 2
"""Places in `euler`."""
MEASURED = frozenset(SIGNALS) - {"pwm", "rpm", "voltage", "tau_cmd", "armed"}
"""Signals that change in every dive."""
FAVOURED = {
    "velocity": "dvl", "gyro": "imu|gyro|angular_velocity", "specific_force": "imu|accel", "quaternion": "imu|attitude",
    "altitude": "dvl|range|altimeter|ping", "depth": "depth", "voltage": "battery",
    "pwm": "thrust(?!er)",
}  # fmt: skip
"""Topics that are taken first where several hold a signal."""

OF_EARTH = re.compile(r"(local_position|global_position|velocity_local|vehicle_odometry)(?!.*body)")
"""Topics whose velocity is in earth axes: in PX4 north, east, down, in MAVROS east, north, up."""

FORCE = re.compile(r"(?<![a-z])(?:forces?|thrusts?)(?![a-z])")
FILTERED = re.compile(r"filtered|ekf|estimat|odom|local_position")
WRENCH = "XYZKMN"
IN_NEWTONS = re.compile(r"([XYZ])[ _]?[\[(]?N[\])]?|([KMN])[ _]?[\[(]?N[ ·*.]?m[\])]?")
ANGLES = re.compile(r"\d+:(?:.*_)?(?:orientation|attitude)_\*")
"""Families of names whose three numbers are angles: a quaternion has a fourth."""
COUNTED_FROM_1 = {1, 2, 3, 4}
"""Places of a quaternion's parts as MAVLink and MATLAB count them, its `q1` to `q4`."""
_EAST_FIRST = {0: 1, 1: 0, 2: 2}
"""Places in east, north, up of those in north, east."""


NEAR_ONE = 1.1
"""Factor within which the length of a quaternion is 1."""
LARGEST_JUMP, NOISY = 5.0, 0.1
"""A depth that jumps by more metres, and by more of its range, from row to row is noise of something else."""


class Confidence(Enum):
    """How a unit and a column were found."""

    NAMED = "named"
    LIKELY = "likely"
    GUESSED = "guessed"


@dataclass(frozen=True)
class Choice:
    """Columns that a signal is proposed to be made of, and the reasons, in sentences.

    The first reason is that of its unit, empty if its name says it. mends: those of physics.
    """

    signal: str
    columns: Columns
    confidence: Confidence
    reasons: tuple[str, ...]
    mends: tuple[Mend, ...] = ()


@dataclass(frozen=True)
class Candidate:
    """Columns of one stream that may be a signal: by place, the field; the unit in their names; and a velocity's
    axes."""

    signal: str
    stream: Stream
    fields: dict[int, str]
    unit: str | None
    rank: int
    frame: str = BODY

    @property
    def names(self) -> str:
        return ", ".join(map(self.stream.full_name, self.fields.values()))

    @property
    def values(self) -> Array:
        return np.column_stack([self.stream.columns[self.fields[place]] for place in sorted(self.fields)])

    @property
    def moves(self) -> bool:
        """Whether any of its known values change."""
        known = self.values[np.isfinite(self.values).all(axis=1)]
        return len(known) > 1 and bool(np.ptp(known, axis=0).any())

    @property
    def drives_nothing(self) -> bool:
        """Whether these are outputs or speeds of thrusters that are 0 all the time, as an autopilot logs what no
        thruster is connected to."""
        return self.signal in ("pwm", "rpm") and not np.nan_to_num(self.values).any()

    @property
    def worth(self) -> tuple[bool, bool, bool, float, int, int]:
        """Larger is better: moves, is complete, is in body axes, of a favoured topic, well named, has more rows."""
        known = self.values[np.isfinite(self.values).all(axis=1)]
        complete = len(self.fields) >= WIDTHS.get(self.signal, 1)
        favoured = bool(re.search(FAVOURED.get(self.signal, "^$"), snake(self.stream.name)))
        return self.moves, complete, self.frame not in EARTH, float(favoured), -self.rank, len(known)


def candidates_in(stream: Stream, time: str) -> Iterable[Candidate]:
    sets: dict[tuple[str, str], dict[int, str]] = {}
    about: dict[tuple[str, str], tuple[str | None, int]] = {}
    frames: dict[tuple[str, str], str] = {}
    for field in stream.columns:
        name = named(stream.name, field)
        if name is None or field == time or name.place < 0 or not np.isfinite(stream.columns[field]).any():
            continue
        key = name.signal, name.family
        sets.setdefault(key, {}).setdefault(name.place, field)
        about.setdefault(key, (name.unit, name.rank))
        if name.frame and frames.get(key) != "ENU":
            frames[key] = name.frame
    _join_verticals(sets, frames)
    if {"N"} < {field for field in stream.columns if field in tuple(WRENCH)}:
        sets[("tau_cmd", WRENCH)] = {k: axis for k, axis in enumerate(WRENCH) if axis in stream.columns}
        about[("tau_cmd", WRENCH)] = None, 0
    if newtons := {
        WRENCH.index(of[1] or of[2]): of[0] for of in map(IN_NEWTONS.fullmatch, stream.columns) if of
    }:
        sets[("tau_cmd", WRENCH)] = newtons
        about[("tau_cmd", WRENCH)] = "N", 0
    if sets.get(("tau_cmd", WRENCH), {}).get(2) == "Z":
        sets = {
            key: fields for key, fields in sets.items() if key[0] != "depth" or "Z" not in fields.values()
        }
    for (signal, family), fields in sets.items():
        key = signal, family
        frame = frames.get(key, BODY)
        if frame == "ENU":
            fields = {_EAST_FIRST[place]: field for place, field in fields.items()}
        elif signal == "velocity" and OF_EARTH.search(snake(stream.name)):
            # ROS begins the names of its topics with a slash.
            frame = "ENU" if stream.name.startswith("/") else "NED"
        if signal == "quaternion" and fields.keys() == COUNTED_FROM_1:
            fields = {place - 1: field for place, field in fields.items()}
        if signal == "quaternion" and len(fields) == WIDTHS["euler"] and ANGLES.fullmatch(family):
            signal, fields = "euler", dict(enumerate(fields[place] for place in sorted(fields)))
        if signal == "euler" and fields.keys() == {PITCH_ANGLE} and _is_flat(stream, fields[PITCH_ANGLE]):
            fields = {HEADING: fields[PITCH_ANGLE]}
        yield Candidate(signal, stream, fields, *about[key], frame)


def _is_flat(stream: Stream, angle: str) -> bool:
    """Whether an angle is the theta beside x and y, without z, of a pose in the plane, which is the heading."""
    place = position_in(stream.columns)
    return snake(angle) == "theta" and place is not None and place[2] is None


def _join_verticals(
    sets: dict[tuple[str, str], dict[int, str]], frames: Mapping[tuple[str, str], str]
) -> None:
    """Join a lone velocity down, or up, to the body's velocity of the same name but for the axis, if z points so:
    with `speed_ahead`, `speed_down` is of the body, and with `speed_north` of the earth."""
    for key in [key for key, fields in sets.items() if frames.get(key) in EARTH and set(fields) == {2}]:
        for other, fields in sets.items():
            shares = other[0] == key[0] and other[1].partition(":")[2] == key[1].partition(":")[2]
            is_up = frames.get(other, BODY) == "FLU"
            if (
                shares
                and frames.get(other) not in EARTH
                and 2 not in fields
                and is_up == (frames[key] == "ENU")
            ):
                fields[2] = sets.pop(key)[2]
                break


def choices_of(candidates: Sequence[Candidate]) -> tuple[tuple[Choice, ...], list[str]]:
    """The best candidate of each signal, and notes on those that can't be used; of two attitudes the quaternion."""
    choices: list[Choice] = []
    notes: list[str] = []
    for signal in SIGNALS:
        usable: list[Candidate] = []
        still: list[Candidate] = []
        for candidate in candidates:
            if candidate.signal != signal:
                continue
            if candidate.frame in EARTH and len(candidate.fields) < WIDTHS["velocity"]:
                notes.append(
                    f"{candidate.names}: not used for velocity. It is a part of one in earth axes, and only the whole "
                    "can be turned to the body's."
                )
            elif not candidate.moves and (signal in MEASURED or candidate.drives_nothing):
                still.append(candidate)
            elif signal != "quaternion" or len(candidate.fields) == 4:
                usable.append(candidate)
        for candidate in sorted(usable, key=lambda each: each.worth, reverse=True):
            choice, note = _choice(candidate)
            if choice is not None:
                if choice.signal not in {each.signal for each in choices}:
                    choices.append(choice)
                break
            notes.append(note)
        if not usable:
            notes += [
                f"{each.names}: not used for {signal}. {'It' if len(each.fields) == 1 else 'They'} never "
                f"change{'s' if len(each.fields) == 1 else ''}, as where no sensor fills a field."
                for each in still
            ]
    names = {choice.signal for choice in choices}
    if "quaternion" in names:
        choices = [choice for choice in choices if choice.signal != "euler"]
    return tuple(choices), notes


def _choice(candidate: Candidate) -> tuple[Choice | None, str]:
    """A choice of a candidate's columns, or None and a note that says why it can't be used."""
    candidate = replace(candidate, fields=_used(candidate))
    signal, stream, fields = candidate.signal, candidate.stream, candidate.fields
    width = WIDTHS.get(signal)
    places = list(range(width)) if width else sorted(fields)
    # An attitude and a filtered velocity are known whole or not at all; of any other vector a part may be unknown.
    whole = signal in WHOLE or (signal == "velocity" and is_filtered(map(stream.full_name, fields.values())))
    missing = NOTHING if whole else None
    names = tuple(stream.full_name(fields[place]) if place in fields else missing for place in places)
    values = candidate.values
    named_unit = candidate.unit
    guess = Guess(named_unit, "") if named_unit else unit_of(signal, values)
    if signal == "pwm" and not named_unit and np.nanmax(np.abs(values)) > 1.0 and _are_forces(names):
        guess = Guess("N", "By their name, they are forces: taken for newtons.", False)
    if why_not := _is_none(signal, values):
        return None, f"{', '.join(filter(None, names))}: not used for {signal}. {why_not}"
    if signal == "specific_force" and named_unit and len(fields) == width:
        by_size = unit_of(signal, values)
        guess = guess if by_size.unit else by_size
    if signal == "pressure" and named_unit:
        guess = from_surface(values, named_unit) or guess
    if not guess.unit:
        return None, f"{', '.join(filter(None, names))}: not used for {signal}. {guess.reason}"
    confidence = (
        Confidence.GUESSED if not guess.is_telling else Confidence.NAMED if named_unit else Confidence.LIKELY
    )
    reasons = [guess.reason]
    if signal == "altitude" and np.nanmedian(values) < 0:
        signal = "depth"
        reasons = ["", "It is mostly below 0, so it is taken for a height, not for an altitude."]
    lacking = [str(k + 1) for k, name in enumerate(names) if name == missing]
    if lacking:
        of = (
            f"column {lacking[0]}, which is" if len(lacking) == 1 else f"columns {listed(lacking)}, which are"
        )
        reasons.append(f"Nothing is named for {of} taken for {'0' if whole else 'unknown'}.")
        confidence = Confidence.GUESSED
    if signal == "depth" and any(map(is_position_z, filter(None, names))):
        reasons.append("It is a position, which may count from elsewhere than the surface.")
    if signal in ("pwm", "rpm") and all(map(is_by_side, filter(None, names))):
        reasons.append("Port is taken for the vehicle file's first thruster, and starboard for its second.")
        confidence = Confidence.GUESSED
    if candidate.frame == "FLU":
        reasons.append("By its name, y is to port, so its axes are forward, left, up.")
    if candidate.frame in EARTH:
        reasons.append(f"By its name, it is in earth axes ({candidate.frame}), and the attitude turns it.")
    offset = (guess.offset,) * len(names) if guess.offset else ()
    scale = (guess.scale,) * len(names) if guess.scale != 1.0 else ()
    columns = Columns(names, guess.unit, offset, scale, candidate.frame)
    return Choice(signal, columns, confidence, tuple(reasons)), ""


def _is_none(signal: str, values: Array) -> str:
    """A sentence on values (n, columns) that can't be the quaternion or depth of their name; "" if they can."""
    known = values[np.isfinite(values).all(axis=1)]
    if signal == "quaternion":
        sizes = np.linalg.norm(known, axis=1)
        sizes = sizes[sizes > 0.0]
        usual = float(np.median(sizes)) if len(sizes) else 0.0
        if not 1.0 / NEAR_ONE < usual < NEAR_ONE or np.ptp(np.quantile(sizes, (0.05, 0.95))) > NEAR_ONE - 1.0:
            return (
                f"Their length is {usual:.2g} as a rule, and a quaternion's is 1: if they are angles, name them under "
                "`euler`."
            )
    if signal == "depth" and len(known) > 1:
        jump = float(np.median(np.abs(np.diff(known[:, 0]))))
        if jump > max(LARGEST_JUMP, NOISY * float(np.ptp(np.quantile(known, (0.05, 0.95))))):
            return f"It jumps by {jump:.3g} to and fro from row to row, as no depth in metres does."
    return ""


def _used(candidate: Candidate) -> dict[int, str]:
    """The fields of a candidate; of thrusters, without outputs that nothing is connected to."""
    if candidate.signal not in ("pwm", "rpm"):
        return candidate.fields
    driven = {
        place: field
        for place, field in candidate.fields.items()
        if np.nan_to_num(candidate.stream.columns[field]).any()
    }
    return driven or candidate.fields


def _are_forces(names: Iterable[str | None]) -> bool:
    return all(FORCE.search(snake(name)) for name in names if name)


def is_filtered(names: Iterable[str]) -> bool:
    """Whether the names of a velocity's columns say that it comes from a filter."""
    return any(FILTERED.search(snake(name)) for name in names)
