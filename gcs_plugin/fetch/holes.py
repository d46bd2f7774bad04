"""What nobody has of a dive: a vehicle that sent on while none of its frames was recorded."""

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
    """`length_s` of a dive of which nobody has a frame, `after_s` after its first frame."""

    after_s: float
    length_s: float


def holes_in(records: Sequence[tuple[int, bytes]], source: tuple[int, int]) -> tuple[Hole, ...]:
    """The holes in what is recorded of a vehicle's component, in its order, by stamps in Unix microseconds."""
    own = [((stamp_us - records[0][0]) * 1e-6, raw) for stamp_us, raw in records if sender(raw) == source]
    found = silences(
        np.array([time_s for time_s, _ in own]),
        np.array([_boot_s(raw) for _, raw in own]),
        np.array([sequence(raw) for _, raw in own], np.int64),
    )
    return tuple(Hole(silence.begins_s, silence.seconds) for silence in found)


def lost_in(records: Sequence[tuple[int, bytes]], source: tuple[int, int]) -> int:
    """How many frames of a vehicle's component lack elsewhere, at the least: sequence numbers come again after 255."""
    own = [(stamp_us, raw) for stamp_us, raw in records if sender(raw) == source]
    return sum(
        (sequence(after) - sequence(before) - 1) % SEQUENCES
        for (before_us, before), (after_us, after) in pairwise(own)
        if after_us - before_us <= LEAST_S * 1e6 and after != before
    )


def _boot_s(raw: bytes) -> float:
    """The time since boot that a frame states; NaN for none."""
    if message_id_at(raw, 0) != _SYSTEM_TIME or (frame := frame_at(raw, 0, len(raw))) is None:
        return np.nan
    message = decode(frame)
    return np.nan if message is None else float(message.time_boot_ms) * 1e-3
