"""Rings for alarms: the bell of whoever shows them, and a program that makes a sound."""

import shlex
import shutil
import subprocess
from collections.abc import Callable, Sequence

from bridge.errors import ConfigError
from gcs_plugin.watch.alarms import Settings
from gcs_plugin.watch.picture import Alarm, Kind


class Bell:
    """Rings once for each alarm that wasn't there before; `bell` rings the terminal's own.

    `played` is the sound that plays, or played last. Raises ConfigError if the sound's program is not on this computer.
    """

    def __init__(self, settings: Settings, bell: Callable[[], object]) -> None:
        self._bell = bell if settings.bell else _silence
        self._sound = shlex.split(settings.sound)
        if self._sound and shutil.which(self._sound[0]) is None:
            raise ConfigError(f"alarms: sound: no program '{self._sound[0]}' is here; give another, or none")
        self.played: subprocess.Popen[bytes] | None = None
        self._known: frozenset[tuple[Kind, str]] = frozenset()

    def hear(self, alarms: Sequence[Alarm]) -> tuple[Alarm, ...]:
        """Take the alarms of now; ring for those that are new, and return them."""
        new = tuple(alarm for alarm in alarms if alarm.key not in self._known)
        self._known = frozenset(alarm.key for alarm in alarms)
        if new:
            self._bell()
            if self._sound:
                self.played = subprocess.Popen(
                    self._sound,
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    stderr=subprocess.DEVNULL,
                    start_new_session=True,
                )
        return new


def _silence() -> None:
    """No bell."""
