"""Reads a table of text as people have them: its separator, its names and its numbers."""

import csv
import re
import zlib
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import chain, islice
from pathlib import Path
from typing import Final

import numpy as np

from bridge.arrays import Array, Mask
from bridge.errors import LogError
from bridge.wire.tlog import GZIP, load_bytes
from identify.ingest.files.streams import Stream, Streams
from identify.ingest.mapping.names import with_unit
from identify.words import listed

TABLES: Final = (".csv", ".csv.gz", ".txt", ".tsv")
"""Endings of their files."""
COMMENT: Final = ("#", "%")
SEPARATORS: Final = ("\t", ";", ",", " ")
"""In the order in which they are believed: a comma may stand in a number, and a space in a name."""
SNIFFED: Final = 20
CHUNK: Final = 50_000
MOST_BAD: Final = 1_000
"""At most one row in so many may be bad; in a column of numbers, at most one cell in so many is a word."""
NOTHING: Final = ("-", "--", "-.-", "--.--")
"""For no number: QGroundControl writes dashes."""
SPOKEN: Final = {
    "true": 1.0, "false": 0.0,
    **dict.fromkeys(
        ("na", "n/a", "#n/a", "#num!", "#div/0!", "#value!", "null", "none", "nan(ind)", "-nan(ind)", *NOTHING), np.nan
    ),
}  # fmt: skip
OF_WINDOWS: Final = re.compile(r"-?1\.#[A-Z]\w*")
"""What programs of Windows write for no number: 1.#QNAN, -1.#IND00."""
MOSTLY: Final = 0.5
"""A column of words is told to be none if so many of its cells are numbers."""
LONGEST_SHOWN: Final = 40
HEAD_BYTES: Final = 4096
NAMES_BYTES: Final = 1 << 16
"""Of a table of which the names alone are asked."""
MOST_ZEROS: Final = 0.01
"""A file with a larger share of zero bytes in its first HEAD_BYTES is not text. Fewer come from a garbled serial line;
later ones from a loss of power."""
DECIMAL_COMMA: Final = re.compile(r"\s*[+-]?\d*,\d+([eE][+-]?\d+)?\s*")
BEGINS_WITH_DATE: Final = re.compile(r"\s*\d{4}([-/])\d\d\1\d\d([T ]|\s*$)")
UNIT_BEHIND: Final = re.compile(r"(\S+?)\s*([^\W\d_]\S*|[°º%]\S*)")
"""A number with its unit, in one cell."""
UNIT_APART: Final = re.compile(r"\s+(?=[\[(])")
NO_TEXT: Final = "is no table of text; give a .csv with a line of names first"


@dataclass(frozen=True)
class _Form:
    separator: str
    decimal_comma: bool

    def cells(self, line: str) -> list[str]:
        if '"' not in line:
            return line.split(self.separator)
        try:
            return next(csv.reader([line], delimiter=self.separator, skipinitialspace=True))
        except csv.Error:
            return [line]

    def count(self, line: str) -> int:
        return len(self.cells(line)) if '"' in line else line.count(self.separator) + 1

    def number(self, cell: str) -> float:
        """Raises ValueError."""
        cell = cell.strip()
        spoken = SPOKEN.get(cell.lower())
        if spoken is not None:
            return spoken
        if OF_WINDOWS.fullmatch(cell):
            return np.nan
        return float(cell.replace(",", ".") if self.decimal_comma else cell)

    def is_number(self, cell: str) -> bool:
        try:
            self.number(cell)
        except ValueError:
            return False
        return True


def read_table(path: Path) -> Streams:
    """The table in a file of text, gzipped or not. Raises LogError.

    The separator is a comma, a semicolon (numbers may then have a decimal comma), a tab or runs of spaces. Names stand
    in the first line, or in the last comment before numbers; without names, columns are named by their number from 1.
    A second line without numbers holds units, which join the names: `u [m/s]`; so does the unit in all cells of a
    column, as in `12.3 m`. A column in which more than one cell in a thousand is no number is a column of words. At
    most one row in a thousand may be bad, and is left out.
    """
    return _table(*_text(path), path)


def column_names(path: Path) -> tuple[str, ...]:
    """The names of a table's columns, by its first lines alone. Raises LogError if these are no table."""
    try:
        with path.open("rb") as file:
            data = file.read(NAMES_BYTES)
    except OSError as error:
        raise LogError(f"can't be read ({error.strerror}); give a recording that can", path) from None
    if data.startswith(GZIP):
        try:
            data = zlib.decompressobj(zlib.MAX_WBITS | 16).decompress(data)
        except zlib.error:
            raise LogError(f"{NO_TEXT}", path) from None
    whole = len(data) < NAMES_BYTES
    (stream,) = _table(_decoded(data if whole else data[: data.rfind(b"\n") + 1], path), whole, path).streams
    return (*stream.columns, *stream.text)


def _table(text: str, complete: bool, path: Path) -> Streams:
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    kept = [i for i, line in enumerate(lines) if line and not line.isspace() and not line.startswith(COMMENT)]
    if not kept:
        raise LogError(f"{_no_rows()}", path)
    form = _sniffed([lines[i] for i in kept])
    if form.separator == " ":
        lines = [" ".join(line.split()) for line in lines]
    comments = [line.lstrip("#% \t") for line in lines[: kept[0]] if line.startswith(COMMENT)]
    names, above, notes = _names([lines[i] for i in kept[:3]], comments, form)
    kept = kept[above:]
    if not kept:
        raise LogError(f"{_no_rows()}", path)
    if len(names) < form.count(lines[kept[-1]]) and all(_ends_open(lines[i], names, form) for i in kept):
        names = [*names, ""]
    if twice := [name for name, count in Counter(filter(None, names)).items() if count > 1]:
        notes = (*notes, f"Several columns are named {listed(twice)}: the first keeps that name.")
    names = _told_apart(names)
    if form.count(lines[kept[-1]]) < len(names) or not complete:
        kept, notes = kept[:-1], (*notes, "The last row is cut off and was left out.")
    bad = _miscounted(lines, kept, len(names), form)
    if bad:
        kept = [i for i in kept if i not in bad]
    values, blank, wrong = _values([lines[i] for i in kept], len(names), form)
    rows = np.array(kept, np.intp)
    words = {
        j for j, at in enumerate(wrong) if len(at) * MOST_BAD > len(kept) - np.count_nonzero(blank[:, j])
    }
    for j in sorted(words):
        united = _united(_words([lines[i] for i in kept], j, form), values[:, j], names[j], form)
        if isinstance(united, str):
            numbers = np.count_nonzero(np.isfinite(values[:, j]))
            if not united and numbers >= MOSTLY * (len(kept) - np.count_nonzero(blank[:, j])):
                first = kept[wrong[j][0]]
                united = (
                    f"{numbers} cells of '{names[j]}' are numbers, and row {first + 1} "
                    f"{no_number(form.cells(lines[first])[j])}: the column was read as words."
                )
            notes += (united,) if united else ()
        else:
            names[j], values[:, j], wrong[j] = united
            words.remove(j)
    for j, at in enumerate(wrong):
        if j not in words:
            cells = ((kept[i], form.cells(lines[kept[i]])[j]) for i in at)
            bad |= {line: no_number(cell) for line, cell in cells}
    notes += _left_out(path, bad, len(kept))
    good = np.array([line not in bad for line in kept], np.bool_) if bad else np.ones(len(kept), np.bool_)
    stream = Stream(
        "",
        {name: values[good, j] for j, name in enumerate(names) if j not in words},
        {names[j]: _words([lines[i] for i in rows[good]], j, form) for j in sorted(words)},
    )
    empty = {name: blank[good, j] for j, name in enumerate(names) if blank[good, j].any()}
    return Streams((stream,), notes, empty, rows[good] + 1)


def _text(path: Path) -> tuple[str, bool]:
    data, complete = load_bytes(path)
    return _decoded(data, path), complete


def _decoded(data: bytes, path: Path) -> str:
    wide = data.startswith((b"\xff\xfe", b"\xfe\xff"))
    head = data[:HEAD_BYTES]
    if not wide and head.count(b"\0") > MOST_ZEROS * len(head):
        raise LogError(f"{NO_TEXT}", path)
    # Spreadsheets write cp1252 where they were told nothing, and a degree sign in a name is no UTF-8 then.
    for encoding in ("utf-16",) if wide else ("utf-8-sig", "cp1252"):
        try:
            return data.decode(encoding)
        except UnicodeDecodeError:
            continue
    raise LogError(f"{NO_TEXT}", path)


def _no_rows() -> str:
    return "holds no rows; give a .csv with a line of names and a line for each sample"


def _sniffed(lines: Sequence[str]) -> _Form:
    """The form in which most of the first lines have as many cells as the first of all, and more than one."""
    best, most, head = _Form(",", False), 0, lines[: SNIFFED + 1]
    for separator in SEPARATORS:
        form = _Form(separator, False)
        tried = [UNIT_APART.sub("_", " ".join(line.split())) for line in head] if separator == " " else head
        counts = [form.count(line) for line in tried]
        alike = sum(count == counts[0] for count in counts[1:]) if counts[0] > 1 else 0
        if alike > most:
            best, most = form, alike
    spaced = _Form(" ", True)
    if best.separator == "," and not _are_numbers(head, best) and _are_numbers(head, spaced):
        return spaced
    return _Form(best.separator, best.separator != "," and _has_decimal_commas(lines[1:], best))


def _are_numbers(lines: Sequence[str], form: _Form) -> bool:
    """Whether lines hold numbers alone, several each, and no comma but a decimal one."""
    rows = [form.cells(" ".join(line.split())) for line in lines]
    return all(
        len(row) > 1 and all(form.is_number(cell) and not cell.endswith(",") for cell in row) for row in rows
    )


def _has_decimal_commas(lines: Sequence[str], form: _Form) -> bool:
    """Whether the first lines with a fraction have it behind a comma; a vehicle at rest begins with whole ones."""
    broken = (line for line in lines if "," in line or "." in line)
    while first := list(islice(broken, SNIFFED)):
        cells = [cell for line in first for cell in form.cells(line)]
        point = any("." in cell and form.is_number(cell) for cell in cells)
        if point or any(DECIMAL_COMMA.fullmatch(cell) for cell in cells):
            return not point
    return False


def _names(
    first: Sequence[str], comments: Sequence[str], form: _Form
) -> tuple[list[str], int, tuple[str, ...]]:
    """The names, the number of lines that they take of the first three, and notes."""
    names = _header_cells(first[0], form)
    if not _is_row(names, form):
        if len(first) > 2 and _holds_units(first[1], first[2], len(names), form):
            units = [cell.strip().strip("[]()").strip() for cell in form.cells(first[1])]
            named = [f"{name} [{unit}]" if unit else name for name, unit in zip(names, units, strict=True)]
            return named, 2, ("The line after the names holds no number: it was taken for units.",)
        return names, 1, ()
    for comment in comments[-1:]:
        above = _header_cells(comment, form)
        if len(above) == len(names):
            return above, 0, ()
    numbered = [str(number) for number in range(1, len(names) + 1)]
    note = f"The table has no line of names: its columns are named by their numbers, 1 to {len(names)}."
    return numbered, 0, (note,)


def _header_cells(line: str, form: _Form) -> list[str]:
    if form.separator != " ":
        return [name.strip() for name in form.cells(line)]
    joined = UNIT_APART.sub("\0", line.strip())
    return [name.replace("\0", " ") for name in form.cells(joined) if name]


def _is_row(cells: Sequence[str], form: _Form) -> bool:
    filled = [cell for cell in cells if cell.strip()]
    data = sum(form.is_number(cell) or BEGINS_WITH_DATE.match(cell) is not None for cell in filled)
    return bool(filled) and 2 * data >= len(filled)


def _holds_units(line: str, after: str, width: int, form: _Form) -> bool:
    cells = form.cells(line)
    filled = [cell for cell in cells if cell.strip()]
    wordy = not any(form.is_number(cell) and cell.strip() not in NOTHING for cell in filled)
    are_units = bool(filled) and wordy and not _is_row(cells, form)
    return len(cells) == width and are_units and _is_row(form.cells(after), form)


def _ends_open(line: str, names: Sequence[str], form: _Form) -> bool:
    """Whether a row ends with a separator that the line of names lacks."""
    return form.count(line) == len(names) + 1 and line.rstrip(" ").endswith(form.separator)


def _told_apart(names: Sequence[str]) -> list[str]:
    """Name a column without a name by its number, and a name that stands again by its place as well."""
    distinct: dict[str, None] = {}
    for number, name in enumerate(names, start=1):
        new = name or f"column {number}"
        distinct[new if new not in distinct else f"{new} (column {number})"] = None
    return list(distinct)


def _miscounted(lines: Sequence[str], kept: Sequence[int], width: int, form: _Form) -> dict[int, str]:
    """What is wrong with each line that has not `width` cells, by its place in `lines`."""
    bad = {}
    for i in kept:
        count = form.count(lines[i])
        if count != width:
            bad[i] = f"has {count} cells, the first line names {width}"
    return bad


def _values(lines: Sequence[str], width: int, form: _Form) -> tuple[Array, Mask, list[list[int]]]:
    """Numbers (n, width), NaN in other cells; mask of empty cells; by column, the rows that hold a word."""
    values = np.full((len(lines), width), np.nan)
    blank = np.zeros((len(lines), width), np.bool_)
    wrong: list[list[int]] = [[] for _ in range(width)]
    doubtful: set[int] = set()
    for start in range(0, len(lines), CHUNK):
        part = lines[start : start + CHUNK]
        span = slice(start, start + len(part))
        plain = [j for j in range(width) if j not in doubtful]
        try:
            values[span, plain] = _plain(part, plain, form)
        except ValueError:
            plain = []
        if len(plain) == width:
            continue
        for j, cells in enumerate(_columns(part, width, form)):
            if j in plain:
                continue
            empty = [not cell or cell.isspace() for cell in cells]
            numbers, words = _numbers(cells, empty, form)
            values[span, j], blank[span, j] = numbers, empty
            wrong[j] += [start + i for i in words]
            if words or any(empty):
                doubtful.add(j)
    return values, blank, wrong


def _plain(lines: Sequence[str], columns: Sequence[int], form: _Form) -> Array:
    """Numbers (n, k) in columns that hold nothing else. Raises ValueError if they do."""
    if not columns:
        return np.zeros((len(lines), 0))
    points = [line.replace(",", ".") for line in lines] if form.decimal_comma else lines
    return np.loadtxt(
        points, delimiter=form.separator, comments=None, ndmin=2, usecols=columns, quotechar='"'
    )


def _columns(lines: Sequence[str], width: int, form: _Form) -> Iterator[list[str]]:
    """Each column's cells (n,) in lines of `width` cells each."""
    if any('"' in line for line in lines):
        cells = list(chain.from_iterable(map(form.cells, lines)))
    else:
        cells = form.separator.join(lines).split(form.separator)
    return (cells[j::width] for j in range(width))


def _numbers(cells: Sequence[str], empty: Sequence[bool], form: _Form) -> tuple[Array, list[int]]:
    """Numbers (n,), NaN for an empty cell or a word, and the places of words."""
    filled = ["nan" if nothing else cell for cell, nothing in zip(cells, empty, strict=True)]
    if not form.decimal_comma:
        try:
            return np.fromiter(map(float, filled), np.float64, len(filled)), []
        except ValueError:
            pass
    numbers, words = np.full(len(filled), np.nan), []
    for i, cell in enumerate(filled):
        try:
            numbers[i] = form.number(cell)
        except ValueError:
            words.append(i)
    return numbers, words


def _united(cells: Sequence[str], plain: Array, name: str, form: _Form) -> tuple[str, Array, list[int]] | str:
    """Of a column (n,) whose cells are numbers with a unit, its name with that, the numbers and the rows of words; of
    any other "", or what is wrong with its units.

    plain (n,): the numbers without a unit, NaN for other cells.
    """
    numbers, units, wrong = np.full(len(cells), np.nan), dict[str, None](), list[int]()
    for i, cell in enumerate(cells):
        match = None if not cell or form.is_number(cell) else UNIT_BEHIND.fullmatch(cell)
        if match is not None and form.is_number(match[1]):
            numbers[i] = form.number(match[1])
            units[match[2]] = None
        elif cell and not form.is_number(cell):
            wrong.append(i)
            if len(wrong) * MOST_BAD > len(cells):
                return ""
    # A zero is the same in every unit.
    all_units = [*units, *(["none"] if np.nan_to_num(plain).any() else [])]
    if not units:
        return ""
    try:
        named = [with_unit(name, unit) for unit in units]
    except ValueError:
        return ""
    if len(all_units) > 1:
        return f"The cells of '{name}' are in different units ({', '.join(all_units)}): it was read as words."
    return named[0], np.where(np.isfinite(plain), plain, numbers), wrong


def no_number(cell: str) -> str:
    """What is wrong with a cell, in words that follow its row's number."""
    shown = "".join(letter if letter.isprintable() else "?" for letter in cell.strip()[:LONGEST_SHOWN])
    return f"holds '{shown}', which is no number"


def _words(lines: Sequence[str], column: int, form: _Form) -> tuple[str, ...]:
    return tuple(form.cells(line)[column].strip() for line in lines)


def _left_out(path: Path, bad: dict[int, str], rows: int) -> tuple[str, ...]:
    """A note on the bad lines, by their places in the file. Raises LogError if they are too many."""
    if not bad:
        return ()
    first = min(bad)
    if len(bad) * MOST_BAD > rows:
        more = f"and {len(bad) - 1} more rows are bad; " if len(bad) > 1 else ""
        raise LogError(f"row {first + 1} {bad[first]}; {more}mend {'them' if more else 'it'}", path)
    if len(bad) == 1:
        return (f"Row {first + 1} {bad[first]}: it was left out.",)
    numbers = [str(place + 1) for place in sorted(bad)[:3]]
    if len(bad) > 3:
        numbers.append(f"{len(bad) - 3} more")
    return (f"Rows {listed(numbers)} were left out; the first {bad[first]}.",)
