"""Finds the segments of the vehicle's ring that belong to a dive, and puts the whole recording into its folder.

A dive that is still recorded is refused; frames recorded since are added.
"""

import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from math import inf
from pathlib import Path
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import LogError, NotOfThisDive
from bridge.locks import holder_of
from bridge.wire.framing import Frame, decode
from bridge.wire.whole_recording import WHOLE, with_unmerged_frames
from gcs_plugin.dives.folder import DiveFolder
from gcs_plugin.fetch.merging import MergedRecording, merge_recordings, write_records
from gcs_plugin.fetch.requests import Listing
from gcs_plugin.locks import LOOK_EVERY_S, is_being_written
from gcs_plugin.recording.state import Holding, held, held_second, hung

MARGIN_MS: Final = 10_000
"""Margin around the first and last boot time heard: `BOOT_ID` comes once a second, and any of these may be lost."""
HALF_ROUND_MS: Final = 1 << 31
"""Boot times that lie farther apart are of a dive in which boot time wrapped, as it does after 49.7 days."""
BOOT_ID: Final = "BOOT_ID"
_TELLS: Final[int] = dialect.MAVLINK_MSG_ID_NAMED_VALUE_INT


@dataclass(frozen=True, slots=True)
class Boot:
    """A boot that the ground heard: its identity, the sender, and the first and last boot time it sent."""

    identity: int
    source: tuple[int, int]
    first_ms: int
    last_ms: int


def boots_told(frames: Iterable[Frame]) -> Iterator[Boot]:
    """Each time that a recording tells a boot, as a boot of that moment."""
    for frame in frames:
        if frame.message_id != _TELLS:
            continue
        message = decode(frame)
        if message is not None and message.name == BOOT_ID:
            ms = message.time_boot_ms
            yield Boot(message.value, (frame.system, frame.component), ms, ms)


def boots_in(frames: Iterable[Frame]) -> list[Boot]:
    """Return the boots in a recording, in the order in which they were first heard."""
    boots: dict[int, Boot] = {}
    for now in boots_told(frames):
        before = boots.get(now.identity, now)
        boots[now.identity] = replace(
            now, first_ms=min(before.first_ms, now.first_ms), last_ms=max(before.last_ms, now.last_ms)
        )
    return list(boots.values())


def segments_of_dive(listing: Listing, boots: list[Boot]) -> Listing:
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
        if ends_ms < segment.begins_ms or (boot is not None and boot.last_ms - boot.first_ms > HALF_ROUND_MS):
            chosen.append(entry)  # boot time wrapped within the segment or the dive, and orders neither
            continue
        is_before = boot is not None and segment.boot == first and ends_ms < boot.first_ms - MARGIN_MS
        is_after = boot is not None and segment.boot == last and segment.begins_ms > boot.last_ms + MARGIN_MS
        if not is_before and not is_after:
            chosen.append(entry)
    return chosen


def segments_of_newest_boot(listing: Listing, most_ms: int | None) -> Listing:
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


CLOSED_WITHIN_S: Final = 3.0
"""How long to wait after the end of a dive for its files to be synced to disk and closed."""


def refuse_recorded(folder: DiveFolder, now_unix_s: float, again: str) -> None:
    """Raise LogError, ending with `again`, if a recorder still writes this dive.

    Frames that it wrote after the whole recording was made would never be read.
    """
    holding = held(now_unix_s) or hung(now_unix_s)
    if holding is not None and _is_of(holding, folder):
        raise LogError(
            f"{folder.path}: is still recorded, by process {holding.pid}; let that go on in the next dive "
            f"(`seatrial record --next`) or end it (`seatrial record --end`), and {again}"
        )
    if (second := next((hold for hold in held_second(now_unix_s) if _is_of(hold, folder)), None)) is not None:
        raise _recorded_elsewhere(folder, second.pid, again)
    looks = round(CLOSED_WITHIN_S / LOOK_EVERY_S)
    while (written := next(filter(is_being_written, folder.heard()), None)) is not None and looks > 0:
        looks -= 1
        time.sleep(LOOK_EVERY_S)
    if written is None:
        return
    raise _recorded_elsewhere(folder, holder_of(written), again)


def remade(
    folder: DiveFolder, source: tuple[int, int], make: Callable[[Sequence[Path]], MergedRecording], again: str
) -> MergedRecording:
    """Apply `make` to the dive's recordings and put the result in the dive's folder; `source` as in `merge_recordings`.

    Raises LogError as `make` does, and if a recording grew meanwhile; the previous whole recording then stays
    unchanged.
    """
    before = _sizes(folder)
    renew(folder, source)
    made = make(folder.telemetry())
    if _sizes(folder) != before:
        raise LogError(
            f"{folder.path}: its recording grew meanwhile, so that somebody still records it; end that recording, and "
            f"{again}"
        )
    write_records(folder.path / WHOLE, made.records)
    return made


def renew(folder: DiveFolder, source: tuple[int, int]) -> MergedRecording | None:
    """Add frames of the dive's other recordings to its whole one; None if that is missing or lacks nothing.

    Raises LogError as `merge_recordings` does.
    """
    whole = folder.path / WHOLE
    if not with_unmerged_frames([*folder.heard(), *folder.telemetry()]):
        return None
    made = merge_recordings(folder.heard(), [whole], source)
    write_records(whole, made.records)
    return made


def _is_of(holding: Holding, folder: DiveFolder) -> bool:
    return Path(holding.folder).resolve() == folder.path.resolve()


def _recorded_elsewhere(folder: DiveFolder, process: int | None, again: str) -> LogError:
    by = f" by process {process}," if process else ""
    return LogError(
        f"{folder.path}: is still recorded,{by} beside what `seatrial record --end` ends; end that recording where it "
        f"runs (Ctrl-C there; in MAVProxy `seatrial record stop`), and {again}"
    )


def _sizes(folder: DiveFolder) -> dict[Path, int]:
    return {path: path.stat().st_size for path in folder.heard() if path.is_file()}
