# SPDX-License-Identifier: GPL-3.0-or-later
"""`seatrial ff`: switch the feed-forward off at once, or to another mode after a confirmation."""

from collections.abc import Callable
from typing import Any, Final, NamedTuple

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import Clock
from bridge.errors import ParamRejected
from bridge.vehicle.mode import BY_WORD, Mode, word_of
from bridge.vehicle.parameters import ACTIVE
from bridge.wire.framing import Frame
from bridge.wire.readings import decode
from gcs_plugin.feedforward.off_orders import OffMarks, OffOrders
from gcs_plugin.feedforward.switch import Switch, caution
from gcs_plugin.fleet import Fleet
from gcs_plugin.mavproxy.parameters import ARMED, SHOW_EVERY_S
from gcs_plugin.params.session import News
from gcs_plugin.peers import Source

GIVE_UP_S: Final = 30.0
"""For any mode except off: switching to off never gives up by itself."""
AGREE_WITHIN_S: Final = 60.0
SAID_S: Final = 3.0
"""Vehicles say their mode once a second: one said longer ago than this is dated."""


class _Asked(NamedTuple):
    """A mode that was asked for of a system, when, and the mode that the vehicle was in then."""

    mode: Mode
    system: int
    at_s: float
    was: float


class Switching:
    """Runs at most one switch at a time; `off` replaces any other."""

    def __init__(self, fleet: Fleet, clock: Clock, say: Callable[[str], None]) -> None:
        self._fleet, self._clock, self._say = fleet, clock, say
        self._marks, self._orders = OffMarks(), OffOrders()
        self._switch: Switch | None = None
        self._began_s = self._shown_s = 0.0
        self._asked: _Asked | None = None
        self._active: dict[Source, float] = {}
        self._modes: dict[int, tuple[float, float]] = {}  # that vehicles say, and when, by system

    def command(self, words: list[str]) -> bool:
        """Handle `ff WORDS`; False for an unknown command. Raises SeatrialError."""
        match words:
            case [mode] if BY_WORD.get(mode) is Mode.OFF:
                # Off needs no confirmation. It goes to the vehicle chosen, otherwise to every vehicle that is or was
                # heard.
                self._begin(
                    Switch(Mode.OFF, self._fleet.chosen, self._fleet.peers.known(self._clock.boot_s()))
                )
            case [mode] if mode in BY_WORD:
                self._ask(mode)
            case ["yes", mode, *armed] if mode in BY_WORD and armed in ([], [ARMED]):
                self._agree(mode, bool(armed))
            case _:
                return False
        return True

    def on_frame(self, frame: Frame) -> None:
        if frame.message_id == dialect.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT:
            reading = decode(frame)
            if reading is not None and reading.signal == "ff_mode":
                self._modes[frame.system] = reading.values[0], self._clock.boot_s()
        if self._switch is not None:
            self._switch.on_frame(frame, self._clock.boot_s())

    def on_news(self, news: News) -> None:
        """Note from any PARAM_VALUE, whoever requested it, whether a vehicle has parameters in force."""
        if news.message.get_type() == "PARAM_VALUE" and news.message.param_id == ACTIVE:
            self._active[news.source] = news.message.param_value

    def tick(self) -> list[Any]:
        switch, now_s = self._switch, self._clock.boot_s()
        if switch is None:
            return []
        systems = self._fleet.systems(now_s) if self._fleet.chosen is None else (self._fleet.chosen,)
        switch.twins = next((fault for system in systems if (fault := self._fleet.peers.fault(system))), "")
        if switch.mode is not Mode.OFF:
            switch.overruled = switch.overruled or any(
                self._orders.has_ordered_off(n) for n in switch.waits_for or systems
            )
        messages = switch.tick(now_s)
        self._marks.mark(messages)
        if switch.done or switch.hopeless(now_s):
            self._end("")
        elif switch.mode is not Mode.OFF and (switch.refusal or now_s - self._began_s >= GIVE_UP_S):
            self._end("given up, ")
            return []
        elif now_s - self._shown_s >= SHOW_EVERY_S:
            self._shown_s = now_s
            self._say(f"ff: {switch.words}")
        return messages

    def cancel(self) -> bool:
        """Stop sending; False if nothing is being sent."""
        if self._switch is None:
            return False
        self._end("stopped by the user, ")
        return True

    def status(self) -> list[str]:
        """A line about the switch in progress, if any."""
        return [f"ff: {self._switch.words}"] if self._switch is not None else []

    def mode_words(self, system: int) -> str:
        """The mode that a vehicle said last, and how long ago unless just now; "" for none."""
        if system not in self._modes:
            return ""
        mode, said_s = self._modes[system]
        age_s = self._clock.boot_s() - said_s
        return f"feed-forward {word_of(mode)}" + (f" {age_s:.0f} s ago" if age_s > SAID_S else "")

    def _ask(self, mode: str) -> None:
        now_s = self._clock.boot_s()
        source = self._fleet.meant(now_s)
        system = source[0]
        if BY_WORD[mode].applies_feedforward and self._active.get(source) == 0.0:
            raise ParamRejected(
                f"vehicle {system} has no parameters in force to feed forward; upload some first"
            )
        was, _ = self._modes.get(system, (float(Mode.OFF), 0.0))
        self._asked, self._orders = _Asked(BY_WORD[mode], system, now_s, was), OffOrders()
        armed = self._fleet.peers.armed(system)
        if warning := caution(BY_WORD[mode], system, was, self._active.get(source), armed=armed):
            self._say(warning)
        self._say(
            f"to set the feed-forward of vehicle {system}{', which is ARMED,' if armed else ''} to {mode}:"
        )
        self._say(f"    seatrial ff yes {mode}{f' {ARMED}' if armed else ''}")

    def _agree(self, mode: str, armed_said: bool) -> None:
        now_s = self._clock.boot_s()
        system, _ = self._fleet.meant(now_s)
        asked, self._asked = self._asked, None
        if asked is None or asked[:2] != (BY_WORD[mode], system) or now_s - asked.at_s > AGREE_WITHIN_S:
            raise ParamRejected(
                f"`seatrial ff {mode}` comes first, within {AGREE_WITHIN_S:.0f} s; nothing was sent"
            )
        if self._fleet.peers.armed(system) and not armed_said:
            self._asked = asked
            raise ParamRejected(
                f"the vehicle is ARMED; to set it all the same: seatrial ff yes {mode} {ARMED}"
            )
        self._begin(Switch(BY_WORD[mode], system, was=asked.was, while_disarmed=not armed_said))

    def _begin(self, switch: Switch) -> None:
        self._switch, self._asked = switch, None
        self._began_s = self._shown_s = self._clock.boot_s()
        self._say(f"ff: {switch.mode.word}, sent until the vehicle says so")

    def _end(self, how: str) -> None:
        assert self._switch is not None
        self._say(f"ff: {how}{self._switch.words}")
        self._switch = None
