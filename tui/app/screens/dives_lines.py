"""Dives as `seatrial dives --json` lists them, as lines: a table of all of them, and the details of one."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from bridge.errors import LogError
from bridge.text import printable
from bridge.vehicle.coefficients import COEFFICIENTS, DOFS
from gcs_plugin.dives.folder import began, length_s
from tui.app.drawing import (
    NOTHING,
    SHOWN_IN,
    Line,
    Lines,
    Role,
    Span,
    apart,
    cut,
    day,
    hanging,
    heading,
    number,
    stopwatch,
    width,
)
from tui.app.jobs import real
from tui.dive_list import FAIR, dive_folders, kept_glance, letters, short_name

SENTENCES: Final = ("conditions", "stray", "restarts", "damaged", "lacking", "unheard", "underway")

UNREAD: Final = "…"
AT, CHOSEN, RECORDED = "▶", "◆", "●"
HEADS: Final = f"{'':4}{'began, UTC':<18}{'length':<10}{'loss':>6}  {'mass':<7}{'damping':<8}dive"
MASSES, DAMPINGS = "mass", "damping"
SHORT: Final = 5  # letters kept of a shortened word: `ident.`
LEAST_NAME: Final = 8  # cells
ANGULAR: Final = 3  # first rotational degree of freedom


@dataclass(frozen=True)
class AxisRange:
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
    size_bytes: float = math.nan
    loss: float = math.nan
    relative_std: Mapping[str, float] | None = None
    spans: Mapping[str, AxisRange] = field(default_factory=dict)
    why_not: str = ""
    error: str = ""
    notes: str = ""
    events: tuple[str, ...] = ()
    learnt: tuple[str, ...] = ()
    worked_on: tuple[str, ...] = ()
    conditions: str = ""
    stray: str = ""
    restarts: str = ""
    damaged: str = ""
    lacking: str = ""
    unheard: str = ""
    underway: str = ""
    unread: bool = field(default=False, kw_only=True)

    @property
    def identifiable(self) -> bool:
        """Whether any coefficient could be identified."""
        return any(std <= FAIR for std in (self.relative_std or {}).values())


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
    lasts_s = real(lasts_s) if glance is None else glance.duration_s
    return ListedDive(folder, printable(short_name(folder), "?"), real(began_s), lasts_s, unread=True)


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
        real(data["began_unix_s"]),
        real(data["duration_s"]),
        real(data["size_bytes"]),
        real(data["loss"]),
        None
        if excitation is None
        else {entry["name"]: _or(real(entry["relative_std"]), math.inf) for entry in excitation},
        {entry["axis"]: _range(entry) for entry in data["axes"]},
        str(data["why_not"]),
        str(data["error"]),
        str(data["notes"]),
        tuple(map(str, data["events"])),
        tuple(map(str, data["learnt"])),
        tuple(map(str, data["worked_on"])),
        *(str(data.get(name, "")) for name in SENTENCES),
    )


def _range(data: Mapping[str, Any]) -> AxisRange:
    return AxisRange(real(data["seconds"]), real(data["thrust"]), real(data["speed"]))


def _or(value: float, otherwise: float) -> float:
    return value if math.isfinite(value) else otherwise


def table(
    dives: Sequence[ListedDive],
    at: int,
    chosen: Path | None,
    recorded: Path | None,
    cells: int,
    rows: int,
) -> Lines:
    """Heads and the rows around the dive at `at`; the chosen and the recorded dive are marked."""
    head: Line = ((cut(HEADS, cells), "quiet"),)
    first = window(len(dives), at, rows - 1)
    shown = dives[first : first + max(rows - 1, 0)]
    return (
        head,
        *(
            _row(dive, first + n == at, dive.folder == chosen, dive.folder == recorded, cells)
            for n, dive in enumerate(shown)
        ),
    )


def window(count: int, at: int, rows: int) -> int:
    """First of the `rows` entries shown, with the entry at `at` in the middle if possible."""
    return max(0, min(at - rows // 2, count - rows))


def row_under(y: int, count: int, at: int, rows: int) -> int | None:
    """Index of the entry in line `y` of a table of `rows` lines including its heads; None if no entry is there."""
    entry = window(count, at, rows - 1) + y - 1
    return entry if y >= 1 and entry < count else None


def _row(dive: ListedDive, is_at: bool, is_chosen: bool, is_recorded: bool, cells: int) -> Line:
    role: Role = "strong" if is_at else "plain"
    marks: Line = (
        (AT if is_at else " ", "accent"),
        (CHOSEN if is_chosen else " ", "accent"),
        (RECORDED, "bad") if is_recorded else (" ", "plain"),
        (" ", "plain"),
    )
    loss = f"{number(100 * dive.loss, 1)} %" if math.isfinite(dive.loss) else NOTHING
    relative_std = dict(dive.relative_std) if dive.relative_std is not None else None
    line: Line = (
        *marks,
        (f"{day(dive.began_unix_s):<18}", role),
        (f"{length(dive.duration_s):<10}", role),
        (f"{loss:>6}  ", _of_loss(dive.loss, role)),
        (f"{UNREAD if dive.unread else letters(relative_std, MASSES):<7}", "accent"),
        (f"{UNREAD if dive.unread else letters(relative_std, DAMPINGS):<8}", "accent"),
    )
    room = cells - width(line)
    made = _made_of(dive, room)
    name = cut(dive.name, room - (len(made) + 1 if made else 0))
    return apart((*line, (name, role)), ((made, "quiet"),), cells)


def _made_of(dive: ListedDive, room: int) -> str:
    """The work done on the dive: in full if it fits next to the name, else in short unless the name gets too short."""
    words, short = ", ".join(dive.worked_on), " ".join(f"{word[:SHORT]}." for word in dive.worked_on)
    if len(dive.name) + 1 + len(words) <= room:
        return words
    return short if room - len(short) > LEAST_NAME else ""


def _of_loss(loss: float, role: Role) -> Role:
    return "warn" if loss > 0.05 else role


def length(seconds: float) -> str:
    """Format a duration as `00:13:27`, rounded as `seatrial dives` does; dashes if unknown."""
    return stopwatch(round(seconds)) if math.isfinite(seconds) else NOTHING


def details(dive: ListedDive, recorded: bool, cells: int, key: str = "") -> Lines:
    """Details of a dive: identifiable coefficients and their excitation, notes, and the work done on it.

    `key` is the key that asks for the conditions.
    """
    lines: list[Line] = [heading(dive.name, str(dive.folder.name), cells)]
    if dive.underway:
        lines += hanging(dive.underway, "warn", cells)
    elif recorded:
        lines += hanging("is being recorded: this is what it holds so far", "warn", cells)
    if dive.unread:
        return (*lines, *hanging("is being read: what it could tell comes with that", "quiet", cells))
    if dive.error:
        lines += hanging(f"can't be read: {dive.error}", "bad", cells)
    elif not dive.underway:
        lines += _axes(dive)
    if dive.damaged:
        lines += hanging(dive.damaged, "bad", cells)
    if dive.why_not:
        unknown = (
            "what it could identify is not known" if dive.relative_std is None else "nothing to identify"
        )
        lines += hanging(f"{unknown}: {dive.why_not}", "warn", cells)
    stray = f"{dive.stray}." if dive.stray else ""
    for sentence in filter(None, (stray, dive.restarts, dive.lacking, dive.unheard)):
        lines += hanging(sentence, "warn", cells)
    asks = f" [{key}]" if key else ""
    if dive.conditions:
        lines += hanging(f"conditions: {dive.conditions}{asks}", "plain", cells)
    else:
        lines += hanging(f"conditions: not noted{asks}", "quiet", cells)
    if dive.notes:
        lines += hanging(f"noted: {' '.join(dive.notes.split())}", "plain", cells)
    for event in dive.events:
        lines += hanging(f"noted at {' '.join(event.split())}", "plain", cells)
    for sentence in dive.learnt:
        lines += hanging(sentence, "quiet", cells)
    return tuple(lines)


def _axes(dive: ListedDive) -> Iterator[Line]:
    """A row per degree of freedom: predicted accuracy of mass and damping, and the range of thrust and speed."""
    yield (
        (
            f"{'could tell, 1 std':<18}{'mass':<12}{'damping':<13}{'recorded':>8}{'thrust':>13}{'speed':>14}",
            "quiet",
        ),
    )
    for dof, name in enumerate(DOFS):
        line: Line = ((f"  {name:<16}", "plain"),)
        for kind, cells in ((MASSES, 12), (DAMPINGS, 13)):
            coefficient = next(c for c in COEFFICIENTS if c.kind == kind and c.dof == dof)
            text, role = known_to((dive.relative_std or {}).get(coefficient.name, math.nan))
            line = (*line, (f"{coefficient.name} ", "quiet"), (f"{text:<{cells - 4}}", role))
        span = dive.spans.get(name)
        if span is None:
            yield (*line, (f"{NOTHING:>8}", "quiet"))
            continue
        unit, factor = ("m/s", 1.0) if dof < ANGULAR else SHOWN_IN["rad/s"]
        yield (
            *line,
            (f"{number(span.seconds, 0):>6}", "plain"),
            (" s", "quiet"),
            (f"{number(span.thrust, 1):>9}", "plain"),
            (f" {'N' if dof < ANGULAR else 'N m':<3}", "quiet"),
            (f"{number(factor * span.speed, 2 if dof < ANGULAR else 1):>8}", "plain"),
            (f" {unit:<5}", "quiet"),
        )


def known_to(relative_std: float) -> Span:
    """Predicted accuracy of a value: `0.7 %`; `no` if too poor to use, dashes if unknown."""
    if math.isnan(relative_std):
        return NOTHING, "quiet"
    if relative_std > FAIR:
        return "no", "warn"
    return f"{100 * relative_std:.1f} %", "strong"
