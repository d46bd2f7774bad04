"""What vehicles say in words while they are recorded: STATUSTEXT, long ones joined, fit for a terminal."""

from collections.abc import Callable
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Frame, decode
from gcs_plugin.recorder import Recorded, Recorder

PIECE_CHARACTERS = 50
LONGEST_CHARACTERS = 1000

Tell = Callable[[str], None]


class StatusTexts:
    """Hears every frame of a link; `tell` gets each text once it is whole, or at its vehicle's next heartbeat."""

    def __init__(self, tell: Tell) -> None:
        self._tell = tell
        self._begun: dict[tuple[int, int], tuple[int, str]] = {}

    def hear(self, frame: Frame) -> None:
        source = (frame.system, frame.component)
        if frame.message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT:
            self._end(source)
        if frame.message_id != dialect.MAVLINK_MSG_ID_STATUSTEXT:
            return
        message = decode(frame)
        if message is None:
            return
        number, before = self._begun.get(source, (0, ""))
        if not message.id or number != message.id:
            self._end(source)
            before = ""
        self._begun[source] = message.id, before + message.text
        goes_on = message.id and len(message.text) >= PIECE_CHARACTERS
        if not goes_on or len(before) > LONGEST_CHARACTERS:
            self._end(source)

    def _end(self, source: tuple[int, int]) -> None:
        _, text = self._begun.pop(source, (0, ""))
        if text:
            self._tell(f"vehicle {source[0]}: {printable(text)}")


class TellingRecorder(Recorder):
    """A recorder that hands on what vehicles say in words."""

    def __init__(self, tell: Tell, *of_recorder: Any) -> None:
        self._texts = StatusTexts(tell)
        super().__init__(*of_recorder)

    def step(self, timeout_s: float) -> list[Recorded]:
        taken = super().step(timeout_s)
        for item in taken:
            self._texts.hear(item.frame)
        return taken


def printable(text: str) -> str:
    """`text` without what could steer a terminal."""
    return "".join(c for c in text if c.isprintable())
