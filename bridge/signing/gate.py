"""Who is let in on a signed link, who is not, and when the crew must hear of it.

Anyone can make up senders, so that places in memory and words are bounded. Each reason has places of its own, and
within it those who signed rightly before, or whom this side was told to follow, have theirs: strangers of one kind
take none of another. Who finds no place is told of in one sentence for all of these.
"""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from bridge.clock import Clock
from bridge.framing import Frame
from bridge.signing.frame import is_of, is_signed, link_and_time, signed, unsigned
from bridge.signing.key import SigningKey
from bridge.signing.times import Refusal, Times

RADIO_STATUS: Final = 109
"""What a radio says of itself; it holds no key, so that the guide lets this one in unsigned."""
PATIENCE_S: Final = 2.0
GONE_S: Final = 5.0
AGAIN_EVERY_S: Final = 30.0
MOST_TOLD: Final = 8
"""Senders of one kind that are named at a time: who invents systems must not drown what matters."""

Sender = tuple[int, int]
"""System, component."""

_TO_DO: Final = {
    # Anyone can send this: to leave the key out here is no advice on a stranger's word.
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
    """The sender (system, component) of which nothing is let in on a link, and why; None for more than are named."""

    link: str
    sender: Sender | None
    refusal: Refusal

    @property
    def sentence(self) -> str:
        """For who reads it beside the link."""
        to_do = _TO_DO[self.refusal]
        if self.sender is None:
            return (
                f"{self.link}: more senders are refused than are named; yours is among them where it {to_do}"
            )
        system, component = self.sender
        return f"{self.link}: all that system {system}, component {component}, sends is refused, since it {to_do}"

    @property
    def brief(self) -> str:
        """For a vehicle to say to its ground."""
        who = "more systems are" if self.sender is None else f"system {self.sender[0]}/{self.sender[1]} is"
        return f"{who} refused: {self.refusal.value}"


@dataclass
class _Refused:
    since_s: float
    last_s: float
    tell_s: float
    known: bool


class Gate:
    """Signs what goes out on the link `name` and judges what comes in, counted by kind in `counts`.

    `tell` hears of a component of which nothing is let in within 3 s of the first frame refused, and each half minute
    while that lasts. `number` is the link's in signatures, `system` whom this side was told to follow, None for nobody.
    Used by the link's reader and writer, one at a time.
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
        """What was refused so far: `12 unsigned, 3 of another key refused`; "" for nothing."""
        parts = [f"{self.counts[refusal]} {refusal.value}" for refusal in Refusal if self.counts.get(refusal)]
        return f"{', '.join(parts)} refused" if parts else ""

    @property
    def trouble(self) -> str:
        """What the crew must do where nothing of a component is let in; "" where all is well."""
        now_s = self._clock.boot_s()
        lasting = [item for item in list(self._refused.items()) if now_s - item[1].since_s >= PATIENCE_S]
        if not lasting:
            return ""
        (refusal, sender), _ = min(lasting, key=_matters)
        return Trouble(self._name, sender, refusal).sentence

    @property
    def fault(self) -> str:
        """Why the times can't be kept over a restart, "" where they can."""
        return self._times.fault

    def out(self, raw: bytes) -> bytes:
        """A whole frame as it goes out. Raises FrameError for MAVLink 1, which can't be signed."""
        return signed(raw, self._secret, self._number, self._times.next())

    def admit(self, frame: Frame) -> bytes:
        """A frame that came, without its signature; b"" where it is refused."""
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
        """Tell what is due; to be called with every read."""
        now_s = self._clock.boot_s()
        for (refusal, sender), entry in list(self._refused.items()):
            if now_s >= entry.tell_s:
                entry.tell_s = now_s + AGAIN_EVERY_S
                self._tell(Trouble(self._name, sender, refusal))
            if now_s - entry.last_s > GONE_S:
                del self._refused[refusal, sender]

    def close(self) -> None:
        """Keep the times of the signatures."""
        self._times.close()

    def _judge(self, frame: Frame) -> Refusal | None:
        if not is_signed(frame.raw):
            return Refusal.UNSIGNED
        if not is_of(frame.raw, self._secret):
            return Refusal.OTHER_KEY
        link, time = link_and_time(frame.raw)
        return self._times.take((frame.system, frame.component, link), time)

    def _place(self, refusal: Refusal, sender: Sender, now_s: float) -> _Refused:
        """A place for one that has none: its own, or that of all for whom there is none."""
        known = sender[0] == self._system or self._times.knows(sender[0])
        alike = sum(
            reason is refusal and other is not None and entry.known is known
            for (reason, other), entry in self._refused.items()
        )
        whose = sender if alike < MOST_TOLD else None
        return self._refused.setdefault((refusal, whose), _Refused(now_s, now_s, now_s + PATIENCE_S, known))


def _matters(item: tuple[tuple[Refusal, Sender | None], _Refused]) -> tuple[bool, bool, bool]:
    """What comes first where one sentence must do: the known, what was signed at all, then that there are more."""
    (refusal, sender), entry = item
    return (sender is None or not entry.known, refusal is Refusal.UNSIGNED, sender is not None)
