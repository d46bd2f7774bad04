"""The table of a vehicle's parameters: which columns stand in it, by the room, and none of them cut."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from bridge.reports import Written
from gcs_plugin.params.comparison import Compared, Comparison
from gcs_plugin.params.meaning import acting, word_for
from gcs_plugin.params.plan import Verdict
from gcs_plugin.params.proposal import TAKEN_BACK
from tui.app.drawing import NOTHING, Line, Lines, Role, Span, around
from tui.app.header import PHONE

AT: Final = "▶"
CHOSEN, LEFT, NOT_ASKED, DOUBT = "■", "□", " ", "▲"
MARKS: Final = 3
"""Cells of a line before its name."""
EQUAL: Final = "read back equal"
EQUAL_SHORT: Final = "equal"
FAILED: Final = {
    "refused": "refused",
    "unverified": "unverified",
    "rolled_back": "rolled back",
    "not_sent": "not sent",
}
"""Outcomes in words for the end of a line; the sentence below the table says all."""
SHORT: Final = {"not on the vehicle": "absent", "implausible": "unlikely", TAKEN_BACK: "taken back"}
"""Short forms of verdicts and reasons for narrow lines; the sentence below the table has the full words."""
LEAST_WORDS: Final = len("▲ failed")
"""Cells kept for what becomes of a line, so that the columns stay as they are while it is written."""
DIGITS, FEWEST_DIGITS = 5, 3
ALIKE, FAR = 1.0, 3.0
"""Change in half-intervals: up to ALIKE it is within the interval, above FAR it deserves a second look."""
HALF: Final = "±"
"""Column head of half the 95 % interval, in the line's unit: the 95 stands in the key's legend, for beside a value it
reads as per cent of it."""
IN_HALVES: Final = "Δ/±"
"""Column head of the change, in units of the ± column."""
CHANGE: Final = 6
UNITLESS: Final = "1"
"""The unit of a plain number; it is not shown."""
VEHICLE: Final = "vehicle"
ARROW: Final = " →"


@dataclass(frozen=True)
class _Column:
    """A column: its head, and text and role of each line; `right`: at the right of its cells, as numbers are."""

    head: str
    spans: tuple[Span, ...]
    right: bool = True
    least: int = 0

    @property
    def cells(self) -> int:
        """Those of its widest text, at least `least`, and a blank before it."""
        return 1 + max(self.least, len(self.head), *(len(text) for text, _ in self.spans))

    def cell(self, n: int) -> Span:
        text, role = self.spans[n]
        return self._placed(text), role

    @property
    def heading(self) -> str:
        return self._placed(self.head)

    def _placed(self, text: str) -> str:
        return f"{text:>{self.cells}}" if self.right else f" {text:<{self.cells - 1}}"


_Columns = tuple[_Column, ...]


def table(
    shown: Comparison,
    chosen: Collection[str],
    at: int,
    became: Mapping[str, Written],
    cells: int,
    rows: int,
    *,
    back: bool = False,
    stale: bool = False,
) -> Lines:
    """Table with a heading and the lines that fit, including the line at `at`; `became` holds the results of writes.

    `stale`: the vehicle's values may be out of date. No column is cut: those for which there is no room are left out.
    """
    entries = shown.parameters
    if not entries:
        return ()
    heads = (
        "was" if became else "staged" if shown.waits else VEHICLE,
        "before" if back else "identified" if cells >= PHONE else "new",
    )
    columns = next(
        columns
        for digits in range(DIGITS, FEWEST_DIGITS - 1, -1)
        for values in (_values(entries, chosen, heads, digits, stale=stale),)
        for columns in (_fitting(entries, values, became, cells),)
        if digits == FEWEST_DIGITS or _width(columns) <= cells
    )

    def row(n: int) -> Line:
        entry = entries[n]
        mark = (CHOSEN if entry.name in chosen else LEFT) if entry.choosable else NOT_ASKED
        (name, role), *others = (column.cell(n) for column in columns)
        return (
            (AT if n == at else " ", "accent"),
            (mark, "accent"),
            (DOUBT if entry.doubted else " ", "warn"),
            (name[1:], "tab" if n == at else role),
            *others,
        )

    head = " " * MARKS + "".join(column.heading for column in columns)[1:]
    return ((head.rstrip(), "quiet"),), *around(len(entries), at, rows, row)


def _fitting(
    entries: Sequence[Compared], values: _Columns, became: Mapping[str, Written], cells: int
) -> _Columns:
    """The columns that fit, in their order on the screen: `values` always.

    Then the unit, and what is to be said of a line, in full or else in a word; in the room left, what is told in
    intervals, the value last accepted, and the meaning.
    """
    unit = _column("unit", [("" if entry.unit == UNITLESS else entry.unit, "quiet") for entry in entries])
    full, brief = (
        _column("", [_words(entry, became.get(entry.name), brief=brief) for entry in entries], LEAST_WORDS)
        for brief in (False, True)
    )
    if _width((*values, unit, brief)) > cells:
        values = _spans_in_place(entries, values, brief, became)
        return (*values, unit) if _width((*values, unit)) <= cells else values
    columns, intervals = (*values, unit), _in_intervals(entries)
    words = full if _width((*columns, *intervals, full)) <= cells else brief
    for column in intervals:
        if _width((*columns, column, words)) > cells:
            break
        columns = (*columns, column)
    columns = (*columns, words)
    meaning = _column("meaning", [(entry.sentence, "quiet") for entry in entries])
    return (*columns, meaning) if _width((*columns, meaning)) <= cells else columns


def _spans_in_place(
    entries: Sequence[Compared], values: _Columns, words: _Column, became: Mapping[str, Written]
) -> _Columns:
    """`values` with what became of a line, or why it can't be written, in place of its change."""
    *others, change = values
    spans = tuple(
        of_words if entry.name in became or not (entry.choosable or _is_same(entry)) else of_change
        for entry, of_words, of_change in zip(entries, words.spans, change.spans, strict=True)
    )
    return (*others, _Column(change.head, spans))


def _column(head: str, spans: Sequence[Span], least: int = 0) -> _Column:
    return _Column(head, tuple(spans), right=False, least=least)


def _width(columns: _Columns) -> int:
    """Cells of a line: its marks, and its columns less the blank before the first."""
    return MARKS - 1 + sum(column.cells for column in columns)


def _values(
    entries: Sequence[Compared],
    chosen: Collection[str],
    heads: tuple[str, str],
    digits: int,
    *,
    stale: bool,
) -> _Columns:
    """Name, old and new value with so many digits, and their difference in per cent."""
    roles: list[Role] = [
        "strong" if entry.name in chosen else "plain" if entry.choosable else "quiet" for entry in entries
    ]
    olds = (f"{acting_number(entry.name, entry.present, digits)}{ARROW}" for entry in entries)
    of_olds: list[Role] = ["stale" if stale else "plain" if entry.changes else "quiet" for entry in entries]
    targets = (acting_number(entry.name, entry.target, digits) for entry in entries)
    percents = (entry.percent or NOTHING for entry in entries)
    return (
        _column("name", _spans((entry.name for entry in entries), roles)),
        _Column(f"{heads[0]}{ARROW}", _spans(olds, of_olds), least=len(f"{VEHICLE}{ARROW}")),
        _Column(heads[1], _spans(targets, roles)),
        _Column("change", _spans(percents, roles)),
    )


def _in_intervals(entries: Sequence[Compared]) -> _Columns:
    """Half the interval, the change in halves of it, and the value last accepted."""
    halves = (number(half(entry)) for entry in entries)
    changes = (_change(entry.change) for entry in entries)
    accepted = (acting_number(entry.name, entry.accepted) for entry in entries)
    quiet: list[Role] = ["quiet"] * len(entries)
    return (
        _Column(HALF, _spans(halves, quiet)),
        _Column(IN_HALVES, _spans(changes, map(_far, entries))),
        _Column("accepted", _spans(accepted, quiet)),
    )


def _far(entry: Compared) -> Role:
    """The role of a change, by how far it goes beyond the interval."""
    halves = abs(entry.change or 0.0)
    return "warn" if halves > FAR else "plain" if halves > ALIKE else "quiet"


def _spans(texts: Iterable[str], roles: Iterable[Role]) -> tuple[Span, ...]:
    return tuple((text, role) for text, role in zip(texts, roles, strict=True))


def number(value: float | None, digits: int = DIGITS) -> str:
    return NOTHING if value is None else f"{value + 0.0:.{digits}g}"


def acting_number(name: str, value: float | None, digits: int = DIGITS) -> str:
    """The value by which a vehicle acts with this parameter, to so many digits, or the word that stands for it."""
    if value is None:
        return NOTHING
    return word_for(name, value) or number(acting(name, value), digits)


def _change(change: float | None) -> str:
    if change is None:
        return NOTHING
    texts = f"{change:+.1f}", f"{change:+.0f}", f"{change:+.0e}"
    return next((text for text in texts if len(text) <= CHANGE), texts[-1])


def half(entry: Compared) -> float | None:
    """Half of the entry's 95 % interval, None if it has none."""
    return None if entry.low95 is None or entry.high95 is None else (entry.high95 - entry.low95) / 2


def _is_same(entry: Compared) -> bool:
    return entry.verdict == Verdict.SAME.value


def _words(entry: Compared, became: Written | None, *, brief: bool) -> Span:
    """What is to be said of a line, "" for nothing, and its role; `brief`: in a word."""
    if became:
        if became.equal:
            return f"✓ {EQUAL_SHORT if brief else EQUAL}", "accent"
        return f"{DOUBT} {'failed' if brief else FAILED.get(became.outcome, 'failed')}", "bad"
    words = entry.reason if entry.changes else entry.verdict
    role: Role = "warn" if entry.changes or entry.staged else "quiet" if _is_same(entry) else "bad"
    return SHORT.get(words, words) if brief else words, role
