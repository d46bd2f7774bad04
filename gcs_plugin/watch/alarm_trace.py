"""Alarms that are gone: each stands among the vehicle's words, with how long it lasted."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from gcs_plugin.watch.picture import Alarm, Kind, Said

SEVERITY, SEVERITY_OVER = 3, 4
"""MAV_SEVERITY of an alarm among the words: an error while it holds, a warning once it is over."""

KEPT: Final = 10
BACK_S: Final = 10.0
"""An alarm that comes back so soon goes on: a value near its limit would fill the list."""


@dataclass(frozen=True)
class _Lasted:
    """An alarm with its last words; `last_s` is when it was last seen."""

    alarm: Alarm
    began_s: float
    last_s: float
    utc_s: float


class AlarmTrace:
    """Takes the alarms of each picture. Those in the vehicle's own words are left out: the words stand there anyway."""

    def __init__(self) -> None:
        self._lasted: deque[_Lasted] = deque(maxlen=KEPT)

    def take(self, alarms: Sequence[Alarm], now_s: float, unix_s: float) -> None:
        """The alarms that hold at `now_s`, Unix time `unix_s` (NaN if nobody knows the date)."""
        for alarm in alarms:
            if alarm.kind is Kind.VEHICLE:
                continue
            same = (n for n, kept in enumerate(self._lasted) if kept.alarm.key == alarm.key)
            before = next((n for n in same if now_s - self._lasted[n].last_s <= BACK_S), None)
            if before is None:
                self._lasted.append(_Lasted(alarm, now_s, now_s, unix_s))
            else:
                kept = self._lasted[before]
                self._lasted[before] = _Lasted(alarm, kept.began_s, now_s, kept.utc_s)

    def said(self, now_s: float) -> tuple[Said, ...]:
        """Each alarm as a text at the time at which it began, the oldest first."""
        return tuple(self._text(kept, now_s) for kept in self._lasted)

    def _text(self, kept: _Lasted, now_s: float) -> Said:
        words = f"ALARM {kept.alarm.words}"
        if now_s - kept.last_s <= BACK_S:
            return Said(kept.utc_s, SEVERITY, words, kept.began_s)
        lasted_s = kept.last_s - kept.began_s
        return Said(kept.utc_s, SEVERITY_OVER, f"{words}; over after {lasted_s:.0f} s", kept.began_s)
