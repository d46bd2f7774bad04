"""Order a vehicle to turn a thruster by MAV_CMD_DO_MOTOR_TEST: once per pulse, or repeatedly for ArduSub."""

import math
from dataclasses import dataclass
from typing import Any, Final, Protocol

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.vehicle.thrusters import NEUTRAL_US
from gcs_plugin.peers import ground_heartbeat

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
        return dialect.MAVLink_command_long_message(
            system,
            component,
            dialect.MAV_CMD_DO_MOTOR_TEST,
            0,
            self.thruster + first,
            dialect.MOTOR_TEST_THROTTLE_PWM,
            self.pwm_us,
            self.timeout_s,
            1,
            dialect.MOTOR_TEST_ORDER_BOARD,
            0,
        )


class Orders(Protocol):
    """Makes the messages of an order, and those that keep a vehicle in its motor test between orders."""

    def order(self, test: MotorTest, now_s: float) -> list[Any]: ...

    def meanwhile(self, now_s: float) -> list[Any]: ...


class OneOrder:
    """Sends a single message per order: the vehicle ends each test by itself."""

    def __init__(self, target: tuple[int, int]) -> None:
        self._target = target

    def order(self, test: MotorTest, now_s: float) -> list[Any]:
        del now_s
        return [test.message(*self._target)]

    def meanwhile(self, now_s: float) -> list[Any]:
        del now_s
        return []


class ArduSubOrders:
    """Repeats every order, and neutral between orders, because ArduSub ignores the timeout and counts motors from 0.

    In ArduSub an order holds until the next, and without an order for 0.5 s it disarms itself (ArduSub/motors.cpp).
    Its failsafes also expect a pilot and a ground station, and it sends its outputs only twice a second unless asked.
    """

    def __init__(self, target: tuple[int, int]) -> None:
        self._target = target
        self._test = MotorTest(0, NEUTRAL_US, 0.0)
        self._end_s, self._due_s, self._ask_s = math.inf, -math.inf, -math.inf

    def order(self, test: MotorTest, now_s: float) -> list[Any]:
        self._test, self._end_s, self._due_s = test, now_s + test.timeout_s, now_s + REPEAT_S
        return [test.message(*self._target, first=0)]

    def meanwhile(self, now_s: float) -> list[Any]:
        if now_s >= self._end_s:
            self._test, self._end_s = MotorTest(self._test.thruster, NEUTRAL_US, 0.0), math.inf
            self._due_s = now_s
        if now_s < self._due_s:
            return []
        self._due_s = now_s + REPEAT_S
        system, _ = self._target
        sticks = dialect.MAVLink_manual_control_message(system, 0, 0, STICK_CENTRE, 0, 0)
        return [self._test.message(*self._target, first=0), sticks, *self._asked(now_s)]

    def _asked(self, now_s: float) -> list[Any]:
        if now_s < self._ask_s:
            return []
        self._ask_s = now_s + ASK_EVERY_S
        wanted, every_us = dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW, SERVO_EVERY_US
        interval = dialect.MAVLink_command_long_message(
            *self._target, dialect.MAV_CMD_SET_MESSAGE_INTERVAL, 0, wanted, every_us, 0, 0, 0, 0, 0
        )
        return [ground_heartbeat(), interval]


def orders_for(autopilot: int, target: tuple[int, int]) -> Orders:
    """The kind of orders for component `target`, whose heartbeat has this MAV_AUTOPILOT."""
    ardupilot = autopilot == dialect.MAV_AUTOPILOT_ARDUPILOTMEGA
    return ArduSubOrders(target) if ardupilot else OneOrder(target)
