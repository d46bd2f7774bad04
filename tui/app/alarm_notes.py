"""Alarms as events of the dive being recorded, so that whoever looked away, or comes after, learns of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from gcs_plugin.watch.picture import Alarm, Kind
from tui.app.view import View

AGAIN_S: Final = 60.0
"""An alarm that comes back sooner is the same event."""


@dataclass(frozen=True)
class AlarmEvent:
    """An event of a dive folder, at a Unix time of the recording's clock."""

    folder: Path
    unix_s: float
    text: str


class AlarmNotes:
    """Takes the alarms that are new; gives those that are events of the dive being recorded."""

    def __init__(self) -> None:
        self._noted_s: dict[tuple[str, Kind, str], float] = {}

    def take(self, new: Sequence[Alarm], view: View) -> tuple[AlarmEvent, ...]:
        """None without a recording, or in an app that only looks: it leaves no traces."""
        recording = view.recording
        if recording is None or view.view_only:
            return ()
        now_s, events = recording.own_unix_s(view.unix_s), []
        for alarm in new:
            key = (recording.folder, *alarm.key)
            if now_s - self._noted_s.get(key, -AGAIN_S) >= AGAIN_S:
                self._noted_s[key] = now_s
                events.append(AlarmEvent(Path(recording.folder), now_s, f"ALARM {alarm.words}"))
        return tuple(events)
