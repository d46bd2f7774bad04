"""Reads an autopilot's parameters, each by a request of its own.

ArduSub answers nothing at all for a name that it does not know; such a name counts as unknown after `UNKNOWN_AFTER`
questions.
"""

import math
from collections.abc import Sequence
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

AGAIN_S: Final = 0.6
UNKNOWN_AFTER: Final = 5


class Questions:
    """Values by name as they come; a name that was asked for in vain has NaN. One question is open at a time."""

    def __init__(self, system: int, component: int, names: Sequence[str]) -> None:
        self._target, self._names = (system, component), names
        self.values: dict[str, float] = {}
        self._asked, self._due_s = 0, -math.inf

    @property
    def complete(self) -> bool:
        return len(self.values) == len(self._names)

    def step(self, now_s: float) -> list[Any]:
        name = next((name for name in self._names if name not in self.values), None)
        if name is None or now_s < self._due_s:
            return []
        if self._asked >= UNKNOWN_AFTER:
            self.values[name], self._asked = math.nan, 0
            return []
        self._asked, self._due_s = self._asked + 1, now_s + AGAIN_S
        return [dialect.MAVLink_param_request_read_message(*self._target, name.encode(), -1)]

    def on_value(self, name: str, value: float) -> None:
        """A PARAM_VALUE of the autopilot's own component arrived, asked for or not."""
        if name in self._names:
            if name not in self.values:
                self._asked, self._due_s = 0, -math.inf
            self.values[name] = value


def unread(name: str, verb: str = "is") -> str:
    """The sentence for the crew on a value that the autopilot has not answered yet."""
    return f"{name} {verb} not read yet: wait, or look at the autopilot's link"
