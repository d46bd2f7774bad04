"""A report, its figures as files, and the single HTML page that shows it, with its inputs, versions and settings: no
network, no script, no further files.
"""

import itertools
import platform
import re
import unicodedata
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from urllib.parse import quote

from bridge.errors import LogError
from bridge.files import whole
from bridge.vehicle.config import VehicleFile
from bridge.version import installed
from identify.dive import Dive
from identify.report import picture, traces
from identify.report.cells import NONE, Cell, Quantity, duration, to_csv
from identify.report.plot import DARK, LIGHT, Draw
from identify.report.traces import Traces
from identify.words import MISSING, raised, safe, unbroken


def _variables(colours: dict[str, str]) -> str:
    return " ".join(f"--{name}: {colour};" for name, colour in colours.items())


STYLE = (
    f"""
:root {{ {_variables(LIGHT)} color-scheme: light dark; }}
@media screen and (prefers-color-scheme: dark) {{ :root {{ {_variables(DARK)} }} }}
"""
    + """
* { box-sizing: border-box; }
html { -webkit-text-size-adjust: 100%; }
body { margin: 0 auto; max-width: 1240px; padding: 20px 16px 60px; background: var(--ground);
  color: var(--ink);
  font: 18px/1.5 system-ui, "Segoe UI", Roboto, "Helvetica Neue", "Noto Sans", "DejaVu Sans", sans-serif; }
h1 { font-size: 1.9em; line-height: 1.2; margin: 0; }
h2 { font-size: 1.4em; line-height: 1.25; margin: 2.4em 0 .4em; padding-top: .5em;
  border-top: 3px solid var(--ink); }
h1, h2, p, li, caption, figcaption { overflow-wrap: anywhere; }
td, th { overflow-wrap: break-word; }
td.long { overflow-wrap: anywhere; }
section > p, section > ul { max-width: 75ch; }
.subtitle { color: var(--soft); margin: .3em 0 0; }
.verdict { font-size: 1.2em; font-weight: 600; margin: 1em 0; padding: .7em .9em; background: var(--raised);
  border-left: 8px solid var(--first); }
.warning { max-width: 85ch; margin: 1em 0; padding: .1em .9em; background: var(--alarm-ground);
  border: 3px solid var(--alarm); border-left-width: 12px; }
.warning p { margin: .6em 0; }
.warning strong { font-size: 1.15em; color: var(--alarm); }
.judged { padding: .5em .9em; background: var(--raised); border-left: 8px solid var(--fourth); font-weight: 600; }
.judged span { color: var(--fourth); }
.judged.no { background: var(--alarm-ground); border-color: var(--alarm); }
.judged.no span { color: var(--alarm); }
nav ul { display: flex; flex-wrap: wrap; gap: .3em 1.4em; list-style: none; margin: 0; padding: 0; }
a { color: var(--first); }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
caption, figcaption { text-align: left; color: var(--soft); font-size: .92em; max-width: 85ch; }
caption { padding-bottom: .4em; }
table:not(.bars):has(> caption) { min-width: min(100%, 60ch); }
th, td { text-align: left; vertical-align: baseline; padding: .32em 1.1em .32em 0;
  border-bottom: 1px solid var(--tick); }
thead th { border-bottom: 2px solid var(--ink); vertical-align: bottom; line-height: 1.25; }
.number { text-align: right; }
.number, .short { white-space: nowrap; }
.scroll thead th { white-space: normal; }
.scroll { overflow-x: auto; margin: 1.2em 0; }
tbody th { font-weight: 600; }
.csv { margin: -.8em 0 1.4em; font-size: .85em; color: var(--soft); }
.csv summary { cursor: pointer; width: max-content; }
.csv summary::after { content: ": a click selects it all, to be copied"; }
.csv:not([open]) summary::after { content: ""; }
.csv pre { overflow-x: auto; margin: .3em 0; padding: .5em .7em; background: var(--raised); user-select: all; }
figure { display: flow-root; margin: 1.4em 0 2em; }
figcaption { margin-top: .3em; }
.wide-picture, .column-picture { display: block; width: 100%; height: auto; stroke-linejoin: round; }
.column-picture { display: none; max-width: 480px; }
@media screen and (max-width: 700px) {
  body { font-size: 17px; padding: 14px 12px 40px; }
  table { font-size: 15px; }
  .wide-picture { display: none; }
  .column-picture { display: block; }
  th, td { padding-right: .5em; }
  td:not(.number):not(.short) { overflow-wrap: anywhere; }
  tbody th.short { white-space: normal; }
  .wide, .wide tbody, .wide tr, .wide td, .wide th { display: block; }
  .wide caption { display: block; }
  .wide thead { display: none; }
  .wide tr { border-bottom: 2px solid var(--ink); padding: .4em 0; }
  .wide td { display: inline-block; border: 0; padding: .05em 1.2em .05em 0; white-space: normal; }
  .wide td:empty { display: none; }
  .wide td::before { content: attr(data-label) "\\00a0 "; color: var(--soft); font-size: .9em; }
  .wide tbody th { border: 0; padding: .1em 0; } }
@media print {
  body { max-width: none; padding: 0; font-size: 11pt; }
  nav, .csv { display: none; }
  figure, tr, .verdict, .warning { break-inside: avoid; }
  h2 { break-after: avoid; } }
"""
)

WIDE_TABLE_COLUMNS = 5
PHONE_CELLS = 30
"""Letters of unbroken cells beside the row's name that still fit a phone's page; with more, a row becomes a block."""
PHONE_LINE = 38
"""Letters of a line of the table there, with the longest part of the rows' names."""
SHORT_CELL = 16
"""Longest text of a cell that is never broken, as a quantity never is."""
LONG_WORD = 32
"""Letters from which a word in a cell, such as a hash, may be broken anywhere, so that the table fits the page."""


@dataclass(frozen=True)
class Table:
    """Cells by row; the first of a row names it."""

    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    caption: str = ""

    @property
    def shown(self) -> tuple[tuple[str, ...], ...]:
        """The cells as the page shows them."""
        return tuple(tuple(raised(str(cell)) for cell in row) for row in self.rows)


@dataclass(frozen=True)
class Figure:
    """A figure of a page. `name` tells its content and names its file; `draw` draws it at a width in inches."""

    name: str
    caption: str
    draw: Draw


@dataclass(frozen=True)
class Section:
    """A heading, a warning, judgements, a paragraph, figures, the other paragraphs, tables, traces, in this order.

    `warning` and `text` have a blank line between paragraphs; the first paragraph of the warning is its headline.
    `judged` are sentences that say yes (True) or no, each with its colour and mark. `filed` are figures for files: the
    page has their content in its traces.
    """

    heading: str
    text: str = ""
    tables: tuple[Table, ...] = ()
    figures: tuple[Figure, ...] = ()
    warning: str = ""
    judged: tuple[tuple[bool, str], ...] = ()
    traces: tuple[Traces, ...] = ()
    filed: tuple[Figure, ...] = ()


@dataclass(frozen=True)
class Report:
    title: str
    subtitle: str
    verdict: str
    sections: tuple[Section, ...] = ()


def write_report(path: Path, report: Report, drawn: Callable[[float], None] = lambda _: None) -> Path:
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


def render_report(report: Report, drawn: Callable[[float], None] = lambda _: None) -> str:
    """The page as HTML; `drawn` as for `write_report`."""
    headings = _apart([section.heading for section in report.sections], "{} ({})")
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
{_lead("verdict", report.verdict)}{_lead("subtitle", report.subtitle)}<nav aria-label="Parts"><ul>{links}</ul></nav>
</header>
<main>
{body}
</main>
</body>
</html>
"""


def _lead(kind: str, words: str) -> str:
    return f'<p class="{kind}">{safe(unbroken(words))}</p>\n' if words else ""


def _warning(text: str) -> str:
    paragraphs = _paragraphs(text)
    if not paragraphs:
        return ""
    body = "".join(f"<p>{p}</p>\n" for p in paragraphs[1:])
    return f'<div class="warning" role="note">\n<p><strong>{paragraphs[0]}</strong></p>\n{body}</div>\n'


def _judged(good: bool, sentence: str) -> str:
    kind, mark = ("yes", "●") if good else ("no", "▲")
    return f'<p class="judged {kind}"><span aria-hidden="true">{mark}</span> {safe(unbroken(sentence))}</p>\n'


def _paragraphs(text: str) -> list[str]:
    return [safe(unbroken(p.strip())) for p in text.split("\n\n") if p.strip()]


def _section(section: Section, heading: str, anchor: str) -> str:
    first, *others = [f"<p>{p}</p>\n" for p in _paragraphs(section.text)] or [""]
    figures = "".join(_figure(figure, f"{anchor}-{i}") for i, figure in enumerate(section.figures, start=1))
    tables = "".join(map(_table, section.tables))
    curves = "".join(
        traces.render(trace, f"{anchor}-t{i}") for i, trace in enumerate(section.traces, start=1)
    )
    judged = "".join(itertools.starmap(_judged, section.judged))
    body = (
        _warning(section.warning) + judged + first + figures + "".join(others) + tables + curves
        or "<p>Nothing to show.</p>\n"
    )
    return f'<section id="{anchor}">\n<h2>{safe(heading)}</h2>\n{body}</section>'


def _figure(figure: Figure, key: str) -> str:
    drawn = picture.inline(figure.draw, figure.name, key)
    return f"<figure>{drawn}<figcaption>{safe(unbroken(figure.caption))}</figcaption></figure>\n"


def _table(table: Table) -> str:
    width = len(table.columns)
    numeric = [
        i > 0 and all(isinstance(row[i], Quantity) or row[i] in NONE for row in table.rows)
        for i in range(width)
    ]
    short = [all(len(row[i]) <= SHORT_CELL for row in table.shown) for i in range(width)]
    long = [
        any(len(word) > LONG_WORD for row in table.shown for word in row[i].split()) for i in range(width)
    ]
    classes = [
        ' class="number"' if n else ' class="short"' if s else ' class="long"' if w else ""
        for n, s, w in zip(numeric, short, long, strict=True)
    ]
    labels = [safe(column) for column in table.columns]
    head = "".join(f'<th scope="col"{c}>{label}</th>' for c, label in zip(classes, labels, strict=True))
    rows = "".join(
        f'<tr><th scope="row"{classes[0]}>{safe(row[0])}</th>'
        + "".join(f'<td{classes[i]} data-label="{labels[i]}">{safe(row[i])}</td>' for i in range(1, width))
        + "</tr>\n"
        for row in table.shown
    )
    unbroken_cells = [
        max((len(row[i]) for row in table.shown if numeric[i] or short[i]), default=0)
        for i in range(1, width)
    ]
    heads = [
        max(cells, _longest_part(head)) for cells, head in zip(unbroken_cells, table.columns[1:], strict=True)
    ]
    line = sum(heads) + max((_longest_part(row[0]) for row in table.shown), default=0)
    is_wide = width >= WIDE_TABLE_COLUMNS or sum(unbroken_cells) > PHONE_CELLS or line > PHONE_LINE
    kind = ' class="wide"' if is_wide else ""
    caption = f"<caption>{safe(unbroken(table.caption))}</caption>" if table.caption else ""
    body = f"<thead><tr>{head}</tr></thead>\n<tbody>{rows}</tbody>"
    drawn = f'<div class="scroll"><table{kind}>{caption}{body}</table></div>'
    # Without a script: a click in the text selects it all, and the link saves it as a file.
    text = to_csv(table.columns, table.rows)
    data = quote(text, errors="replace")
    saved = f'<a download="{file_name(table.columns[0])}.csv" href="data:text/csv;charset=utf-8,{data}">'
    return (
        f'{drawn}\n<details class="csv"><summary>CSV</summary><p>{saved}Save it as a file</a></p>'
        f"<pre>{safe(text)}</pre></details>\n"
    )


def _longest_part(words: str) -> int:
    """Letters of the longest part that a browser does not break."""
    return max(map(len, re.findall(r"[^\s-]+-?", words)), default=0)


def write_figures(folder: Path, report: Report) -> tuple[Path, ...]:
    """Write every figure into `folder`, which is created if missing. Raises LogError."""
    drawn = [figure for section in report.sections for figure in (*section.figures, *section.filed)]
    written: list[Path] = []
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for figure, name in zip(
            drawn, _apart([file_name(figure.name) for figure in drawn], "{}-{}"), strict=True
        ):
            written += picture.write_files(figure.draw, folder / name)
    except OSError as error:
        reason = error.strerror or error
        raise LogError(f"{folder}: the figures can't be written ({reason}); choose another place") from None
    return tuple(written)


def _apart(names: Sequence[str], form: str) -> list[str]:
    """The names, with a number behind each that is taken, as for dives of the same name; `form` of both."""
    taken: list[str] = []
    for name in names:
        numbered = (form.format(name, number) for number in itertools.count(2))
        taken.append(next(each for each in itertools.chain((name,), numbered) if each not in taken))
    return taken


def file_name(words: str) -> str:
    """Convert words to a name that every file system accepts: lower case, digits and hyphens."""
    plain = unicodedata.normalize("NFKD", words).encode("ascii", "ignore").decode().lower()
    return re.sub(r"[^a-z0-9]+", "-", plain).strip("-")[:100] or "figure"


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
    return replace(report, sections=(*report.sections, provenance(dives, file, settings)))


def provenance(dives: Sequence[Dive | Read], file: VehicleFile, settings: Mapping[str, str]) -> Section:
    """Each recording once and the vehicle file, with SHA-256; versions of the software; settings as given."""
    recordings = (
        run for dive in dives for run in (dive.runs if isinstance(dive, Dive) and dive.runs else (dive,))
    )
    seen = {recording.sha256: recording for recording in recordings}
    lengths = {sha: duration(recording.duration_s) for sha, recording in seen.items()}
    sources = (
        *((held.name, held.source.name, lengths[sha], "recording", sha) for sha, held in seen.items()),
        (file.vehicle.name, file.path.name, MISSING, "vehicle file", file.sha256),
    )
    versions = (("Python", platform.python_version()), *((name, installed(name)) for name in PACKAGES))
    tables = [
        Table(("Name", "File", "Length", "What", "SHA-256"), sources, "What was read."),
        Table(("Made with", "Version"), versions),
    ]
    if settings:
        tables.append(Table(("Setting", "Value"), tuple(settings.items()), "As given on the command line."))
    return Section("Provenance", tables=tuple(tables))
