"""Put the merged frames of several recorders into the order in which each sender sent them, by its sequence numbers.

Two recorders stamp the same frame milliseconds apart, so the stamps alone may swap neighbouring frames.
"""

from collections import defaultdict
from collections.abc import Iterable
from typing import Final

from bridge.framing import MAGIC_2

WITHIN_US: Final = 250_000
NEAR: Final = 64
"""How many frames of its sender may have overtaken a frame. A number farther back means that the sender restarted, or
belongs to the next round of 256."""
SEQUENCES: Final = 256


def as_sent(records: Iterable[tuple[int, bytes]]) -> list[tuple[int, bytes]]:
    """Sort records with rising stamps, in us, so that each sender's frames follow its sequence; stamps stay put."""
    out: list[tuple[int, bytes]] = []
    tails: dict[tuple[int, int], list[int]] = defaultdict(list)
    for stamp_us, raw in records:
        tail = tails[sender(raw)]
        out.append((stamp_us, raw))
        tail.append(len(out) - 1)
        del tail[: -NEAR - 1]
        passed = 0
        for place in reversed(tail[:-1]):
            behind = (sequence(out[place][1]) - sequence(raw)) % SEQUENCES
            if not 0 < behind <= NEAR or stamp_us - out[place][0] > WITHIN_US:
                break
            passed += 1
        for after, place in zip(tail[: -passed - 2 : -1], tail[-2 : -passed - 2 : -1], strict=False):
            out[after] = out[after][0], out[place][1]
        if passed:
            place = tail[-passed - 1]
            out[place] = out[place][0], raw
    return out


def sender(raw: bytes) -> tuple[int, int]:
    """System and component of a complete frame."""
    return (raw[5], raw[6]) if raw[0] == MAGIC_2 else (raw[3], raw[4])


def sequence(raw: bytes) -> int:
    """Sequence number of a complete frame."""
    return raw[4] if raw[0] == MAGIC_2 else raw[2]
