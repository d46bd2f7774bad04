"""Bounded table of values by sender: made-up addresses can neither fill it for good nor make it grow without limit."""

from collections import OrderedDict
from typing import Final, Generic, TypeVar

MOST_SENDERS: Final = 256  # components: far more than any fleet has
GONE_S: Final = 60.0

Source = tuple[int, int]
T = TypeVar("T")


class Senders(Generic[T]):
    """Table of at most MOST_SENDERS entries.

    When it is full, a sender silent for more than `GONE_S` is replaced, an active sender never.
    """

    def __init__(self) -> None:
        # In the order in which the senders were last heard.
        self._kept: OrderedDict[Source, tuple[float, T]] = OrderedDict()

    def put(self, source: Source, time_s: float, kept: T) -> bool:
        """Store the entry of a sender heard at `time_s`; False if the table is full."""
        if source not in self._kept and len(self._kept) >= MOST_SENDERS and not self.let_go(time_s):
            return False
        self._kept[source] = time_s, kept
        self._kept.move_to_end(source)
        return True

    def get(self, source: Source) -> T | None:
        """The entry of a sender, None if it has none."""
        entry = self._kept.get(source)
        return None if entry is None else entry[1]

    def heard_s(self, source: Source) -> float:
        """Time when a sender was last heard; -inf if it has no entry."""
        entry = self._kept.get(source)
        return float("-inf") if entry is None else entry[0]

    def items(self) -> list[tuple[Source, T]]:
        """All senders with their entries, the most recently heard last."""
        return [(source, kept) for source, (_, kept) in self._kept.items()]

    def let_go(self, time_s: float) -> bool:
        """Remove the sender that was silent longest, if for more than `GONE_S`; return whether one was removed."""
        if not self._kept:
            return False
        source, (heard_s, _) = next(iter(self._kept.items()))
        if time_s - heard_s <= GONE_S:
            return False
        del self._kept[source]
        return True
