"""A vehicle's parameters as lines: table, details, confirmation, and how reading and writing go and end."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from bridge import exit_codes
from bridge.reports import APPLIED, WRITING, Written
from gcs_plugin.params.comparison import Compared, Comparison
from gcs_plugin.params.upload import Stage
from tui.app.drawing import NOTHING, Line, Lines, Role, Span, ago, around, cut, lines_of, titled, wrapped
from tui.app.header import PHONE
from tui.app.jobs import JobState, progress

AT: Final = "▶"
CHOSEN, LEFT, NOT_ASKED, DOUBT = "■", "□", " ", "▲"
EQUAL: Final = "read back equal"
EQUAL_SHORT: Final = "equal"
FAILED: Final = {
    "refused": "refused",
    "unverified": "unverified",
    "rolled_back": "rolled back",
    "not_sent": "not sent",
}
"""Outcomes in a word for the end of a line; the sentence below the table says all."""
SHORT: Final = {"not on the vehicle": "absent", "implausible": "unlikely"}
"""Short forms of verdicts for narrow lines; the sentence below the table has the full words."""
DIGITS: Final = 5
WIDE: Final = 90  # cells from which every column fits any value, and the last accepted value stands too
WIDEST, VERDICT = (
    130,
    11,
)  # cells from which the meaning stands at the end of a line, and those of the verdict there
ALIKE, FAR = 1.0, 3.0
"""Change in half-intervals: up to ALIKE it is within the interval, above FAR it deserves a second look."""
IN_HALVES: Final = "Δ/±95%"
"""Column head of the change, in units of the ±95 % column."""
CHANGE, PERCENT = 7, 7
ARROW: Final = " →"

READ_FIRST: Final = "The vehicle is read before anything is written."


@dataclass(frozen=True)
class _Widths:
    """Widths in cells of the columns that shrink on a narrow screen."""

    name: int
    unit: int
    number: int
    file: int
    half: int


ROOMY, TIGHT, OF_A_PHONE = _Widths(14, 13, 10, 11, 8), _Widths(12, 12, 8, 11, 7), _Widths(10, 0, 8, 8, 0)


def number(value: float | None, cells: int = 0) -> str:
    """Format a value to five digits, or fewer if five and a blank exceed `cells`."""
    if value is None:
        return NOTHING
    texts = [f"{value + 0.0:.{digits}g}" for digits in range(DIGITS, 0, -1)]
    return next((text for text in texts if not cells or len(text) < cells), texts[-1])


def _change(change: float | None) -> str:
    """Format a change, leaving a blank before it."""
    if change is None:
        return NOTHING
    texts = f"{change:+.1f}", f"{change:+.0f}", f"{change:+.0e}"
    return next((text for text in texts if len(text) < CHANGE), texts[-1])


def half(entry: Compared) -> float | None:
    """Half of the entry's 95 % interval, None if it has none."""
    return None if entry.low95 is None or entry.high95 is None else (entry.high95 - entry.low95) / 2


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

    `stale`: the vehicle's values may be out of date.
    """

    def row(n: int) -> Line:
        entry = shown.parameters[n]
        return _row(entry, entry.name in chosen, n == at, became.get(entry.name), cells, stale=stale)

    head = _head(cells, back, "was" if became else "staged" if shown.waits else "vehicle")
    return (head, *around(len(shown.parameters), at, rows, row))


def _head(cells: int, back: bool, present: str) -> Line:
    wide = _widths(cells)
    values = present, "before" if back else "identified" if cells >= PHONE else "new"
    head = f"   {'name':<{wide.name}}{values[0]:>{wide.number}}{ARROW}{values[1]:>{wide.file}}{'change':>{PERCENT}}"
    if cells < PHONE:
        return ((head, "quiet"),)
    accepted = f"{'accepted':>{wide.number}}" if cells >= WIDE else ""
    if cells >= WIDEST:
        accepted += f"  {'':<{VERDICT}}meaning"
    return ((f"{head} {'unit':<{wide.unit}}{'±95 %':>{wide.half}}{IN_HALVES:>{CHANGE}}{accepted}", "quiet"),)


def _widths(cells: int) -> _Widths:
    return ROOMY if cells >= WIDE else TIGHT if cells >= PHONE else OF_A_PHONE


def _row(entry: Compared, chosen: bool, at: bool, became: Written | None, cells: int, *, stale: bool) -> Line:
    mark = (CHOSEN if chosen else LEFT) if entry.choosable else NOT_ASKED
    lively: Role = "strong" if chosen else "plain" if entry.choosable else "quiet"
    present: Role = "stale" if stale else "plain" if entry.changes else "quiet"
    wide = _widths(cells)
    far: Role = "quiet" if entry.change is None or abs(entry.change) <= ALIKE else "plain"
    if entry.change is not None and abs(entry.change) > FAR:
        far = "warn"
    line: Line = (
        (AT if at else " ", "accent"),
        (mark, "accent"),
        (DOUBT if entry.doubted else " ", "warn"),
        (f"{cut(entry.name, wide.name - 1):<{wide.name}}", "tab" if at else lively),
        (f"{number(entry.present, wide.number):>{wide.number}}", present),
        (ARROW, "quiet"),
        (f"{number(entry.target, wide.file):>{wide.file}}", lively),
        (f"{entry.percent or NOTHING:>{PERCENT}}", lively),
    )
    if cells < PHONE:
        words, role = _words(entry, became, PERCENT - 1)
        return (*line[:-1], (f" {cut(words, PERCENT - 1):>{PERCENT - 1}}", role)) if became else line
    line = (
        *line,
        (f" {cut(entry.unit, wide.unit - 1):<{wide.unit}}", "quiet"),
        (f"{number(half(entry), wide.half):>{wide.half}}", "quiet"),
        (f"{_change(entry.change):>{CHANGE}}", far),
    )
    if cells >= WIDE:
        line = (*line, (f"{number(entry.accepted, wide.number):>{wide.number}}", "quiet"))
    room = cells - sum(len(text) for text, _ in line) - 2
    words, role = _words(entry, became, min(room, VERDICT - 1) if cells >= WIDEST else room)
    if cells >= WIDEST and len(words) < VERDICT:
        return (*line, (f"  {words:<{VERDICT}}", role), (cut(entry.sentence, room - VERDICT), "quiet"))
    return (*line, (f"  {cut(words, room)}", role)) if room > 0 else line


def _words(entry: Compared, became: Written | None, room: int) -> Span:
    """Text and role for the end of a line, in at most `room` cells."""
    if became:
        if became.equal:
            return f"✓ {EQUAL if len(EQUAL) + 2 <= room else EQUAL_SHORT}", "accent"
        failed = FAILED.get(became.outcome, "")
        return f"{DOUBT} {failed if 0 < len(failed) <= room - 2 else 'failed'}", "bad"
    if entry.changes:
        return (entry.reason or "", "warn")
    role: Role = "warn" if entry.staged else "quiet" if entry.verdict == "same" else "bad"
    return (entry.verdict if len(entry.verdict) <= room else SHORT.get(entry.verdict, entry.verdict), role)


def details(entry: Compared, became: Written | None, stale_s: float | None, cells: int) -> Lines:
    """All that is known about one line, in sentences; `stale_s` is the age of the vehicle's value, None if fresh."""
    unit = "" if entry.unit in ("", "1") else f" {entry.unit}"
    interval = ""
    if half(entry):
        interval = f", 95 % between {number(entry.low95)} and {number(entry.high95)} given the thrust"
    when = f" ({_when(entry.accepted_at)})" if entry.accepted_at else ""
    last = f"last accepted {number(entry.accepted)}{unit}{when}" if entry.accepted is not None else ""
    size = f"the change is {abs(entry.change):.1f} halves of the interval" if entry.change else ""
    held = "staged on the vehicle" if entry.staged else "on the vehicle"
    label = "before" if became else held if stale_s is None else f"{held} {ago(stale_s)}"
    is_now = "the vehicle has none" if entry.present is None else f"{label} {number(entry.present)}"
    by = f" ({entry.percent})" if entry.percent else ""
    sentence = "; ".join(
        filter(None, (f"{is_now} → in the file {number(entry.target)}{unit}{by}{interval}", last, size))
    )
    lines = wrapped(f"{entry.name}: {entry.sentence}" if entry.sentence else entry.name, "strong", cells)
    lines += wrapped(f"{sentence}.", "plain", cells)
    if became:
        lines += wrapped(f"{became.words}.", "accent" if became.equal else "bad", cells)
    if entry.reason:
        lines += wrapped(f"{entry.verdict}: {entry.reason}.", "warn", cells)
    if entry.doubted:
        lines += wrapped(f"{DOUBT} doubted: {entry.doubted}.", "warn", cells)
    return lines


def _when(time: str) -> str:
    """Format `2026-11-21T064500Z` for a reader."""
    return f"{time[:10]} {time[11:13]}:{time[13:15]} UTC"


def top(
    shown: Comparison, chosen: Collection[str], stale_s: float | None, cells: int, *, back: bool, done: bool
) -> Lines:
    """Heading: the file, the number of lines chosen (or written, once `done`), and the age of stale values."""
    if back:
        title = f"ROLL BACK to the values before {_when(Path(shown.file).name)}"
    else:
        title = f"{Path(shown.file).name} OF {shown.of}" if shown.of else shown.file
    count = f"{len(chosen)} of {len(shown.choosable)} chosen"
    if shown.staged:
        count = f"{len(shown.staged)} staged, {count}" if shown.choosable else f"{len(shown.staged)} staged"
    if done:
        parts = (len(chosen), "written"), (len(shown.staged), "put in force")
        count = ", ".join(f"{number_of} {verb}" for number_of, verb in parts if number_of)
    lines = titled(title, count, cells)
    if stale_s is not None:
        lines += wrapped(f"what the vehicle holds was read {ago(stale_s)}", "stale", cells)
    if shown.doubted:
        lines += wrapped(
            f"{DOUBT} the identification ended with '{shown.outcome}': its values may be wrong", "bad", cells
        )
    return lines


def waiting(shown: Comparison, key: str, cells: int) -> Lines:
    """Warning that the vehicle holds values that it does not use; `key` puts them in force."""
    if not shown.waits:
        return ()
    flies = f"another set flies ({shown.active_crc:.0f})" if shown.active_crc else "none of it flies"
    commit = f": commit it with {key}" if key and shown.staged else ""
    return wrapped(f"{DOUBT} staged, and {flies}{commit}", "bad", cells)


def asking(shown: Comparison, chosen: int, needed: str, *, armed: bool, back: bool, cells: int) -> Lines:
    """Question that says which lines will be written and put in force, and which words confirm that."""
    staged, write = len(shown.staged), "write back" if back else "write"
    if not staged:
        task = f"{write} {lines_of(chosen)} to"
    elif not chosen:
        task = f"put {lines_of(staged)} in force on"
    else:
        task = f"{write} {lines_of(chosen)} and put the {staged} staged in force on"
    sentence = f"To {task} vehicle {shown.vehicle.system}, type {needed} and Enter; escape leaves it."
    if armed:
        return (
            ((f" ■ vehicle {shown.vehicle.system} is ARMED ", "armed"),),
            *wrapped(sentence, "strong", cells),
        )
    return wrapped(sentence, "strong", cells)


def reading(state: JobState | None, cells: int) -> Lines:
    """Progress of reading; empty while no reading runs."""
    return () if state is None or not state.runs else (progress(state, cells),)


def writing(written: JobState | None, cells: int, retries: str) -> Lines:
    """Progress or outcome of writing; empty if none was begun. `retries` is the key that tries again."""
    if written is None:
        return ()
    if written.done is None:
        last = written.reports[-1] if written.reports else None
        step = _doing(last.stage) if last is not None and last.of == WRITING else READ_FIRST
        return (*wrapped(step, "strong", cells), progress(written, cells, "looking for the vehicle"))
    result = written.done.result
    if result is None:
        lines = wrapped(written.done.why or "it ended without a word", "bad", cells)
        if written.done.code == exit_codes.LINK:  # a link that fails later leaves a receipt
            lines += wrapped(f"Nothing was written; {retries} tries it again.", "strong", cells)
        return lines
    good = written.done.code == 0
    unkept = result.get("unkept", "")
    sentence = f"{'✓' if good else DOUBT} {result['outcome'].replace('_', ' ')}: {result['sentence']}"
    return (
        *wrapped(sentence, "strong" if good else "bad", cells),
        *(wrapped(unkept, "bad", cells) if unkept else ()),
        *(wrapped(f"values before: {result['preimage']}", "quiet", cells) if _changed(result) else ()),
    )


def _changed(result: Mapping[str, Any]) -> bool:
    """Whether writing changed any value, as far as is known; if not, there are no values before it to name."""
    return any(row["after"] is None or row["after"] != row["before"] for row in result["parameters"])


def _doing(stage: str) -> str:
    """Describe the current step of writing by the name of its stage."""
    if stage in (Stage.UNDO.name, Stage.UNDO_COMMIT.name):
        return "It failed: what was written is taken back."
    if stage == Stage.COMMIT.name:
        return "All lines are read back; the vehicle is told to fly them."
    return "The parameters are being written."


def became(written: JobState | None, shown: Comparison | None) -> dict[str, Written]:
    """Result of each line that was written, as far as it is known."""
    if written is None:
        return {}
    lines = (report.written for report in written.reports)
    results = {line.name: line for line in lines if line is not None}
    done = written.done
    if done is not None and done.result is not None and shown is not None:
        for row in done.result["parameters"]:
            if row["name"] in (*shown.choosable, *shown.staged):
                words = EQUAL if row["outcome"] == APPLIED else row["sentence"]
                results[row["name"]] = Written(row["name"], row["outcome"], words)
    return results
