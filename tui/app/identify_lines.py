"""An identification as lines: progress, parameters during the fit, and results."""

import math
from collections.abc import Mapping, Sequence
from typing import Final

from bridge.vehicle.coefficients import OF_HULL
from tui import exit_codes
from tui.app.converging import converging, passes_of
from tui.app.found import Found, Value
from tui.app.job_lines import NOT_KEPT
from tui.app.jobs import JobState
from tui.app.lines import Line, Lines, Role, cut, heading, width
from tui.app.shown import day, number, stopwatch
from tui.app.wrapped import hanging
from tui.progress import PAGE, UNKEPT, Report
from tui.show import number as significant

BAR_CELLS: Final = 24
NAME_CELLS: Final = 12
WIDE: Final = 120  # cells from which four charts fit side by side
AFTER_A_RUN: Final = (exit_codes.DONE, exit_codes.NO)
COLUMNS: Final = f"{'':8}{'value':>9}  {'95 % interval':<19}  {'unit':<12}{'accepted':>10}{'change':>10}"


def progress(state: JobState, now_s: float, cells: int, goes_on: bool = False) -> Lines:
    """A bar per method and the elapsed time; once the values exist, a bar for the page being written.

    `goes_on`: the screen Parameters opens as soon as the values exist.
    """
    newest = {report.of: report for report in state.told}
    page = newest.pop(PAGE, None)
    newest.pop(UNKEPT, None)
    if page is not None and state.runs:
        return (_bar(PAGE, page, cells),)
    clock = stopwatch((state.ended_s if state.ended_s is not None else now_s) - state.began_s)
    then = "then parameters, " if goes_on and state.runs else ""
    lines: list[Line] = [heading(f"{_stage(state)} {_dive(state)}", then + clock, cells)]
    if not newest and state.runs:
        lines.append((("reading the dive", "quiet"),))
    return (*lines, *(_bar(method, report, cells) for method, report in newest.items()))


def _stage(state: JobState) -> str:
    if state.done is None:
        return "STOPPING" if state.cancelled else "IDENTIFYING"
    if state.cancelled and not state.draws:
        return "STOPPED"
    answered = state.draws or state.unkept is not None
    return "IDENTIFIED" if answered or state.done.code in AFTER_A_RUN else "FAILED"


def _dive(state: JobState) -> str:
    return state.words[1].rstrip("/").rpartition("/")[2] if len(state.words) > 1 else ""


def _bar(method: str, told: Report, cells: int) -> Line:
    full = round(min(max(told.share, 0.0), 1.0) * BAR_CELLS)
    line: Line = (
        (f"{cut(method, NAME_CELLS):<{NAME_CELLS}}", "plain"),
        ("█" * full, "accent"),
        ("░" * (BAR_CELLS - full), "rule"),
        (f" {100 * told.share:>3.0f} %  ", "strong"),
    )
    return (*line, (cut(told.words, max(cells - width(line), 0)), "quiet"))


def curves(told: Sequence[Report], cells: int, rows: int) -> Lines:
    """A chart per reported parameter in a grid that fills the space, next to it the values of other methods."""
    passes, answered = passes_of(told), answers(told)
    if not passes:
        return _answers(answered, cells)
    method_shown = next(item.of for item in told if item.values and not item.answered)
    compared = {method: values for method, values in answered.items() if method != method_shown}
    columns = 4 if cells >= WIDE else 2
    below = -(-len(passes) // columns)
    each, (high, left) = cells // columns, divmod(rows, below)
    lines: list[Line] = []
    for row in range(below):
        charts = [
            converging(item, _unit(item.name), each - 1, high + (row < left), _said(compared, item.name))
            for item in passes[row * columns : (row + 1) * columns]
        ]
        for y in range(max(map(len, charts))):
            lines.append(_beside([chart[y] if y < len(chart) else () for chart in charts], each))
    return tuple(lines)


def answers(told: Sequence[Report]) -> dict[str, dict[str, tuple[float, float]]]:
    """Answers by method: each value with half of its 95 % interval."""
    return {report.of: dict(report.values) for report in told if report.answered and report.values}


def _answers(answered: Mapping[str, Mapping[str, tuple[float, float]]], cells: int) -> Lines:
    """The values of the methods that have answered, one parameter per line."""
    return tuple(
        (
            (f"{name:<6}", "plain"),
            (f"{significant(value):>8}", "strong"),
            (f" ± {significant(half, 2)}", "reference"),
            (cut(f" {_unit(name)}  by {method}", cells - 18), "quiet"),
        )
        for method, values in answered.items()
        for name, (value, half) in values.items()
    )


def _said(answered: Mapping[str, Mapping[str, tuple[float, float]]], name: str) -> str:
    """Values of a parameter by the other methods."""
    said = (f"vs {significant(values[name][0])}" for values in answered.values() if name in values)
    return ", ".join(said)


def _unit(name: str) -> str:
    return OF_HULL[name].unit if name in OF_HULL else ""


def _beside(parts: Sequence[Line], each: int) -> Line:
    return tuple(span for part in parts for span in (*part, (" " * (each - width(part)), "plain")))


def ended(state: JobState, cells: int) -> Lines:
    """How a run without a result ended; empty for a run with a result."""
    done = state.done
    if done is None or (done.code in AFTER_A_RUN and not state.cancelled):
        return ()
    if state.cancelled and state.draws:
        values = "its values are below" if state.unkept is None else NOT_KEPT
        return hanging(f"{_dive(state)}: its page was stopped by you; {values}", "warn", cells)
    if state.cancelled:
        took = stopwatch((state.ended_s or state.began_s) - state.began_s)
        return hanging(
            f"{_dive(state)}: stopped by you after {took}; what lay there before stays", "warn", cells
        )
    said = done.why
    if state.unkept is not None:
        said += f"; {NOT_KEPT}"
    return hanging(said or f"identify ended with exit code {done.code} and said nothing", "bad", cells)


def result(found: Found, cells: int) -> Lines:
    """The outcome in a sentence, the doubts in full, parameters next to last accepted values, reasons and notes."""
    good = found.outcome == "converged" and not found.doubts
    lines: list[Line] = [
        heading(f"{found.dive} {found.configuration}", f"{day(found.written_unix_s)} UTC", cells)
    ]
    lines += hanging(_outcome(found), "strong" if good else "warn", cells)
    for sentence in found.beside[1:]:
        lines += hanging(sentence, "plain", cells)
    for doubt in found.doubts:
        lines += hanging(f"▲ {doubt}", "warn", cells)
    reasons = list(dict.fromkeys(value.reason for value in found.values if value.reason))
    if found.told:
        lines.append(((cut(COLUMNS, cells), "quiet"),))
        lines += [_row(value, reasons) for value in found.values]
    for n, reason in enumerate(reasons, start=1):
        lines += hanging(f"{n}: {reason}", "warn", cells)
    for note in found.notes:
        lines += hanging(note, "quiet", cells)
    return tuple(lines)


def _outcome(found: Found) -> str:
    outcome = found.outcome[:1].upper() + found.outcome[1:]
    second = f"; {found.beside[0].replace(':', ' beside it:')}" if found.beside else ""
    return f"{outcome}: {found.told} of {len(found.coefficients)} coefficients identified by {found.method}{second}."


def _row(one: Value, reasons: Sequence[str]) -> Line:
    if not math.isfinite(one.value):
        why = f"no, see {1 + reasons.index(one.reason)}" if one.reason else "no"
        return ((f"{one.name:<8}", "plain"), (f"{'--':>9}  ", "quiet"), (why, "warn"))
    interval = f"{significant(one.low95)} … {significant(one.high95)}"
    line: Line = (
        (f"{one.name:<8}", "plain"),
        (f"{significant(one.value):>9}", "strong"),
        (f"  {interval:<19}  ", "reference"),
        (f"{one.unit:<12}", "quiet"),
    )
    if not math.isfinite(one.accepted):
        return line
    role: Role = "warn" if one.is_news else "plain"
    return (
        *line,
        (f"{significant(one.accepted):>10}", "plain"),
        (f"{_signed(100 * one.change):>8} %", role),
    )


def _signed(value: float) -> str:
    text = number(value, 1)
    return text if text.startswith(("-", "0.0")) else f"+{text}"


def words_for(dive: str, vehicle: str, at: Mapping[str, object]) -> tuple[str, ...]:
    """The command line of the verb: both methods, and results where `at` says."""
    targets = [word for option, path in at.items() for word in (option, str(path))]
    return ("identify", dive, "--vehicle", vehicle, *targets)
