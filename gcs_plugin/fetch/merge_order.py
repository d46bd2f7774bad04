"""The order of the merged frames of several recorders, and the gaps: times in which no recording has a frame.

Two recorders stamp the same frame milliseconds apart, so the stamps alone may swap neighbouring frames; each sender's
sequence numbers tell the order in which it sent them.
"""

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.wire.framing import MAGIC_2, decode, frame_at, message_id_at
from bridge.wire.silences import LEAST_S, silences
from gcs_plugin.sequences import SEQUENCES

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


WITHIN_US: Final = 250_000
NEAR: Final = 64
"""How many frames of its sender may have overtaken a frame. A number farther back means that the sender restarted, or
belongs to the next round of 256."""


def as_sent(records: Iterable[tuple[int, bytes]]) -> list[tuple[int, bytes]]:
    """Sort records with rising stamps, in us, so that each sender's frames follow its sequence; stamps stay put."""
    out: list[tuple[int, bytes]] = []
    tails: dict[tuple[int, int], list[int]] = defaultdict(list)
    for stamp_us, raw in records:
        tail = tails[sender(raw)]
        out.append((stamp_us, raw))
        tail.append(len(out) - 1)
        del tail[: -NEAR - 1]
        passed = 0
        for place in reversed(tail[:-1]):
            behind = (sequence(out[place][1]) - sequence(raw)) % SEQUENCES
            if not 0 < behind <= NEAR or stamp_us - out[place][0] > WITHIN_US:
                break
            passed += 1
        for after, place in zip(tail[: -passed - 2 : -1], tail[-2 : -passed - 2 : -1], strict=False):
            out[after] = out[after][0], out[place][1]
        if passed:
            place = tail[-passed - 1]
            out[place] = out[place][0], raw
    return out


def sender(raw: bytes) -> tuple[int, int]:
    """System and component of a complete frame."""
    return (raw[5], raw[6]) if raw[0] == MAGIC_2 else (raw[3], raw[4])


def sequence(raw: bytes) -> int:
    """Sequence number of a complete frame."""
    return raw[4] if raw[0] == MAGIC_2 else raw[2]
