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
    """What a dive's files hold; `heard` are the frames of the links alone, `lost` those that no file took."""

    files: int
    heard: int
    frames: int
    bytes: int
    lost: int
