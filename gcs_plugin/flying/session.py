"""A flight as the ground sees it: commands sent until they are acknowledged, and the vehicle's reports. Pure.

    limits, BEGIN, arm -> (the vehicle counts down and goes to its station) -> legs, FLY -> ... -> FINISH

Every command is sent again until its own acknowledgement comes, for at most `UNANSWERED_S` of hearing the vehicle; END
goes ahead of all others. The vehicle's telemetry alone tells its state. Between commands the session says that its
ground is there.
"""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.flight.flight import WORDS, End, State
from bridge.flight.limits import FlightLimits
from bridge.flight.orders import LEG, LIMITS, ORDER, Order, Seven, checksum, leg_numbers, limit_rows
from bridge.vehicle.legs import Leg
from bridge.wire.framing import Frame, decode
from bridge.wire.readings import decode as decode_reading
from bridge.wire.silences import BACK_S
from gcs_plugin.asking import command_long
from gcs_plugin.peers import GROUND_STATION, Source

RESEND_S: Final = 0.25
ALIVE_EVERY_S: Final = 0.4
"""So often that several arrive within the usual `link_s` on a link that loses a third too."""
UNANSWERED_S: Final = 10.0
"""Longest wait for an acknowledgement, counted only while the vehicle's reports are heard."""
SILENT_S: Final = 3.0
MOST_TRIES: Final = 5
"""Times that rows are sent again: an acknowledgement left from an earlier upload can pass for a new row's, which is
then missing."""
ARM: Final[int] = dialect.MAV_CMD_COMPONENT_ARM_DISARM
_ACK: Final[int] = dialect.MAVLINK_MSG_ID_COMMAND_ACK
_ARRAY: Final[int] = dialect.MAVLINK_MSG_ID_DEBUG_FLOAT_ARRAY


@dataclass(frozen=True, slots=True)
class _Command:
    """A command to be acknowledged, with `answer` in result_param2."""

    command: int
    numbers: Seven
    answer: int


_ARMING: Final = _Command(ARM, (1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0)
_DISARMING: Final = _Command(ARM, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), 0)


@dataclass(frozen=True, slots=True)
class FlightReport:
    """The vehicle's last report of its flight, sent at `boot_s` by its own clock."""

    boot_s: float
    state: State
    end: End
    number: float
    left_s: float
    north_m: float
    east_m: float


class FlightSession:
    """Sends a flight's orders to a vehicle, again until acknowledged, and follows its reports.

    `refused`: the vehicle refused an order, and its words why may still be under way.
    `vehicle` system and component; `number` of the first order, any from 1 to 2^23 that no other ground used.
    """

    def __init__(self, vehicle: Source, number: int) -> None:
        self.vehicle, self._number = vehicle, number
        self._queue: deque[_Command] = deque()
        self._rows: list[_Command] = []
        self._tries = 0
        self._sent_s = self._alive_s = -1e9
        self._asked_s: float | None = None
        self.heard: FlightReport | None = None
        self.heard_s = -1e9
        self._begun = False
        self.failure = ""
        self.refused = False

    @property
    def idle(self) -> bool:
        """Whether all that was asked is acknowledged."""
        return not self._queue

    @property
    def state(self) -> State:
        """The vehicle's state, IDLE before it said one."""
        return State.IDLE if self.heard is None else self.heard.state

    @property
    def ready(self) -> bool:
        """Whether the vehicle is on its station and waits for a manoeuvre."""
        return self.idle and self._is_current and self.state is State.WAITING

    @property
    def over(self) -> bool:
        """Whether the flight that was begun has ended and the vehicle holds or lies still."""
        ended = self._is_current and self.state in (State.IDLE, State.HOLDING)
        return bool(self.failure) or (self._begun and self.idle and ended)

    @property
    def words(self) -> str:
        """Why the flight ended."""
        if self.failure:
            return self.failure
        return WORDS[End.NONE if self.heard is None else self.heard.end]

    def silent(self, now_s: float) -> bool:
        """Whether the vehicle has said nothing of its flight lately."""
        return now_s - self.heard_s > SILENT_S

    def begin(self, limits: FlightLimits, depth_m: float, countdown_s: float) -> None:
        """Ask for a flight whose manoeuvres begin at a depth, and arm the vehicle."""
        rows = limit_rows(limits, depth_m)
        self._send(LIMITS, rows)
        self._order(Order.BEGIN, checksum(rows), countdown_s, len(rows))
        self._queue.append(_ARMING)
        self._begun = True

    def fly(self, legs: Sequence[Leg]) -> None:
        rows = [leg_numbers(place, leg) for place, leg in enumerate(legs)]
        self._send(LEG, rows)
        self._order(Order.FLY, checksum(rows), 0.0, len(rows))

    def finish(self) -> None:
        """Ask it to go back to where it began."""
        self._order(Order.FINISH, 0.0, 0.0, 0)

    def stop(self) -> None:
        """The end key: ahead of all else."""
        self._queue.clear()
        self._sent_s, self._asked_s = -1e9, None
        self._order(Order.END, 0.0, 0.0, 0)

    def disarm(self) -> None:
        """Ask it to disarm, unless that is asked already."""
        if _DISARMING not in self._queue:
            self._queue.append(_DISARMING)

    def fail(self, words: str) -> None:
        """Give the flight up, and all that was asked; what is asked afterwards, to end or to disarm, is still sent."""
        self._queue.clear()
        self._asked_s = None
        self.failure = self.failure or words

    def tick(self, now_s: float) -> list[Any]:
        if self._is_current and self.state is State.IDLE:
            # A flight that ended in its countdown, with the vehicle disarmed: nothing is left to be armed for.
            self._queue = deque(command for command in self._queue if command != _ARMING)
        if not self._queue:
            self._asked_s = None
            return self._ground_alive(now_s)
        if self._asked_s is None or self.silent(now_s):
            self._asked_s = now_s
        if now_s - self._asked_s > UNANSWERED_S:
            self.fail("the vehicle does not answer")
            return []
        if now_s - self._sent_s < RESEND_S:
            return []
        self._sent_s = now_s
        command = self._queue[0]
        return [command_long(self.vehicle, command.command, *command.numbers)]

    def _ground_alive(self, now_s: float) -> list[Any]:
        """That this ground is still there, while its flight is under way."""
        if not self._begun or self.over or now_s - self._alive_s < ALIVE_EVERY_S:
            return []
        self._alive_s = now_s
        return [command_long(self.vehicle, ORDER, float(Order.HERE))]

    def on_frame(self, frame: Frame, now_s: float) -> None:
        if (frame.system, frame.component) != self.vehicle:
            return
        if frame.message_id == _ARRAY:
            reading = decode_reading(frame)
            if reading is not None and reading.signal == "flight":
                self._on_flight(reading.time_s, reading.values, now_s)
        elif (
            frame.message_id == _ACK
            and (message := decode(frame)) is not None
            and message.target_system in (0, GROUND_STATION[0])
        ):
            self._on_ack(message)

    @property
    def _is_current(self) -> bool:
        """Whether the vehicle's last report already has the number of the last order."""
        return self.heard is not None and self.heard.number == self._number

    def _on_flight(self, boot_s: float, values: tuple[float, ...], now_s: float) -> None:
        state, end, number, *others = values
        try:
            heard = FlightReport(boot_s, State(int(state)), End(int(end)), number, *others)
        except (ValueError, OverflowError):
            return
        # Overtaken on the way: one from before the first order would pass for a vehicle that started anew.
        if self.heard is not None and self.heard.boot_s - BACK_S <= boot_s < self.heard.boot_s:
            return
        if self.heard is not None and self.heard.number > 0.0 == number:
            self.fail("the vehicle started anew, and lies still")
        self.heard, self.heard_s = heard, now_s

    def _on_ack(self, message: Any) -> None:
        if not self._queue:
            return
        command = self._queue[0]
        unsupported = message.result == dialect.MAV_RESULT_UNSUPPORTED
        if message.command != command.command or (
            message.result_param2 != command.answer and not unsupported
        ):
            return
        if message.result == dialect.MAV_RESULT_ACCEPTED:
            self._queue.popleft()
            self._sent_s, self._asked_s = -1e9, None
            return
        if message.result == dialect.MAV_RESULT_TEMPORARILY_REJECTED and self._tries < MOST_TRIES:
            self._tries += 1
            self._queue.extendleft(reversed(self._rows))
            return
        if unsupported:
            self.fail("this vehicle flies no manoeuvres by itself")
        else:
            self.refused = not self.failure
            self.fail("the vehicle refuses; its words say why")

    def _send(self, command: int, rows: Sequence[Seven]) -> None:
        self._rows = [_Command(command, row, place) for place, row in enumerate(rows)]
        self._queue += self._rows
        self._tries = 0

    def _order(self, order: Order, of: float, countdown_s: float, count: int) -> None:
        self._number += 1
        numbers = (float(order), float(self._number), of, countdown_s, float(count), 0.0, 0.0)
        self._queue.append(_Command(ORDER, numbers, int(order)))
