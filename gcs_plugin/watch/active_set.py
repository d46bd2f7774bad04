"""Which set of parameters a vehicle says that it flies, whoever asked it or made it do so."""

import math
import re
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Frame, decode
from bridge.parameters import ACTIVE, COMMIT

_NEWS: Final = re.compile(r"FF set (\d+) active")
_PARAM_VALUE: Final[int] = dialect.MAVLINK_MSG_ID_PARAM_VALUE


class ActiveSet:
    """Hears the frames and the words of one vehicle: FF_ACTIVE and FF_COMMIT, which reads alike, and its news.

    `number` is the set's, None where it was not told yet; `told_s` when it was told last.
    """

    def __init__(self) -> None:
        self.number: int | None = None
        self.told_s = -math.inf

    def hear(self, frame: Frame, arrived_s: float) -> None:
        """A frame of the vehicle came."""
        if frame.message_id != _PARAM_VALUE:
            return
        message = decode(frame)
        if message is not None and message.param_id in (ACTIVE, COMMIT) and message.param_value.is_integer():
            self.number, self.told_s = int(message.param_value), arrived_s

    def read(self, text: str, arrived_s: float) -> None:
        """The vehicle said something in words."""
        news = _NEWS.fullmatch(text)
        if news is not None:
            self.number, self.told_s = int(news.group(1)), arrived_s
