"""Pass on the texts of vehicles while they are recorded, and warn when a vehicle has restarted."""

from collections.abc import Callable
from typing import Any

from gcs_plugin.recorded import Recorded
from gcs_plugin.recorder import Recorder
from gcs_plugin.restarts import Restarts
from gcs_plugin.watch import words

Tell = Callable[[str], None]


class StatusTexts(words.StatusTexts):
    """Takes every frame of a link; `tell` gets each complete text with the number of its vehicle."""

    def __init__(self, tell: Tell) -> None:
        super().__init__(lambda source, _severity, text: tell(f"vehicle {source[0]}: {text}"))


class TellingRecorder(Recorder):
    """A recorder that passes on the texts of vehicles and warns of restarts."""

    def __init__(self, tell: Tell, *of_recorder: Any) -> None:
        self._texts = StatusTexts(tell)
        self._restarts = Restarts()
        super().__init__(*of_recorder)

    def step(self, timeout_s: float) -> list[Recorded]:
        taken = super().step(timeout_s)
        for item in taken:
            self._texts.hear(item.frame)
            restart = self._restarts.on_frame(item.frame, item.unix_us / 1e6)
            if restart is not None:
                self._say("warning", restart.words(0.0))
        return taken
