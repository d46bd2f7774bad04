"""MAVLink 2 signing, as the MAVLink guide defines it: signatures, their times, and who is let in.

Thirteen bytes after the checksum: the link's number, the time in steps of 10 us since 2015 in 6 bytes (little
endian), and the first 6 bytes of SHA-256 over key, header, payload, checksum, link and time.

A frame is refused if its stream (system, component, link) sent that time or a later one before, or if it is more than
a minute behind the newest time known here: this computer's clock, or a later time that was received. Outgoing frames
take the newest time as well, so that a side whose clock is behind learns the time from the first frame that it
accepts.
"""

import hashlib
import hmac
import json
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from fastcrc.crc16 import mcrf4xx

from bridge.clock import Clock
from bridge.errors import FrameError
from bridge.files import read_small, whole
from bridge.plain import from_json
from bridge.signing.key import SigningKey
from bridge.wire.framing import MAGIC_2, SIGNATURE_BYTES, SIGNED, Frame

FLAGS_AT: Final = 2
HEADER_BYTES: Final = 10
DIGEST_BYTES: Final = 6
TIME_BYTES: Final = 6


def is_signed(raw: bytes) -> bool:
    """Whether a complete frame carries a signature, of any key."""
    return raw[0] == MAGIC_2 and bool(raw[FLAGS_AT] & SIGNED)


def signed(raw: bytes, secret: bytes, link: int, time: int) -> bytes:
    """Return a complete frame signed with `secret` (32 bytes); it replaces a signature that the frame carries.

    link: 0 to 255; time: steps of 10 us since 2015, below 2^48. Raises FrameError for MAVLink 1, which has no room
    for a signature.
    """
    if raw[0] != MAGIC_2:
        raise FrameError("a frame of MAVLink 1 can't be signed; let what sends it speak MAVLink 2")
    stamped = _flagged(unsigned(raw)) + bytes((link,)) + time.to_bytes(TIME_BYTES, "little")
    return stamped + _digest(secret, stamped)


def unsigned(raw: bytes) -> bytes:
    """Return a complete frame without its signature; its checksum stays as right or wrong as it was."""
    return _flagged(raw[:-SIGNATURE_BYTES]) if is_signed(raw) else raw


def is_of(raw: bytes, secret: bytes) -> bool:
    """Whether the signature of a signed frame was made with `secret`."""
    return hmac.compare_digest(_digest(secret, raw[:-DIGEST_BYTES]), raw[-DIGEST_BYTES:])


def link_and_time(raw: bytes) -> tuple[int, int]:
    """Return the link number and the time (steps of 10 us since 2015) in a frame's signature."""
    return raw[-SIGNATURE_BYTES], int.from_bytes(raw[-DIGEST_BYTES - TIME_BYTES : -DIGEST_BYTES], "little")


def _digest(secret: bytes, stamped: bytes) -> bytes:
    return hashlib.sha256(secret + stamped).digest()[:DIGEST_BYTES]


def _flagged(raw: bytes) -> bytes:
    """Return a frame without signature, with its signed flag inverted and its checksum changed accordingly."""
    end = HEADER_BYTES + raw[1]
    checksum = int.from_bytes(raw[end : end + 2], "little") ^ _turned(raw[1])
    flags = bytes((raw[FLAGS_AT] ^ SIGNED,))
    return raw[:FLAGS_AT] + flags + raw[FLAGS_AT + 1 : end] + checksum.to_bytes(2, "little")


@lru_cache(maxsize=256)
def _turned(size: int) -> int:
    """XOR change of the checksum when the signed flag is inverted, for a payload of `size` bytes.

    A CRC is linear: the change depends only on the position of the flag, so that a frame with an unknown id can be
    signed too.
    """
    zeros = bytes(HEADER_BYTES + size)
    return int(mcrf4xx(zeros[: FLAGS_AT - 1] + bytes((SIGNED,)) + zeros[FLAGS_AT:]) ^ mcrf4xx(zeros))


EPOCH_UNIX_S: Final = 1_420_070_400  # 2015-01-01
STEPS_A_S: Final = 100_000
MINUTE: Final = 60 * STEPS_A_S
LATEST: Final = (1 << 48) - 1
KEEP_EVERY_S: Final = 60.0

Stream = tuple[int, int, int]
"""System, component and link number."""


class Refusal(Enum):
    """Why a frame is not let in. In messages, the value follows a number of frames."""

    UNSIGNED = "unsigned"
    OTHER_KEY = "of another key"
    REPLAYED = "replayed or late"
    OLD = "a minute old"


class Times:
    """The times of one link. `file` keeps them over restarts; without a file they are forgotten.

    `fault` says why they can't be kept, "" if they can.
    """

    def __init__(self, clock: Clock, file: Path | None = None) -> None:
        self.fault = ""
        self._clock, self._file = clock, file
        self._sent, self._heard = _kept(file) if file else (0, {})
        self._newest = max(self._heard.values(), default=0)
        self._reserved = self._sent
        self._keep_due_s = clock.boot_s()

    def next(self) -> int:
        """Return the time for the next outgoing frame, later than all before."""
        self._sent = min(max(self._now(), self._sent + 1), LATEST)
        # The file already holds a time that is later than any sent before the next save: a killed program repeats none.
        if self._sent >= self._reserved:
            self._reserved = self._sent + MINUTE
            self._keep()
        return self._sent

    def take(self, stream: Stream, time: int) -> Refusal | None:
        """Accept the time of a frame whose signature is right, or return why the frame is refused."""
        if time <= self._heard.get(stream, -1):
            return Refusal.REPLAYED
        if time + MINUTE < self._now():
            return Refusal.OLD
        self._heard[stream] = time
        self._newest = max(self._newest, time)
        if self._clock.boot_s() >= self._keep_due_s:
            self._keep()
        return None

    def knows(self, system: int) -> bool:
        """Whether a frame of that system was ever accepted."""
        return any(heard == system for heard, _, _ in self._heard)

    def close(self) -> None:
        """Save the times as they are now."""
        self._reserved = self._sent
        self._keep()

    def _now(self) -> int:
        clock = round((self._clock.unix_s() - EPOCH_UNIX_S) * STEPS_A_S)
        return max(clock, self._newest, 0)

    def _keep(self) -> None:
        self._keep_due_s = self._clock.boot_s() + KEEP_EVERY_S
        if self._file is None:
            return
        heard = {" ".join(map(str, stream)): time for stream, time in self._heard.items()}
        try:
            self._file.parent.mkdir(parents=True, exist_ok=True)
            with whole(self._file) as file:
                file.write(json.dumps({"sent": self._reserved, "heard": heard}).encode())
            self.fault = ""
        except OSError as error:
            self.fault = (
                f"{self._file}: the times of signatures can't be kept ({error.strerror}), so that after a restart "
                "a frame of the last minute could be replayed; check the disk"
            )


def _kept(file: Path) -> tuple[int, dict[Stream, int]]:
    """Return the kept times: the last that may have been sent, and the last heard of each stream.

    If the file is absent or invalid they are 0 and {}: the clock serves then.
    """
    try:
        kept = from_json(read_small(file))
        return _time(kept["sent"]), {_stream(name): _time(time) for name, time in kept["heard"].items()}
    except (OSError, ValueError, LookupError, TypeError, AttributeError):
        return 0, {}


def _time(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= LATEST:
        raise ValueError
    return value


def _stream(name: str) -> Stream:
    system, component, link = map(int, name.split())
    return system, component, link


RADIO_STATUS: Final = 109
"""Status of a radio, which holds no key; the guide lets this message in unsigned."""
PATIENCE_S: Final = 2.0
GONE_S: Final = 5.0
AGAIN_EVERY_S: Final = 30.0
MOST_TOLD: Final = 8
"""Senders of one kind that are named at a time: invented systems must not drown the reports that matter."""

Sender = tuple[int, int]
"""System and component."""

_TO_DO: Final = {
    # Anyone can send unsigned frames: a stranger's word is no reason to advise leaving the key out here.
    Refusal.UNSIGNED: (
        "is not signed; give its side the same key with --sign-key if it is yours, and none to a stranger"
    ),
    Refusal.OTHER_KEY: (
        "is signed with another key; compare the fingerprints that `seatrial keys show FILE` tells on both sides"
    ),
    Refusal.REPLAYED: (
        "repeats times that were heard before; end what replays it, or the second program that signs as that system"
    ),
    Refusal.OLD: (
        "was signed more than a minute ago by this side's time; set the clocks of both sides, "
        "or send it something, such as record --heartbeat does, from which it learns the time"
    ),
}


@dataclass(frozen=True)
class Trouble:
    """A sender (system, component) of which nothing is let in on a link, and why.

    `sender` is None for all senders beyond those that are named.
    """

    link: str
    sender: Sender | None
    refusal: Refusal

    @property
    def sentence(self) -> str:
        """The trouble and the remedy, for the person at this end of the link."""
        to_do = _TO_DO[self.refusal]
        if self.sender is None:
            return (
                f"{self.link}: more senders are refused than are named; yours is among them where it {to_do}"
            )
        system, component = self.sender
        return f"{self.link}: all that system {system}, component {component}, sends is refused, since it {to_do}"

    @property
    def brief(self) -> str:
        """The trouble in short, for a vehicle to send to its ground."""
        who = "more systems are" if self.sender is None else f"system {self.sender[0]}/{self.sender[1]} is"
        return f"{who} refused: {self.refusal.value}"


@dataclass
class _Refused:
    since_s: float
    last_s: float
    tell_s: float
    known: bool


class Gate:
    """Signs outgoing frames on the link `name` and judges incoming ones; `counts` holds the refusals by reason.

    `tell` gets the trouble with a component of which nothing is let in, within 3 s of the first refused frame, and
    again each half minute while that lasts. `number` is the link's number in signatures; `system` is the system that
    this side was set to follow, None if it follows none. The link's reader and writer use the gate, one at a time.
    """

    def __init__(
        self,
        name: str,
        key: SigningKey,
        times: Times,
        clock: Clock,
        tell: Callable[[Trouble], None],
        number: int = 0,
        system: int | None = None,
    ) -> None:
        self.counts: Counter[Refusal] = Counter()
        self._name, self._secret, self._number = name, key.secret, number
        self._times, self._clock, self._tell = times, clock, tell
        self._system = system
        self._refused: dict[tuple[Refusal, Sender | None], _Refused] = {}

    @property
    def words(self) -> str:
        """Refusals so far, such as `12 unsigned, 3 of another key refused`; "" if there were none."""
        parts = [f"{self.counts[refusal]} {refusal.value}" for refusal in Refusal if self.counts.get(refusal)]
        return f"{', '.join(parts)} refused" if parts else ""

    @property
    def trouble(self) -> str:
        """Advice for the crew if nothing of a component is let in; "" if all is well."""
        now_s = self._clock.boot_s()
        lasting = [item for item in list(self._refused.items()) if now_s - item[1].since_s >= PATIENCE_S]
        if not lasting:
            return ""
        (refusal, sender), _ = min(lasting, key=_matters)
        return Trouble(self._name, sender, refusal).sentence

    @property
    def fault(self) -> str:
        """Why the times can't be kept over a restart, "" if they can."""
        return self._times.fault

    def out(self, raw: bytes) -> bytes:
        """Return a complete outgoing frame, signed. Raises FrameError for MAVLink 1, which can't be signed."""
        return signed(raw, self._secret, self._number, self._times.next())

    def admit(self, frame: Frame) -> bytes:
        """Return an incoming frame without its signature; b"" if it is refused."""
        if frame.message_id == RADIO_STATUS and not is_signed(frame.raw):
            return frame.raw
        refusal, sender = self._judge(frame), (frame.system, frame.component)
        if refusal is None:
            for reason in Refusal:
                self._refused.pop((reason, sender), None)
            return unsigned(frame.raw)
        self.counts[refusal] += 1
        now_s = self._clock.boot_s()
        entry = self._refused.get((refusal, sender)) or self._place(refusal, sender, now_s)
        entry.last_s = now_s
        return b""

    def look(self) -> None:
        """Report the troubles that are due. Call with every read."""
        now_s = self._clock.boot_s()
        for (refusal, sender), entry in list(self._refused.items()):
            if now_s >= entry.tell_s:
                entry.tell_s = now_s + AGAIN_EVERY_S
                self._tell(Trouble(self._name, sender, refusal))
            if now_s - entry.last_s > GONE_S:
                del self._refused[refusal, sender]

    def close(self) -> None:
        """Save the times of the signatures."""
        self._times.close()

    def _judge(self, frame: Frame) -> Refusal | None:
        if not is_signed(frame.raw):
            return Refusal.UNSIGNED
        if not is_of(frame.raw, self._secret):
            return Refusal.OTHER_KEY
        link, time = link_and_time(frame.raw)
        return self._times.take((frame.system, frame.component, link), time)

    def _place(self, refusal: Refusal, sender: Sender, now_s: float) -> _Refused:
        """Return a place for a sender that has none: its own, or the shared place if its kind has no more."""
        known = sender[0] == self._system or self._times.knows(sender[0])
        alike = sum(
            reason is refusal and placed is not None and entry.known is known
            for (reason, placed), entry in self._refused.items()
        )
        named = sender if alike < MOST_TOLD else None
        return self._refused.setdefault((refusal, named), _Refused(now_s, now_s, now_s + PATIENCE_S, known))


def _matters(item: tuple[tuple[Refusal, Sender | None], _Refused]) -> tuple[bool, bool, bool]:
    """Sort key for the trouble to show if only one can be shown, the smallest first.

    Known senders come first, then frames that were signed at all, then the note that there are more senders.
    """
    (refusal, sender), entry = item
    return (sender is None or not entry.known, refusal is Refusal.UNSIGNED, sender is not None)
