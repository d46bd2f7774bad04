"""The ring on the disk: records go into the newest segment, the oldest segments are deleted.

Every call may have to wait for the disk.
"""

import contextlib
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bridge.errors import LogError, TakenAway
from bridge.ring.segments import Segment, following, segments_in
from bridge.tlog import STAMP_BYTES, TlogWriter

MEGABYTE: Final = 1_000_000


@dataclass(frozen=True)
class Bounds:
    """Size limits of a ring and of each of its segments, in bytes."""

    total: int = 1000 * MEGABYTE
    segment: int = 4 * MEGABYTE


class RingFiles:
    """The segments of one boot, known by `identity`, in `folder`, which is created if missing.

    Nothing is touched before the first `write`, so that a vehicle starts with a failing disk too. Files that are no
    segments are left alone.
    """

    def __init__(self, folder: Path, bounds: Bounds, identity: int) -> None:
        self._folder, self._bounds, self._identity = folder, bounds, identity
        self._boot = 0
        self._number = 0
        self._size = 0
        self._writer: TlogWriter | None = None

    def write(self, unix_us: int, boot_ms: int, raw: bytes) -> None:
        """Append one record. Raises LogError if that fails; the next record then begins a new segment."""
        if self._writer is not None and self._size + STAMP_BYTES + len(raw) > self._bounds.segment:
            self.sync()
            self.close()
        try:
            if self._writer is None:
                self._writer, self._size = self._begin(boot_ms), 0
            self._writer.write(unix_us, raw)
        except LogError:
            self._give_up()
            raise
        self._size += STAMP_BYTES + len(raw)

    def sync(self) -> None:
        """Put the written records on the disk. Raises LogError if that fails.

        Raises TakenAway if somebody deleted or moved the segment; a deleted segment is written again.
        """
        if self._writer is None:
            return
        try:
            self._writer.sync()
            self._writer.look()
        except LogError as error:
            if isinstance(error, TakenAway) and error.place is None:
                with contextlib.suppress(LogError):
                    self._writer.restore()
            self.close()
            raise

    def close(self) -> None:
        """End the segment."""
        if self._writer is not None:
            with contextlib.suppress(OSError):
                self._writer.close()
            self._writer = None

    def _give_up(self) -> None:
        """End a segment that can't be written, with its records; an empty segment would be litter and is deleted."""
        writer = self._writer
        with contextlib.suppress(LogError):
            self.sync()
        self.close()
        if writer is not None and self._size == 0:
            with contextlib.suppress(OSError):
                writer.path.unlink()

    def _begin(self, boot_ms: int) -> TlogWriter:
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            present = segments_in(self._folder)
            self._boot = self._boot or following(segment for segment, _ in present)
            self._make_room(present)
        except OSError as error:
            raise LogError(f"{self._folder}: the ring can't be kept there ({error.strerror})") from None
        self._number += 1
        segment = Segment(self._boot, self._identity, self._number, boot_ms)
        return TlogWriter(self._folder / segment.name)

    def _make_room(self, present: list[tuple[Segment, int]]) -> None:
        """Delete the oldest segments until one more segment fits."""
        total = sum(size for _, size in present)
        for segment, size in present:
            if total + self._bounds.segment <= self._bounds.total:
                return
            (self._folder / segment.name).unlink(missing_ok=True)
            total -= size
