"""Flights aboard: the ground's orders and the pilot's sticks on the way to the state machine."""

from collections import deque
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import ConfigError
from bridge.flight import orders
from bridge.flight.flight import WORDS, End, Flight, FlightInputs, State
from bridge.flight.orders import Order, Seven
from bridge.vehicle.config import Configuration
from bridge.vehicle.navigation import Navigation
from bridge.vehicle.references import Reference
from bridge.vehicle.thrusters import can_sway
from bridge.wire.readings import Reading

TOUCH: Final = 50
"""A stick this far from its rest, of 1000, is touched: more than any gamepad's noise."""
Z_REST: Final = 500
KEPT_NUMBERS: Final = 8
"""Of the orders to begin or to fly: a repeat may come late, on a slower way to the vehicle, after the end."""
TELL_EVERY_S, REST_TELL_EVERY_S = 0.2, 1.0
_MORE_AXES: Final = {"s": 1, "t": 2}
"""Pitch and roll, with the bit of `enabled_extensions` that says that they are in use."""
_HEARTBEAT: Final[int] = dialect.MAVLINK_MSG_ID_HEARTBEAT
_STICKS: Final[int] = dialect.MAVLINK_MSG_ID_MANUAL_CONTROL
_OVERRIDE: Final[int] = dialect.MAVLINK_MSG_ID_RC_CHANNELS_OVERRIDE
STICKS: Final = (_STICKS, _OVERRIDE)
HEARD: Final = (_HEARTBEAT, *STICKS)
CHANNELS: Final = 6
"""Inputs by which ArduSub moves: pitch, roll, throttle, yaw, forward, lateral."""
REST_US: Final = 1500
TOUCH_US: Final = 20
"""A touch of `TOUCH` is so many microseconds at a joystick's full gain."""
_RELEASED: Final = (0, 65535)

_ACCEPTED: Final = int(dialect.MAV_RESULT_ACCEPTED)
_DENIED: Final = int(dialect.MAV_RESULT_DENIED)
_AGAIN: Final = int(dialect.MAV_RESULT_TEMPORARILY_REJECTED)
"""Not all rows of the order arrived: send them again."""


class Flights:
    """Takes a vehicle's flight orders, and reports its flights."""

    def __init__(self, configuration: Configuration) -> None:
        self.flight = Flight(sways=can_sway(configuration))
        self._texts: list[str] = []
        self._ground_s = self._touched_s = -1e9
        self._here_s: float | None = None
        self._legs: dict[int, Seven] = {}
        self._rows: dict[int, Seven] = {}
        self._obeyed = 0.0
        self._begun = deque[float](maxlen=KEPT_NUMBERS)
        self._tell_s = 0.0
        self._spoken = State.IDLE, End.NONE

    def hear(self, message: Any, now_s: float) -> None:
        """Take a HEARTBEAT, MANUAL_CONTROL or RC_CHANNELS_OVERRIDE of the ground's system."""
        if message.get_type() == "HEARTBEAT":
            self._ground_s = now_s
        elif touched(message):
            self._touched_s = now_s

    def order(
        self, message: Any, navigation: Navigation, *, armed: bool, now_s: float, obstacle: str = ""
    ) -> tuple[int, int]:
        """Obey a COMMAND_LONG of `orders.COMMANDS`; return its MAV_RESULT and result_param2.

        `obstacle`: why no flight may begin now, "" if it may.
        """
        self._ground_s = now_s
        self._here_s = None if self._here_s is None else now_s
        numbers: Seven = (
            *(message.param1, message.param2, message.param3, message.param4),
            *(message.param5, message.param6, message.param7),
        )
        place = int(numbers[0]) if numbers[0] in range(orders.MOST_LEGS) else -1
        if place < 0:
            return _DENIED, 0
        if message.command == orders.LEG:
            self._legs[place] = numbers
            return _ACCEPTED, place
        if message.command == orders.LIMITS:
            self._rows[place] = numbers
            return _ACCEPTED, place
        if numbers[0] == Order.HERE:
            self._here_s = now_s
            return _ACCEPTED, place
        begins = numbers[0] in (Order.BEGIN, Order.FLY)
        if numbers[1] != self._obeyed and not (begins and numbers[1] in self._begun):
            if begins and self._rows_of(numbers) is None:
                return _AGAIN, place
            inputs = FlightInputs(now_s, navigation, armed, now_s, self._touched(now_s))
            refused = (obstacle if numbers[0] == Order.BEGIN else "") or self._obey(numbers, inputs)
            if refused:
                self._texts.append(f"no flight: {refused}")
                return _DENIED, place
            self._obeyed = numbers[1]
            if begins:
                self._begun.append(numbers[1])
        return _ACCEPTED, place

    def take_texts(self) -> list[str]:
        """Sentences for the crew since the last call."""
        texts, self._texts = self._texts, []
        return texts

    def step(
        self,
        navigation: Navigation,
        *,
        armed: bool,
        now_s: float,
        in_command: bool = True,
        autopilot_ready: bool = True,
    ) -> Reference | None:
        """The reference of this tick, None while no flight steers."""
        flight = self.flight
        # Another ground's heartbeats stand for the one that flies only as long as that says nothing by itself.
        ground_s = self._ground_s if self._here_s is None else self._here_s
        inputs = FlightInputs(
            now_s, navigation, armed, ground_s, self._touched(now_s), in_command, autopilot_ready
        )
        reference = flight.step(inputs)
        report = flight.state, flight.end
        if report != self._spoken:
            if flight.end is not self._spoken[1] and flight.end is not End.NONE:
                self._texts.append(f"flight ends: {WORDS[flight.end]}")
            self._spoken, self._tell_s = report, now_s
        return reference

    def reading(self, now_s: float) -> Reading | None:
        """The flight's state for the ground, if that is due."""
        if now_s < self._tell_s:
            return None
        flight = self.flight
        self._tell_s = now_s + (REST_TELL_EVERY_S if flight.state is State.IDLE else TELL_EVERY_S)
        place = flight.pose.north_m, flight.pose.east_m
        return Reading(
            "flight", now_s, (float(flight.state), float(flight.end), self._obeyed, flight.left_s, *place)
        )

    def _touched(self, now_s: float) -> bool:
        return now_s - self._touched_s <= 1.0

    def _obey(self, numbers: Seven, inputs: FlightInputs) -> str:
        """Do as an order says; return why not."""
        order, _, _, countdown_s, *_ = numbers
        if order == Order.END:
            self.flight.stop()
            return ""
        if order == Order.FINISH:
            self.flight.finish()
            return ""
        rows = self._rows_of(numbers)
        if order not in (Order.BEGIN, Order.FLY) or rows is None:
            return "there is no such order"
        try:
            if order == Order.BEGIN:
                refused = self.flight.begin(*orders.limits_in(rows), countdown_s, inputs)
                self._here_s = self._here_s if refused else None
                return refused
            return self.flight.fly([orders.leg_of(row) for row in rows], inputs)
        except ConfigError as error:
            return str(error)

    def _rows_of(self, numbers: Seven) -> list[Seven] | None:
        """The limits or legs that an order is about, None if not all of them arrived."""
        order, _, checksum, _, count, *_ = numbers
        held = self._rows if order == Order.BEGIN else self._legs
        rows = [held[place] for place in sorted(held) if place < count]
        return rows if rows and orders.checksum(rows) == checksum else None


def touched(sticks: Any) -> bool:
    """Whether a MANUAL_CONTROL has a stick off its rest or a button pressed; an axis of 32767 is not in use. Or an
    RC_CHANNELS_OVERRIDE, by which other programs fly, an input off its rest; 0 and 65535 leave it alone."""
    if sticks.get_type() == "RC_CHANNELS_OVERRIDE":
        pulses_us = [getattr(sticks, f"chan{number}_raw") for number in range(1, CHANNELS + 1)]
        return any(us not in _RELEASED and abs(us - REST_US) > TOUCH_US for us in pulses_us)
    rest_positions = {"x": 0, "y": 0, "z": Z_REST, "r": 0}
    rest_positions |= {axis: 0 for axis, bit in _MORE_AXES.items() if sticks.enabled_extensions & bit}
    moved = [axis for axis, at in rest_positions.items() if abs(getattr(sticks, axis) - at) > TOUCH]
    return bool(sticks.buttons or sticks.buttons2) or any(getattr(sticks, axis) != 32767 for axis in moved)
