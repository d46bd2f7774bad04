"""Dives as `seatrial dives --json` lists them, as lines: a table of all of them, and the details of one."""

import math
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any, Final

from bridge.errors import LogError
from bridge.text import printable
from bridge.vehicle.coefficients import COEFFICIENTS, DOFS
from gcs_plugin.dives.recordings import began, bytes_of, length_s
from tui.app.drawing import (
    NOTHING,
    SHOWN_IN,
    Line,
    Lines,
    Role,
    Span,
    apart,
    around,
    cut,
    day,
    hanging,
    number,
    stacked,
    stopwatch,
    titled,
    width,
)
from tui.app.header import PHONE
from tui.app.jobs import real
from tui.dive_list import FAIR, DiveRow, Glance, dive_folders, glance_of, kept_glance, letters, short_name

UNREAD: Final = "…"
AT, CHOSEN, RECORDED = "▶", "◆", "●"
BEGAN: Final = f"{'':4}{'began, UTC':<18}"
LENGTH, LOSS = f"{'length':<10}", f"{'loss':>6}  "
WIDTHS: Final = f"{'mass':<7}{'damping':<8}"
MASSES, DAMPINGS = "mass", "damping"
SHORT: Final = 5  # letters kept of a shortened word: `ident.`
LEAST_NAME: Final = 8  # cells
NARROW: Final = 72
"""Below so many cells a loss stands in its dive's details alone, where it is large: names would lose most letters."""
LOSSY: Final = 0.05
GROWN, LEAST_BYTES = 2, 50_000
"""A recording is looked at again when it has grown so many times, and by a second or two of frames."""
ANGULAR: Final = 3  # first rotational degree of freedom


def listed(result: Any) -> tuple[DiveRow, ...]:
    """The dives of a list as `seatrial dives --json` gives it, the newest first; empty if the value is not a list."""
    return tuple(_dive(entry) for entry in reversed(result)) if isinstance(result, list) else ()


def _dive(data: Mapping[str, Any]) -> DiveRow:
    known = data["excitation"]
    std = None if known is None else {each["name"]: each["relative_std"] for each in known}
    of_glance, of_row = (
        {field.name: data[field.name] for field in fields(of) if field.name in data}
        for of in (Glance, DiveRow)
    )
    glance = glance_of(of_glance | {"relative_std": std, "spans": data["axes"]}, data["folder"])
    lists = {name: tuple(data[name]) for name in ("events", "learnt", "worked_on")}
    return DiveRow(**of_row | lists | {"folder": Path(data["folder"]), "glance": glance})


def with_unread(dives: Sequence[DiveRow], root: Path) -> tuple[DiveRow, ...]:
    """Add the dives of `root` that the list lacks, with the facts known without reading them, or from an earlier look,
    and renew those facts of dives still unread, which grow while they are recorded. The newest first."""
    try:
        folders = dive_folders(root)
    except LogError:
        return tuple(dives)
    read = [dive for dive in dives if not (is_unread(dive) or dive.underway) or dive.folder not in folders]
    known = {dive.folder for dive in read}
    unread = [_unread(folder) for folder in folders if folder not in known]
    return tuple(sorted((*read, *unread), key=_order, reverse=True))


def _order(dive: DiveRow) -> tuple[float, str]:
    return dive.glance.began_unix_s or 0.0, dive.folder.name


def _unread(folder: Path) -> DiveRow:
    glance = kept_glance(folder) or Glance(began(folder), real(length_s(folder)))
    return DiveRow(folder, printable(short_name(folder), "?"), 0, glance, "", (), ())


def is_unread(dive: DiveRow) -> bool:
    """Whether the recording has not been read yet, so that nothing is said of what it could tell."""
    glance = dive.glance
    return glance.relative_std is None and not (glance.why_not or glance.error or dive.underway)


def has_grown(dive: DiveRow) -> bool:
    """Whether a recording holds so much more than when it was listed that it is worth another look."""
    return bytes_of(dive.folder) >= max(GROWN * dive.size_bytes, LEAST_BYTES)


def usual(dives: Sequence[DiveRow], otherwise: Path | None) -> Path | None:
    """The dive that the user most likely means: the newest that could identify anything, else `otherwise`.

    A recording begun on deck with no data in it is not the dive that the crew has just made.
    """
    identifiable = (
        dive.folder for dive in dives if any(std <= FAIR for std in (dive.glance.relative_std or {}).values())
    )
    return next(identifiable, otherwise)


def table(
    dives: Sequence[DiveRow], at: int, chosen: Path | None, recorded: Collection[Path], cells: int, rows: int
) -> Lines:
    """Heads and the rows around the dive at `at`; the chosen dive and those being recorded are marked."""

    def row(n: int) -> Line:
        dive = dives[n]
        return _row(dive, n == at, dive.folder == chosen, dive.folder in recorded, cells)

    loss = LOSS if cells >= NARROW else ""
    heads = f"{BEGAN}{LENGTH}{loss}{WIDTHS}dive" if cells >= PHONE else f"{BEGAN}dive"
    return (((cut(heads, cells), "quiet"),), *around(len(dives), at, rows, row))


def _row(dive: DiveRow, is_at: bool, is_chosen: bool, is_recorded: bool, cells: int) -> Line:
    role: Role = "strong" if is_at else "plain"
    marks: Line = (
        (AT if is_at else " ", "accent"),
        (CHOSEN if is_chosen else " ", "accent"),
        (RECORDED, "bad") if is_recorded else (" ", "plain"),
        (" ", "plain"),
    )
    loss = f"{number(100 * dive.glance.loss, 1)} %" if math.isfinite(dive.glance.loss) else NOTHING
    line: Line = (*marks, (f"{day(real(dive.glance.began_unix_s)):<18}", role))
    if cells >= PHONE:
        line = (
            *line,
            (f"{length(dive.glance.duration_s):<10}", role),
            *(((f"{loss:>6}  ", "warn" if dive.glance.loss > LOSSY else role),) if cells >= NARROW else ()),
            (f"{_letters(dive, MASSES):<7}", "accent"),
            (f"{_letters(dive, DAMPINGS):<8}", "accent"),
        )
    room = cells - width(line)
    made = _made_of(dive, room)
    name = cut(dive.name, room - (len(made) + 1 if made else 0))
    return apart((*line, (name, role)), ((made, "quiet"),), cells)


def _letters(dive: DiveRow, kind: str) -> str:
    return UNREAD if is_unread(dive) else letters(dive.glance.relative_std, kind)


def _made_of(dive: DiveRow, room: int) -> str:
    """The work done on the dive: in full if it fits next to the name, else in short unless the name gets too short."""
    words, short = ", ".join(dive.worked_on), " ".join(map(_short, dive.worked_on))
    if len(dive.name) + 1 + len(words) <= room:
        return words
    return short if room - len(short) > LEAST_NAME else ""


def _short(words: str) -> str:
    """The first word, shortened if it is long: `ident.`, `NO-GO`."""
    first = words.partition(" ")[0]
    return first if len(first) <= SHORT else f"{first[:SHORT]}."


def length(seconds: float) -> str:
    """Format a duration as `00:13:27`, rounded as `seatrial dives` does; dashes if unknown."""
    return stopwatch(round(seconds)) if math.isfinite(seconds) else NOTHING


def details(dive: DiveRow, recorded: bool, cells: int, key: str = "") -> Lines:
    """Details of a dive: identifiable coefficients and their excitation, notes, and the work done on it.

    `key` is the key that asks for the conditions.
    """
    folder = dive.folder.name
    lines: list[Line] = [*titled(dive.name, folder if folder != dive.name else "", cells)]
    if dive.underway:
        lines += hanging(dive.underway, "warn", cells)
    elif recorded:
        lines += hanging("is being recorded: this is what it holds so far", "warn", cells)
    if is_unread(dive):
        return (*lines, *hanging("is being read: what it could tell comes with that", "quiet", cells))
    if dive.glance.error:
        lines += hanging(f"can't be read: {dive.glance.error}", "bad", cells)
    elif not dive.underway:
        lines += _axes(dive, cells)
    lines += stacked((dive.damaged,), "bad", cells, hanging)
    lines += stacked((dive.glance.untold,), "warn", cells, hanging)
    if dive.glance.loss > LOSSY:
        lines += hanging(
            f"{number(100 * dive.glance.loss, 1)} % of its frames were lost on the link", "warn", cells
        )
    lines += stacked(dive.glance.oddities, "warn", cells, hanging)
    asks = f" [{key}]" if key else ""
    if dive.conditions:
        lines += hanging(f"conditions: {dive.conditions}{asks}", "plain", cells)
    else:
        lines += hanging(f"conditions: not noted{asks}", "quiet", cells)
    lines += stacked(dive.noted, "plain", cells, hanging)
    return (*lines, *stacked(dive.learnt, "quiet", cells, hanging))


def _axes(dive: DiveRow, cells: int) -> Iterator[Line]:
    """A row per degree of freedom: predicted accuracy of mass and damping, and the range of thrust and speed, which a
    phone has no room for."""
    spans = "" if cells < PHONE else f"{'recorded':>8}{'thrust range':>13}{'speed range':>14}"
    yield ((f"{'could tell, 1 std':<18}{'mass':<12}{'damping':<13}{spans}", "quiet"),)
    for dof, name in enumerate(DOFS):
        line: Line = ((f"  {name:<16}", "plain"),)
        for kind, column in ((MASSES, 12), (DAMPINGS, 13)):
            coefficient = next(c for c in COEFFICIENTS if c.kind == kind and c.dof == dof)
            text, role = known_to((dive.glance.relative_std or {}).get(coefficient.name, math.nan))
            line = (*line, (f"{coefficient.name} ", "quiet"), (f"{text:<{column - 4}}", role))
        if not spans:
            yield line
            continue
        span = next((span for span in dive.glance.spans if span.axis == name), None)
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
