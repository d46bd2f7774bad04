"""The state that the app shows at one instant: the vehicle's picture as it ages, the recording, and a replayed dive."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, Protocol, TypeVar

from bridge.vehicle.config import load_vehicle
from gcs_plugin.dives.folder import load_folder
from gcs_plugin.dives.replay import Reel
from gcs_plugin.recording.state import FRESH_S, Holding
from gcs_plugin.watch.picture import Alarm, Armed, Freshness, Picture, SensorRow, ThrusterRow, Trace
from gcs_plugin.watch.watcher import Watcher
from tui.app.next_step import Next, Situation

Row = TypeVar("Row", SensorRow, ThrusterRow, Trace)
STALE_S, GONE_S = 3.0, 10.0
"""HEARTBEAT and FF_MODE arrive once a second: stale after 3 periods, gone after 10."""
SPEEDS: Final = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
BEFORE_S: Final = 65.0
"""Seconds read before the position shown, for the charts of the last minute."""


@dataclass(frozen=True)
class Forcing:
    """State of the feed-forward's off switch since it was thrown.

    words: how it goes. sent: number of orders. done: all vehicles are off. waits_for: systems not known to be off yet.
    """

    words: str
    sent: int
    done: bool
    waits_for: tuple[int, ...] = ()


@dataclass(frozen=True)
class Replayed:
    """State of the replay at `at_s` of `length_s` seconds; `speed` in times real time; `paused` also at the end."""

    name: str
    picture: Picture
    at_s: float
    length_s: float
    speed: float
    paused: bool


@dataclass(frozen=True)
class View:
    """All that the app shows at an instant.

    recording: it runs, or it hangs (`recorder_hangs`); None if there is none.
    forcing: the off switch, None until it is thrown.
    behind_s: age of the picture.
    trouble: a fault of the station, "" for none.
    view_only: the user may only look.
    replay: the replayed dive, which Watch shows in place of the picture; everything else here is live.
    over: the dive has ended in order, so that silence is no alarm.
    waits: as `over`, and the next dive is recorded already, though no vehicle is heard.
    last_heard: the picture when the vehicle was last heard, None if it never was.
    next, situation: the thing to do now, and the situation that it follows from; None until that was determined.
    """

    picture: Picture
    unix_s: float
    recording: Holding | None
    forcing: Forcing | None = None
    behind_s: float = 0.0
    trouble: str = ""
    view_only: bool = False
    replay: Replayed | None = None
    over: bool = False
    waits: bool = False
    last_heard: Picture | None = None
    next: Next | None = None
    situation: Situation | None = None

    @property
    def alarms(self) -> tuple[Alarm, ...]:
        """The vehicle's alarms; none of a dive that is over."""
        return () if self.over else self.picture.alarms

    @property
    def recorder_silent_s(self) -> float:
        """Time since the recorder last reported, s; 0 if no recording runs."""
        return 0.0 if self.recording is None else self.recording.age_s(self.unix_s)

    @property
    def recorder_hangs(self) -> bool:
        """Whether the recorder runs, and has not reported for so long that it must be taken to hang."""
        return self.recorder_silent_s > FRESH_S

    @property
    def records(self) -> bool:
        """Whether a recording runs that still reports."""
        return self.recording is not None and not self.recorder_hangs


def heard_of(picture: Picture) -> int | None:
    """System of the vehicle shown, None if it is not heard now, whoever else is."""
    shown = picture.links[0].system if picture.links else None
    links = (link for link in picture.links if link.system == shown)
    return shown if any(not link.lost and link.age_s <= STALE_S for link in links) else None


def silent_after(view: View) -> bool:
    """Whether the vehicle was disarmed before it fell silent."""
    links = view.picture.links
    return (
        view.picture.armed is Armed.DISARMED and bool(links) and all(link.age_s > STALE_S for link in links)
    )


class Views(Protocol):
    """Supplier of views. None of its methods wait."""

    def view(self) -> View: ...

    def set_period(self, period_s: float) -> None:
        """Set the period, s, at which a new view is requested."""
        ...

    def force_off(self) -> None:
        """Start to switch the feed-forward off, and go on until the vehicle acknowledges."""
        ...


def aged(picture: Picture, behind_s: float) -> Picture:
    """Return the picture as it looks `behind_s` after it was made."""
    picture = replace(
        picture,
        armed_age_s=picture.armed_age_s + behind_s,
        ff_mode_age_s=picture.ff_mode_age_s + behind_s,
        active_set_age_s=picture.active_set_age_s + behind_s,
        links=tuple(
            replace(link, age_s=link.age_s + behind_s, lost=link.lost or behind_s > STALE_S)
            for link in picture.links
        ),
    )
    if behind_s <= STALE_S:
        return picture

    def older(row: Row) -> Row:
        gone = behind_s > GONE_S or row.freshness is Freshness.GONE
        freshness = Freshness.GONE if gone else Freshness.STALE
        return replace(row, age_s=row.age_s + behind_s, freshness=freshness)

    return replace(
        picture,
        sensors=tuple(map(older, picture.sensors)),
        traces={key: older(trace) for key, trace in picture.traces.items()},
        thrusters=tuple(map(older, picture.thrusters)),
    )


class Replay:
    """A recorded dive shown on its own clock, which can pause, seek and run faster.

    `make_watcher` returns a new watcher for frames recorded from a Unix time on; `clock` returns seconds.
    """

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
        return Watcher(file, unix_at_zero_s=began_unix_s)

    return Replay(dive.name, reel, watcher, time.monotonic)
