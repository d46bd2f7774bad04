"""MAVLink 1 and 2 framing: splits a byte stream into frames, packs frames, and resynchronises by CRC.

A frame with a known message id is checked by CRC-16/MCRF4XX, which includes the CRC extra byte of that message. A
frame with an id that the dialect does not know can't be checked: it passes with `known=False`, to be recorded and
never acted upon.
"""

import re
import struct
from bisect import bisect_left, insort
from collections import Counter
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import ardupilotmega as dialect

MAGIC_1: Final = 0xFE
MAGIC_2: Final = 0xFD
SIGNED: Final = 0x01
SIGNATURE_BYTES: Final = 13
LONGEST_FRAME: Final = 10 + 255 + 2 + SIGNATURE_BYTES
INCOMPLETE: Final = -1
IMPOSSIBLE: Final = 0

ESC_INFO: Final = 290
ESC_STATUS: Final = 291

_MAGIC = re.compile(rb"[\xfd\xfe]")
CRC_EXTRA: Final = {number: bytes((kind.crc_extra,)) for number, kind in dialect.mavlink_map.items()} | {
    ESC_INFO: bytes((251,)),
    ESC_STATUS: bytes((10,)),
}
"""CRC extra byte by message id; the checksum ends with it. A frame whose id is missing here can't be checked."""
FULL_BYTES: Final = {number: kind.unpacker.size for number, kind in dialect.mavlink_map.items()}
"""Full payload length by message id, before MAVLink 2 cuts trailing zeros."""
_HEADER_2 = struct.Struct("<BBBBBBBHB")  # magic, length, flags, sequence, sender, 24-bit id


@dataclass(frozen=True, slots=True)
class Frame:
    """One complete MAVLink frame as received. `known` means that its id is known and its CRC is right."""

    raw: bytes
    message_id: int
    system: int
    component: int
    sequence: int
    known: bool

    @property
    def payload(self) -> bytes:
        """The payload as sent: MAVLink 2 cuts its trailing zero bytes."""
        start = 10 if self.raw[0] == MAGIC_2 else 6
        return self.raw[start : start + self.raw[1]]


def measure(data: bytes, start: int) -> int:
    """Return the length of the frame that would begin at `start`.

    INCOMPLETE if the header is cut off, IMPOSSIBLE if no frame can begin there.
    """
    have = len(data) - start
    if have < 1:
        return INCOMPLETE
    magic = data[start]
    if magic == MAGIC_2:
        if have >= 3 and data[start + 2] & ~SIGNED:
            return IMPOSSIBLE
        if have < 10:
            return INCOMPLETE
        return data[start + 1] + (12 + SIGNATURE_BYTES if data[start + 2] else 12)
    if magic == MAGIC_1:
        if have < 6:
            return INCOMPLETE
        # MAVLink 1 does not cut zeros, so a payload longer than its message shows at once that this is no frame.
        full = FULL_BYTES.get(data[start + 5])
        return IMPOSSIBLE if full is not None and data[start + 1] > full else data[start + 1] + 8
    return IMPOSSIBLE


def _header(data: bytes, start: int) -> tuple[int, int, int, int, int]:
    """Return message id, system, component, sequence, and offset of the payload, of the complete header at `start`."""
    if data[start] == MAGIC_2:
        number = data[start + 7] | data[start + 8] << 8 | data[start + 9] << 16
        return number, data[start + 5], data[start + 6], data[start + 4], start + 10
    return data[start + 5], data[start + 3], data[start + 4], data[start + 2], start + 6


def frame_at(data: bytes, start: int, length: int) -> Frame | None:
    """Return the frame in `data[start:start + length]`, or None if its id is unknown or its CRC is wrong.

    `length` comes from `measure`, and `data` must hold that many bytes.
    """
    number, system, component, sequence, payload = _header(data, start)
    extra, end = CRC_EXTRA.get(number), payload + data[start + 1]
    if extra is None or mcrf4xx(data[start + 1 : end] + extra) != data[end] | data[end + 1] << 8:
        return None
    return Frame(data[start : start + length], number, system, component, sequence, True)


def unchecked_frame_at(data: bytes, start: int, length: int) -> Frame:
    """Return the same bytes as a frame with `known=False`, for an id whose CRC can't be checked."""
    number, system, component, sequence, _ = _header(data, start)
    return Frame(data[start : start + length], number, system, component, sequence, False)


def message_id_at(data: bytes, start: int) -> int:
    """Message id in the complete header at `start`."""
    return _header(data, start)[0]


def has_known_id(data: bytes, start: int) -> bool:
    """Whether the complete header at `start` has an id whose CRC can be checked."""
    return message_id_at(data, start) in CRC_EXTRA


def _known_headers() -> re.Pattern[bytes]:
    """Return the pattern of a frame start with a known id, judged by the header alone."""
    lows: dict[tuple[int, int], str] = {}
    for number in sorted(CRC_EXTRA):
        high = number >> 8 & 0xFF, number >> 16
        lows[high] = f"{lows.get(high, '')}\\x{number & 0xFF:02x}"
    ids = "|".join(f"[{low}]\\x{middle:02x}\\x{high:02x}" for (middle, high), low in lows.items())
    pattern = rf"\xfd(?=[\s\S][\x00\x01][\s\S]{{4}}(?:{ids}))|\xfe(?=[\s\S]{{4}}[{lows[0, 0]}])"
    return re.compile(pattern.encode("ascii"))


_KNOWN: Final = _known_headers()


def find_magic(data: bytes, start: int, end: int) -> int:
    """Offset of the next byte in `data[start:end]` that can begin a frame, or -1."""
    match = _MAGIC.search(data, start, end)
    return match.start() if match else -1


PAUSE_S: Final = 0.5
STALL_S: Final = 5.0
"""For so long a stream may stand still within a frame, as TCP does over a network that loses a segment."""


class Framer:
    """Incremental parser: `feed` or `hear` bytes as they arrive, `flush` when the stream ends.

    The resulting frames do not depend on how the stream was split. Parsing time grows only with the length of the
    stream, whatever its bytes are. `counts`: "good" and "unknown" (frames), "checksum" (damaged frames at a place
    where a frame was due), "skipped" (bytes outside any frame).
    """

    def __init__(self) -> None:
        self.counts: Counter[str] = Counter()
        self._unparsed = b""
        self._in_step = True
        self._ahead = _Ahead()
        self._data_s = 0.0

    def hear(self, data: bytes, now_s: float) -> list[Frame]:
        """As `feed`; without data for PAUSE_S also the frames that a broken start holds back.

        The beginning of a frame that holds none back waits for its end, up to STALL_S.
        """
        if data:
            self._data_s = now_s
            return self.feed(data)
        paused_s = now_s - self._data_s
        if not self._unparsed or paused_s < PAUSE_S or (paused_s < STALL_S and not self._holds_back()):
            return []
        return self.flush()

    def feed(self, data: bytes) -> list[Frame]:
        """Return the frames that `data` completes."""
        return self._take(data, final=False)

    def flush(self) -> list[Frame]:
        """Return the frames held back by a start that was never completed. Call when the stream ends."""
        return self._take(b"", final=True)

    def _holds_back(self) -> bool:
        """Whether the end of the stream would bring a frame."""
        trial = Framer()
        trial._in_step = self._in_step
        return bool(trial._take(self._unparsed, final=True))

    def _take(self, more: bytes, final: bool) -> list[Frame]:
        data = self._unparsed + more if self._unparsed else bytes(more)
        self._ahead.renew(data)
        frames: list[Frame] = []
        position, end = 0, len(data)
        while position < end:
            length = measure(data, position)
            frame = None
            if length > 0 and position + length <= end:
                frame = frame_at(data, position, length)
            if frame is None and self._in_step:
                verdict = self._judge(data, position, length, final)
                if verdict is _Verdict.WAIT:
                    break
                if verdict is _Verdict.NO:
                    position = self._skip(data, position, end)
                    continue
                frame = unchecked_frame_at(data, position, length)
            elif frame is None:
                place, length = self._search(data, position, final)
                if place > position:
                    self.counts["skipped"] += place - position
                position = place
                if length <= 0:
                    break
                frame = frame_at(data, position, length) or unchecked_frame_at(data, position, length)
            frames.append(frame)
            self.counts["good" if frame.known else "unknown"] += 1
            self._in_step = True
            position += length
        self._unparsed = data[position:]
        self._ahead.drop(position)
        return frames

    def _judge(self, data: bytes, position: int, length: int, final: bool) -> "_Verdict":
        """Decide whether an uncheckable frame stands at `position`, where a frame is due.

        A complete frame with a known id gets here only with a wrong CRC and is refused.
        """
        undecided = _Verdict.NO if final else _Verdict.WAIT
        if length == IMPOSSIBLE:
            return _Verdict.NO
        if length == INCOMPLETE:
            return undecided
        after = position + length
        whole = after <= len(data)
        if has_known_id(data, position):
            if whole:
                self.counts["checksum"] += 1
            return _Verdict.NO if whole else undecided
        inside = min(after, len(data))
        if self._ahead.right(data, position + 1, inside) < inside:
            return _Verdict.NO
        if not whole or (not final and self._ahead.open(position + 1, inside)):
            return undecided
        if after == len(data):
            return _Verdict.YES if final else undecided
        return _Verdict.YES if data[after] in (MAGIC_1, MAGIC_2) else _Verdict.NO

    def _skip(self, data: bytes, position: int, end: int) -> int:
        following = find_magic(data, position + 1, end)
        following = end if following < 0 else following
        self.counts["skipped"] += following - position
        self._in_step = False
        return following

    def _search(self, data: bytes, position: int, final: bool) -> tuple[int, int]:
        """Find the next frame after bytes that belong to no frame; return its offset and length.

        The length is IMPOSSIBLE if no frame begins before the end of the data, and INCOMPLETE if more data must
        decide. A frame that can't be checked is accepted only if a frame with a right CRC follows it immediately.
        """
        end = len(data)
        right = self._ahead.right(data, position, end)
        opened = end if final else self._ahead.first_open(position, end)
        decided = min(right, opened)
        for match in _MAGIC.finditer(data, max(position, decided - LONGEST_FRAME), right):
            start = match.start()
            if end - start >= _HEADER_2.size:
                # Most false starts are rejected here.
                if data[start] == MAGIC_1:
                    after = start + 8 + data[start + 1]
                elif data[start + 2] & ~SIGNED:
                    continue
                else:
                    after = start + (12 + SIGNATURE_BYTES if data[start + 2] else 12) + data[start + 1]
                if after < decided or right < after <= end:
                    continue
            length = measure(data, start)
            after = start + length
            if length == IMPOSSIBLE:
                continue
            if length == INCOMPLETE or (after > end and (right == end or has_known_id(data, start))):
                if final:
                    continue
                return start, INCOMPLETE
            if after > right or has_known_id(data, start):
                continue
            if not final and (after == end or self._ahead.open(start + 1, after + 1)):
                return start, INCOMPLETE
            if after == right < end:
                return start, length
        return right, measure(data, right) if right < end else IMPOSSIBLE


class _Verdict(Enum):
    NO = 0
    YES = 1
    WAIT = 2


class _Ahead:
    """Offsets of the frames with a right CRC ahead in a stream; each start is judged only once.

    Offsets are those in the current data and must be asked for in rising order.
    """

    def __init__(self) -> None:
        self._judged = 0
        self._right: list[int] = []
        self._open: list[tuple[int, int]] = []
        """Starts that can't be judged yet, each with the length of data that it needs."""

    def renew(self, data: bytes) -> None:
        """Judge the open starts again after data was added."""
        if self._open:
            opened, self._open = self._open, []
            for start, needed in opened:
                if needed > len(data) or measure(data, start) == INCOMPLETE:
                    self._open.append((start, needed))
                elif _KNOWN.match(data, start):
                    self._judge(data, start)

    def drop(self, count: int) -> None:
        """Shift the offsets after the first `count` bytes of the data were dropped."""
        self._judged = max(self._judged - count, 0)
        if self._right:
            self._right = [start - count for start in self._right if start >= count]
        if self._open:
            self._open = [(start - count, needed - count) for start, needed in self._open if start >= count]

    def right(self, data: bytes, start: int, end: int) -> int:
        """Offset in `data[start:end]` of the first frame with a right CRC, or `end`."""
        while self._right and self._right[0] < start:
            del self._right[0]
        self._judged = max(self._judged, start)
        if not self._right:
            self._look(data, end)
        return min(self._right[0], end) if self._right else end

    def first_open(self, start: int, end: int) -> int:
        """Offset in `[start, end)` of the first start that can't be judged yet, or `end`."""
        place = bisect_left(self._open, (start,))
        return min(self._open[place][0], end) if place < len(self._open) else end

    def open(self, start: int, end: int) -> bool:
        """Whether `[start, end)` has a start that can't be judged yet."""
        return self.first_open(start, end) < end

    def _look(self, data: bytes, end: int) -> None:
        """Judge the starts before `end`, up to the first with a right CRC."""
        whole = min(end, len(data) - _HEADER_2.size + 1)
        for match in _KNOWN.finditer(data, self._judged, max(whole, 0) + _HEADER_2.size - 1):
            start = match.start()
            if start >= whole:
                break
            self._judge(data, start)
            if self._right:
                self._judged = start + 1
                return
        # The headers of the last starts may be incomplete.
        for match in _MAGIC.finditer(data, max(self._judged, whole), end):
            start = match.start()
            if measure(data, start) == INCOMPLETE:
                self._open.append((start, len(data) + 1))
            elif _KNOWN.match(data, start):
                self._judge(data, start)
                if self._right:
                    self._judged = start + 1
                    return
        self._judged = max(end, self._judged)

    def _judge(self, data: bytes, start: int) -> None:
        """Judge a start that has a complete header and a known id."""
        length = measure(data, start)
        if length == IMPOSSIBLE:
            return
        if start + length > len(data):
            self._open.append((start, start + length))
        elif frame_at(data, start, length) is not None:
            insort(self._right, start)


_DECODER = dialect.MAVLink(None)


def decode(frame: Frame) -> Any | None:
    """Return the pymavlink message of a frame, or None if pymavlink does not know its id or can't decode it."""
    if not frame.known or frame.message_id not in FULL_BYTES:
        return None
    try:
        return _DECODER.decode(bytearray(frame.raw))
    except (dialect.MAVError, struct.error, UnicodeDecodeError):
        return None


class Encoder:
    """Packs messages into MAVLink 2 frames of one sender, with its own sequence numbers."""

    def __init__(self, system: int, component: int) -> None:
        self.system = system
        self.component = component
        self._packer = dialect.MAVLink(None, srcSystem=system, srcComponent=component)

    @property
    def sequence(self) -> int:
        """The sequence number of the next frame."""
        return int(self._packer.seq)

    def encode(self, message: Any) -> bytes:
        """Return the frame of a pymavlink message. Raises struct.error if a value does not fit its field."""
        raw: bytes = message.pack(self._packer)
        self._packer.seq = (self._packer.seq + 1) & 0xFF
        return raw

    def frame(self, message_id: int, payload: bytes) -> bytes:
        """Return the frame of a payload in wire order; used for the most frequent messages.

        Raises KeyError for an id without a known CRC extra.
        """
        extra = CRC_EXTRA[message_id]
        body = payload.rstrip(b"\0") or payload[:1]
        high, low = divmod(message_id, 0x10000)
        sequence = self._packer.seq
        self._packer.seq = (sequence + 1) & 0xFF
        head = _HEADER_2.pack(MAGIC_2, len(body), 0, 0, sequence, self.system, self.component, low, high)
        unsealed = head + body
        return unsealed + mcrf4xx(unsealed[1:] + extra).to_bytes(2, "little")
