"""What a recording is made of: frames with their time and link, notices to the operator, and the counts of a dive."""

from dataclasses import dataclass

from bridge.framing import Frame


@dataclass(frozen=True, slots=True)
class Notice:
    """Something that an operator must hear of: `level` is "info", "warning" or "error"."""

    unix_us: int
    level: str
    sentence: str


@dataclass(frozen=True, slots=True)
class Recorded:
    """A frame that is in a file, or waits for one: from which link, at what time it arrived."""

    unix_us: int
    link: str
    frame: Frame


@dataclass(frozen=True, slots=True)
class Count:
    """What the files in a dive's folder hold; `heard` are the frames of the links alone.

    `lost` are those that came and are in no file, `moved` those in files that somebody moved elsewhere; `missed` are
    those that never came, by the numbers of those that did: at least so many, since a long gap tells no number.
    `unheard_s` is the vehicle's longest silence between two of its frames, 0 for none; `keeps_ring` where it tells that
    it keeps a recording of its own.
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
