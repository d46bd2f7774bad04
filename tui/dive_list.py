"""Dives as a list shows them: date, length, loss, coefficients that each could identify, and results so far.

Everything that requires reading the recording is cached next to it in a small file, which may be deleted.
"""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from bridge import schema
from bridge.errors import ConfigError, LogError
from bridge.files import read_small
from bridge.plain import from_json
from bridge.vehicle.coefficients import COEFFICIENTS
from gcs_plugin.dives.folder import list_folders
from gcs_plugin.dives.recordings import GLANCE, is_date, recordings
from identify.axis_span import Span

VERSION: Final = 8
GOOD, FAIR = 0.1, 0.3
"""Relative standard errors up to which a coefficient would be known well, and at all."""


@dataclass(frozen=True)
class Glance:
    """The contents of a recording at a glance. `loss` is NaN if no sequence numbers are recorded.

    `relative_std` by coefficient, inf for a coefficient that could not be identified; None if unknown, and `why_not`
    says why. `error` is set if the recording can't be read at all; `stray` reports bytes in it that belong to no
    message, `restarts` the vehicle's restarts and the run that is used, `lacking` the frames of other recordings that
    the whole recording lacks. `unheard_s` is the longest silence within the recording, 0 if there is none, and
    `unheard` says when it was and how to get its frames.
    """

    began_unix_s: float | None = None
    duration_s: float = math.nan
    loss: float = math.nan
    relative_std: dict[str, float] | None = None
    spans: tuple[Span, ...] = ()
    why_not: str = ""
    error: str = ""
    stray: str = ""
    restarts: str = ""
    lacking: str = ""
    unheard_s: float = 0.0
    unheard: str = ""

    @property
    def untold(self) -> str:
        """That the recording has nothing to identify, or that this is not known, and why; "" for neither."""
        subject = (
            "what it could identify is not known" if self.relative_std is None else "nothing to identify"
        )
        return f"{subject}: {self.why_not}" if self.why_not else ""

    @property
    def oddities(self) -> tuple[str, ...]:
        """What is odd about the recording, in sentences."""
        stray = f"{self.stray}." if self.stray else ""
        return tuple(filter(None, (stray, self.restarts, self.lacking, self.unheard)))


@dataclass(frozen=True)
class DiveRow:
    """A dive in a list; `notes` and `events` are the crew's own words, each event with its time.

    `learnt` describes the results next to it, `worked_on` is each of them in short ("identified", "GO in shadow");
    `conditions` describes the dive's conditions in a line. `damaged` says why its `dive.yaml` can't be read,
    `underway` that it is being recorded and holds nothing yet.
    """

    folder: Path
    name: str
    size_bytes: int
    glance: Glance
    notes: str
    events: tuple[str, ...]
    learnt: tuple[str, ...]
    worked_on: tuple[str, ...] = ()
    conditions: str = ""
    damaged: str = ""
    underway: str = ""

    @property
    def noted(self) -> tuple[str, ...]:
        """What the crew noted, a line each."""
        notes = (f"noted: {' '.join(self.notes.split())}",) if self.notes else ()
        return (*notes, *(f"noted at {' '.join(event.split())}" for event in self.events))


def dive_folders(root: Path) -> list[Path]:
    """`root` itself if it is a dive folder, otherwise the dive folders in it, the oldest first. Raises LogError if
    `root` is no folder."""
    if not root.is_dir():
        problem = "is a file" if root.exists() else "no such folder"
        raise LogError(f"{root}: {problem}; give the folder that holds the dives")
    return [root] if recordings(root) else [folder.path for folder in list_folders(root)]


def kept_glance(folder: Path) -> Glance | None:
    """The cached glance at a dive, made with any vehicle file; None if the recordings have changed since."""
    try:
        known = from_json(read_small(folder / GLANCE))["key"]
        states = {str(state[0]): state for state in (*known["recordings"], *known["beside"])}
        if all(states.get(file.name) == state_of(file) for file in recordings(folder)):
            return kept(folder, known | {"version": VERSION})
    except (OSError, ValueError, LookupError, TypeError):
        pass
    return None


def results_beside(dive: Path) -> dict[str, Path]:
    """Where an identification leaves its files next to a dive, by its options."""
    names = {"--json": "identified.json", "--param": "identified.param", "--report": "identified.html"}
    return {option: dive / name for option, name in names.items()}


def short_name(folder: Path) -> str:
    """`hovering` of `2026-11-20T0912Z-hovering`; the whole name if a folder is named in another way, or has no name but
    the number that keeps dives of one minute apart."""
    name = folder.resolve().name
    date, mark, title = name.partition("Z-")
    return title if mark and title and date[:4].isdecimal() and not title.isdecimal() else name


def letters(relative_std: dict[str, float] | None, kind: str) -> str:
    """A letter for each of the six coefficients of a kind ("mass", "damping"), by its axis.

    A capital if it would be known to 10 %, a small letter to 30 %, a dot if not at all; dashes if nothing is known.
    """
    names = [coefficient.name for coefficient in COEFFICIENTS if coefficient.kind == kind]
    if relative_std is None:
        return "-" * len(names)
    return "".join(_letter(name[-1], relative_std.get(name, math.inf)) for name in names)


def _letter(axis: str, relative_std: float) -> str:
    if relative_std > FAIR:
        return "·"
    return axis.upper() if relative_std <= GOOD else axis


def state_of(file: Path) -> list[str | int]:
    """Name, size and time of change of a recording; zeros if it can't be opened."""
    try:
        state = file.stat()
    except OSError:
        return [file.name, 0, 0]
    return [file.name, state.st_size, state.st_mtime_ns]


def kept(folder: Path, key: dict[str, Any]) -> Glance | None:
    """The cached glance; None if there is none, or it has another key."""
    file = folder / GLANCE
    try:
        data = from_json(read_small(file))
        if data["key"] != key:
            return None
        glance = glance_of(data["glance"], str(file))
    except (OSError, ValueError, KeyError, TypeError, AttributeError, ConfigError):
        return None
    return glance if glance.began_unix_s is None or is_date(glance.began_unix_s) else None


def glance_of(data: dict[str, Any], where: str) -> Glance:
    """A glance from plain data, in which null stands for a number that JSON can't represent. Raises ConfigError, and
    for data of another kind KeyError, TypeError, AttributeError."""
    std = data["relative_std"]
    known = _without_null(data) | {
        "relative_std": _without_null(std or {}),
        "spans": [_without_null(span) for span in data["spans"]],
    }
    glance = schema.build(Glance, known, where)
    finite = glance.relative_std or {}
    return replace(glance, relative_std=std and {name: finite.get(name, math.inf) for name in std})


def _without_null(data: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in data.items() if value is not None}
