"""Orders to a vehicle's motors: arm, disarm, and MAV_CMD_DO_MOTOR_TEST, repeated for firmware that holds an order."""

import math
from dataclasses import dataclass
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import Clock
from bridge.errors import LinkError
from bridge.links.link import Link
from bridge.vehicle.thrusters import NEUTRAL_US
from gcs_plugin.asking import Asking, command_long
from gcs_plugin.peers import Source, ground_heartbeat

REPEAT_S: Final = 0.2
ASK_EVERY_S: Final = 1.0
SERVO_EVERY_US: Final = 50_000
STICK_CENTRE: Final = 500  # of MANUAL_CONTROL's z


@dataclass(frozen=True, slots=True)
class MotorTest:
    """An order: `thruster` counts from 0; the vehicle returns to neutral by itself after `timeout_s`."""

    thruster: int
    pwm_us: float
    timeout_s: float

    def message(self, system: int, component: int, first: int = 1) -> dialect.MAVLink_command_long_message:
        """Encode the order as COMMAND_LONG: motors count from `first` there, in the order of the vehicle's file."""
        return command_long(
            (system, component),
            dialect.MAV_CMD_DO_MOTOR_TEST,
            self.thruster + first,
            dialect.MOTOR_TEST_THROTTLE_PWM,
            self.pwm_us,
            self.timeout_s,
            1,
            dialect.MOTOR_TEST_ORDER_BOARD,
        )


class HeldOrders:
    """Repeats every order, and neutral between orders, for firmware that holds an order and counts motors from 0.

    Any other vehicle ends each test by itself, and takes a single message as an order. ArduSub ignores the timeout: an
    order holds until the next, and after 0.5 s without one it disarms itself (ArduSub/motors.cpp). Its failsafes also
    expect a pilot and a ground station, and it sends its outputs only twice a second unless asked.
    """

    def __init__(self, target: Source) -> None:
        self._target = target
        self._test = MotorTest(0, NEUTRAL_US, 0.0)
        self._end_s, self._due_s, self._ask_s = math.inf, -math.inf, -math.inf

    def order(self, test: MotorTest, now_s: float) -> list[Any]:
        """Return the messages that begin a test."""
        self._test, self._end_s, self._due_s = test, now_s + test.timeout_s, now_s + REPEAT_S
        return [test.message(*self._target, first=0)]

    def meanwhile(self, now_s: float) -> list[Any]:
        """Return the messages that are due by now: the order again, or neutral once its time is up."""
        if now_s >= self._end_s:
            self._test, self._end_s = MotorTest(self._test.thruster, NEUTRAL_US, 0.0), math.inf
            self._due_s = now_s
        if now_s < self._due_s:
            return []
        self._due_s = now_s + REPEAT_S
        system, _ = self._target
        sticks = dialect.MAVLink_manual_control_message(system, 0, 0, STICK_CENTRE, 0, 0)
        return [self._test.message(*self._target, first=0), sticks, *self._outputs_asked(now_s)]

    def _outputs_asked(self, now_s: float) -> list[Any]:
        if now_s < self._ask_s:
            return []
        self._ask_s = now_s + ASK_EVERY_S
        wanted, every_us = dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW, SERVO_EVERY_US
        interval = command_long(self._target, dialect.MAV_CMD_SET_MESSAGE_INTERVAL, wanted, every_us)
        return [ground_heartbeat(), interval]


ARM_WITHIN_S: Final = 5.0
CERTAIN_BEATS: Final = 2
"""HEARTBEATs in a row that must say disarmed: the first may be older than an order to arm that is still on its way."""


def arm(link: Link, clock: Clock, target: Source) -> None:
    """Arm the vehicle `target` (system, component).

    Raises LinkError if it refuses, LinkTimeout if it does not answer within ARM_WITHIN_S.
    """
    awaited = "an answer to the order to arm"
    number = dialect.MAV_CMD_COMPONENT_ARM_DISARM
    result = Asking(link, clock, target).command(number, 1.0, seconds=ARM_WITHIN_S, awaited=awaited)
    if result != dialect.MAV_RESULT_ACCEPTED:
        raise LinkError(f"{link.name}: the vehicle refused to arm (answer {result}); see what it says")


def disarm(link: Link, clock: Clock, target: Source) -> None:
    """Disarm the vehicle `target`. Its HEARTBEATs are believed, since a late answer may be to the order to arm.

    Raises LinkTimeout if they do not say so within ARM_WITHIN_S.
    """
    in_a_row = 0

    def is_disarmed(message: Any) -> bool | None:
        nonlocal in_a_row
        if message.get_type() == "HEARTBEAT":
            armed = message.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED
            in_a_row = 0 if armed else in_a_row + 1
        return in_a_row >= CERTAIN_BEATS or None

    number = dialect.MAV_CMD_COMPONENT_ARM_DISARM
    order = command_long(target, number)
    Asking(link, clock, target).until(is_disarmed, ARM_WITHIN_S, order, "a HEARTBEAT that says disarmed")
