"""The state that the app shows at one instant, and the interface that supplies it."""

import math
from dataclasses import dataclass
from typing import Protocol

from gcs_plugin.watch.picture import Picture
from tui.app.replay import Replayed


@dataclass(frozen=True)
class Recording:
    """The running recording; `disk_left_s` is inf while no data arrives.

    `trouble` says what to do if a signed link accepts no frames. `waiting` frames could not be written yet, for the
    reason `unwritten`; "" if all received frames are in a file. `told_unix_s` is the time of its last report, inf for
    just now; `hung_process` is its process id if that is too long ago, otherwise 0. For `set_by_s` and `taken_away`
    see `Holding`.
    """

    began_unix_s: float
    disk_left_s: float
    lost: int
    trouble: str = ""
    unwritten: str = ""
    waiting: int = 0
    told_unix_s: float = math.inf
    hung_process: int = 0
    set_by_s: float = 0.0
    taken_away: str = ""


@dataclass(frozen=True)
class Forcing:
    """State of the feed-forward's off switch since it was thrown: its observations in words, number of orders sent,
    whether all vehicles are off, and the systems that are not known to be off yet.
    """

    words: str
    sent: int
    done: bool
    waits_for: tuple[int, ...] = ()


@dataclass(frozen=True)
class View:
    """`behind_s` is the age of the picture; `trouble` is a fault of the station, "" for none.

    `view_only`: the user may only look. `replay` is the replayed dive, which Watch shows in place of the picture;
    everything else here is live.
    """

    picture: Picture
    unix_s: float
    recording: Recording | None
    forcing: Forcing | None = None
    behind_s: float = 0.0
    trouble: str = ""
    view_only: bool = False
    replay: Replayed | None = None

    @property
    def records(self) -> bool:
        """Whether a recording runs that still reports."""
        return self.recording is not None and not self.recording.hung_process


class Views(Protocol):
    """Supplier of views. None of its methods wait."""

    def view(self) -> View:
        """The newest view."""
        ...

    def set_period(self, period_s: float) -> None:
        """Set the period, s, at which a new view is requested."""
        ...

    def force_off(self) -> None:
        """Start to switch the feed-forward off, and go on until the vehicle acknowledges."""
        ...
