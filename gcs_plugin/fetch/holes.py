"""Find the gaps in a dive: times at which the vehicle sent frames and no recording has any of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import decode, frame_at, message_id_at
from bridge.silences import LEAST_S, silences
from gcs_plugin.fetch.as_sent import SEQUENCES, sender, sequence

_SYSTEM_TIME: Final[int] = dialect.MAVLINK_MSG_ID_SYSTEM_TIME


@dataclass(frozen=True)
class Hole:
    """A gap of `length_s` in which no recording has a frame, beginning `after_s` after the dive's first frame."""

    after_s: float
    length_s: float


def holes_in(records: Sequence[tuple[int, bytes]], source: tuple[int, int]) -> tuple[Hole, ...]:
    """Return the gaps in the records of a vehicle's component, in recorded order, with stamps in Unix microseconds."""
    frames = [((stamp_us - records[0][0]) * 1e-6, raw) for stamp_us, raw in records if sender(raw) == source]
    gaps = silences(
        np.array([time_s for time_s, _ in frames]),
        np.array([_boot_s(raw) for _, raw in frames]),
        np.array([sequence(raw) for _, raw in frames], np.int64),
    )
    return tuple(Hole(silence.begins_s, silence.seconds) for silence in gaps)


def lost_in(records: Sequence[tuple[int, bytes]], source: tuple[int, int]) -> int:
    """Count the component's frames missing outside the gaps; a lower bound, as sequence numbers wrap at 256."""
    frames = [(stamp_us, raw) for stamp_us, raw in records if sender(raw) == source]
    return sum(
        (sequence(after) - sequence(before) - 1) % SEQUENCES
        for (before_us, before), (after_us, after) in pairwise(frames)
        if after_us - before_us <= LEAST_S * 1e6 and after != before
    )


def _boot_s(raw: bytes) -> float:
    """Time since boot that a SYSTEM_TIME frame states, in s; NaN for any other frame."""
    if message_id_at(raw, 0) != _SYSTEM_TIME or (frame := frame_at(raw, 0, len(raw))) is None:
        return np.nan
    message = decode(frame)
    return np.nan if message is None else float(message.time_boot_ms) * 1e-3
