"""Tells a crew which device is silent, which speaks without sense, and which is back."""

from collections.abc import Iterable

SILENT_S = 3.0


class SensorWatch:
    """What the vehicle's slots last gave, bytes and samples apart."""

    def __init__(self, slots: Iterable[str], now_s: float) -> None:
        self._bytes_s = dict.fromkeys(slots, now_s)
        self._samples_s = dict(self._bytes_s)
        self._silent: set[str] = set()

    def bytes_came(self, slot: str, time_s: float) -> None:
        self._bytes_s[slot] = time_s

    def sample_came(self, slot: str, time_s: float) -> None:
        self._samples_s[slot] = time_s

    def texts(self, now_s: float) -> list[str]:
        """One short sentence for each slot that fell silent, or came back, since the last call."""
        texts = []
        for slot, heard_s in self._samples_s.items():
            silent = now_s - heard_s > SILENT_S
            if silent and slot not in self._silent:
                self._silent.add(slot)
                speaks = now_s - self._bytes_s[slot] <= SILENT_S
                texts.append(
                    f"{slot} makes no sense: check its baud" if speaks else f"{slot} silent: check cable"
                )
            elif not silent and slot in self._silent:
                self._silent.remove(slot)
                texts.append(f"{slot} is back")
        return texts
