"""Data types of a recording: frames with their time and link, notices to the operator, and the counts of a dive."""

from dataclasses import dataclass

from bridge.framing import Frame


@dataclass(frozen=True, slots=True)
class Notice:
    """Notice to the operator; `level` is "info", "warning" or "error"."""

    unix_us: int
    level: str
    sentence: str


@dataclass(frozen=True, slots=True)
class Recorded:
    """A recorded frame, in a file or waiting for it, with its arrival time and the name of its link."""

    unix_us: int
    link: str
    frame: Frame


@dataclass(frozen=True, slots=True)
class Count:
    """Counts of a dive. `files`, `frames` and `bytes` are those of the files in its folder.

    `heard` counts the frames that arrived on the links, without those of the outlet; `lost` the frames that arrived and
    are in no file; `moved` the frames in files that were moved elsewhere; `missed` the frames that never arrived, by
    the sequence numbers: a lower bound, since a long gap does not show its length. `unheard_s` is the vehicle's longest
    silence between two of its frames, 0 for none; `keeps_ring`: the vehicle reports that it keeps a recording onboard.
    """

    files: int
    heard: int
    frames: int
    bytes: int
    lost: int
    moved: int = 0
    missed: int = 0
    unheard_s: float = 0.0
    keeps_ring: bool = False
