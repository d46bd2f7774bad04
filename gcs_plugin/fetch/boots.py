"""Which boots of a vehicle a recording of the ground heard, and which segments of its ring belong to that dive.

The vehicle tells its boot once a second, as NAMED_VALUE_INT `BOOT_ID`: no clock of either side is needed for it.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import LogError
from bridge.framing import Frame, decode
from bridge.ring.segments import Segment
from gcs_plugin.fetch.listing import Listing

MARGIN_MS: Final = 10_000
"""Around the first and the last that was heard: a boot is told once a second, and any may be lost."""
BOOT_ID: Final = "BOOT_ID"
_TELLS: Final[int] = dialect.MAVLINK_MSG_ID_NAMED_VALUE_INT


@dataclass(frozen=True, slots=True)
class Boot:
    """What was heard of one boot: who told it, and its boot time then, first and last."""

    identity: int
    source: tuple[int, int]
    first_ms: int
    last_ms: int


def boots_heard(frames: Iterable[Frame]) -> list[Boot]:
    """The boots that a recording tells of, in the order in which they were heard first."""
    found: dict[int, Boot] = {}
    for frame in frames:
        if frame.message_id != _TELLS:
            continue
        message = decode(frame)
        if message is None or message.name != BOOT_ID:
            continue
        ms = message.time_boot_ms
        before = found.get(message.value, Boot(message.value, (frame.system, frame.component), ms, ms))
        found[message.value] = Boot(
            before.identity, before.source, min(before.first_ms, ms), max(before.last_ms, ms)
        )
    return list(found.values())


NOTHING_OF_IT: Final = (
    "the vehicle's own recording holds nothing of this dive any more; the ground's is all there is"
)


def of_dive(listing: Listing, boots: list[Boot]) -> Listing:
    """The segments from the first to the last that was heard of a dive, those of boots in between too.

    Raises LogError where the ring holds nothing of it any more.
    """
    heard = {boot.identity: boot for boot in boots}
    numbers = [segment.boot for segment, _ in listing if segment.identity in heard]
    if not numbers:
        raise LogError(NOTHING_OF_IT)
    first, last = min(numbers), max(numbers)
    chosen = []
    afters = _followers(listing)
    for segment, size in listing:
        if not first <= segment.boot <= last:
            continue
        boot = heard.get(segment.identity)
        after = afters.get(segment)
        if boot is not None and segment.boot == first and after is not None:
            over = after.begins_ms < boot.first_ms - MARGIN_MS
        else:
            over = False
        if boot is not None and segment.boot == last:
            over = over or segment.begins_ms > boot.last_ms + MARGIN_MS
        if not over:
            chosen.append((segment, size))
    return chosen


def _followers(listing: Listing) -> dict[Segment, Segment]:
    """Each segment's next of the same boot."""
    found: dict[Segment, Segment] = {}
    before: dict[int, Segment] = {}
    for segment, _ in listing:
        if segment.identity in before:
            found[before[segment.identity]] = segment
        before[segment.identity] = segment
    return found


def newest(listing: Listing, most_ms: int | None) -> Listing:
    """The segments of the newest boot, or those alone that hold its last `most_ms` as far as their names tell.

    Raises LogError where there are none.
    """
    if not listing:
        raise LogError("the vehicle's own recording is empty; check the disk of its bridge")
    boot = [entry for entry in listing if entry[0].boot == listing[-1][0].boot]
    if most_ms is None:
        return boot
    # How long the last one is nobody knows before it is there.
    begins_ms = boot[-1][0].begins_ms - most_ms
    first = max((n for n, (segment, _) in enumerate(boot) if segment.begins_ms <= begins_ms), default=0)
    return boot[first:]
