"""Reads the few parameters of the autopilot that a companion depends on, and says which of them do not fit.

The companion writes none of them: a crew sets them once, and a check says so in a sentence. ArduSub answers nothing at
all for a name that it does not know; such a name counts as unknown after `UNKNOWN_AFTER` questions.
"""

import math
from collections.abc import Sequence
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.ardusub.frames import FRAME, direction_name, function_name
from bridge.ardusub.mixing import MOTOR_FACTORS

AGAIN_S: Final = 0.6
UNKNOWN_AFTER: Final = 5

FAILSAFE: Final = "FS_GCS_ENABLE"
PILOT: Final = "SYSID_MYGCS"
"""Whose sticks are taken. Up to 4.6; 4.7 has MAV_GCS_SYSID in its place (by its source)."""
PILOT_FAILSAFE: Final = "FS_PILOT_INPUT"
WARNS_ALONE: Final = 1
DVL: Final = {"VISO_TYPE": 1.0, "EK3_SRC1_POSXY": 0.0, "EK3_SRC1_VELXY": 6.0}
"""Settings with which ArduSub takes VISION_POSITION_DELTA for velocity (measured, 4.5.7)."""
RECORDED: Final = ("INS_GYRO_FILTER", "INS_ACCEL_FILTER")
"""Read for the recording alone: how late the autopilot's rates of turn and accelerations are."""


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


class Settings(Questions):
    """The parameters that a companion depends on."""

    def __init__(self, system: int, component: int, thrusters: int, has_dvl: bool) -> None:
        self._thrusters, self._has_dvl = thrusters, has_dvl
        names = [
            FRAME,
            FAILSAFE,
            PILOT_FAILSAFE,
            PILOT,
            *(direction_name(number) for number in range(1, thrusters + 1)),
            *(function_name(number) for number in range(1, thrusters + 1)),
            *(DVL if has_dvl else ()),
            *RECORDED,
        ]
        super().__init__(system, component, names)

    @property
    def obstacle(self) -> str:
        """Why the companion may not hold the sticks, and the way out; "" if it may."""
        if not self.complete:
            return "the autopilot's parameters are not read yet"
        if self.values[FRAME] not in MOTOR_FACTORS:
            return f"{FRAME} {self.values[FRAME]:g} is not supported: 1 (vectored) and 2 (vectored_6dof) are"
        if self._thrusters != len(MOTOR_FACTORS[int(self.values[FRAME])]):
            return f"{FRAME} {self.values[FRAME]:g} has not {self._thrusters} thrusters: name that vehicle's own file"
        for name in (FAILSAFE, PILOT_FAILSAFE):
            # NaN too: without a fail-safe a dead companion would leave the last sticks in force.
            if not self.values[name] > (WARNS_ALONE if name == FAILSAFE else 0):
                return f"{name} must stop the vehicle: set it to 2"
        if math.isnan(self.values[PILOT]):
            return f"no {PILOT}: from 4.7 on ArduSub has MAV_GCS_SYSID, use 4.5 or 4.6"
        return ""

    @property
    def advice(self) -> tuple[str, ...]:
        """Sentences for the crew on settings that do not fit the DVL."""
        if not (self._has_dvl and self.complete):
            return ()
        return tuple(
            f"DVL unused: {name} is {self.values[name]:g}, set {wanted:g}"
            for name, wanted in DVL.items()
            if self.values[name] != wanted
        )
