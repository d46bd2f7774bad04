"""A vehicle's parameters as lines: details, confirmation, and how reading and writing go and end."""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any, Final

from bridge import exit_codes
from bridge.reports import APPLIED, WRITING, Written
from gcs_plugin.params.comparison import Compared, Comparison
from gcs_plugin.params.meaning import NOT_SET, acting, is_unset
from gcs_plugin.params.upload import Stage
from tui.app.drawing import Lines, ago, lines_of, titled, wrapped
from tui.app.jobs import JobState, progress
from tui.app.screens.parameters_table import DOUBT, EQUAL, acting_number, half, number

READ_FIRST: Final = "The vehicle is read before anything is written."


def details(entry: Compared, became: Written | None, stale_s: float | None, cells: int) -> Lines:
    """All that is known about a parameter, in sentences.

    became: the result of writing it, None if it was not written. stale_s: age of the vehicle's value, None if fresh.
    """
    interval = ""
    if half(entry):
        interval = f", 95 % between {number(entry.low95)} and {number(entry.high95)} given the thrust"
    when = f" ({_when(entry.accepted_at)})" if entry.accepted_at else ""
    last = f"last accepted {_in_unit(entry, entry.accepted)}{when}" if entry.accepted is not None else ""
    size = _against_interval(entry.change) if entry.change else ""
    held = "staged on the vehicle" if entry.staged else "on the vehicle"
    label = "before" if became else held if stale_s is None else f"{held} {ago(stale_s)}"
    is_now = "the vehicle has none" if entry.present is None else f"{label} {_value(entry, entry.present)}"
    by = f" ({entry.percent})" if entry.percent else ""
    sentence = "; ".join(
        filter(None, (f"{is_now} → in the file {_in_unit(entry, entry.target)}{by}{interval}", last, size))
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


def _against_interval(change: float) -> str:
    """A change, in halves of the 95 % interval, in words."""
    halves = abs(change)
    if halves <= 1.0:
        return "the change lies within the interval"
    return f"the change goes {halves:.1f} times as far as the interval"


def _value(entry: Compared, value: float) -> str:
    """The value by which the vehicle acts, with a note if it is a default because the parameter is not set."""
    acts_by = acting(entry.name, value)
    return acting_number(entry.name, value) if acts_by == value else f"{number(acts_by)} ({NOT_SET})"


def _in_unit(entry: Compared, value: float) -> str:
    has_unit = entry.unit not in ("", "1") and not is_unset(entry.name, value)
    return f"{_value(entry, value)} {entry.unit}" if has_unit else _value(entry, value)


def _when(time: str) -> str:
    """Format `2026-11-21T064500Z` for a reader."""
    return f"{time[:10]} {time[11:13]}:{time[13:15]} UTC"


def heading(
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
    if stage in (Stage.UNDO.name, Stage.UNDO_COMMIT.name):
        return "It failed: what was written is taken back."
    if stage == Stage.COMMIT.name:
        return "All lines are read back; the vehicle is told to fly them."
    if stage == Stage.WITHDRAW.name:
        return "All lines are read back; the set in force is taken out of force."
    return "The parameters are being written."


def results(written: JobState | None, shown: Comparison | None) -> dict[str, Written]:
    """The result of each line that was written, by parameter id, as far as it is known."""
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
