"""A report and the single HTML page that shows it, with its inputs, versions and settings: no network, no script, no
further files.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import starmap
from pathlib import Path
from typing import TYPE_CHECKING

from bridge.errors import LogError
from bridge.files import whole
from identify.report import traces
from identify.report.plot import STYLE
from identify.report.traces import Traces
from identify.words import safe

if TYPE_CHECKING:
    from identify.report.plot import Draw
import math
import platform
from collections.abc import Mapping
from dataclasses import replace
from importlib.metadata import PackageNotFoundError, version

from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.words import MISSING, seconds

WIDE_TABLE_COLUMNS = 5
SHORT_CELL, NUMBER_CELL = 16, 28
"""Longest cells that are never broken: any text, and text that begins like a number. Longer cells count as sentences.
"""
LONG_WORD = 32
"""Letters from which a word in a cell, such as a hash, may be broken anywhere, so that the table fits the page."""

_NUMBER = re.compile(r"[−±+]?\d|—|$")


@dataclass(frozen=True)
class Table:
    """Cells as displayed; the first cell of a row names the row."""

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    caption: str = ""


@dataclass(frozen=True)
class Figure:
    """`name`: content of the figure, also used for its file name; `draw`: draws it at a width in inches."""

    name: str
    caption: str
    draw: "Draw"


@dataclass(frozen=True)
class Section:
    """A heading, a warning, judgements, a paragraph, figures, the other paragraphs, tables, traces, in this order.

    `warning` and `text` have a blank line between paragraphs; the first paragraph of the warning is its headline.
    `judged` are sentences that say yes (True) or no, each with its colour and mark.
    """

    heading: str
    text: str = ""
    tables: tuple[Table, ...] = ()
    figures: tuple[Figure, ...] = ()
    warning: str = ""
    judged: tuple[tuple[bool, str], ...] = ()
    traces: tuple[Traces, ...] = ()


@dataclass(frozen=True)
class Report:
    """`verdict` is the sentence for a reader in a hurry."""

    title: str
    subtitle: str
    verdict: str
    sections: tuple[Section, ...] = ()


def _unseen(share: float) -> None:
    """Progress callback that does nothing."""
    del share


def write_report(path: Path, report: Report, drawn: Callable[[float], None] = _unseen) -> Path:
    """Write the page to `path`, atomically: the file holds either the old page or the whole new page.

    `drawn` is called with the share of the figures drawn so far. Raises LogError.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        text = render_report(report, drawn).encode()
        with whole(path) as file:
            file.write(text)
    except OSError as error:
        reason = error.strerror or error
        raise LogError(f"{path}: the report can't be written ({reason}); choose another place") from None
    return path


def render_report(report: Report, drawn: Callable[[float], None] = _unseen) -> str:
    """The page as HTML; `drawn` as for `write_report`."""
    headings = _told_apart([section.heading for section in report.sections])
    links = "".join(f'<li><a href="#part-{i}">{safe(h)}</a></li>' for i, h in enumerate(headings, start=1))
    parts, done, figures = [], 0, sum(len(section.figures) for section in report.sections)
    for i, (section, heading) in enumerate(zip(report.sections, headings, strict=True), start=1):
        parts.append(_section(section, heading, f"part-{i}"))
        done += len(section.figures)
        drawn(done / max(figures, 1))
    body = "\n".join(parts)
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; style-src 'unsafe-inline'">
<title>{safe(report.title)}</title>
<style>{STYLE}{traces.STYLE if any(section.traces for section in report.sections) else ""}</style>
</head>
<body>
<header>
<h1>{safe(report.title)}</h1>
{_told("subtitle", report.subtitle)}{_told("verdict", report.verdict)}<nav aria-label="Parts"><ul>{links}</ul></nav>
</header>
<main>
{body}
</main>
</body>
</html>
"""


def _told(kind: str, words: str) -> str:
    return f'<p class="{kind}">{safe(words)}</p>\n' if words else ""


def _told_apart(headings: Sequence[str]) -> list[str]:
    """Headings, with a number behind each that repeats an earlier heading, as for dives of the same name."""
    return [h if (n := headings[:i].count(h)) == 0 else f"{h} ({n + 1})" for i, h in enumerate(headings)]


def _warning(text: str) -> str:
    paragraphs = _paragraphs(text)
    if not paragraphs:
        return ""
    body = "".join(f"<p>{p}</p>\n" for p in paragraphs[1:])
    return f'<div class="warning" role="note">\n<p><strong>{paragraphs[0]}</strong></p>\n{body}</div>\n'


def _judged(good: bool, sentence: str) -> str:
    kind, mark = ("yes", "●") if good else ("no", "▲")
    return f'<p class="judged {kind}"><span aria-hidden="true">{mark}</span> {safe(sentence)}</p>\n'


def _paragraphs(text: str) -> list[str]:
    return [safe(p.strip()) for p in text.split("\n\n") if p.strip()]


def _section(section: Section, heading: str, anchor: str) -> str:
    first, *others = [f"<p>{p}</p>\n" for p in _paragraphs(section.text)] or [""]
    figures = "".join(_figure(figure, f"{anchor}-{i}") for i, figure in enumerate(section.figures, start=1))
    tables = "".join(map(_table, section.tables))
    curves = "".join(
        traces.render(trace, f"{anchor}-t{i}") for i, trace in enumerate(section.traces, start=1)
    )
    judged = "".join(starmap(_judged, section.judged))
    body = (
        _warning(section.warning) + judged + first + figures + "".join(others) + tables + curves
        or "<p>Nothing to show.</p>\n"
    )
    return f'<section id="{anchor}">\n<h2>{safe(heading)}</h2>\n{body}</section>'


def _figure(figure: Figure, key: str) -> str:
    # Imported here, because matplotlib takes half a second to import and most users of this module draw nothing.
    from identify.report.picture import inline

    drawn = inline(figure.draw, figure.name, key)
    return f"<figure>{drawn}<figcaption>{safe(figure.caption)}</figcaption></figure>\n"


def _table(table: Table) -> str:
    width = len(table.columns)
    short = [all(len(row[i]) <= SHORT_CELL for row in table.rows) for i in range(width)]
    brief = [all(len(row[i]) <= NUMBER_CELL for row in table.rows) for i in range(width)]
    numeric = [i > 0 and brief[i] and all(_NUMBER.match(row[i]) for row in table.rows) for i in range(width)]
    long = [any(len(word) > LONG_WORD for row in table.rows for word in row[i].split()) for i in range(width)]
    classes = [
        ' class="number"' if n else ' class="short"' if s else ' class="long"' if w else ""
        for n, s, w in zip(numeric, short, long, strict=True)
    ]
    labels = [safe(column) for column in table.columns]
    head = "".join(f'<th scope="col"{c}>{label}</th>' for c, label in zip(classes, labels, strict=True))
    rows = "".join(
        f'<tr><th scope="row">{safe(row[0])}</th>'
        + "".join(f'<td{classes[i]} data-label="{labels[i]}">{safe(row[i])}</td>' for i in range(1, width))
        + "</tr>\n"
        for row in table.rows
    )
    kind = ' class="wide"' if width >= WIDE_TABLE_COLUMNS else ""
    caption = f"<caption>{safe(table.caption)}</caption>" if table.caption else ""
    body = f"<thead><tr>{head}</tr></thead>\n<tbody>{rows}</tbody>"
    return f'<div class="scroll"><table{kind}>{caption}{body}</table></div>\n'


PACKAGES = ("seatrial", "numpy", "scipy", "numba", "torch", "matplotlib")


@dataclass(frozen=True)
class Read:
    """A recording that was read elsewhere; `duration_s` is NaN if unknown."""

    name: str
    source: Path
    sha256: str
    duration_s: float


def with_provenance(
    report: Report, dives: Sequence[Dive | Read], file: VehicleFile, settings: Mapping[str, str]
) -> Report:
    """The report with its provenance as the last part."""
    return replace(report, sections=(*report.sections, provenance(dives, file, settings)))


def provenance(dives: Sequence[Dive | Read], file: VehicleFile, settings: Mapping[str, str]) -> Section:
    """Each recording once and the vehicle file, with SHA-256; versions of the software; settings as given."""
    seen = {dive.sha256: dive for dive in dives}
    sources = (
        *(
            (dive.name, dive.source.name, _length(dive.duration_s), "recording", sha)
            for sha, dive in seen.items()
        ),
        (file.vehicle.name, file.path.name, MISSING, "vehicle file", file.sha256),
    )
    versions = (("Python", platform.python_version()), *((name, _version(name)) for name in PACKAGES))
    tables = [
        Table(("Name", "File", "Length", "What", "SHA-256"), sources, "What was read."),
        Table(("Made with", "Version"), versions),
    ]
    if settings:
        tables.append(Table(("Setting", "Value"), tuple(settings.items()), "As given on the command line."))
    return Section("Provenance", tables=tuple(tables))


def _length(duration_s: float) -> str:
    return seconds(duration_s) if math.isfinite(duration_s) else MISSING


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return "not installed"
