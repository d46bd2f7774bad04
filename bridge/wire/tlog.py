"""Recordings: 8-byte big-endian Unix microseconds, then the raw frame, repeated; no header.

Writing is unbuffered, so that written records survive a crash of the program. Reading salvages: whatever was cut,
flipped or inserted, every intact frame comes out, with the best time that can still be derived from the file.
"""

import contextlib
import os
import struct
import zlib
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from itertools import chain
from pathlib import Path
from types import TracebackType
from typing import Final, TypeVar

from bridge.errors import LogError, NothingRecorded, TakenAway
from bridge.files import size_to_read, sync_folder
from bridge.wire.framing import (
    INCOMPLETE,
    MAGIC_1,
    MAGIC_2,
    Frame,
    find_magic,
    frame_at,
    has_known_id,
    measure,
    unchecked_frame_at,
)
from bridge.wire.redaction import without_contents, without_key

Record = tuple[int, Frame]
T = TypeVar("T")

STAMP_BYTES: Final = 8
GZIP: Final = b"\x1f\x8b"
SUFFIXES: Final = (".tlog", ".tlog.gz")
"""Endings of a recording's name."""
LATEST_US: Final = 4_102_444_800_000_000  # the year 2100: a later stamp is damage, or no stamp at all
OUTLIER_US: Final = 100_000
PIECE_BYTES: Final = 1024  # small, because zlib discards all output of the piece that ends in damage
MOST_BYTES: Final = 2 << 30
"""The most that is read of one file, plain or decompressed: 25 kB/s for a day. A recording is untrusted, its reader
needs several bytes of memory for each byte of the file, and a gzip file may decompress without end."""
MOST_COMPRESSION: Final = (
    100  # times; recordings and tables compress about fourfold, and no real file is this uniform
)
FEW_BYTES: Final = 1 << 24
STAMP = struct.Struct(">Q")
_END: Final = (0, Frame(b"", 0, 0, 0, 0, False))

DELETED_ONCE_CLOSED: Final = (".nfs", ".fuse_hidden")
"""Prefixes to which network disks rename a file that is deleted while open."""


def record_of(unix_us: int, raw: bytes) -> bytes:
    """Return a record as every recording written here holds it: without signing keys and file contents."""
    return STAMP.pack(unix_us) + _as_kept(raw)


def _as_kept(raw: bytes) -> bytes:
    return without_contents(without_key(raw))


class TlogWriter:
    """A new recording at `path`. Each record is with the operating system when `write` returns.

    Raises LogError if the file exists, can't be created or can't be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._is_named = False
        try:
            self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o644)
        except FileExistsError:
            raise LogError("exists already and is never overwritten; give another name", path) from None
        except OSError as error:
            raise LogError(
                f"can't be made ({error.strerror}); check the folder and its rights", path
            ) from None

    def write(self, unix_us: int, raw: bytes) -> None:
        """Append one complete record, except for signing keys and file contents, which no recording holds."""
        record = record_of(unix_us, raw)
        try:
            while record:
                record = record[os.write(self._file, record) :]
        except OSError as error:
            raise LogError(f"can't be written ({error.strerror}); free disk space", self.path) from None

    def sync(self) -> None:
        """Wait until all records are on the disk. Takes about 3 ms: keep it off the receive path."""
        try:
            os.fsync(self._file)
        except OSError as error:
            raise LogError(
                f"can't be put on the disk ({error.strerror}); check the disk", self.path
            ) from None
        if not self._is_named:
            # The folder entry of the file, and that of its folder, which may be new too.
            sync_folder(self.path.parent)
            sync_folder(self.path.parent.parent)
            self._is_named = True

    def look(self) -> None:
        """Check that the file is still under its name. Raises TakenAway if it is not."""
        with contextlib.suppress(OSError):  # a failing disk can't answer; `sync` reports it
            _check_in_place(self._file, self.path)

    def close(self) -> None:
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def __enter__(self) -> "TlogWriter":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _check_in_place(file: int, path: Path) -> None:
    """Raise TakenAway if the open `file` is no longer at `path`, OSError if that can't be determined."""
    here, place = os.fstat(file), _place(file)
    with contextlib.suppress(FileNotFoundError, NotADirectoryError):
        there = path.stat()
        if os.path.samestat(here, there):
            return
        # Some network disks give a file a new number each time it is examined.
        if there.st_dev == here.st_dev and place == os.path.realpath(path):
            return
    deleted = here.st_nlink == 0 or os.path.basename(place).startswith(DELETED_ONCE_CLOSED)
    raise TakenAway(path, None if deleted else place)


def _place(file: int) -> str:
    """Current path of an open file as far as the system reports it, otherwise "elsewhere"."""
    try:
        place = os.readlink(f"/proc/self/fd/{file}")
    except OSError:
        return "elsewhere"
    return place if os.path.exists(place) else "elsewhere"


def read_tlog(path: Path) -> Iterator[Record]:
    """Iterate over the intact records of a `.tlog` or `.tlog.gz` as (Unix microseconds, frame).

    Raises LogError if the file is missing or holds no MAVLink frame.
    """
    return iter(TlogReader(path))


class TlogReader:
    """Iterable over the records of a `.tlog` or `.tlog.gz`. `counts` is complete after the first pass.

    Recordings of other programs may hold signing keys and contents of transferred files; both are removed from the
    frames.

    `counts`: "records"; "unknown" (records with an id that can't be checked); "checksum" (records lost to damage);
    "skipped" (bytes outside any record); "stamps mended" (records with a damaged time, given their neighbour's);
    "cut" (1 if the file ends within a record, or its gzip data is cut or damaged).

    Raises LogError if the file is missing, is empty, or holds no MAVLink frame.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.counts: Counter[str] = Counter()
        self._data, gzip_whole = load_recording(path)
        self._gzip_cut = 0 if gzip_whole else 1

    def __iter__(self) -> Iterator[Record]:
        self.counts.clear()
        if self._gzip_cut:
            self.counts["cut"] = 1
        return _mend_stamps(_salvage(self._data, self.counts), self.counts)


def load_recording(path: Path) -> tuple[bytes, bool]:
    """Return the bytes of a `.tlog` or `.tlog.gz`, decompressed, and whether its gzip data was complete.

    Raises LogError if the file is missing, NothingRecorded if it is empty or holds no MAVLink frame.
    """
    data, whole = load_bytes(path)
    if not data:
        raise NothingRecorded("is empty, nothing was recorded in it; give another recording", path)
    if next_record(data, 0, Counter()) is None:
        raise NothingRecorded("holds no MAVLink frame; give a .tlog recording", path)
    return data, whole


def each_nonempty(paths: Sequence[Path], read: Callable[[Path], T]) -> Iterator[T]:
    """Yield `read(path)` for each file of one recording, skipping files that hold no frame.

    A killed recorder or a full disk leaves such files next to good ones. Raises NothingRecorded if no file holds a
    frame, and the other errors of `read`.
    """
    held, nothing = False, None
    for path in paths:
        try:
            taken = read(path)
        except NothingRecorded as error:
            nothing = nothing or error
            continue
        held = True
        yield taken
    if nothing is not None and not held:
        raise nothing


def load_bytes(path: Path) -> tuple[bytes, bool]:
    """Return the contents of a file, decompressed if gzip, and whether they are complete.

    Raises LogError, also for a pipe or a device, and for a file of more than MOST_BYTES.
    """
    try:
        size = size_to_read(path)
        if size is None:
            raise LogError("is no file; take it away", path)
        if size > MOST_BYTES:
            raise LogError(
                f"{size / 1e9:.1f} GB is more than the {MOST_BYTES / 1e9:.1f} GB that are read of a file, "
                "which hold a dive of a day; give a part of it",
                path,
            )
        data = path.read_bytes()
    except FileNotFoundError:
        raise LogError("no such file; check the name", path) from None
    except OSError as error:
        raise LogError(f"can't be read ({error.strerror}); give a recording that can", path) from None
    if not data.startswith(GZIP):
        return data, True
    return _gunzip(data)


def _gunzip(data: bytes) -> tuple[bytes, bool]:
    """Decompress gzip data up to its end, a cut, damage or an excessive size; also return whether it is complete."""
    parts: list[bytes] = []
    size, most = 0, min(max(MOST_COMPRESSION * len(data), FEW_BYTES), MOST_BYTES)
    while data:
        decompressor = zlib.decompressobj(wbits=31)
        at = 0
        while at < len(data) and not decompressor.eof:
            try:
                parts.append(decompressor.decompress(data[at : at + PIECE_BYTES]))
            except zlib.error:
                return b"".join(parts), False
            at += PIECE_BYTES
            size += len(parts[-1])
            if size > most:
                return b"".join(parts), False
        if not decompressor.eof:
            return b"".join(parts), False
        data = decompressor.unused_data + data[at:]
    return b"".join(parts), True


def _salvage(data: bytes, counts: Counter[str]) -> Iterator[tuple[int | None, Frame]]:
    """Yield every intact record; its stamp is None if lost or impossible."""
    position, records = 0, 0
    while (record := next_record(data, position, counts)) is not None:
        position, stamp, frame = record
        records += 1
        raw = _as_kept(frame.raw)
        yield stamp, frame if raw is frame.raw else frame_at(raw, 0, len(raw)) or frame
    counts["records"] += records


def next_record(data: bytes, position: int, counts: Counter[str]) -> tuple[int, int | None, Frame] | None:
    """Return the first intact record from `position` on as (end, stamp, frame), or None.

    The stamp is None if it is lost or impossible. Damage before the record is added to `counts`.
    """
    end = len(data)
    if position >= end:
        return None
    start = position + STAMP_BYTES
    length = measure(data, start)
    if length > 0 and start + length <= end:
        frame = frame_at(data, start, length) or _unchecked(data, start, length, counts)
        if frame is not None:
            stamp = STAMP.unpack_from(data, position)[0]
            return start + length, stamp if stamp < LATEST_US else None, frame
    match = _next_known(data, position, end)
    if match is None:
        _count_tail(data, position, counts)
        return None
    start, frame = match
    begin = start - STAMP_BYTES
    counts["checksum"] += 1
    counts["skipped"] += max(begin, position) - position
    stamp = STAMP.unpack_from(data, begin)[0] if begin >= position else LATEST_US
    return start + len(frame.raw), stamp if stamp < LATEST_US else None, frame


def _unchecked(data: bytes, start: int, length: int, counts: Counter[str]) -> Frame | None:
    """Return a frame with an unknown id if a valid stamp precedes it, a record or the end of the file follows, and no
    known frame hides in it."""
    if has_known_id(data, start) or STAMP.unpack_from(data, start - STAMP_BYTES)[0] >= LATEST_US:
        return None
    after = start + length
    if after < len(data):
        following = after + STAMP_BYTES
        if following >= len(data) or data[following] not in (MAGIC_1, MAGIC_2):
            return None
        if STAMP.unpack_from(data, after)[0] >= LATEST_US:
            return None
    if _next_known(data, start + 1, after) is not None:
        return None
    counts["unknown"] += 1
    return unchecked_frame_at(data, start, length)


def _next_known(data: bytes, start: int, end: int) -> tuple[int, Frame] | None:
    """Return the first frame with a right CRC that begins in `data[start:end]`, with its offset."""
    position = find_magic(data, start, end)
    while position >= 0:
        length = measure(data, position)
        if length > 0 and position + length <= len(data):
            frame = frame_at(data, position, length)
            if frame is not None:
                return position, frame
        position = find_magic(data, position + 1, end)
    return None


def _count_tail(data: bytes, position: int, counts: Counter[str]) -> None:
    start = position + STAMP_BYTES
    length = measure(data, start)
    if length == INCOMPLETE or start + length > len(data):
        counts["cut"] = 1
    else:
        counts["checksum"] += 1
    counts["skipped"] += len(data) - position


def _mend_stamps(records: Iterator[tuple[int | None, Frame]], counts: Counter[str]) -> Iterator[Record]:
    """Give a record whose stamp is lost, or lies far outside its neighbours', the time of the previous record."""
    before: int | None = None
    waiting: list[tuple[int | None, Frame]] = []
    for stamp, frame in chain(records, [_END]):
        if stamp is None:
            waiting.append((stamp, frame))
            continue
        following = None if frame is _END[1] else stamp
        for doubtful, earlier in waiting:
            before = mended(doubtful, before, following)
            if before != doubtful:
                counts["stamps mended"] += 1
            yield before, earlier
        waiting = [(stamp, frame)]


def mended(stamp: int | None, before: int | None, following: int | None) -> int:
    """Return a record's stamp, or that of the previous record if its own is lost or an outlier.

    `before` is the previous stamp, already mended; `following` is the next stamp that is not lost. Either may be None
    at an end of the recording; without `before`, `following` is used. Where the clock was set back, a stamp on either
    side of that is no outlier.
    """
    neighbours = [near for near in (before, following) if near is not None]
    if stamp is None:
        return neighbours[0] if neighbours else 0
    if before is None:
        low, high = None, following
    elif following is None:
        low, high = before, None
    elif min(abs(stamp - before), abs(stamp - following)) < before - following - OUTLIER_US:
        return stamp
    else:
        low, high = min(neighbours), max(neighbours)
    if (low is not None and stamp < low - OUTLIER_US) or (high is not None and stamp > high + OUTLIER_US):
        return neighbours[0]
    return stamp
