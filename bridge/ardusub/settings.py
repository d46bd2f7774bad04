"""The few parameters of the autopilot that a companion depends on, and which of them do not fit.

The companion writes none of them: a crew sets them once, and a check says so in a sentence.
"""

import math
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.firmware.ardusub import (
    ARDUSUB,
    COUPLED,
    COUPLING,
    DVL,
    FAILSAFE,
    FRAME,
    MOTOR_FACTORS,
    PILOT,
    PILOT_FAILSAFE,
    WARNS_ALONE,
    direction_name,
    function_name,
)
from bridge.firmware.questions import Questions

RENEW_S: Final = 2.0
"""One is read anew so often, in turn: a crew changes them, and an echo or an answer may be lost."""


class Settings(Questions):
    """The parameters that a companion depends on."""

    def __init__(self, system: int, component: int, thrusters: int, has_dvl: bool) -> None:
        self._thrusters, self._has_dvl = thrusters, has_dvl
        self._wiring = [
            FRAME,
            *(direction_name(number) for number in range(1, thrusters + 1)),
            *(function_name(number) for number in range(1, thrusters + 1)),
        ]
        others = [COUPLING, *(DVL if has_dvl else ()), *ARDUSUB.corners.values()]
        super().__init__(system, component, [*self._wiring, FAILSAFE, PILOT_FAILSAFE, PILOT, *others])
        # The pilot's is read by the handover, which counts its own reads alone.
        self._renewed = [*self._wiring, FAILSAFE, PILOT_FAILSAFE, *others]
        self._renew_s, self._turn = math.inf, 0

    def step(self, now_s: float) -> list[Any]:
        """The question to send now: for each unknown setting, later for each again, except SYSID_MYGCS."""
        if not self.complete:
            self._renew_s = now_s + RENEW_S
            return super().step(now_s)
        if now_s < self._renew_s:
            return []
        self._renew_s, self._turn = now_s + RENEW_S, (self._turn + 1) % len(self._renewed)
        name = self._renewed[self._turn].encode()
        return [dialect.MAVLink_param_request_read_message(*self._target, name, -1)]

    @property
    def wiring(self) -> tuple[float, ...]:
        """The frame, and what drives each output and which way, as read last; once `complete`."""
        return tuple(self.values[name] for name in self._wiring)

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
        """Sentences for the crew on settings that do not fit the DVL, or that change the meaning of a stick."""
        if not self.complete:
            return ()
        said = [
            f"DVL unused: {name} is {self.values[name]:g}, set {wanted:g}"
            for name, wanted in (DVL if self._has_dvl else {}).items()
            if self.values[name] != wanted
        ]
        if self.values[FRAME] in COUPLED and self.values[COUPLING] > 0:
            said.append(
                f"surge falls short while it climbs or dives hard: {COUPLING} is {self.values[COUPLING]:g}, set 0"
            )
        return tuple(said)
