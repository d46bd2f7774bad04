"""Motor tests on the ground's order: one thruster turns, gently and for seconds."""

import math
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.vehicle.thrusters import NEUTRAL_US

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
