"""Rings for alarms: the bell of whoever shows them, and a program that makes a sound."""

import shlex
import shutil
import subprocess
from collections.abc import Callable, Sequence

from bridge.errors import ConfigError
from gcs_plugin.watch.alarms import BACK_S, Settings
from gcs_plugin.watch.picture import Alarm, Kind


class Bell:
    """Rings once for each alarm that wasn't there in the last BACK_S; `bell` rings the terminal's own. A value at its
    limit would ring without end.

    `played` is the sound that plays, or played last. Raises ConfigError if the sound's program is not on this computer.
    The terminal's bell rings in place of a sound that can't be started.
    """

    def __init__(self, settings: Settings, bell: Callable[[], object]) -> None:
        self._bell, self._is_on = bell, settings.bell
        try:
            self._sound = shlex.split(settings.sound)
        except ValueError:
            raise ConfigError(
                f"alarms: sound: a quote in {settings.sound} is not closed; close it, or leave it out"
            ) from None
        if self._sound and shutil.which(self._sound[0]) is None:
            raise ConfigError(f"alarms: sound: no program '{self._sound[0]}' is here; give another, or none")
        self.played: subprocess.Popen[bytes] | None = None
        self._last_s: dict[tuple[Kind, str], float] = {}

    def hear(self, alarms: Sequence[Alarm], now_s: float) -> tuple[Alarm, ...]:
        """Take the alarms of `now_s`; ring for those that are new, and return them."""
        recent = {key: last_s for key, last_s in self._last_s.items() if now_s - last_s <= BACK_S}
        new = tuple(alarm for alarm in alarms if alarm.key not in recent)
        self._last_s = recent | dict.fromkeys((alarm.key for alarm in alarms), now_s)
        if new and (self._fails() or self._is_on):
            self._bell()
        return new

    def _fails(self) -> bool:
        """Play the sound, if there is one; return whether it can't be started."""
        if not self._sound:
            return False
        try:
            self.played = subprocess.Popen(
                self._sound,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                start_new_session=True,
            )
        except OSError:
            return True
        return False
