"""Asks the autopilot for the messages that a dive needs, one by one, and again for each that is not acknowledged.

Never for every id: some end a firmware (`Firmware.never_asked`). A message that is denied is not asked for again.
"""

import math
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.firmware.description import AUTOPILOT, Firmware

AGAIN_S: Final = 1.0
STREAM_AGAIN_S: Final = 3.0
RENEW_S: Final = 60.0
"""An autopilot that rebooted has forgotten all rates, and beats on as if nothing had been."""

_ACCEPTED: Final = (dialect.MAV_RESULT_ACCEPTED, dialect.MAV_RESULT_IN_PROGRESS)


class Rates:
    """One request is under way at a time; `denied` are the ids that the autopilot does not send."""

    def __init__(self, system: int, firmware: Firmware) -> None:
        self._target, self._firmware = (system, AUTOPILOT), firmware
        self._left = list(firmware.rates_hz)
        self._asked: int | None = None
        self._due_s = self._stream_due_s = -math.inf
        self._renew_s = math.inf
        self.denied: set[int] = set()

    @property
    def settled(self) -> bool:
        """Whether every message was granted or denied."""
        return not self._left

    def step(self, now_s: float, has_stream: bool) -> list[Any]:
        """The request to send now, if any; `has_stream`: messages of the firmware's stream alone do come."""
        stream = self._firmware.stream
        if stream is not None and not has_stream and now_s >= self._stream_due_s:
            # Asked first: it sets the rates of all that the stream carries anew.
            self._stream_due_s = now_s + STREAM_AGAIN_S
            self.begin_anew()
            rate_hz = self._firmware.stream_hz
            return [dialect.MAVLink_request_data_stream_message(*self._target, stream, rate_hz, 1)]
        if not self._left and now_s >= self._renew_s:
            self.begin_anew()
        if not self._left or now_s < self._due_s:
            return []
        self._asked, self._due_s = self._left[0], now_s + AGAIN_S
        interval_us = 1e6 / self._firmware.rates_hz[self._asked]
        return [
            dialect.MAVLink_command_long_message(
                *self._target,
                dialect.MAV_CMD_SET_MESSAGE_INTERVAL,
                0,
                self._asked,
                interval_us,
                0,
                0,
                0,
                0,
                0,
            )
        ]

    def on_ack(self, message: Any, now_s: float) -> None:
        """A COMMAND_ACK of the autopilot; it names no message, hence one request at a time."""
        if message.command != dialect.MAV_CMD_SET_MESSAGE_INTERVAL or self._asked is None:
            return
        if message.result not in _ACCEPTED:
            self.denied.add(self._asked)
        self._left.remove(self._asked)
        self._asked, self._due_s = None, now_s
        if not self._left:
            self._renew_s = now_s + RENEW_S

    def begin_anew(self) -> None:
        """Ask for everything again, but for what was denied."""
        self._left = [number for number in self._firmware.rates_hz if number not in self.denied]
        self._asked, self._due_s = None, -math.inf
