"""What is kept of each sender: a table that nobody who makes up addresses can fill for good, or without end."""

from collections import OrderedDict
from typing import Final, Generic, TypeVar

MOST_SENDERS: Final = 256  # components: far more than any fleet has
GONE_S: Final = 60.0

Source = tuple[int, int]
T = TypeVar("T")


class Senders(Generic[T]):
    """Where all places are taken, one who has been silent for `GONE_S` leaves his to the next; none who speaks does."""

    def __init__(self) -> None:
        # In the order in which they were last heard.
        self._kept: OrderedDict[Source, tuple[float, T]] = OrderedDict()

    def put(self, source: Source, time_s: float, kept: T) -> bool:
        """Keep this of one who speaks at `time_s`; False where there is no place for him."""
        if source not in self._kept and len(self._kept) >= MOST_SENDERS and not self.let_go(time_s):
            return False
        self._kept[source] = time_s, kept
        self._kept.move_to_end(source)
        return True

    def get(self, source: Source) -> T | None:
        """What is kept of a sender, None where nothing is."""
        found = self._kept.get(source)
        return None if found is None else found[1]

    def heard_s(self, source: Source) -> float:
        """When he last spoke; -inf for one of whom nothing is kept."""
        found = self._kept.get(source)
        return float("-inf") if found is None else found[0]

    def items(self) -> list[tuple[Source, T]]:
        """Everybody, the one who was heard last at the end."""
        return [(source, kept) for source, (_, kept) in self._kept.items()]

    def let_go(self, time_s: float) -> bool:
        """Forget the one who has been silent the longest, if for more than `GONE_S`; False where nobody has."""
        if not self._kept:
            return False
        source, (heard_s, _) = next(iter(self._kept.items()))
        if time_s - heard_s <= GONE_S:
            return False
        del self._kept[source]
        return True
