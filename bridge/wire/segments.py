"""Segments of the vehicle's own recording: their file names, and those in a folder."""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bridge.files import is_own_file

_NAME = re.compile(r"(\d{6})-([0-9a-f]{8})-(\d{6})-(\d{10})\.tlog", re.ASCII)
MOST_BOOTS: Final = 999_999


@dataclass(frozen=True, order=True, slots=True)
class Segment:
    """One file: segment `number` of boot number `boot`, known by `identity`; begins at boot time `begins_ms`, which
    wraps as BOOT_ID's does."""

    boot: int
    identity: int
    number: int
    begins_ms: int

    @property
    def name(self) -> str:
        """File name such as `000012-3f9a1c00-000003-0000754000.tlog`; names sort as segments do."""
        return f"{self.boot:06d}-{self.identity:08x}-{self.number:06d}-{self.begins_ms:010d}.tlog"


def segment_named(name: str) -> Segment | None:
    """Return the segment with that file name; None for any other file."""
    match = _NAME.fullmatch(name)
    if match is None:
        return None
    return Segment(int(match[1]), int(match[2], 16), int(match[3]), int(match[4]))


def segments_in(folder: Path) -> list[tuple[Segment, int]]:
    """Return the segments in a folder with their sizes in bytes, oldest first.

    Raises OSError if the folder can't be read.
    """
    segments = []
    for path in folder.iterdir():
        segment = segment_named(path.name)
        if segment is None or not is_own_file(path):
            continue
        try:
            segments.append((segment, path.stat().st_size))
        except FileNotFoundError:  # the ring has deleted it meanwhile
            continue
    return sorted(segments)


def following(segments: Iterable[Segment]) -> int:
    """Return the number of a boot that comes after all of these segments."""
    return min(max((segment.boot for segment in segments), default=0) + 1, MOST_BOOTS)
