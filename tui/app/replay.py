"""Replay of a dive: position, speed, and the picture at that position."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

from bridge.framing import Frame
from bridge.vehicle.config import load_vehicle
from gcs_plugin.folder import load_folder
from gcs_plugin.reel import Reel
from gcs_plugin.watch.picture import Picture
from gcs_plugin.watch.watcher import Watcher as RealWatcher
from tui.app.lines import Line, cut
from tui.app.shown import stopwatch

SPEEDS: Final = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
BEFORE_S: Final = 65.0
"""Seconds read before the position shown, for the charts of the last minute."""


class Watcher(Protocol):
    """Makes pictures from frames; see `gcs_plugin.watch`."""

    def feed(self, frame: Frame, arrived_s: float, link: str) -> None: ...

    def picture(self, now_s: float) -> Picture: ...


@dataclass(frozen=True)
class Replayed:
    """State of the replay at `at_s` of `length_s` seconds; `speed` in times real time; `paused` also at the end."""

    name: str
    picture: Picture
    at_s: float
    length_s: float
    speed: float
    paused: bool


class Replay:
    """`make_watcher` returns a new watcher for frames recorded from a Unix time on; `clock` returns seconds."""

    def __init__(
        self, name: str, reel: Reel, make_watcher: Callable[[float], Watcher], clock: Callable[[], float]
    ) -> None:
        self.name = name
        self._reel, self._make_watcher, self._clock = reel, make_watcher, clock
        self._speed, self._runs = 1.0, True
        self._from_s, self._since_s = 0.0, clock()
        self._watcher, self._fed_s = make_watcher(reel.began_unix_s), 0.0

    @property
    def at_s(self) -> float:
        """Position in the dive, s."""
        gone_s = self._speed * (self._clock() - self._since_s) if self._runs else 0.0
        return min(self._from_s + gone_s, self._reel.length_s)

    @property
    def paused(self) -> bool:
        return not self._runs or self.at_s >= self._reel.length_s

    def toggle(self) -> None:
        """Pause or resume; at the end, start again from the beginning."""
        if self.at_s >= self._reel.length_s:
            self.seek(-math.inf)
            self._runs = True
        else:
            self._hold()
            self._runs = not self._runs

    def faster(self, steps: int) -> None:
        """Change the speed by that many steps in `SPEEDS`, up or down."""
        self._hold()
        at = SPEEDS.index(self._speed) + steps
        self._speed = SPEEDS[max(0, min(at, len(SPEEDS) - 1))]

    def seek(self, by_s: float) -> None:
        """Move by that many seconds, forward or back."""
        at_s = max(0.0, min(self.at_s + by_s, self._reel.length_s))
        self._from_s, self._since_s = at_s, self._clock()
        if not self._fed_s <= at_s <= self._fed_s + BEFORE_S:
            self._watcher = self._make_watcher(self._reel.began_unix_s)
            self._fed_s = max(0.0, at_s - BEFORE_S)

    def shown(self) -> Replayed:
        """Feed the frames up to the present position; return the state there."""
        at_s, ended = self.at_s, self.at_s >= self._reel.length_s
        for time_s, frame in self._reel.between(self._fed_s, math.inf if ended else at_s):
            self._watcher.feed(frame, time_s, self.name)
        self._fed_s = math.nextafter(at_s, math.inf) if ended else at_s
        return Replayed(
            self.name, self._watcher.picture(at_s), at_s, self._reel.length_s, self._speed, self.paused
        )

    def _hold(self) -> None:
        """Restart the count at the present position."""
        self._from_s, self._since_s = self.at_s, self._clock()


def open_replay(dive: Path, vehicle: str) -> Replay:
    """Open the replay of a dive folder at its beginning. Reads the whole recording; raises LogError, ConfigError."""
    file = load_vehicle(vehicle) if vehicle else None
    reel = Reel(load_folder(dive).telemetry())

    def watcher(began_unix_s: float) -> Watcher:
        return RealWatcher(file, unix_at_zero_s=began_unix_s)

    return Replay(dive.name, reel, watcher, time.monotonic)


def bar(replayed: Replayed, cells: int) -> Line:
    """The line that marks the lines below it as a replay and not the live vehicle."""
    clock = f"{stopwatch(replayed.at_s)} of {stopwatch(replayed.length_s)}"
    speed = "  PAUSED" if replayed.paused else f"  {replayed.speed:g}x"
    left, right = f" REPLAY {replayed.name}", f"{clock}{speed:<8} "
    live = "  only the lines above are live"
    if len(left) + len(live) + len(right) + 2 <= cells:
        left += live
    left = cut(left, max(cells - len(right) - 2, 0))
    return ((f"{left}{right:>{max(cells - len(left), 0)}}", "lost"),)
