"""The version of the autopilot and its few parameters that a companion depends on, and which of them do not fit.

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
    FAILSAFE_AFTER,
    FRAME,
    HEAVE_GAIN,
    LONGEST_ALONE_S,
    MOTOR_FACTORS,
    PILOT,
    PILOT_FAILSAFE,
    PILOT_FAILSAFE_AFTER,
    TIMED_FROM,
    TRIED_FROM,
    WARNS_ALONE,
    direction_name,
    function_name,
    version_of,
)
from bridge.firmware.questions import AGAIN_S, Questions, unread

RENEW_S: Final = 2.0
"""One is read anew so often, in turn: a crew changes them, and an echo or an answer may be lost."""
VERSION_AGAIN_S: Final = 2.0
VERSION_ANEW_S: Final = 30.0
"""A crew may update the firmware while the companion runs."""
_NO_VERSION: Final = (0, 0, 0)


class Settings(Questions):
    """The parameters that a companion depends on, and the firmware's version, 0.0.0 where it is not known."""

    def __init__(self, system: int, component: int, thrusters: int, has_dvl: bool) -> None:
        self._thrusters, self._has_dvl = thrusters, has_dvl
        self._wiring = [
            FRAME,
            *(direction_name(number) for number in range(1, thrusters + 1)),
            *(function_name(number) for number in range(1, thrusters + 1)),
        ]
        others = [
            PILOT_FAILSAFE_AFTER,
            COUPLING,
            *(DVL if has_dvl else ()),
            *ARDUSUB.corners.values(),
        ]
        super().__init__(system, component, [*self._wiring, FAILSAFE, PILOT_FAILSAFE, PILOT, *others])
        # The pilot's is read by the handover, which counts its own reads alone.
        self._renewed = [*self._wiring, FAILSAFE, PILOT_FAILSAFE, *others]
        self._renew_s, self._turn = math.inf, 0
        self.version, self._version_due_s = _NO_VERSION, -math.inf
        # By themselves, so that nothing waits for an answer: older firmware lacks one, flights alone need the other.
        self._apart = {FAILSAFE_AFTER: math.nan, HEAVE_GAIN: math.nan}
        self._apart_due_s = dict.fromkeys(self._apart, -math.inf)

    def step(self, now_s: float) -> list[Any]:
        """The questions to send now: for each unknown setting, later for each again, except SYSID_MYGCS."""
        return [*self._ask_version(now_s), *self._ask_apart(now_s), *self._ask_setting(now_s)]

    def on_version(self, number: int) -> None:
        """An AUTOPILOT_VERSION of the autopilot's own component arrived, with this flight_sw_version."""
        self.version = version_of(number)

    def on_value(self, name: str, value: float) -> None:
        if name in self._apart:
            self._apart[name] = value
        super().on_value(name, value)

    def _ask_version(self, now_s: float) -> list[Any]:
        if now_s < self._version_due_s:
            return []
        self._version_due_s = now_s + (VERSION_AGAIN_S if self.version == _NO_VERSION else VERSION_ANEW_S)
        message = float(dialect.MAVLINK_MSG_ID_AUTOPILOT_VERSION)
        ways = [(dialect.MAV_CMD_REQUEST_MESSAGE, message)]
        if self.version == _NO_VERSION:
            # The way before 2019: just the firmware that is too old may know no other.
            ways.append((dialect.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES, 1.0))
        return [
            dialect.MAVLink_command_long_message(*self._target, command, 0, first, 0, 0, 0, 0, 0, 0)
            for command, first in ways
        ]

    def _ask_apart(self, now_s: float) -> list[Any]:
        asked = []
        for name, value in self._apart.items():
            has_it = name != FAILSAFE_AFTER or self.version >= TIMED_FROM
            if has_it and now_s >= self._apart_due_s[name]:
                self._apart_due_s[name] = now_s + (AGAIN_S if math.isnan(value) else VERSION_ANEW_S)
                asked.append(dialect.MAVLink_param_request_read_message(*self._target, name.encode(), -1))
        return asked

    def _ask_setting(self, now_s: float) -> list[Any]:
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
            return unread("the autopilot's parameters", "are")
        if self.version == _NO_VERSION:
            return unread("the autopilot's version")
        if self.version < TRIED_FROM:
            return f"ArduSub {'.'.join(map(str, self.version))} is too old: update it to 4.5 or 4.6"
        if self.values[FRAME] not in MOTOR_FACTORS:
            return f"{FRAME} {self.values[FRAME]:g} is not supported: 1 (vectored) and 2 (vectored_6dof) are"
        if self._thrusters != len(MOTOR_FACTORS[int(self.values[FRAME])]):
            return f"{FRAME} {self.values[FRAME]:g} has not {self._thrusters} thrusters: name that vehicle's own file"
        # Without a fail-safe a dead companion would leave the last sticks in force.
        for name in (FAILSAFE, PILOT_FAILSAFE):
            if math.isnan(self.values[name]):
                return unread(name)
            if not self.values[name] > WARNS_ALONE:
                return f"{name} must stop the vehicle: set it to 2"
        if self.version >= TIMED_FROM and not self.fails_after_s <= LONGEST_ALONE_S:
            if math.isnan(self.fails_after_s):
                return unread(FAILSAFE_AFTER)
            return f"{FAILSAFE_AFTER} is {self.fails_after_s:g} s: set it to {LONGEST_ALONE_S:g} or less"
        after_s = self.values[PILOT_FAILSAFE_AFTER]
        if math.isnan(after_s):
            return unread(PILOT_FAILSAFE_AFTER)
        if after_s > LONGEST_ALONE_S:
            return f"{PILOT_FAILSAFE_AFTER} is {after_s:g} s: set it to {LONGEST_ALONE_S:g} or less"
        if math.isnan(self.values[PILOT]):
            return f"no {PILOT}: from 4.7 on ArduSub has MAV_GCS_SYSID, use 4.5 or 4.6"
        return ""

    @property
    def fails_after_s(self) -> float:
        """After how much silence the autopilot stops the vehicle; NaN until it is read, and where the firmware has no
        such setting."""
        return self._apart[FAILSAFE_AFTER]

    @property
    def flight_obstacle(self) -> str:
        """Why no flight may be steered, though the sticks may be held; "" if one may."""
        gain = self._apart[HEAVE_GAIN]
        if gain == 1.0:
            return ""
        return unread(HEAVE_GAIN) if math.isnan(gain) else f"{HEAVE_GAIN} is {gain:g}: set it to 1"

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
