"""The parameter set that a vehicle says it flies, whoever asked it or changed the set."""

import math
import re
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Frame, decode
from bridge.parameters import ACTIVE, COMMIT

_NEWS: Final = re.compile(r"FF set (\d+) active")
_PARAM_VALUE: Final[int] = dialect.MAVLINK_MSG_ID_PARAM_VALUE


class ActiveSet:
    """Follows the frames and texts of a vehicle: FF_ACTIVE, FF_COMMIT (read in the same way), and its news in words.

    `number` is the set's number, None if not yet known; `told_s` is the time of the last message that stated it.
    """

    def __init__(self) -> None:
        self.number: int | None = None
        self.told_s = -math.inf

    def hear(self, frame: Frame, arrived_s: float) -> None:
        """Take a frame of the vehicle."""
        if frame.message_id != _PARAM_VALUE:
            return
        message = decode(frame)
        if message is not None and message.param_id in (ACTIVE, COMMIT) and message.param_value.is_integer():
            self.number, self.told_s = int(message.param_value), arrived_s

    def read(self, text: str, arrived_s: float) -> None:
        """Take a text of the vehicle."""
        news = _NEWS.fullmatch(text)
        if news is not None:
            self.number, self.told_s = int(news.group(1)), arrived_s
