"""Who is let in on a signed link, who is not, and when the crew must hear of it."""

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
"""Systems of which it is told at a time: who invents systems must not drown what matters."""

_TO_DO: Final = {
    Refusal.UNSIGNED: "is not signed; give its side the same key with --sign-key, or leave --sign-key out here",
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
    """A component of a system of which nothing is let in on a link, and why."""

    link: str
    system: int
    component: int
    refusal: Refusal

    @property
    def sentence(self) -> str:
        """For who reads it beside the link."""
        who = f"system {self.system}, component {self.component},"
        return f"{self.link}: all that {who} sends is refused, since it {_TO_DO[self.refusal]}"

    @property
    def brief(self) -> str:
        """For a vehicle to say to its ground."""
        return f"system {self.system}/{self.component} is refused: {self.refusal.value}"


@dataclass
class _Refused:
    since_s: float
    last_s: float
    refusal: Refusal
    tell_s: float


class Gate:
    """Signs what goes out on the link `name` and judges what comes in, counted by kind in `counts`.

    `tell` hears of a component of which nothing is let in within 3 s of the first frame refused, and each half minute
    while that lasts. `number` is the link's in signatures. Used by the link's reader and writer, one at a time.
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
        self._refused: dict[tuple[int, int], _Refused] = {}

    @property
    def words(self) -> str:
        """What was refused so far: `12 unsigned, 3 of another key refused`; "" for nothing."""
        parts = [f"{self.counts[refusal]} {refusal.value}" for refusal in Refusal if self.counts.get(refusal)]
        return f"{', '.join(parts)} refused" if parts else ""

    @property
    def trouble(self) -> str:
        """What the crew must do where nothing of a component is let in; "" where all is well."""
        now_s = self._clock.boot_s()
        return next(
            (
                Trouble(self._name, *source, entry.refusal).sentence
                for source, entry in list(self._refused.items())
                if now_s - entry.since_s >= PATIENCE_S
            ),
            "",
        )

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
        refusal, source = self._judge(frame), (frame.system, frame.component)
        if refusal is None:
            self._refused.pop(source, None)
            return unsigned(frame.raw)
        self.counts[refusal] += 1
        if source in self._refused or len(self._refused) < MOST_TOLD:
            now_s = self._clock.boot_s()
            first = _Refused(now_s, now_s, refusal, now_s + PATIENCE_S)
            entry = self._refused.setdefault(source, first)
            entry.last_s, entry.refusal = now_s, refusal
        return b""

    def look(self) -> None:
        """Tell what is due; to be called with every read."""
        now_s = self._clock.boot_s()
        for source, entry in list(self._refused.items()):
            if now_s >= entry.tell_s:
                entry.tell_s = now_s + AGAIN_EVERY_S
                self._tell(Trouble(self._name, *source, entry.refusal))
            if now_s - entry.last_s > GONE_S:
                del self._refused[source]

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
