"""The links of a bridge: frames in from each, bytes out to all. Reports once that a link failed or is back, and again
and again that it is too slow."""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final

from bridge.errors import LinkError
from bridge.links.link import Link
from bridge.wire.framing import Frame, Framer

LARGEST_WRITE: Final = 1200  # fits a datagram on every network
MOST_READS_A_STEP, MOST_BYTES_A_STEP = 64, 1 << 16
TELL_SLOW_EVERY_S: Final = 10.0


@dataclass
class _Side:
    """One link with its own framer. `fault` is why it fails, "" after a whole step in which it carried something and
    did not fail: one that opens, as a UDP port does without a network, carries nothing yet.

    `dropped` is the number of its lost writes that the crew knows of; `tell_s`: when it may hear of more.
    """

    link: Link
    framer: Framer = field(default_factory=Framer)
    fault: str = ""
    failed: bool = False
    carried: bool = False
    dropped: int = 0
    tell_s: float = -math.inf


class Sides:
    """Links by number; `say` tells the crew when a link is lost, back or too slow."""

    def __init__(self, links: Sequence[Link], say: Callable[[str], None]) -> None:
        self._sides = [_Side(link) for link in links]
        self._say = say

    @property
    def faults(self) -> dict[str, str]:
        """Why links do not work, by link name."""
        return {side.link.name: side.fault for side in self._sides if side.fault}

    def heard(self, now_s: float) -> Iterator[tuple[int, Frame]]:
        """Yield the frames that arrived since the last call, each with its link's number.

        A flood is not read to its end, for the loop that steers waits here.
        """
        for number, side in enumerate(self._sides):
            size = 0
            for _ in range(MOST_READS_A_STEP):
                try:
                    data = side.link.read(0.0)
                except LinkError as error:
                    self._failed(side, str(error))
                    break
                # A link that reconnects by itself raises nothing: its `fault` says that it is away.
                if not data and side.link.fault:
                    self._failed(side, side.link.fault)
                yield from ((number, frame) for frame in side.framer.hear(data, now_s))
                size += len(data)
                side.carried = side.carried or bool(data)
                if not data or size >= MOST_BYTES_A_STEP:
                    break

    def write(self, number: int, frames: Sequence[bytes]) -> None:
        """Send frames on one link, in as few writes as can carry them."""
        for data in _batches(frames):
            self._write(self._sides[number], data)

    def write_all(self, frames: Sequence[bytes], but: int = -1) -> None:
        """Send frames on every link except number `but`."""
        for data in _batches(frames):
            for number, side in enumerate(self._sides):
                if number != but:
                    self._write(side, data)

    def end_step(self, now_s: float) -> None:
        """Report the failed links that carried again for a whole step, and those that do not carry all."""
        for side in self._sides:
            if side.fault and side.carried and not side.failed:
                self._is_back(side)
            elif not side.fault and side.link.lost_writes > side.dropped and now_s >= side.tell_s:
                side.tell_s = now_s + TELL_SLOW_EVERY_S
                self._say(f"link too slow: {side.link.name}, {self._newly_lost(side)} writes lost")
            side.failed = side.carried = False

    def _write(self, side: _Side, data: bytes) -> None:
        lost = side.link.lost_writes
        try:
            side.link.write(data)
        except LinkError as error:
            self._failed(side, str(error))
            return
        if side.link.fault:
            self._failed(side, side.link.fault)
        side.carried = side.carried or side.link.lost_writes == lost

    def _is_back(self, side: _Side) -> None:
        # A link that reconnects by itself counts the writes that were lost meanwhile.
        lost = self._newly_lost(side)
        self._say(f"link back: {side.link.name}{f', {lost} writes lost' if lost else ''}")
        side.fault = ""

    @staticmethod
    def _newly_lost(side: _Side) -> int:
        """The writes lost that the crew did not know of."""
        before, side.dropped = side.dropped, side.link.lost_writes
        return side.dropped - before

    def _failed(self, side: _Side, fault: str) -> None:
        if not side.fault:
            self._say(f"link lost: {side.link.name}")
        side.fault, side.failed = fault, True


def _batches(frames: Sequence[bytes]) -> Iterable[bytes]:
    """Yield the frames in order, joined up to the size of one write."""
    batch: list[bytes] = []
    size = 0
    for frame in frames:
        if size + len(frame) > LARGEST_WRITE and batch:
            yield b"".join(batch)
            batch, size = [], 0
        batch.append(frame)
        size += len(frame)
    if batch:
        yield b"".join(batch)
