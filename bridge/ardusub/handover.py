"""Who holds the sticks: SYSID_MYGCS of the autopilot, which takes MANUAL_CONTROL from that system alone.

    FREE -> TAKING -> HELD -> LEAVING -> FREE

While SYSID_MYGCS is the vehicle's own system, the pilot's sticks reach the companion alone, which sends them on. If
the companion dies, the autopilot hears nobody any more and disarms by itself (`FS_GCS_ENABLE`). A value counts only as
read back by a separate read; an echo proves nothing, and ArduSub merges the echoes of several writes.

The earlier value is stored in a file before anything is written, so that a companion that died can put it back when it
starts again. The file is touched while the sticks are held: one that is fresh says that they were held from here. If
another program writes SYSID_MYGCS, its value stays: the companion takes the sticks again only after the feed-forward
has been off once.
"""

import math
import os
import time
from concurrent.futures import Executor, Future
from contextlib import suppress
from enum import Enum, auto
from pathlib import Path
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.files import read_small, to_disk, whole
from bridge.firmware.ardusub import PILOT
from bridge.firmware.questions import unread
from bridge.onboard.parameters import InlineExecutor

AGAIN_S: Final = 0.5
QUIET_S: Final = 0.3
"""Between the last write and the read that proves it: an echo on its way must not pass for the answer."""
GIVE_UP_S: Final = 10.0
CHECK_EVERY_S: Final = 5.0
TOUCH_EVERY_S: Final = 1.0
LATELY_S: Final = 10.0
"""No other companion takes the sticks so shortly after the one on this computer died: the autopilot still takes that
one's system for the pilot's, or has disarmed by itself."""
_ON_AGAIN: Final = "FF_MODE 0 and on again"


class Holder(Enum):
    """Who flies."""

    FREE = auto()
    TAKING = auto()
    HELD = auto()
    LEAVING = auto()


class Handover:
    """Takes and gives back the sticks of the autopilot of `system`. `ground` is the pilot's system.

    `holder` says where it is, `fault` why the sticks can't be taken ("" if they can), and `trouble` the same as a
    sentence for the crew with the way out. `said` collects the other sentences. `value` is SYSID_MYGCS as last read,
    NaN before; `starting` until that was acted on; `held_lately` whether a companion with the same `store` held the
    sticks just before this one began. `aside` writes and clears `store`, for a loop that must not wait for a
    disk that stalls; without it `step` waits.
    """

    def __init__(
        self, system: int, component: int, ground: int, store: Path | None, aside: Executor | None = None
    ) -> None:
        self._target, self._system, self._ground, self._store = (system, component), system, ground, store
        self.holder = Holder.FREE
        self.fault = self.trouble = ""
        self.said: list[str] = []
        self.value = math.nan
        self.held_lately = self._touched_lately()
        self._before = self._remembered()
        self.starting = True
        self._left_behind = self._store is not None and self._store.exists()
        self._aside = aside or InlineExecutor()
        self._keeping: Future[None] | None = None
        self._touching: Future[None] | None = None
        self._touched_s = -math.inf
        self._barred = False
        self._due_s = -math.inf
        self._wrote_s = self._read_s = -math.inf
        self._deadline_s = math.inf
        self._doubt_s = math.inf

    @property
    def forwards(self) -> bool:
        """Whether the pilot's sticks are to be sent on: from before the sticks are taken until they are proven back,
        so that no moment lies between; the autopilot ignores those of the system that does not hold them."""
        return self.holder is not Holder.FREE

    @property
    def given_back(self) -> bool:
        """Whether the sticks are the pilot's for all that is known: not before what a companion that died has left was
        read."""
        unknown = (
            self.starting and self._left_behind and (math.isnan(self.value) or self.value == self._system)
        )
        return self.holder is Holder.FREE and not unknown

    @property
    def obstacle(self) -> str:
        """Why the sticks can't be taken now, "" if they can."""
        if self.fault or math.isnan(self.value):
            return self.fault or unread(PILOT)
        foreign = self.holder is Holder.FREE and self.value != self._ground
        if not foreign:
            return ""
        if self.value == self._system:
            return f"{PILOT} is {self.value:g}, the vehicle's own system: {self._mend}"
        mend = f"set {PILOT} to {self._ground}, or start the companion with --ground {self.value:g}"
        return f"{PILOT} is {self.value:g}, the pilot's system {self._ground}: {mend}"

    @property
    def _mend(self) -> str:
        """The way out where the vehicle's own system holds the sticks, and this companion does not."""
        return f"end the other companion, or set {PILOT} to {self._ground}"

    def step(self, wanted: bool, now_s: float, *, asked: bool) -> list[Any]:
        """The messages to send to the autopilot now.

        `wanted`: the companion is to hold the sticks; `asked`: a mode or a flight asks it to, whatever stands against.
        """
        if not asked:
            self._barred = False
            self.fault = self.trouble = ""
        if math.isnan(self.value):
            return self._read(now_s)
        if self.holder is Holder.FREE:
            if self.starting:
                self._find_left_behind(now_s)
            elif wanted and not self._barred:
                self._take(now_s)
        elif self.holder in (Holder.TAKING, Holder.HELD) and not wanted:
            self._begin(Holder.LEAVING, now_s)
        if self.holder is Holder.HELD and now_s >= self._touched_s + TOUCH_EVERY_S:
            self._keep_fresh(now_s)
        return self._messages(now_s)

    def on_value(self, name: str, value: float, now_s: float) -> None:
        """A PARAM_VALUE of the autopilot's own component arrived."""
        if name != PILOT:
            return
        asked = self._read_s > self._wrote_s
        before, self.value = self.value, value
        if self.holder is Holder.HELD and value == self._system:
            self._doubt_s = math.inf
        elif self.holder is Holder.HELD and not self._read_s > self._doubt_s:
            # It may be of before, and late: where another program wrote it, a read from now on says so too.
            if self._doubt_s == math.inf:
                self._doubt_s, self._due_s = now_s, now_s + QUIET_S
        elif self.holder is Holder.HELD:
            self.holder, self._doubt_s = Holder.FREE, math.inf
            self._lose_to_another(value)
        elif self.holder is Holder.TAKING and value == self._system and asked:
            self.holder, self._due_s = Holder.HELD, now_s + CHECK_EVERY_S
            self.said.append("companion holds the sticks")
        elif self.holder is Holder.LEAVING and value == self._before and asked:
            self.holder, self._due_s = Holder.FREE, now_s + CHECK_EVERY_S
            self._aside.submit(self._forget)
            self.said.append(f"sticks given back: {PILOT} {value:g}")
        elif (
            self.holder in (Holder.TAKING, Holder.LEAVING)
            and asked
            and value not in (self._system, self._before)
        ):
            self._aside.submit(self._forget)
            self.holder, self._due_s = Holder.FREE, now_s + CHECK_EVERY_S
            self._lose_to_another(value)
        elif self.holder is Holder.FREE and not self._barred and value != before:
            self._warn_of_another(value)

    def _lose_to_another(self, value: float) -> None:
        self._bar(
            f"{PILOT} became {value:g}: another program took the sticks",
            f"sticks lost: {PILOT} set to {value:g} by another program: end it, then {_ON_AGAIN}",
        )

    def _warn_of_another(self, value: float) -> None:
        """The sticks are free, and their owner has changed or was read the first time."""
        left_behind = self.starting and value == self._system
        if value == self._system and not left_behind:
            self.said.append(f"{PILOT} is {value:g}, the vehicle's own system: {self._mend}")
        elif value != self._ground and not left_behind:
            self.said.append(
                f"{PILOT} is {value:g}: other sticks than those of system {self._ground} fly; end their program, or "
                f"set {PILOT} to {self._ground}"
            )

    def _bar(self, fault: str, trouble: str) -> None:
        """Leave the sticks alone until the feed-forward was off once."""
        self._barred, self.fault, self.trouble = True, fault, trouble

    def _take(self, now_s: float) -> None:
        if self.obstacle:
            self._bar(self.obstacle, f"sticks not taken: {self.obstacle}; then {_ON_AGAIN}")
            return
        if self._keeping is None or self._before != self.value:
            self._before = self.value
            self._keeping = self._aside.submit(self._remember, self._before)
        if not self._keeping.done():
            return
        error, self._keeping = self._keeping.exception(), None
        if error is not None:
            self._bar(
                f"the value of {PILOT} can't be kept: {error}",
                f"sticks not taken: disk can't be written: free space on the companion's, then {_ON_AGAIN}",
            )
            return
        self._begin(Holder.TAKING, now_s)

    def _keep_fresh(self, now_s: float) -> None:
        if self._touching is None or self._touching.done():
            self._touched_s, self._touching = now_s, self._aside.submit(self._touch)

    def _find_left_behind(self, now_s: float) -> None:
        """At the start alone: later, a 1 is another program's word."""
        self.starting = False
        if self.value == self._system:
            self.said.append(f"{PILOT} was left at {self._system}: putting it back")
            self._begin(Holder.LEAVING, now_s)
        elif self._left_behind:
            self._aside.submit(self._forget)

    def _begin(self, holder: Holder, now_s: float) -> None:
        self.holder, self._due_s, self._deadline_s = holder, now_s, now_s + GIVE_UP_S
        self._doubt_s = math.inf
        self._wrote_s = self._read_s = -math.inf

    def _messages(self, now_s: float) -> list[Any]:
        if self.holder in (Holder.FREE, Holder.HELD):
            return self._read(now_s, CHECK_EVERY_S if self._doubt_s == math.inf else AGAIN_S)
        if now_s >= self._deadline_s and self.holder is Holder.TAKING:
            self._bar(
                f"the autopilot does not answer for {PILOT}",
                f"sticks not taken: no answer for {PILOT}: look at the autopilot's link, then {_ON_AGAIN}",
            )
            self._begin(Holder.LEAVING, now_s)
        if now_s >= self._deadline_s and not self.trouble:
            self.trouble = f"sticks not given back: no answer for {PILOT}: look at the autopilot's link"
        if now_s < self._due_s:
            return []
        if self._read_s >= self._wrote_s:
            value = float(self._system) if self.holder is Holder.TAKING else self._before
            self._wrote_s, self._due_s = now_s, now_s + QUIET_S
            name = PILOT.encode()
            return [
                dialect.MAVLink_param_set_message(*self._target, name, value, dialect.MAV_PARAM_TYPE_INT16)
            ]
        self._read_s, self._due_s = now_s, now_s + AGAIN_S
        return [self._question()]

    def _read(self, now_s: float, every_s: float = AGAIN_S) -> list[Any]:
        if now_s < self._due_s:
            return []
        self._read_s, self._due_s = now_s, now_s + every_s
        return [self._question()]

    def _question(self) -> Any:
        return dialect.MAVLink_param_request_read_message(*self._target, PILOT.encode(), -1)

    def _remembered(self) -> float:
        """The value before that a companion which died has left, else the ground's."""
        try:
            value = math.nan if self._store is None else float(read_small(self._store))
        except (OSError, ValueError):
            value = math.nan
        return value if 1 <= value <= 255 and value != self._system else float(self._ground)

    def _touched_lately(self) -> bool:
        """Whether `store` is there and fresh; a time of the future, after the clock was set back, is not."""
        try:
            return self._store is not None and 0 <= time.time() - self._store.stat().st_mtime < LATELY_S
        except OSError:
            return False

    def _touch(self) -> None:
        if self._store is not None:
            with suppress(OSError):
                os.utime(self._store)

    def _remember(self, before: float) -> None:
        if self._store is not None:
            self._store.parent.mkdir(parents=True, exist_ok=True)
            with whole(self._store) as file:
                file.write(f"{before:g}\n".encode())
                to_disk(file)

    def _forget(self) -> None:
        if self._store is not None:
            # One that is left over counts only where the vehicle's own system holds the sticks at a start.
            with suppress(OSError):
                self._store.unlink(missing_ok=True)
