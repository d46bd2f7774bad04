"""Joins topics that hold a single thruster each, as simulators on Gazebo publish them, into a topic of all.

A column map takes the commands of all thrusters from a single topic, whose times they have.
"""

import re
from collections.abc import Sequence

import numpy as np

from bridge.arrays import Array
from identify.ingest.files.streams import Stream
from identify.ingest.ros.recorded import RECEIVED, STAMP

_OF_A_THRUSTER = re.compile(r"(.*(?:thruster|propeller|motor|esc)s?[/_]?)(\d+)(.*)", re.IGNORECASE)
_OF_THE_HEADER = re.compile(r"header(\..*)?")


def joined_thrusters(streams: Sequence[Stream]) -> tuple[Stream, ...]:
    """A stream for each set of two or more topics of a bag that are named alike but for the number of a thruster, and
    hold a single number each.

    It is named with `*` for that number, `/rov/thrusters/*/thrust`, and has a column for each thruster, `data.0`. Its
    times are those of the first; of the others the nearest message counts, and is unknown where none is within a usual
    step.
    """
    sets: dict[tuple[str, str], dict[int, tuple[Stream, str]]] = {}
    for stream in streams:
        match = _OF_A_THRUSTER.fullmatch(stream.name)
        fields = [name for name in stream.columns if name not in (RECEIVED, STAMP)]
        fields = [name for name in fields if not _OF_THE_HEADER.fullmatch(name)]
        if match and len(fields) == 1:
            topic = f"{match[1]}*{match[3]}"
            sets.setdefault((topic, fields[0]), {})[int(match[2])] = (stream, fields[0])
    return tuple(_joined(topic, of) for (topic, _), of in sets.items() if len(of) > 1)


def _joined(topic: str, thrusters: dict[int, tuple[Stream, str]]) -> Stream:
    first, _ = thrusters[min(thrusters)]
    stamps = first.columns[STAMP]
    columns = {
        f"{field}.{number}": _nearest(stamps, stream.columns[STAMP], stream.columns[field])
        for number, (stream, field) in sorted(thrusters.items())
    }
    return Stream(topic, {**columns, RECEIVED: first.columns[RECEIVED], STAMP: stamps}, {})


def _nearest(time_s: Array, stamps: Array, values: Array) -> Array:
    """The values (m,) of the nearest stamps (m,) to each time (n,); NaN further away than a usual step of times."""
    known = np.flatnonzero(np.isfinite(stamps))
    known = known[np.argsort(stamps[known], kind="stable")]
    steps = np.diff(np.unique(time_s[np.isfinite(time_s)]))
    if not len(known) or not len(steps):
        return np.full(len(time_s), np.nan)
    at = np.nan_to_num(time_s)
    after = np.clip(np.searchsorted(stamps[known], at), 1, max(len(known) - 1, 1))
    sides = known[np.stack([after - 1, np.minimum(after, len(known) - 1)])]
    apart_s = np.abs(stamps[sides] - time_s)
    nearer = np.where(apart_s[0] <= apart_s[1], sides[0], sides[1])
    return np.where(np.min(apart_s, axis=0) <= np.median(steps), values[nearer], np.nan)
