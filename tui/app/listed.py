"""Dives as `seatrial dives --json` lists them, the newest first."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bridge.errors import LogError
from bridge.printable import printable
from gcs_plugin.dive_length import length_s
from gcs_plugin.dive_order import began
from tui.dive_list import FAIR, dive_folders, kept_glance, short_name


@dataclass(frozen=True)
class Span:
    """One axis: seconds with both thrust and readings, and the range of thrust and speed in SI; NaN if not recorded."""

    seconds: float
    thrust: float
    speed: float


@dataclass(frozen=True)
class ListedDive:
    """One dive. `relative_std` by coefficient predicts how well it could be identified: inf not at all; None unknown.

    `spans` by axis ("surge"). `why_not`, `error`, `stray`, `restarts`, `lacking`, `unheard`, `damaged` and `underway`
    are sentences, "" for none. `unread`: the recording has not been read yet, and only name, time and length are
    known.
    """

    folder: Path
    name: str
    began_unix_s: float
    duration_s: float
    size_bytes: float
    loss: float
    relative_std: Mapping[str, float] | None
    spans: Mapping[str, Span]
    why_not: str
    error: str
    notes: str
    events: tuple[str, ...]
    learnt: tuple[str, ...]
    conditions: str = ""
    stray: str = ""
    restarts: str = ""
    damaged: str = ""
    unread: bool = False
    lacking: str = ""
    unheard: str = ""
    underway: str = ""

    @property
    def identifiable(self) -> bool:
        """Whether any coefficient could be identified."""
        return any(std <= FAIR for std in (self.relative_std or {}).values())

    @property
    def worked_on(self) -> str:
        """Short form of the work done on it: `identified, diagnosed`."""
        words = (sentence.split(" ", 1)[0].rstrip(":") for sentence in self.learnt)
        return ", ".join(dict.fromkeys(word for word in words if word in ("identified", "diagnosed")))


def listed(result: Any) -> tuple[ListedDive, ...]:
    """The dives of a list in reverse order; empty if the value is not a list."""
    return tuple(_dive(entry) for entry in reversed(result)) if isinstance(result, list) else ()


def with_unread(dives: Sequence[ListedDive], root: Path) -> tuple[ListedDive, ...]:
    """Add the dives of `root` that the list lacks, with the facts known without reading them. The newest first."""
    try:
        folders = dive_folders(root)
    except LogError:
        return tuple(dives)
    known = {dive.folder for dive in dives}
    new = [_unread(folder) for folder in folders if folder not in known]
    return tuple(sorted((*dives, *new), key=_order, reverse=True)) if new else tuple(dives)


def _order(dive: ListedDive) -> tuple[float, str]:
    return _or(dive.began_unix_s, 0.0), dive.folder.name


def _unread(folder: Path) -> ListedDive:
    glance, began_s, lasts_s = kept_glance(folder), began(folder), length_s(folder)
    return ListedDive(
        folder,
        printable(short_name(folder), "?"),
        _number(began_s),
        _number(lasts_s) if glance is None else glance.duration_s,
        size_bytes=math.nan,
        loss=math.nan,
        relative_std=None,
        spans={},
        why_not="",
        error="",
        notes="",
        events=(),
        learnt=(),
        unread=True,
    )


def usual(dives: Sequence[ListedDive], otherwise: Path | None) -> Path | None:
    """The dive that the user most likely means: the newest that could identify anything, else `otherwise`.

    A recording begun on deck with no data in it is not the dive that the crew has just made.
    """
    return next((dive.folder for dive in dives if dive.identifiable), otherwise)


def _dive(data: Mapping[str, Any]) -> ListedDive:
    excitation = data["excitation"]
    return ListedDive(
        Path(data["folder"]),
        str(data["name"]),
        _number(data["began_unix_s"]),
        _number(data["duration_s"]),
        _number(data["size_bytes"]),
        _number(data["loss"]),
        None
        if excitation is None
        else {entry["name"]: _or(_number(entry["relative_std"]), math.inf) for entry in excitation},
        {entry["axis"]: _span(entry) for entry in data["axes"]},
        str(data["why_not"]),
        str(data["error"]),
        str(data["notes"]),
        tuple(map(str, data["events"])),
        tuple(map(str, data["learnt"])),
        str(data["conditions"]),
        str(data.get("stray", "")),
        str(data.get("restarts", "")),
        str(data.get("damaged", "")),
        lacking=str(data.get("lacking", "")),
        unheard=str(data.get("unheard", "")),
        underway=str(data.get("underway", "")),
    )


def _span(data: Mapping[str, Any]) -> Span:
    return Span(_number(data["seconds"]), _number(data["thrust"]), _number(data["speed"]))


def _number(value: Any) -> float:
    """A number of a JSON file, NaN for null."""
    return math.nan if value is None else float(value)


def _or(value: float, otherwise: float) -> float:
    return value if math.isfinite(value) else otherwise
