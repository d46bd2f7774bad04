"""Pass on the texts of vehicles while they are recorded."""

from collections.abc import Callable
from typing import Any

from gcs_plugin.recorded import Recorded
from gcs_plugin.recorder import Recorder
from gcs_plugin.watch import words

Tell = Callable[[str], None]


class StatusTexts(words.StatusTexts):
    """Takes every frame of a link; `tell` gets each complete text with the number of its vehicle."""

    def __init__(self, tell: Tell) -> None:
        super().__init__(lambda source, _severity, text: tell(f"vehicle {source[0]}: {text}"))


class TellingRecorder(Recorder):
    """A recorder that passes on the texts of vehicles."""

    def __init__(self, tell: Tell, *of_recorder: Any) -> None:
        self._texts = StatusTexts(tell)
        super().__init__(*of_recorder)

    def step(self, timeout_s: float) -> list[Recorded]:
        taken = super().step(timeout_s)
        for item in taken:
            self._texts.hear(item.frame)
        return taken
