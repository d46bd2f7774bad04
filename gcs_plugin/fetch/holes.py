"""What nobody has of a dive: a vehicle that sent on while none of its frames was recorded.

A vehicle that said nothing shows none: its sequence numbers go on where they were. One that started anew was away for
a time that nobody knows: what it sent since is a hole, as far as its time since boot tells.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import decode, frame_at, message_id_at
from gcs_plugin.fetch.as_sent import SEQUENCES, sender, sequence

LEAST_US: Final = 2_000_000
TIMES: Final = 10
"""Longer than the usual time between two frames of the vehicle."""
LOOKED_AT: Final = 1000
"""Frames before and after a silence, for one that states the time since boot."""
_STATES: Final = frozenset(
    number for number, kind in dialect.mavlink_map.items() if "time_boot_ms" in kind.fieldnames
)


@dataclass(frozen=True)
class Hole:
    """`length_s` of a dive of which nobody has a frame, `after_s` after its first frame."""

    after_s: float
    length_s: float


def holes_in(records: Sequence[tuple[int, bytes]], source: tuple[int, int]) -> tuple[Hole, ...]:
    """The holes in what is recorded of a vehicle's component, by stamps in Unix microseconds that rise."""
    own = [(stamp_us, raw) for stamp_us, raw in records if sender(raw) == source]
    if len(own) < 2:
        return ()
    whole_us = own[-1][0] - own[0][0]
    found = []
    for place in range(1, len(own)):
        silent_us = own[place][0] - own[place - 1][0]
        if silent_us <= LEAST_US:
            continue
        sent = (sequence(own[place][1]) - sequence(own[place - 1][1])) % SEQUENCES
        if silent_us <= TIMES * (whole_us - silent_us) / (len(own) - 1) or sent == 1:
            continue
        length_us = min(silent_us, _since_start_us(own, place))
        if length_us > LEAST_US:
            found.append(Hole((own[place - 1][0] - records[0][0]) * 1e-6, length_us * 1e-6))
    return tuple(found)


def lost_in(records: Sequence[tuple[int, bytes]], source: tuple[int, int]) -> int:
    """How many frames of a vehicle's component lack elsewhere, at the least: sequence numbers come again after 255."""
    own = [(stamp_us, raw) for stamp_us, raw in records if sender(raw) == source]
    return sum(
        (sequence(after) - sequence(before) - 1) % SEQUENCES
        for (before_us, before), (after_us, after) in pairwise(own)
        if after_us - before_us <= LEAST_US and after != before
    )


def _since_start_us(own: Sequence[tuple[int, bytes]], place: int) -> float:
    """How long the vehicle had been on when it was heard again at `place`; infinite where it was on all the time."""
    before = _boot_us(reversed(own[max(0, place - LOOKED_AT) : place]))
    after = _boot_us(own[place : place + LOOKED_AT])
    if before is None or after is None or after[1] >= before[1]:
        return math.inf
    return after[1] - (after[0] - own[place][0])


def _boot_us(records: Iterable[tuple[int, bytes]]) -> tuple[int, int] | None:
    """The first stamp and time since boot that one of these frames states, in us."""
    for stamp_us, raw in records:
        if message_id_at(raw, 0) in _STATES and (frame := frame_at(raw, 0, len(raw))) is not None:
            message = decode(frame)
            if message is not None and message.time_boot_ms:
                return stamp_us, 1000 * int(message.time_boot_ms)
    return None
