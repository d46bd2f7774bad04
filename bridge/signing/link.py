"""Links with and without a key: a signed link hears only senders with the key; the other warns if its peer signs.

A frame is refused if its stream (system, component, link) sent that time or a later one before, or if it is more than
a minute behind the newest time known here: this computer's clock, or a later time that was received. Outgoing frames
take the newest time as well, so that a side whose clock is behind learns the time from the first frame that it
accepts.
"""

import json
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from bridge.clock import Clock
from bridge.errors import FrameError
from bridge.files import read_small, write_whole
from bridge.links.link import Link, Wrapper
from bridge.plain import from_json
from bridge.signing.key import SigningKey, is_of, is_signed, link_and_time, signed, unsigned
from bridge.wire.framing import Frame, Framer, measure

if TYPE_CHECKING:
    from concurrent.futures import Executor

EPOCH_UNIX_S: Final = 1_420_070_400  # 2015-01-01
STEPS_A_S: Final = 100_000
MINUTE: Final = 60 * STEPS_A_S
LATEST: Final = (1 << 48) - 1
KEEP_EVERY_S: Final = 60.0
WAIT_S: Final = 0.05
"""A stalled disk holds up a link, and the control loop that writes to it, for no longer."""

Stream = tuple[int, int, int]
"""System, component and link number."""


class Refusal(Enum):
    """Why a frame is not let in. In messages, the value follows a number of frames."""

    UNSIGNED = "unsigned"
    OTHER_KEY = "of another key"
    REPLAYED = "replayed or late"
    OLD = "a minute old"


class Times:
    """The times of one link. `file` keeps them over restarts; without a file, or on a full or stalled disk, they are
    forgotten."""

    def __init__(self, clock: Clock, file: Path | None = None) -> None:
        self._clock, self._file = clock, file
        self._sent, self._heard = _kept(file) if file else (0, {})
        self._newest = max(self._heard.values(), default=0)
        self._reserved = self._sent
        self._keep_due_s = clock.boot_s()
        self._aside: Executor | None = None

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

    def close(self) -> None:
        self._reserved = self._sent
        self._keep()

    def _now(self) -> int:
        clock = round((self._clock.unix_s() - EPOCH_UNIX_S) * STEPS_A_S)
        return max(clock, self._newest, 0)

    def _keep(self) -> None:
        self._keep_due_s = self._clock.boot_s() + KEEP_EVERY_S
        if self._file is None:
            return
        from concurrent.futures import ThreadPoolExecutor, wait

        self._aside = self._aside or ThreadPoolExecutor(1, "keep times")
        heard = {" ".join(map(str, stream)): time for stream, time in self._heard.items()}
        text = json.dumps({"sent": self._reserved, "heard": heard})
        wait([self._aside.submit(_write, self._file, text)], WAIT_S)


def _write(file: Path, text: str) -> None:
    # Without them, a frame of the last minute could be replayed after a restart, which must stop no dive.
    with suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        write_whole(file, text)


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
MOST_NAMED: Final = 8
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


class Gate:
    """Signs outgoing frames on the link `name` and judges incoming ones; `counts` holds the refusals by reason.

    `tell` gets the trouble with a component of which nothing is let in, within 3 s of the first refused frame, and
    again each half minute while that lasts. `number` is the link's number in signatures. The link's reader and writer
    use the gate, one at a time.
    """

    def __init__(
        self,
        name: str,
        key: SigningKey,
        times: Times,
        clock: Clock,
        tell: Callable[[Trouble], None],
        number: int = 0,
    ) -> None:
        self.counts: Counter[Refusal] = Counter()
        self._name, self._secret, self._number = name, key.secret, number
        self._times, self._clock, self._tell = times, clock, tell
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

    def out(self, raw: bytes) -> bytes:
        """Return a complete outgoing frame, signed. Raises FrameError for MAVLink 1, which can't be signed."""
        return signed(raw, self._secret, self._number, self._times.next())

    def admit(self, frame: Frame) -> bytes:
        """Return an incoming frame without its signature; b"" if it is refused."""
        if frame.message_id == RADIO_STATUS and not is_signed(frame.raw):
            return frame.raw
        refusal = self._judge(frame)
        sender: Sender | None = (frame.system, frame.component)
        if refusal is None:
            for reason in Refusal:
                self._refused.pop((reason, sender), None)
            return unsigned(frame.raw)
        self.counts[refusal] += 1
        named = sum(reason is refusal and known is not None for reason, known in self._refused)
        if (refusal, sender) not in self._refused and named >= MOST_NAMED:
            sender = None
        now_s = self._clock.boot_s()
        self._refused.setdefault((refusal, sender), _Refused(now_s, now_s, now_s + PATIENCE_S)).last_s = now_s
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


def _matters(item: tuple[tuple[Refusal, Sender | None], _Refused]) -> tuple[bool, bool]:
    """Sort key for the trouble to show if only one can be shown, the smallest first.

    Frames that were signed at all come first, then the note that there are more senders than are named.
    """
    (refusal, sender), _ = item
    return refusal is Refusal.UNSIGNED, sender is not None


MOST_LOOKED_AT: Final = 200
"""Number of frames that are examined: a system that signs does so in each of its frames."""


class KeylessLink(Wrapper):
    """Passes all bytes on unchanged. Calls `tell` once, with a sentence, if a system signs its frames."""

    def __init__(self, link: Link, tell: Callable[[str], None]) -> None:
        super().__init__(link)
        self._tell = tell
        self._framer: Framer | None = Framer()
        self._looked_at = 0

    def read(self, timeout_s: float) -> bytes:
        data = self._link.read(timeout_s)
        if self._framer is not None and data:
            self._look(self._framer, data)
        return data

    def _look(self, framer: Framer, data: bytes) -> None:
        for frame in framer.feed(data):
            self._looked_at += 1
            if is_signed(frame.raw):
                self._framer = None
                self._tell(
                    f"{self.name}: system {frame.system} signs what it sends, and may refuse all that comes from here, "
                    "since this side has no key; give it the same one with --sign-key"
                )
                return
        if self._looked_at >= MOST_LOOKED_AT:
            self._framer = None


LARGEST_WRITE: Final = 1400  # signed frames must also fit a datagram on every network
MOST_REFUSED_A_READ: Final = 64


class SignedLink(Wrapper):
    """Checks incoming frames and passes them on without their signature; signs outgoing frames.

    Incoming bytes that are no frame are not passed on. Outgoing bytes that are no frame, and frames that can't be
    signed, are not sent; `dropped` counts these.
    """

    def __init__(self, link: Link, gate: Gate, clock: Clock) -> None:
        super().__init__(link)
        self._gate, self._clock = gate, clock
        self._framer = Framer()

    def read(self, timeout_s: float) -> bytes:
        # A stranger's datagrams must not delay those of the vehicle.
        for _ in range(MOST_REFUSED_A_READ):
            data = self._link.read(timeout_s)
            admitted = b"".join(map(self._gate.admit, self._framer.hear(data, self._clock.boot_s())))
            if admitted or not data:
                break
            timeout_s = 0.0
        self._gate.look()
        return admitted

    def write(self, data: bytes) -> None:
        batch = b""
        place = 0
        while place < len(data):
            size = measure(data, place)
            if size <= 0 or place + size > len(data):
                self.dropped += 1
                break
            out = self._signed(data[place : place + size])
            if len(batch) + len(out) > LARGEST_WRITE:
                self._link.write(batch)
                batch = b""
            batch += out
            place += size
        if batch:
            self._link.write(batch)

    def close(self) -> None:
        self._gate.close()
        self._link.close()

    def _signed(self, raw: bytes) -> bytes:
        try:
            return self._gate.out(raw)
        except FrameError:
            self.dropped += 1
            return b""
