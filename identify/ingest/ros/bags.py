"""Reads a bag of ROS 1 (`.bag`) or ROS 2 (`.mcap`, `.db3`, packed or not, or a folder of these) into streams, one for
each topic."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from bridge.arrays import Array
from bridge.errors import LogError
from identify.ingest.files.streams import Stream, Streams, some_of
from identify.ingest.ros.db3 import read_db3
from identify.ingest.ros.definitions import Types, definition_file, full_type, is_large, types_of
from identify.ingest.ros.fields import Undefined, columns_of
from identify.ingest.ros.mcap import read_mcap
from identify.ingest.ros.recorded import RECEIVED, STAMP, CutOff, Reader, Topic, of_packed
from identify.ingest.ros.rosbag1 import read_rosbag1
from identify.ingest.ros.thruster_topics import joined_thrusters
from identify.words import listed

_OF_ROS_2: dict[str, Reader] = {
    ".mcap": read_mcap,
    ".db3": read_db3,
    ".mcap.zstd": of_packed(read_mcap),
    ".db3.zstd": of_packed(read_db3),
}
READERS: dict[str, Reader] = {".bag": read_rosbag1, ".bag.active": read_rosbag1, **_OF_ROS_2}
"""By ending; a recorder of ROS 1 that was killed leaves a `.bag.active`."""
HEADER_STAMP = "header.stamp"
APART_S = 1.0
"""Longer than the way of any message from a sensor to the log."""
NONE = -1.0
"""First covariance of a quantity of an Imu that its sensor does not measure (sensor_msgs/Imu, REP 145)."""
OF_AN_IMU = ("orientation", "angular_velocity", "linear_acceleration")
AT_ONCE = 4096
"""Messages of a topic that are read at once: few enough to stay in the processor's memory."""


def read_bag(files: Sequence[Path]) -> Streams:
    """The topics of a bag that hold numbers, and notes on what was left out. `files` are its parts in their order.

    Columns are the numeric fields, `stamp`, the time in the messages' header in s, and `received`, the time of the log
    in Unix s. A topic without header times has those of the log as `stamp`. Topics that hold a single thruster each
    are joined in a further one. Images and clouds of points are left out.

    Raises LogError if there is nothing to read, or a library is missing.
    """
    topics: dict[str, _TopicColumns] = {}
    notes: list[str] = []
    cut: list[Path] = []
    left_out: set[str] = set()

    def wanted(topic: Topic) -> bool:
        """Whether a topic is read; it gets its place in `topics`, and otherwise a note."""
        is_damaged = not (topic.name + topic.type + topic.encoding).isprintable()
        if is_damaged or is_large(topic) or topic.name in left_out:
            return False
        if topic.encoding not in ("cdr", "ros1"):
            notes.append(
                f"Topic {topic.name} is in {topic.encoding or 'an unnamed encoding'}, which is not read; "
                "only messages of ROS are."
            )
            left_out.add(topic.name)
            return False
        before = topics.setdefault(topic.name, _TopicColumns(topic, types_of(topic, files[0])))
        if full_type(before.topic.type) != full_type(topic.type):
            notes.append(f"Topic {topic.name} also holds messages of type {topic.type}, which were left out.")
            return False
        return True

    for file in files:
        try:
            for topic, time_ns, message in READERS[ending_of(file)](file, wanted):
                topics[topic.name].add(time_ns, message)
        except CutOff:
            cut.append(file)
        except OSError as error:
            raise LogError(f"can't be read ({error.strerror}); give a recording that can", file) from None
    streams = [stream for topic in topics.values() if (stream := topic.stream(notes)) is not None]
    undefined = {name: topic.undefined for name, topic in topics.items() if topic.undefined}
    if undefined:
        types = sorted({full_type(topics[name].topic.type) for name in undefined})
        said = some_of([f"{name} ({kind})" for name, kind in undefined.items()])
        notes.append(
            f"Left out, since the bag does not define what they hold: {said}. Put the definition beside the bag, as "
            f"{definition_file(types[0])}, or record it as .mcap, which has the definitions."
        )
    if not streams and cut and not undefined:
        raise LogError(
            "is cut off or damaged before its first message with numbers, so nothing can be read; copy it again, or "
            "give another bag",
            cut[0],
        )
    notes += [f"{file.name} is cut off or damaged: all that is whole was read." for file in cut]
    if not streams:
        said = "".join(f" {note}" for note in notes[-1:])
        raise LogError(f"holds no message with numbers that can be read; check the bag.{said}", files[0])
    unstamped = [name for name, topic in topics.items() if not topic.is_stamped]
    if unstamped:
        notes.append(
            f"No header time in {some_of(unstamped)}: `{STAMP}` is when the log got a message, later by what the way "
            "takes; a diagnosis shows that as a delay."
        )
    return Streams((*streams, *joined_thrusters(streams)), tuple(notes))


def headers_apart(streams: Sequence[Stream], by_s: float = APART_S) -> str:
    """How far the headers of two topics are from each other, by the times at which the log got their messages, in
    words; "" if by less than `by_s`, or if these are no topics of a bag."""
    late_s: dict[str, float] = {}
    for stream in streams:
        if {STAMP, RECEIVED} <= stream.columns.keys():
            after_s = stream.columns[RECEIVED] - stream.columns[STAMP]
            if np.isfinite(after_s).any():
                late_s[stream.name] = float(np.nanmedian(after_s))
    if not late_s:
        return ""
    least, most = min(late_s, key=late_s.__getitem__), max(late_s, key=late_s.__getitem__)
    if late_s[most] - late_s[least] < by_s:
        return ""
    return (
        f"the log got {most} {late_s[most]:.3g} s after its headers' times, and {least} {late_s[least]:.3g} s"
    )


class _TopicColumns:
    """Collects the messages of a topic, and turns them into columns piece by piece, to hold few of them at a time."""

    def __init__(self, topic: Topic, types: Types) -> None:
        self.topic, self._types = topic, types
        self._messages: list[bytes] = []
        self._times_ns: list[int] = []
        self._pieces: list[dict[str, Array]] = []
        self.undefined = ""
        self._misfits = 0
        self.is_stamped = True

    def add(self, time_ns: int, message: bytes) -> None:
        if self.undefined:
            return
        self._messages.append(message)
        self._times_ns.append(time_ns)
        if len(self._messages) >= AT_ONCE:
            self._turn()

    def stream(self, notes: list[str]) -> Stream | None:
        """None for a topic without numbers; `notes` get a sentence on what was left out."""
        self._turn()
        if self.undefined:
            return None
        if self._misfits:
            of, fit, were = (
                ("message", "doesn't", "was") if self._misfits == 1 else ("messages", "don't", "were")
            )
            notes.append(
                f"{self._misfits} {of} of {self.topic.name} {fit} fit the definition of {self.topic.type} and {were} "
                "left out."
            )
        columns = _joined(self._pieces)
        if not columns.keys() - {RECEIVED, HEADER_STAMP}:
            return None
        if none := _without_unmeasured(columns):
            notes.append(
                f"By its covariance, {self.topic.name} does not measure {listed(none)}: taken for no reading."
            )
        stamp = columns.pop(HEADER_STAMP, None)
        if stamp is None:
            stamp = np.zeros(0)
        self.is_stamped = bool((stamp > 0).any())
        columns[STAMP] = columns[RECEIVED] if not self.is_stamped else np.where(stamp > 0, stamp, np.nan)
        return Stream(self.topic.name, columns, {})

    def _turn(self) -> None:
        if not self._messages:
            return
        try:
            columns, fits = columns_of(
                self._messages, full_type(self.topic.type), self._types, self.topic.encoding == "cdr"
            )
        except Undefined as undefined:
            kind, part = self.topic.type, str(undefined)
            self.undefined = kind if part == full_type(kind) else f"{kind}, of {part}"
        else:
            self._misfits += int(np.count_nonzero(~fits))
            columns[RECEIVED] = np.array(self._times_ns, np.float64) * 1e-9
            self._pieces.append({name: column[fits] for name, column in columns.items()})
        self._messages, self._times_ns = [], []


def _without_unmeasured(columns: dict[str, Array]) -> list[str]:
    """Make what an Imu says that it does not measure NaN in the columns; return the names of it."""
    none = []
    for name in OF_AN_IMU:
        covariance = columns.get(f"{name}_covariance.0")
        if covariance is None or not (unmeasured := covariance == NONE).any():
            continue
        none.append(name)
        for axis in "xyzw":
            if (field := f"{name}.{axis}") in columns:
                columns[field] = np.where(unmeasured, np.nan, columns[field])
    return none


def _joined(pieces: list[dict[str, Array]]) -> dict[str, Array]:
    """Columns of all pieces, behind each other; NaN where a piece lacks one."""
    names = dict.fromkeys(name for piece in pieces for name in piece)
    nothing = [np.full(len(piece[RECEIVED]), np.nan) for piece in pieces]
    return {
        name: np.concatenate([piece.get(name, empty) for piece, empty in zip(pieces, nothing, strict=True)])
        for name in names
    }


def ending_of(file: Path) -> str:
    """The ending of a bag, a key of READERS; "" for another file."""
    return next((ending for ending in READERS if file.name.lower().endswith(ending)), "")


def bag_files(folder: Path) -> Iterator[Path]:
    """The parts of a ROS 2 bag, which is a folder with a `metadata.yaml`, in the order of their numbers."""
    parts = [file for file in folder.iterdir() if ending_of(file) in _OF_ROS_2]
    yield from sorted(parts, key=lambda file: (len(file.name), file.name))
