"""Orders and questions of the ground, other than on parameters: arming, motor tests, TIMESYNC, file transfers.

Orders are taken from one address only, and only so often; any other request is refused.
"""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.vehicle.parameters import COMMIT, MODE
from bridge.vehicle.thrusters import NEUTRAL_US
from bridge.wire.ftp import PAYLOAD_BYTES, Fault, decode, refused
from bridge.wire.status_codes import Topic, coded

STATION_SYSTEM = 255


@dataclass(frozen=True, slots=True)
class Ground:
    """MAVLink address whose writes and commands are accepted; `component` None accepts all of the system."""

    system: int = STATION_SYSTEM
    component: int | None = None

    def gives(self, system: int, component: int) -> bool:
        """Whether an order from this address comes from the ground."""
        return system == self.system and self.component in (None, component)

    def __str__(self) -> str:
        return f"system {self.system}" + ("" if self.component is None else f", component {self.component}")


ArmHandler = Callable[[bool], bool]
MotorTestHandler = Callable[[Any], int]


def answer_timesync(message: Any, boot_s: float) -> list[Any]:
    """Return the answer to a TIMESYNC request, which has tc1 = 0; [] for another system's answer."""
    if message.tc1 != 0:
        return []
    return [dialect.MAVLink_timesync_message(round(boot_s * 1e9), message.ts1)]


def answer_command(message: Any, arm: ArmHandler, test: MotorTestHandler | None = None) -> list[Any]:
    """Return the COMMAND_ACK to a COMMAND_LONG that was addressed here.

    `arm` returns whether it did as asked, `test` returns the MAV_RESULT of a motor test; None if no program on board
    turns thrusters.
    """
    if message.command == dialect.MAV_CMD_DO_MOTOR_TEST and test is not None:
        return acknowledge(message, test(message))
    if message.command != dialect.MAV_CMD_COMPONENT_ARM_DISARM:
        return acknowledge(message, dialect.MAV_RESULT_UNSUPPORTED)
    if message.param1 not in (0.0, 1.0) or not arm(message.param1 == 1.0):
        return deny_command(message)
    return acknowledge(message, dialect.MAV_RESULT_ACCEPTED)


def deny_command(message: Any) -> list[Any]:
    """Return the COMMAND_ACK that denies a COMMAND_LONG, as to a sender that may not give orders here."""
    return acknowledge(message, dialect.MAV_RESULT_DENIED)


def acknowledge(message: Any, result: int, of: int = 0) -> list[Any]:
    """Return the COMMAND_ACK of a COMMAND_LONG; `of` goes into result_param2."""
    sender = message.get_srcSystem(), message.get_srcComponent()
    return [dialect.MAVLink_command_ack_message(message.command, result, 0, of, *sender)]


def refuse_file_transfer(message: Any) -> list[Any]:
    """Refuse a file transfer at once.

    A ground station that asks for parameters as a file then requests them singly.
    """
    answer = refused(decode(bytes(message.payload)), Fault.UNKNOWN).encode()
    sender = message.get_srcSystem(), message.get_srcComponent()
    payload = answer.ljust(PAYLOAD_BYTES, b"\0")
    return [dialect.MAVLink_file_transfer_protocol_message(0, *sender, list(payload))]


LOWEST_US: Final = 1100.0
HIGHEST_US: Final = 1900.0
LONGEST_S: Final = 3.0


class MotorTests:
    """The running motor test. It ends by itself, so that a lost link leaves no thruster turning."""

    def __init__(self, thrusters: int) -> None:
        self._thrusters = thrusters
        self._running: tuple[int, float, float] | None = None

    def ask(self, message: Any, armed: bool, now_s: float) -> int:
        """Start, replace or (at neutral) end a test as COMMAND_LONG asks; return the MAV_RESULT."""
        thruster, kind, pwm_us, for_s = message.param1, message.param2, message.param3, message.param4
        numbers = (thruster, pwm_us, for_s)
        if kind != dialect.MOTOR_TEST_THROTTLE_PWM or not all(map(math.isfinite, numbers)):
            return int(dialect.MAV_RESULT_DENIED)
        if thruster not in range(1, self._thrusters + 1) or not 0.0 <= for_s <= LONGEST_S:
            return int(dialect.MAV_RESULT_DENIED)
        if not LOWEST_US <= pwm_us <= HIGHEST_US:
            return int(dialect.MAV_RESULT_DENIED)
        if not armed:
            return int(dialect.MAV_RESULT_TEMPORARILY_REJECTED)
        self._running = int(thruster) - 1, pwm_us, now_s + for_s
        return int(dialect.MAV_RESULT_ACCEPTED)

    def pwm_us(self, armed: bool, now_s: float) -> tuple[float, ...]:
        """Pulse widths (us) of all thrusters now: neutral except for the thruster under test."""
        widths = [NEUTRAL_US] * self._thrusters
        if not armed or (self._running is not None and now_s >= self._running[2]):
            self._running = None
        if self._running is not None:
            widths[self._running[0]] = self._running[1]
        return tuple(widths)


REPORT_EVERY_S: Final = 10.0


class RateLimit:
    """Allows `burst` actions at once, and `rate_hz` a second in the long run."""

    def __init__(self, rate_hz: float, burst: int, now_s: float) -> None:
        self._rate_hz, self._burst = rate_hz, burst
        self._left, self._asked_s, self._report_s = float(burst), now_s, now_s

    def allows(self, now_s: float) -> bool:
        """Whether one more action is allowed now; an allowed action is counted."""
        earned = (now_s - self._asked_s) * self._rate_hz
        self._left, self._asked_s = min(float(self._burst), self._left + earned), now_s
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True

    def to_be_reported(self, now_s: float) -> bool:
        """Whether to report now that the limit was exceeded: at most once every `REPORT_EVERY_S`."""
        if now_s < self._report_s:
            return False
        self._report_s = now_s + REPORT_EVERY_S
        return True


ORDERS: Final = frozenset(("PARAM_SET", "COMMAND_LONG"))
DENIALS_HZ, MOST_DENIALS = 10.0, 50  # an order and a few retries; a flood of orders gets no flood of denials
STRANGER_AGAIN_S, STRANGERS_EVERY_S = 10.0, 1.0
WRITES_HZ, MOST_WRITES = 200.0, 1000  # a set of all parameters at once, but no more than the loop can answer
STORES_HZ, MOST_STORES = 5.0, 50  # writes that wait for the disk


class OrderGate:
    """Which of the ORDERS are obeyed: those of `ground`, and no more writes than the loop and the disk keep up with.

    `counts` counts orders from strangers ("refused") and dropped writes ("too fast"); `say` reports both to the crew.
    """

    def __init__(
        self, ground: Ground, counts: Counter[str], say: Callable[[str], None], now_s: float
    ) -> None:
        self.ground = ground
        self._counts, self._say = counts, say
        self._writes = RateLimit(WRITES_HZ, MOST_WRITES, now_s)
        self._stores = RateLimit(STORES_HZ, MOST_STORES, now_s)
        self._denials = RateLimit(DENIALS_HZ, MOST_DENIALS, now_s)
        self._strangers: dict[str, float] = {}
        self._stranger_due_s = now_s

    def is_stranger(self, message: Any) -> bool:
        """Whether a message's sender may give no orders."""
        return not self.ground.gives(message.get_srcSystem(), message.get_srcComponent())

    def may_deny(self, message: Any, now_s: float) -> bool:
        """Report a stranger's order, again after a while for a crew that missed the first report; return whether it may
        be answered."""
        self._counts["refused"] += 1
        system, component = message.get_srcSystem(), message.get_srcComponent()
        # A stranger in the ground's own system is named with its component, any other by its system alone.
        stranger = str(Ground(system, component if system == self.ground.system else None))
        if now_s >= max(self._strangers.get(stranger, now_s), self._stranger_due_s):
            self._strangers[stranger] = now_s + STRANGER_AGAIN_S
            self._stranger_due_s = now_s + STRANGERS_EVERY_S
            self._say(coded(Topic.STRANGER, f"orders from {stranger} are refused", system))
        return self._denials.allows(now_s)

    def may_write(self, message: Any, now_s: float) -> bool:
        """Whether the loop and the disk can keep up with this write. FF_MODE 0 (off) is always accepted."""
        if message.param_id == MODE and message.param_value == 0.0:
            return True
        pace = self._stores if message.param_id in (MODE, COMMIT) else self._writes
        if pace.allows(now_s):
            return True
        self._counts["too fast"] += 1
        if pace.to_be_reported(now_s):
            self._say("writes come too fast: some are dropped")
        return False
