"""The segments of a ring: whole `.tlog` files whose names alone tell their order, their boot and where they begin.

No wall clock is in a name: a small computer often has none until a net gives it one. A boot has a number, which
orders it after those that the folder holds, and an identity drawn at random, which tells it from any other boot of any
folder. Within a boot, time is boot time, which never runs back.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bridge.file_size import is_own_file

_NAME = re.compile(r"(\d{6})-([0-9a-f]{8})-(\d{6})-(\d{10})\.tlog", re.ASCII)
MOST_BOOTS: Final = 999_999


@dataclass(frozen=True, order=True, slots=True)
class Segment:
    """One file: the `number`-th of the `boot`-th boot, which is known by `identity`, from `begins_ms` of boot time."""

    boot: int
    identity: int
    number: int
    begins_ms: int

    @property
    def name(self) -> str:
        """`000012-3f9a1c00-000003-0000754000.tlog`; names sort as segments do."""
        return f"{self.boot:06d}-{self.identity:08x}-{self.number:06d}-{self.begins_ms:010d}.tlog"


def segment_named(name: str) -> Segment | None:
    """The segment of that name; None for any other file."""
    found = _NAME.fullmatch(name)
    if found is None:
        return None
    return Segment(int(found[1]), int(found[2], 16), int(found[3]), int(found[4]))


def segments_in(folder: Path) -> list[tuple[Segment, int]]:
    """The segments in a folder with their sizes in bytes, oldest first. Raises OSError where it can't be read."""
    found = []
    for path in folder.iterdir():
        segment = segment_named(path.name)
        if segment is None or not is_own_file(path):
            continue
        try:
            found.append((segment, path.stat().st_size))
        except FileNotFoundError:  # the ring has let it go meanwhile
            continue
    return sorted(found)


def following(segments: Iterable[Segment]) -> int:
    """The number of a boot that comes after all of these."""
    return min(max((segment.boot for segment in segments), default=0) + 1, MOST_BOOTS)
