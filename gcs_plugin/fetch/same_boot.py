"""Two recordings without a frame in common, on one clock by the time since boot that one vehicle told in both."""

from bisect import bisect_left
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Frame, decode, frame_at, message_id_at
from gcs_plugin.fetch.boots import boots_heard
from gcs_plugin.fetch.one_clock import Anchor, Kept
from gcs_plugin.restarts import SAME_BOOT_S

NEAREST: Final = 10
"""Words of the boot clock around a time, of which the quickest counts."""
_TELLS: Final = (dialect.MAVLINK_MSG_ID_SYSTEM_TIME, dialect.MAVLINK_MSG_ID_NAMED_VALUE_INT)


@dataclass(frozen=True)
class _Tick:
    """A word of the boot clock, all in us: its place, when it was recorded, what it says, and the vehicle's own Unix
    time at boot."""

    place: int
    stamp_us: int
    boot_us: int
    began_us: int


def by_boot_time(
    kept: Sequence[Kept], heard: Sequence[tuple[int, Frame]], source: tuple[int, int]
) -> list[Anchor]:
    """When the words of `kept` on the vehicle's boot clock came, by the clock of `heard`; none where they tell of
    different boots, or of none."""
    theirs = [
        (place, one.stamp_us, frame)
        for place, one in enumerate(kept)
        if message_id_at(one.raw, 0) in _TELLS and (frame := frame_at(one.raw, 0, len(one.raw))) is not None
    ]
    ours = [
        (place, stamp_us, frame)
        for place, (stamp_us, frame) in enumerate(heard)
        if frame.message_id in _TELLS
    ]
    boots = [
        {boot.identity for boot in boots_heard(frame for _, _, frame in told)} for told in (theirs, ours)
    ]
    if all(boots) and not boots[0] & boots[1]:
        return []
    known = sorted(_ticks(ours, source), key=lambda tick: tick.boot_us)
    anchors = []
    for tick in _ticks(theirs, source):
        same = [one for one in known if abs(one.began_us - tick.began_us) <= SAME_BOOT_S * 1e6]
        if not same:
            continue
        middle = bisect_left(same, tick.boot_us, key=lambda one: one.boot_us)
        near = same[max(0, min(middle, len(same)) - NEAREST) : middle + NEAREST]
        ahead_us = min(one.stamp_us - one.boot_us for one in near)
        anchors.append(Anchor(tick.place, tick.boot_us + ahead_us - tick.stamp_us))
    return anchors


def _ticks(told: Iterable[tuple[int, int, Frame]], source: tuple[int, int]) -> list[_Tick]:
    found = []
    for place, stamp_us, frame in told:
        if frame.message_id != _TELLS[0] or (frame.system, frame.component) != source:
            continue
        message = decode(frame)
        if message is not None and message.time_unix_usec:
            boot_us = 1000 * int(message.time_boot_ms)
            found.append(_Tick(place, stamp_us, boot_us, int(message.time_unix_usec) - boot_us))
    return found
