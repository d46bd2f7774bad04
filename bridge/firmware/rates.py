"""Asks the autopilot for the messages that a dive needs, one by one, and again for each that is not acknowledged.

Never for every id: some end a firmware (`Firmware.never_asked`). A message that is denied is not asked for again. What
came at its rate and comes far slower is asked for at once: the autopilot rebooted, or another program that shares the
link set rates of its own.
"""

import math
from collections import Counter
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.firmware.description import AUTOPILOT, Firmware

AGAIN_S: Final = 1.0
STREAM_AGAIN_S: Final = 3.0
RENEW_S: Final = 60.0
"""An autopilot that rebooted has forgotten all rates, and beats on as if nothing had been."""

LOOK_S: Final = 3.0
FULL_SHARE, SLOW_SHARE = 0.5, 0.25
LEAST_HZ: Final = 10.0
"""A slower message is not counted: a few that are lost would pass for a lower rate."""

_ACCEPTED: Final = (dialect.MAV_RESULT_ACCEPTED, dialect.MAV_RESULT_IN_PROGRESS)


class Rates:
    """One request is under way at a time; `denied` are the ids that the autopilot does not send.

    `system` is the autopilot's, `asker` the system and component that the requests come from.
    """

    def __init__(self, system: int, firmware: Firmware, asker: tuple[int, int]) -> None:
        self._target, self._firmware, self._asker = (system, AUTOPILOT), firmware, asker
        self._counts, self._full = Counter[int](), set[int]()
        self._looked_s = -math.inf
        self._left = list(firmware.rates_hz)
        self._asked: int | None = None
        self._times = 0
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
        if not self._left and (now_s >= self._renew_s or self._slowed(now_s)):
            self.begin_anew()
        if not self._left or now_s < self._due_s:
            return []
        self._times = self._times + 1 if self._asked is not None else 1
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

    def on_frame(self, number: int) -> None:
        """A message of the autopilot with this id arrived."""
        self._counts[number] += 1

    def _slowed(self, now_s: float) -> bool:
        """Whether a message that came at its rate comes far slower now."""
        spent_s = now_s - self._looked_s
        if spent_s < LOOK_S:
            return False
        rates = [(number, hz) for number, hz in self._firmware.rates_hz.items() if hz >= LEAST_HZ]
        shares = {number: self._counts[number] / (hz * spent_s) for number, hz in rates}
        self._counts.clear()
        self._looked_s = now_s
        slowed = any(shares[number] < SLOW_SHARE for number in self._full)
        self._full = set() if slowed else self._full | {n for n, s in shares.items() if s >= FULL_SHARE}
        return slowed

    def on_ack(self, message: Any, now_s: float) -> None:
        """A COMMAND_ACK of the autopilot; it names no message, hence one request at a time.

        After a request that was sent again, the next waits until the answers to all of them must have come.
        """
        if message.command != dialect.MAV_CMD_SET_MESSAGE_INTERVAL or self._asked is None:
            return
        # On a link that is shared the answers to others are heard too.
        if (message.target_system, message.target_component) not in ((0, 0), self._asker):
            return
        if message.result not in _ACCEPTED:
            self.denied.add(self._asked)
        self._left.remove(self._asked)
        late_s = self._times * AGAIN_S if self._times > 1 else 0.0
        self._asked, self._due_s = None, now_s + late_s
        if not self._left:
            self._renew_s = now_s + RENEW_S

    def begin_anew(self) -> None:
        """Ask for everything again that was not denied."""
        self._left = [number for number in self._firmware.rates_hz if number not in self.denied]
        self._asked, self._due_s = None, -math.inf
