"""What the app shows at one instant, and who makes it."""

import math
from dataclasses import dataclass
from typing import Protocol

from gcs_plugin.watch.picture import Picture
from tui.app.replay import Replayed


@dataclass(frozen=True)
class Recording:
    """The recording that runs; `disk_left_s` is inf where nothing comes.

    `trouble` says what to do where its signed link lets nothing in. `waiting` frames could not be written yet, for the
    reason `unwritten`; "" where all that came is in a file. `told_unix_s` is when it told of itself, inf for just now;
    `hung_process` is its number where that is too long ago, 0 else. `set_by_s` and `taken_away`: see
    `Holding`.
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
    """The feed-forward's off switch since it was thrown: what it sees, in words, and whether all vehicles are off, or
    which systems are not known to be yet."""

    words: str
    sent: int
    done: bool
    waits_for: tuple[int, ...] = ()


@dataclass(frozen=True)
class View:
    """`behind_s` is how long ago the picture was made; `trouble` what the station can't do, "" where all is well.

    `view_only`: whoever looks may only look. `replay` is the dive that is replayed, which Watch shows in place of the
    picture; all else here is live.
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
        """Whether a recording runs that still tells of itself."""
        return self.recording is not None and not self.recording.hung_process


class Views(Protocol):
    """Who makes views. Nothing here waits."""

    def view(self) -> View:
        """The newest."""
        ...

    def set_period(self, period_s: float) -> None:
        """How often a new one is asked for."""
        ...

    def force_off(self) -> None:
        """Begin to switch the feed-forward off, and go on until the vehicle acknowledges."""
        ...
