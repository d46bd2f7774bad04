"""Decides who is let in on a signed link, and when the crew must hear of a sender that is refused.

Anyone can invent senders, so memory and messages are bounded. Each reason for a refusal has its own places. Within a
reason, senders that signed correctly before, or that this side was set to follow, have places apart from strangers.
Strangers of one kind thus take no places of another. All senders of a kind that find no place share one message.
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
