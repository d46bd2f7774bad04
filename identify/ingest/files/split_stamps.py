"""Stamps that a table holds as two columns, whole seconds and the nanoseconds beyond them, as ROS keeps its times.

By the seconds alone, all rows of a second would come at one time.
"""

import re
from dataclasses import replace
from typing import Final

import numpy as np

from bridge.arrays import Array, Mask
from identify.ingest.files.streams import Stream, Streams
from identify.ingest.mapping.names import snake

SECONDS: Final = re.compile(r"(?:(.*)_)?secs?")
NANOSECONDS: Final = re.compile(r"(?:(.*)_)?n(?:ano)?secs?")
ALONE: Final = "stamp"
"""Name of a stamp whose columns are named by their units alone."""
SECOND_NS: Final = 1e9


def with_whole_stamps(streams: Streams) -> Streams:
    """The contents of files with each split stamp as one more column, in s: `header.stamp` of `header.stamp.sec` and
    `header.stamp.nanosec`."""
    whole, empty = list[Stream](), dict[str, Mask](streams.empty)
    for stream in streams.streams:
        stamps = dict[str, Array]()
        for name, seconds, beyond in _split(stream):
            stamps[name] = stream.columns[seconds] + stream.columns[beyond] / SECOND_NS
            if (blank := empty.get(stream.full_name(seconds))) is not None:
                empty[stream.full_name(name)] = blank
        dates = stream.dates | stamps.keys()
        whole.append(replace(stream, columns={**stream.columns, **stamps}, dates=dates) if stamps else stream)
    return replace(streams, streams=tuple(whole), empty=empty)


def _split(stream: Stream) -> list[tuple[str, str, str]]:
    """Of each split stamp of a stream, the name of the whole and its columns of seconds and of nanoseconds."""
    beyond = {match[1]: name for name in stream.columns if (match := NANOSECONDS.fullmatch(snake(name)))}
    stamps = []
    for name in stream.columns:
        match = SECONDS.fullmatch(snake(name))
        if match is None or match[1] not in beyond:
            continue
        stem = re.sub(r"[^A-Za-z0-9]*secs?$", "", name, flags=re.IGNORECASE) or ALONE
        if (
            stem not in stream.columns
            and stem not in stream.text
            and _is_beyond(stream.columns[beyond[match[1]]])
        ):
            stamps.append((stem, name, beyond[match[1]]))
    return stamps


def _is_beyond(nanoseconds: Array) -> bool:
    """Whether a column (n,) counts on within its second."""
    known = nanoseconds[np.isfinite(nanoseconds)]
    return len(known) > 0 and bool((known >= 0).all() and (known < SECOND_NS).all() and known.max() > 0)
