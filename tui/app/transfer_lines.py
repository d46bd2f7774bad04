"""Reading and writing of parameters as lines: progress, outcome, and the result of each line."""

from collections.abc import Mapping
from typing import Any, Final

from gcs_plugin.params.upload import Stage
from tui import exit_codes
from tui.app.comparison import Comparison
from tui.app.jobs import JobState
from tui.app.lines import Line, Lines, cut
from tui.app.parameter_lines import DOUBT, EQUAL
from tui.app.wrapped import bar, wrapped
from tui.progress import WRITING, Written

BAR_CELLS = 24
READ_FIRST: Final = "The vehicle is read before anything is written."


def progress(share: float, words: str, cells: int) -> Line:
    """A bar, the share in per cent, and the current step."""
    done: Line = ((bar(share, BAR_CELLS), "accent"), (f" {share:4.0%} ", "strong"))
    return (*done, (cut(f" {words}", cells - BAR_CELLS - 6), "plain"))


def reading(state: JobState | None, cells: int) -> Lines:
    """Progress of reading; empty while no reading runs."""
    if state is None or not state.runs:
        return ()
    report = state.told[-1] if state.told else None
    return (progress(report.share if report else 0.0, report.words if report else "begins", cells),)


def writing(written: JobState | None, cells: int, retries: str) -> Lines:
    """Progress or outcome of writing; empty if none was begun. `retries` is the key that tries again."""
    if written is None:
        return ()
    if written.done is None:
        last = written.told[-1] if written.told else None
        share, words = (last.share, last.words) if last is not None else (0.0, "looking for the vehicle")
        step = _doing(last.stage) if last is not None and last.of == WRITING else READ_FIRST
        return (*wrapped(step, "strong", cells), progress(share, words, cells))
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
    lines = (report.written for report in written.told)
    results = {line.name: line for line in lines if line is not None}
    done = written.done
    if done is not None and done.result is not None and shown is not None:
        for row in done.result["parameters"]:
            if row["name"] in (*shown.choosable, *shown.staged):
                equal = row["outcome"] == "applied"
                results[row["name"]] = Written(row["name"], equal, EQUAL if equal else row["sentence"])
    return results
