"""Find the boots of a vehicle in the ground's recording, and the segments of its ring that belong to that dive.

The vehicle sends its boot once a second as NAMED_VALUE_INT `BOOT_ID`, so neither side's wall clock is needed.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import zip_longest
from math import inf
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import LogError, NotOfThisDive
from bridge.wire.framing import Frame, decode
from gcs_plugin.fetch.requests import Listing

MARGIN_MS: Final = 10_000
"""Margin around the first and last boot time heard: `BOOT_ID` comes once a second, and any of these may be lost."""
BOOT_ID: Final = "BOOT_ID"
_TELLS: Final[int] = dialect.MAVLINK_MSG_ID_NAMED_VALUE_INT


@dataclass(frozen=True, slots=True)
class Boot:
    """A boot that the ground heard: its identity, the sender, and the first and last boot time it sent."""

    identity: int
    source: tuple[int, int]
    first_ms: int
    last_ms: int


def boots_heard(frames: Iterable[Frame]) -> list[Boot]:
    """Return the boots in a recording, in the order in which they were first heard."""
    boots: dict[int, Boot] = {}
    for frame in frames:
        if frame.message_id != _TELLS:
            continue
        message = decode(frame)
        if message is None or message.name != BOOT_ID:
            continue
        ms = message.time_boot_ms
        before = boots.get(message.value, Boot(message.value, (frame.system, frame.component), ms, ms))
        boots[message.value] = Boot(
            before.identity, before.source, min(before.first_ms, ms), max(before.last_ms, ms)
        )
    return list(boots.values())


def of_dive(listing: Listing, boots: list[Boot]) -> Listing:
    """Return the segments from the first to the last boot time heard of a dive, including all boots in between.

    Raises NotOfThisDive if the ring holds none of the dive's boots any more.
    """
    heard = {boot.identity: boot for boot in boots}
    numbers = [segment.boot for segment, _ in listing if segment.identity in heard]
    if not numbers:
        raise NotOfThisDive(
            "the vehicle's own recording holds nothing of this dive any more; the ground's is all there is"
        )
    first, last = min(numbers), max(numbers)
    chosen = []
    for entry, following in zip_longest(listing, listing[1:]):
        segment, boot = entry[0], heard.get(entry[0].identity)
        if not first <= segment.boot <= last:
            continue
        ends_ms = following[0].begins_ms if following and following[0].identity == segment.identity else inf
        is_before = boot is not None and segment.boot == first and ends_ms < boot.first_ms - MARGIN_MS
        is_after = boot is not None and segment.boot == last and segment.begins_ms > boot.last_ms + MARGIN_MS
        if not is_before and not is_after:
            chosen.append(entry)
    return chosen


def newest(listing: Listing, most_ms: int | None) -> Listing:
    """Return the segments of the newest boot, or only those that hold its last `most_ms`, judged by their names.

    Raises LogError if the listing is empty.
    """
    if not listing:
        raise LogError("the vehicle's own recording is empty; check the disk of its bridge")
    boot = [entry for entry in listing if entry[0].boot == listing[-1][0].boot]
    if most_ms is None:
        return boot
    # The length of the last segment is unknown until it is fetched, so count back from its beginning.
    begins_ms = boot[-1][0].begins_ms - most_ms
    first = max((n for n, (segment, _) in enumerate(boot) if segment.begins_ms <= begins_ms), default=0)
    return boot[first:]
