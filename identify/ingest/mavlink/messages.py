"""Messages of one vehicle in a recording of many senders, on its boot clock, and its silences.

A vehicle is a MAVLink system that sends telemetry. Its components may each count time from their own start. The
component with the most messages sets the clock; the others are shifted by their times of arrival, and so are messages
without a time. The difference of two clocks is the least arrival time minus boot time in every ten seconds: that of
the frame that came quickest.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.clock import OLDEST_UNIX_S
from bridge.errors import LogError
from bridge.wire.framing import MAGIC_2
from bridge.wire.silences import Silence, longest, silences, way_to_mend
from identify.checks.readings.impossible import WILD_S, tame
from identify.dive import Kind, Note
from identify.ingest.mavlink.frames import HEADER_1, HEADER_2, Fields, Frames, Rows

CLEARLY_MORE = 5.0
REBOOT_S = 2.0
LONGEST_BOOT_S = 1e9
BLOCK_S = 10.0
SET_S = 0.25  # a recorder's clock that jumps by more was set
APART_S = 5.0  # between the boot times of two clocks, by when they arrived; late frames are less late
TURNS, TURN_S = 6, 20.0  # so often in succession, within that time each, two clocks are heard in turn
MOST_RUNS = 20  # that are read; a recording of two vehicles seems to restart thousands of times
WRAP_S = 2**32 * 1e-6
NEAR_S, NEARLY_ALL = 1.0, 0.95  # when a driver's stamps count as being on the vehicle's clock

# Sent only by devices aboard, so that their sender is a vehicle.
TELEMETRY = (
    "HIGHRES_IMU", "ODOMETRY", "ATTITUDE", "ATTITUDE_QUATERNION", "ACTUATOR_OUTPUT_STATUS",
    "SERVO_OUTPUT_RAW", "DEBUG_FLOAT_ARRAY", "LOCAL_POSITION_NED", "SCALED_IMU2", "RAW_IMU",
    "SCALED_PRESSURE2", "GLOBAL_POSITION_INT", "DISTANCE_SENSOR",
)  # fmt: skip
# Messages that set the clock: each of them states a boot time.
TIMED = (
    "HIGHRES_IMU", "ODOMETRY", "ATTITUDE", "ATTITUDE_QUATERNION", "ACTUATOR_OUTPUT_STATUS",
    "LOCAL_POSITION_NED", "SCALED_IMU2", "SCALED_PRESSURE2", "GLOBAL_POSITION_INT", "DISTANCE_SENSOR",
    "NAMED_VALUE_FLOAT", "SYSTEM_TIME",
)  # fmt: skip


@dataclass(frozen=True)
class _ClockOffset:
    """Arrival time minus boot time in seconds, by row. `boot_s`: the latest boot time up to each of these rows;
    `last_s`: the latest of all. A clock that began anew goes on for all that: `added_s` (k,), from 0 on, is what the
    times of each of its starts lack."""

    row: Array
    offset_s: Array
    boot_s: Array
    last_s: float
    added_s: Array

    def at(self, rows: Array | Rows) -> Array:
        return np.interp(rows, self.row, self.offset_s)

    def row_of(self, boot_s: Array) -> Array:
        """The row (n,), as a fraction, that belongs to each boot time: messages of one stamp get the same."""
        return np.interp(boot_s, self.boot_s, self.row)

    def going_on(self, stated_s: Array, arrived_s: Array) -> Array:
        """Stated boot times (n,) on the clock that goes on, of the start that is nearest to when they arrived on it."""
        each = stated_s[:, None] + self.added_s
        return np.take_along_axis(each, np.abs(each - arrived_s[:, None]).argmin(axis=1)[:, None], axis=1)[
            :, 0
        ]


@dataclass(frozen=True)
class Batch:
    """Messages of a kind: boot times (n,), strictly increasing, in s, and their fields. False without any."""

    time_s: Array
    fields: Fields

    def __len__(self) -> int:
        return len(self.time_s)

    def columns(self, *names: str) -> Array:
        """The named fields as (n, k)."""
        return np.column_stack([self.fields[name].astype(np.float64) for name in names])

    @property
    def components(self) -> NDArray[np.int64]:
        """The sender (n,) of each message: its component."""
        return self.fields.frames.component[self.fields.rows]


@dataclass(frozen=True)
class Messages:
    """A vehicle's messages. `taken` are the rows of a run without a restart, `span_s` its length in boot time;
    `twins`: two vehicles speak under its address in the recording."""

    frames: Frames
    system: int
    primary: int
    taken: slice
    span_s: float
    clocks: dict[int, _ClockOffset]
    notes: tuple[str, ...]
    twins: bool

    @property
    def began_unix_s(self) -> float:
        """Arrival time of the run's first frame."""
        return float(self.frames.arrival_s[self.taken.start])

    @property
    def arrived_at_boot_s(self) -> float | None:
        """Arrival time that belongs to boot time 0, from the run's beginning on; None if the stamps are no dates."""
        if self.began_unix_s < OLDEST_UNIX_S:
            return None
        return float(self.clocks[self.primary].at(np.array([self.taken.start]))[0])

    def get(self, name: str, **equal: Any) -> Batch:
        """The messages called `name`.

        `equal` asks for fields of a certain value (`id=0`). If several components send the message, the most frequent
        sender's messages are taken.
        """
        fields = self._of_vehicle(name)
        keep = np.ones(len(fields), np.bool_)
        for field, value in equal.items():
            keep &= fields[field] == value
        return self._batch(fields.at(keep))

    def components(self, name: str) -> set[int]:
        """The vehicle's components that send the messages called `name`."""
        return set(self.frames.component[self._of_vehicle(name).rows].tolist())

    def by_name(self, name: str) -> dict[str, Batch]:
        """The messages called `name`, grouped by their own field `name`, as in NAMED_VALUE_FLOAT."""
        fields = self._of_vehicle(name)
        names = fields["name"]
        return {
            value.decode("ascii", "replace"): self._batch(fields.at(names == value))
            for value in np.unique(names)
        }

    def get_from_anyone(self, name: str) -> Batch:
        """As `get`, but from any system: a driver may send under a ground station's id.

        Dated by arrival, unless nearly all messages state a time close to the vehicle's boot time at their arrival.
        """
        rows = self._rows(name)
        fields = Fields(self.frames, name, rows)
        arrived, stated = self._arrival_boot_s(rows), stated_s(fields)
        is_near = np.abs(stated - arrived) < NEAR_S
        are_near = np.count_nonzero(is_near) > NEARLY_ALL * len(rows)
        return _rising(np.where(is_near, stated, arrived) if are_near else arrived, fields)

    def _of_vehicle(self, name: str) -> Fields:
        rows = self._rows(name)
        return Fields(self.frames, name, rows[self.frames.system[rows] == self.system])

    def _batch(self, fields: Fields) -> Batch:
        components = self.frames.component[fields.rows]
        sender = int(np.argmax(np.bincount(components, minlength=1)))
        sent = fields.at(components == sender)
        return _rising(self._boot_s(sent, sender), sent)

    def _rows(self, name: str) -> Rows:
        rows = self.frames.rows(name)
        inside: Rows = rows[(rows >= self.taken.start) & (rows < self.taken.stop)]
        return inside

    def _arrival_boot_s(self, rows: Rows) -> Array:
        return self.frames.arrival_s[rows] - self.clocks[self.primary].at(rows)

    def _boot_s(self, fields: Fields, component: int) -> Array:
        by_arrival = self._arrival_boot_s(fields.rows)
        own_clock = self.clocks.get(component)
        if own_clock is None:
            return by_arrival
        arrived = self.frames.arrival_s[fields.rows] - own_clock.at(fields.rows)
        stated = own_clock.going_on(stated_s(fields), arrived)
        stated[stated > own_clock.last_s + WILD_S] = np.nan
        if "time_usec" in fields and fields["time_usec"].dtype == np.dtype("<u4"):
            stated += np.round((arrived - stated) / WRAP_S) * WRAP_S
        stated[stated < own_clock.boot_s[0] - WILD_S] = np.nan
        at = own_clock.row_of(stated)
        stated += own_clock.at(at) - self.clocks[self.primary].at(at)
        return np.where(np.isfinite(stated), stated, by_arrival)


def stated_s(fields: Fields) -> Array:
    """Boot time that each message states, in s; NaN if it states none, or a Unix time, or if all of several state 0."""
    units_s = {"time_boot_ms": 1e-3, "time_usec": 1e-6, "usec": 1e-6}
    name = next((name for name in units_s if name in fields), None)
    if name is None:
        return np.full(len(fields), np.nan)
    time_s = fields[name].astype(np.float64) * units_s[name]
    states_none = len(time_s) > 1 and not time_s.any()
    return np.where((time_s < LONGEST_BOOT_S) & (not states_none), time_s, np.nan)


def vehicle_runs(frames: Frames, source: str) -> tuple[Messages, ...]:
    """The messages of the vehicle in `frames`, split at restarts, in their order.

    Only the `MOST_RUNS` longest runs. Raises LogError for no vehicle, or more than one.
    """
    system, system_notes = vehicle_system(frames, source)
    components = [int(c) for c in np.unique(frames.component[frames.system == system])]
    timed = {component: timed_rows(frames, system, component) for component in components}
    stating = sum(len(rows) for rows, _ in timed.values())
    # A few rows whose time lies far from those around them are left out; a restart shifts all later times and stays.
    among = {component: tame(frames.arrival_s[rows] - time_s) for component, (rows, time_s) in timed.items()}
    timed = {
        component: (rows[among[component]], time_s[among[component]])
        for component, (rows, time_s) in timed.items()
        if among[component].any()
    }
    wild = stating - sum(len(rows) for rows, _ in timed.values())
    state, they = ("message states", "it") if wild == 1 else ("messages state", "they")
    wild_notes = (f"{wild} {state} a time that can't be; when {they} arrived is taken.",) if wild else ()
    if not timed:
        raise LogError(
            f"none of system {system}'s messages carries a boot time; record its full telemetry", source
        )
    primary = max(timed, key=lambda component: len(timed[component][0]))
    twins = two_clocks(frames.arrival_s[timed[primary][0]], timed[primary][1])
    made = []
    for taken, span_s in _runs(len(frames), *timed[primary]):
        clocks = {}
        for component, (rows, time_s) in timed.items():
            inside = (rows >= taken.start) & (rows < taken.stop)
            if inside.any():
                clocks[component] = _clock(frames, rows[inside], time_s[inside])
        notes = system_notes + wild_notes
        made.append(Messages(frames, system, primary, taken, span_s, clocks, notes, twins))
    return tuple(made)


def vehicle_system(frames: Frames, source: str) -> tuple[int, tuple[str, ...]]:
    """System id of the vehicle, and notes. Raises LogError for no vehicle, or several with similar message counts."""
    rows = np.concatenate([frames.rows(name) for name in TELEMETRY])
    systems, counts = np.unique(frames.system[rows], return_counts=True)
    if len(systems) == 0:
        raise LogError(
            f"holds {len(frames)} MAVLink frame{'' if len(frames) == 1 else 's'} but no vehicle's telemetry; record "
            "the vehicle's own link",
            source,
        )
    order = np.argsort(-counts)
    best, others = int(order[0]), order[1:]
    if len(others) == 0:
        return int(systems[best]), ()
    said = ", ".join(
        f"system {systems[i]} ({counts[i]} message{'' if counts[i] == 1 else 's'})" for i in order
    )
    if counts[best] < CLEARLY_MORE * counts[others[0]]:
        raise LogError(
            f"several vehicles speak in it, {said}; split the recording, one vehicle a file", source
        )
    return int(systems[best]), (f"Several senders of telemetry: {said}; system {systems[best]} is taken.",)


def timed_rows(frames: Frames, system: int, component: int) -> tuple[Rows, Array]:
    """Rows of a component's messages that state a boot time, in their order, and these times in s."""
    all_rows: list[Rows] = []
    all_times: list[Array] = []
    for name in TIMED:
        rows = frames.rows(name)
        rows = rows[(frames.system[rows] == system) & (frames.component[rows] == component)]
        if len(rows) == 0:
            continue
        time_s = stated_s(Fields(frames, name, rows))
        good = np.isfinite(time_s)
        all_rows.append(rows[good])
        all_times.append(time_s[good])
    if not all_rows:
        return np.zeros(0, np.int64), np.zeros(0)
    joined, times = np.concatenate(all_rows), np.concatenate(all_times)
    order = np.argsort(joined, kind="stable")
    return joined[order], times[order]


def _runs(total: int, rows: Rows, time_s: Array) -> list[tuple[slice, float]]:
    """Stretches in which the boot time does not run back: their rows, and the length of each in s."""
    back = np.flatnonzero(np.diff(time_s) < -REBOOT_S) + 1
    starts, ends = [0, *back.tolist()], [*back.tolist(), len(rows)]
    edges = [0, *rows[back].tolist(), total]
    spans_s = [float(np.ptp(time_s[a:b])) for a, b in zip(starts, ends, strict=True)]
    longest = sorted(np.argsort(spans_s, kind="stable")[-MOST_RUNS:].tolist())
    return [(slice(edges[i], edges[i + 1]), spans_s[i]) for i in longest]


def two_clocks(arrival_s: Array, time_s: Array) -> bool:
    """Whether boot times (n,) that arrived at `arrival_s` (n,) are of two clocks in turn, so of two vehicles.

    A restart changes the clock once, and the old one is not heard again. Vehicles that were switched on within APART_S
    of each other are not told apart.
    """
    booted_s = arrival_s - time_s
    turn = np.flatnonzero(np.abs(np.diff(booted_s)) > APART_S) + 1
    if len(turn) <= TURNS:
        return False
    # After each turn the clock goes on that was left by the turn before.
    goes_on = np.abs(booted_s[turn[1:]] - booted_s[turn[:-1] - 1]) <= APART_S
    goes_on &= np.diff(arrival_s[turn]) <= TURN_S
    return bool(np.any(np.convolve(goes_on, np.ones(TURNS), "valid") == TURNS))


def _clock(frames: Frames, rows: Rows, time_s: Array) -> _ClockOffset:
    offset, added_s, set_at = frames.arrival_s[rows] - time_s, [0.0], list[int]()
    time_s = time_s.copy()
    for at, by_s in _set_at(offset, time_s):
        if time_s[at] - time_s[at - 1] < -REBOOT_S:
            time_s[at:] += by_s
            offset[at:] -= by_s
            added_s.append(added_s[-1] + by_s)
        else:
            set_at.append(at)
    latest_s = np.maximum.accumulate(time_s)
    parts: list[Array] = []
    first_row = rows[0]
    for begin, end in pairwise([0, *set_at, len(rows)]):
        # Never more than rows: the span is only as good as the recording's times.
        blocks = min(max(1, int(np.ptp(time_s[begin:end]) / BLOCK_S)), end - begin)
        starts = np.unique(np.linspace(begin, end, blocks, endpoint=False).astype(np.int64))
        least = np.minimum.reduceat(offset[:end], starts)
        parts.append(np.column_stack([rows[starts], least, latest_s[starts]]))
        parts[-1][0, 0] = first_row
        if end < len(rows):
            between_s = frames.arrival_s[rows[end - 1] : rows[end] + 1]
            last_row = rows[end - 1] + int(np.abs(np.diff(between_s)).argmax())
            parts.append(np.array([[last_row, least[-1], latest_s[end - 1]]]))
            first_row = last_row + 1
    row, least, boot_s = np.concatenate(parts).T
    return _ClockOffset(row, least, boot_s, float(latest_s[-1]), np.array(added_s))


def _set_at(offset: Array, time_s: Array) -> list[tuple[int, float]]:
    """Where the recorder's clock was set, or the sender's began anew, and by how many seconds: the offset (n,) of its
    times from boot times (n,) jumps, and stays there for BLOCK_S. After a link that stalled, it falls back."""
    near = round(BLOCK_S * len(offset) / max(float(np.ptp(time_s)), BLOCK_S))
    least = max(near // 5, 1)
    set_at: list[tuple[int, float]] = []
    for at in (np.flatnonzero(np.abs(np.diff(offset)) > SET_S) + 1).tolist():
        since = max([at - near, 0, *(each for each, _ in set_at[-1:])])
        if at - since < least or len(offset) - at < least:
            continue
        by_s = offset[at : at + near].min() - offset[since:at].min()
        if abs(by_s) > SET_S and abs(offset[at] - offset[at - 1] - by_s) < 0.5 * abs(by_s):
            set_at.append((at, float(by_s)))
    return set_at


def _rising(time_s: Array, fields: Fields) -> Batch:
    """Sort by time and keep the first of equal times: a recording of two links holds messages twice."""
    unique_s, first = np.unique(time_s, return_index=True)
    return Batch(unique_s, fields.at(first))


BOOT_ID: Final = b"BOOT_ID"
"""Name under which a vehicle that keeps its own recording sends its boot id."""
NAME_AT: Final = 8
"""Offset of the name in NAMED_VALUE_INT, after time and value."""


def silences_of(frames: Frames, system: int) -> tuple[Silence, ...]:
    """Silences of the component of `system` that sends most, by the Unix time of the recording."""
    rows = np.flatnonzero(frames.system == system)
    if not len(rows):
        return ()
    component = int(np.argmax(np.bincount(frames.component[rows])))
    rows = rows[frames.component[rows] == component]
    return silences(frames.arrival_s[rows], boot_times_s(frames, rows), sequence(frames, rows))


def unheard_notes(frames: Frames, system: int) -> tuple[str, ...]:
    """A note on the silences and on who may have the missing frames; empty without silences."""
    silences = silences_of(frames, system)
    return (note(frames, silences, keeps_ring(frames, system)),) if silences else ()


def note(frames: Frames, pauses: Sequence[Silence], ring: bool) -> str:
    """Describe the longest silence and how to get the frames; "" without silences. `ring`: the vehicle keeps a
    recording.
    """
    worst = longest(pauses)
    if worst is None:
        return ""
    begins_s = max(0.0, worst.begins_s - float(frames.arrival_s[0]))
    more = {1: "", 2: ", and once more for less"}.get(
        len(pauses), f", and {len(pauses) - 1} times more for less"
    )
    sentence = f"Nothing was heard of the vehicle for {worst.seconds:.0f} s at a stretch"
    return Note(f"{sentence}, from {clock(begins_s)} on{more}: {way_to_mend(ring)}.", Kind.UNHEARD)


def clock(seconds: float) -> str:
    """A time in a recording in completed seconds, such as `0:18` or `1:02:03`."""
    minutes, seconds_left = divmod(int(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{seconds_left:02d}" if hours else f"{minutes}:{seconds_left:02d}"


def keeps_ring(frames: Frames, system: int) -> bool:
    """Whether the vehicle reports that it keeps its own recording."""
    rows = frames.rows("NAMED_VALUE_INT")
    starts = frames.start[rows[frames.system[rows] == system]]
    name = np.frombuffer(BOOT_ID, np.uint8)
    at = starts[:, None] + NAME_AT + np.arange(len(name))
    return bool((frames.data[np.minimum(at, len(frames.data) - 1)] == name).all(axis=1).any())


def boot_times_s(frames: Frames, rows: Rows) -> Array:
    """Boot times (n,) that a component's frames in `rows` state, NaN if they state none."""
    system, component = int(frames.system[rows[0]]), int(frames.component[rows[0]])
    stating, stated = timed_rows(frames, system, component)
    boot_s = np.full(len(rows), np.nan)
    boot_s[np.searchsorted(rows, stating)] = stated
    return boot_s


def sequence(frames: Frames, rows: Rows) -> NDArray[np.int64]:
    """Sequence numbers (n,), from the header before each payload."""
    data, start = frames.data, frames.start[rows]
    head = np.maximum(start - HEADER_2, 0)
    second = (data[head] == MAGIC_2) & (data[head + 5] == frames.system[rows])
    second &= (data[head + 6] == frames.component[rows]) & (start >= HEADER_2)
    return np.where(second, data[head + 4], data[start - HEADER_1 + 2]).astype(np.int64)
