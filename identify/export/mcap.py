"""Topics as an MCAP file, which Foxglove and PlotJuggler open.

Messages are of ROS 2 (CDR, with their definitions in the file): both programs read these without further files, they
are rows of binary numbers, and unlike JSON they hold NaN, which stands for a reading that is unknown.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from identify.export.signals import PlotTopic
from identify.ingest.extras import library
from identify.ingest.ros.recorded import EXTRA

PROFILE, DEFINED_AS, ENCODED_AS = "ros2", "ros2msg", "cdr"
LEAD = b"\x00\x01\x00\x00"
"""Begins a message in CDR: little-endian numbers, which follow each other without gaps if all have 8 bytes."""
PACKAGE = "seatrial_msgs"
TIME = "time_s"
NANOSECONDS = 1_000_000_000


@dataclass(frozen=True)
class Written:
    """What an MCAP file holds: messages by topic, and the Unix s that were added to the dive's times."""

    messages: Mapping[str, int]
    origin_s: float


def write_mcap(
    file: BinaryIO, topics: Sequence[PlotTopic], unix_at_boot_s: float | None, about: Mapping[str, str]
) -> Written:
    """Write topics in the order of their times; `about` becomes the file's metadata.

    The log's time is the dive's, in Unix time where the dive knows that; each message also has the dive's own time in
    full precision, as `time_s`. Times before 0 are counted from the whole second before the first. Raises LogError if
    the library is missing.
    """
    writers = library("mcap.writer", EXTRA, Path(str(getattr(file, "name", "mcap"))))
    writer = writers.Writer(file)
    writer.start(PROFILE, "seatrial")
    origin_ns = _origin_ns(topics, unix_at_boot_s)
    channels = [_channel(writer, topic) for topic in topics]
    times_ns = [origin_ns + np.rint(topic.time_s * NANOSECONDS).astype(np.int64) for topic in topics]
    rows = [np.column_stack([topic.time_s, topic.value]).astype("<f8") for topic in topics]
    of = np.repeat(np.arange(len(topics)), [len(each) for each in times_ns])
    places = np.concatenate([np.arange(len(each)) for each in times_ns] or [of])
    order = np.argsort(np.concatenate(times_ns or [of]), kind="stable")
    for k, row in zip(of[order].tolist(), places[order].tolist(), strict=True):
        time_ns = int(times_ns[k][row])
        writer.add_message(channels[k], time_ns, LEAD + rows[k][row].tobytes(), time_ns, row)
    writer.add_metadata("seatrial", dict(about))
    writer.finish()
    return Written({topic.name: len(topic.time_s) for topic in topics}, origin_ns / NANOSECONDS)


def _origin_ns(topics: Sequence[PlotTopic], unix_at_boot_s: float | None) -> int:
    if unix_at_boot_s is not None:
        # Unix time in nanoseconds has more digits than a float.
        whole_s, part_s = divmod(unix_at_boot_s, 1.0)
        return int(whole_s) * NANOSECONDS + round(part_s * NANOSECONDS)
    start_s = min((float(topic.time_s[0]) for topic in topics), default=0.0)
    return NANOSECONDS * -int(np.floor(min(start_s, 0.0)))


def _channel(writer: Any, topic: PlotTopic) -> int:
    last = "".join(word.capitalize() for word in topic.name.replace("/", "_").split("_"))
    definition = "".join(f"float64 {field}\n" for field in (TIME, *topic.fields))
    schema = writer.register_schema(f"{PACKAGE}/msg/{last}", DEFINED_AS, definition.encode("ascii"))
    return int(writer.register_channel(topic.name, ENCODED_AS, schema, {"offered_qos_profiles": ""}))
