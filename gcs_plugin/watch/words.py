"""STATUSTEXT messages of vehicles: long texts joined from their pieces, printable on a screen."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.text import printable
from bridge.wire.framing import Frame, decode
from bridge.wire.status_codes import CrewText, decoded

PIECE_CHARACTERS: Final = 50
LONGEST_CHARACTERS: Final = 1000
MOST_BEGUN: Final = 256

Tell = Callable[[tuple[int, int], int, CrewText], None]
"""Called with (system, component), severity and text."""


@dataclass(frozen=True, slots=True)
class _Begun:
    number: int
    severity: int
    text: str


class StatusTexts:
    """Takes every frame of a link; `tell` gets each text once it is complete, or at its sender's next heartbeat."""

    def __init__(self, tell: Tell) -> None:
        self._tell = tell
        self._begun: dict[tuple[int, int], _Begun] = {}

    def hear(self, frame: Frame) -> None:
        if frame.message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT:
            self._end((frame.system, frame.component))
        elif frame.message_id == dialect.MAVLINK_MSG_ID_STATUSTEXT:
            self._take(frame)

    def _take(self, frame: Frame) -> None:
        source = (frame.system, frame.component)
        message = decode(frame)
        if message is None:
            return
        begun = self._begun.get(source)
        before = begun.text if begun is not None and message.id and begun.number == message.id else ""
        if not before:
            self._end(source)
        text = before + message.text
        if source not in self._begun and len(self._begun) >= MOST_BEGUN:
            self._end(next(iter(self._begun)))
        self._begun[source] = _Begun(message.id, message.severity, text)
        goes_on = message.id and len(message.text) >= PIECE_CHARACTERS
        if not goes_on or len(text) > LONGEST_CHARACTERS:
            self._end(source)

    def _end(self, source: tuple[int, int]) -> None:
        begun = self._begun.pop(source, None)
        if begun is not None and begun.text:
            self._tell(source, begun.severity, decoded(printable(begun.text)))
