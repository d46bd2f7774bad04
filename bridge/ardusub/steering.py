"""Flies a flight's references by sticks in MANUAL, where a stick is a thrust (ArduSub 4.5, mode_manual.cpp).

The controller is that of a vehicle that has no autopilot; its wrench reaches the thrusters through ArduSub's mixer.
Roll and pitch are left to the hull: MANUAL has no say over them. In the countdown the autopilot is put into MANUAL and
armed; when the flight is over it gets sticks at rest, is disarmed if the flight says so, and is put back into the mode
that it was in.
"""

import math
from dataclasses import replace
from typing import Any, Final

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.ardusub.heard import FRESH_S, Heard
from bridge.ardusub.law import FULL_STICK
from bridge.ardusub.mixing import Mixer
from bridge.firmware.ardusub import MANUAL
from bridge.firmware.description import AUTOPILOT
from bridge.flight.flight import State
from bridge.vehicle.autopilot import RATE_HZ, Actuation, Autopilot
from bridge.vehicle.coefficients import HEAVE
from bridge.vehicle.feedforward import FEEDFORWARD_DOFS
from bridge.vehicle.mode import Mode
from bridge.vehicle.navigation import Navigation
from bridge.vehicle.references import Reference

TICK_S: Final = 1 / RATE_HZ
AGAIN_S: Final = 0.3
MODE_LEAD_S: Final = 2.8
"""An armed vehicle is put into MANUAL so long before the countdown ends: a heartbeat a second tells the mode."""
MODE_BACK_S: Final = 3.0
"""The mode that was before is asked for so long: an autopilot may refuse it, and then MANUAL stays."""
REST_S: Final = 0.5
"""Sticks at rest are repeated for so long after a flight where no pilot sends any, before the sticks are given back: a
single message may be lost."""
_ENABLE: Final = float(dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED)


class Steering:
    """Sticks, modes and arming of a flight, tick by tick.

    `active` from the countdown until the vehicle is the pilot's again, or disarmed; `flying` while it sends sticks for
    the pilot's.
    """

    def __init__(self, system: int) -> None:
        self._system = system
        self.active = self.flying = False
        self._autopilot: Autopilot | None = None
        self._mixer: Mixer | None = None
        self._before: int | None = None
        self._arms: bool | None = None
        self._back_until_s = self._rest_until_s = -math.inf
        self._unheard_s = math.inf
        self._due_s = {"arm": -math.inf, "mode": -math.inf}
        self._armed_s = self._manual_s = -math.inf

    def fit(self, autopilot: Autopilot, mixer: Mixer) -> None:
        """Take the controller and the autopilot's mixer, once both are known."""
        self._autopilot, self._mixer = autopilot, mixer

    @property
    def pending(self) -> bool:
        """Whether an order to disarm is not yet obeyed."""
        return self._arms is False

    def arm(self, wanted: bool) -> None:
        """Have the autopilot armed, which happens in a countdown alone, or disarmed."""
        self._arms = wanted

    def rest(self, now_s: float, heard: Heard) -> list[Any]:
        """Sticks at rest, and a disarming that was asked for."""
        return [self._sticks(0, 0, 0, 0), *self._arming(now_s, heard)]

    def step(
        self, now_s: float, state: State, left_s: float, reference: Reference | None,
        navigation: Navigation, heard: Heard, *, held: bool, mode: Mode, sticks_s: float,
    ) -> tuple[list[Any], Actuation | None]:  # fmt: skip
        """The messages of a flight's tick, and the forces for the recording.

        `left_s`: the rest of the countdown; `held`: the autopilot takes the companion's sticks alone; `mode` is
        FF_MODE; `sticks_s`: when the pilot's came last.
        """
        self._unheard_s = math.inf
        if state is State.IDLE:
            return self._ended(now_s, heard, sticks_s), None
        if not self.active:
            self.active, self._before = True, heard.mode
        self.flying = True
        if state is not State.COUNTDOWN:
            self._arms = self._arms and None
            messages, actuation = self._flown(now_s, reference, navigation, heard, mode)
            return [*messages, *self._arming(now_s, heard)], actuation
        messages = [self._sticks(0, 0, 0, 0)] if held else []
        if heard.mode != MANUAL and (not heard.armed or left_s <= MODE_LEAD_S):
            ordered = self._mode(now_s, MANUAL)
            self._manual_s = now_s if ordered else self._manual_s
            messages += ordered
        if held or self._arms is False:
            messages += self._arming(now_s, heard)
        return messages, None

    def unheard(self, now_s: float) -> list[Any]:
        """The autopilot is silent, and may hear all the same: sticks at rest in place of the flight's last."""
        if not self.flying:
            return []
        self._unheard_s = min(self._unheard_s, now_s)
        return [self._sticks(0, 0, 0, 0)] if now_s <= self._unheard_s + REST_S else []

    def _flown(
        self, now_s: float, reference: Reference | None, navigation: Navigation, heard: Heard, mode: Mode
    ) -> tuple[list[Any], Actuation | None]:
        if reference is None or self._autopilot is None or self._mixer is None:
            return [self._sticks(0, 0, 0, 0)], None
        # A place can't be held by the feed-forward alone.
        self._autopilot.mode = Mode.BOTH if mode.applies_feedforward else Mode.OFF
        wanted = self._autopilot.step(now_s, navigation, reference)
        tau = np.array(wanted.tau_cmd)
        ahead, aside, turn = self._mixer.inputs(tau[list(FEEDFORWARD_DOFS)])
        down = self._mixer.heave_input(float(tau[HEAVE]))
        asked = np.array([ahead, aside, down, turn]) / heard.gain
        asked = np.rint(FULL_STICK * asked / max(1.0, float(np.abs(asked).max())))
        # Sticks end at the joystick's gain, know no roll and no pitch, and leave small thrusts in the dead zone.
        ahead, aside, down, turn = heard.gain * asked / FULL_STICK
        x, y, z, k, m, n = self._mixer.whole_wrench(np.array([ahead, aside, turn]), down).tolist()
        actuation = replace(wanted, tau_cmd=(x, y, z, k, m, n), pwm_us=(), mode=int(mode))
        return [self._sticks(*asked)], actuation

    def _ended(self, now_s: float, heard: Heard, sticks_s: float) -> list[Any]:
        """Sticks at rest once, and on where no pilot sends any, for REST_S and until all is as it was."""
        self._arms = self._arms and None
        first, self.flying = self.flying, False
        if first:
            self._back_until_s, self._rest_until_s = now_s + MODE_BACK_S, now_s + REST_S
        messages, alone = self._arming(now_s, heard), now_s - sticks_s > FRESH_S
        if self.active:
            messages += self._mode_back(now_s, heard)
            if alone and now_s < self._rest_until_s:
                self.active = True
        if first or (self.active and alone):
            messages.insert(0, self._sticks(0, 0, 0, 0))
        return messages

    def _mode_back(self, now_s: float, heard: Heard) -> list[Any]:
        """The order of the mode that was before; once all is as it was, it is active no more."""
        manual = heard.mode == MANUAL or (heard.mode == self._before and _is_older(heard, self._manual_s))
        gives_back = manual and self._before not in (None, MANUAL) and now_s < self._back_until_s
        if gives_back and self._arms is None:
            return self._mode(now_s, int(self._before or 0))
        if self._arms is None:
            self.active = False
        return []

    def _arming(self, now_s: float, heard: Heard) -> list[Any]:
        doubtful = self._arms is False and _is_older(heard, self._armed_s)
        if self._arms is None or (heard.armed == self._arms and not doubtful):
            self._arms = None
            return []
        ordered = self._order("arm", now_s, dialect.MAV_CMD_COMPONENT_ARM_DISARM, float(self._arms), 0.0)
        self._armed_s = now_s if ordered and self._arms else self._armed_s
        return ordered

    def _mode(self, now_s: float, mode: int) -> list[Any]:
        return self._order("mode", now_s, dialect.MAV_CMD_DO_SET_MODE, _ENABLE, float(mode))

    def _order(self, kind: str, now_s: float, command: int, first: float, second: float) -> list[Any]:
        if now_s < self._due_s[kind]:
            return []
        self._due_s[kind] = now_s + AGAIN_S
        return [
            dialect.MAVLink_command_long_message(
                self._system, AUTOPILOT, command, 0, first, second, 0, 0, 0, 0, 0
            )
        ]

    def _sticks(self, ahead: float, aside: float, down: float, turn: float) -> Any:
        """MANUAL_CONTROL, its own z being 500 at rest and less downwards."""
        return dialect.MAVLink_manual_control_message(
            self._system, round(ahead), round(aside), round(500 - down / 2), round(turn), 0
        )


def _is_older(heard: Heard, ordered_s: float) -> bool:
    """Whether the latest heartbeat may be of before an order was obeyed: it tells the state once a second."""
    return heard.beat_s < ordered_s + AGAIN_S
