"""Put two recordings without a common frame on one clock, by the vehicle's time since boot in both."""

from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Frame, decode, frame_at, message_id_at
from gcs_plugin.fetch.boots import boots_heard
from gcs_plugin.fetch.one_clock import Anchor, Kept
from gcs_plugin.peers import SAME_BOOT_S

NEAREST: Final = 10
"""How many boot-clock messages on each side of a time are compared; the one with the least delay counts."""
_TELLS: Final = (dialect.MAVLINK_MSG_ID_SYSTEM_TIME, dialect.MAVLINK_MSG_ID_NAMED_VALUE_INT)


@dataclass(frozen=True)
class _Tick:
    """A SYSTEM_TIME message, times in us: its index, when it was recorded, the boot time it states, and the Unix time
    of boot by the vehicle's clock."""

    place: int
    stamp_us: int
    boot_us: int
    began_us: int


def by_boot_time(
    kept: Sequence[Kept], heard: Sequence[tuple[int, Frame]], source: tuple[int, int]
) -> list[Anchor]:
    """Date the boot-clock messages of `kept` by the clock of `heard`.

    Empty if the two recordings are of different boots, or state no boot time.
    """
    theirs = [
        (place, rec.stamp_us, frame)
        for place, rec in enumerate(kept)
        if message_id_at(rec.raw, 0) in _TELLS and (frame := frame_at(rec.raw, 0, len(rec.raw))) is not None
    ]
    ours = [
        (place, stamp_us, frame)
        for place, (stamp_us, frame) in enumerate(heard)
        if frame.message_id in _TELLS
    ]
    boots = [
        {boot.identity for boot in boots_heard(frame for _, _, frame in recorded)}
        for recorded in (theirs, ours)
    ]
    if all(boots) and not boots[0] & boots[1]:
        return []
    known = sorted(_ticks(ours, source), key=lambda tick: tick.boot_us)
    anchors = []
    for tick in _ticks(theirs, source):
        same = [rec for rec in known if abs(rec.began_us - tick.began_us) <= SAME_BOOT_S * 1e6]
        if not same:
            continue
        middle = bisect_left(same, tick.boot_us, key=lambda one: one.boot_us)
        near = same[max(0, min(middle, len(same)) - NEAREST) : middle + NEAREST]
        ahead_us = min(rec.stamp_us - rec.boot_us for rec in near)
        anchors.append(Anchor(tick.place, tick.boot_us + ahead_us - tick.stamp_us))
    return anchors


def _ticks(told: Iterable[tuple[int, int, Frame]], source: tuple[int, int]) -> list[_Tick]:
    ticks = []
    for place, stamp_us, frame in told:
        if frame.message_id != _TELLS[0] or (frame.system, frame.component) != source:
            continue
        message = decode(frame)
        if message is not None and message.time_unix_usec:
            boot_us = 1000 * int(message.time_boot_ms)
            ticks.append(_Tick(place, stamp_us, boot_us, int(message.time_unix_usec) - boot_us))
    return ticks
