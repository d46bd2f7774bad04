"""An identification, beside the values accepted before, as lines: progress, values during the fit, and results."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import zip_longest
from pathlib import Path
from typing import Any, Final

import numpy as np

from bridge import exit_codes
from bridge.arrays import Array
from bridge.errors import ParamError
from bridge.files import read_small
from bridge.plain import from_json
from bridge.reports import PAGE, UNKEPT, Report
from bridge.vehicle.coefficients import OF_HULL
from gcs_plugin.params.files import read_parameters
from gcs_plugin.params.last_accepted import last_accepted
from gcs_plugin.params.plan import coefficient_of
from identify.words import capital
from tui.app.curves import ACROSS, AXIS_CELLS, BLANK, Dots, braille, dots, dotted, framed
from tui.app.drawing import (
    NOTHING,
    Line,
    Lines,
    Role,
    apart,
    cut,
    day,
    hanging,
    number,
    stopwatch,
    titled,
    width,
)
from tui.app.jobs import NOT_KEPT, JobState, newer
from tui.dive_list import results_beside
from tui.show import number as significant

LEAST_PASSES: Final = 4
LEAST_SPAN: Final = 0.001  # share of the value, so that a constant value still has an axis
SMALLEST: Final = 1e-9
BAR_CELLS: Final = 24
NAME_CELLS: Final = 12
WIDE: Final = 120  # cells from which four charts fit side by side
BETWEEN: Final = 3  # cells between the table and what stands beside it
BETWEEN_CHARTS: Final = 3
REFUSED: Final = "not identified"
LEAST_SIDE_CELLS: Final = 48  # cells, below which reasons and notes come under the table
AFTER_A_RUN: Final = (exit_codes.DONE, exit_codes.NO)
NAMED, ACCEPTED = f"{'':7}", f"{'accepted':>8} →"
AFTER: Final = (
    f"{'value':>8}",
    f"{'change':>9}",
    f"  {'unit':<12}",
    f"  {'95 % interval':<15}",
    f"  {'given the thrust':<17}",
)
"""Heads of the columns; those at the end are left out where they have no room."""


@dataclass(frozen=True)
class Value:
    """One parameter in `unit`, NaN if not identified, with its 95 % interval; `reason` says why it was not.

    `given` is the interval given the vehicle file's thrust, the other holds the thrust's uncertainty.
    `accepted` is the value that the vehicle last accepted, NaN for none.
    """

    name: str
    unit: str
    value: float
    low95: float
    high95: float
    given: tuple[float, float]
    reason: str
    accepted: float = math.nan

    @property
    def change(self) -> float:
        """Relative change from the last accepted value."""
        return self.value / self.accepted - 1 if self.accepted else math.nan

    @property
    def is_news(self) -> bool:
        """Whether the last accepted value lies outside the interval given the thrust, which acts on both alike."""
        low, high = self.given
        return not low <= self.accepted <= high and math.isfinite(self.accepted)


@dataclass(frozen=True)
class Comparison:
    """The second method: its outcome, and where it agrees with the first."""

    method: str
    outcome: str
    sentences: tuple[str, ...]


@dataclass(frozen=True)
class Identified:
    """The identification of a dive; `comparison` is None without a second method, `param` without a file to upload."""

    dive: str
    configuration: str
    method: str
    outcome: str
    values: tuple[Value, ...]
    doubts: tuple[str, ...]
    notes: tuple[str, ...]
    comparison: Comparison | None
    param: Path | None
    written_unix_s: float

    @property
    def coefficients(self) -> tuple[Value, ...]:
        """The values without those derived from others."""
        return tuple(value for value in self.values if value.name in OF_HULL)

    @property
    def count(self) -> int:
        """Number of coefficients that have a value."""
        return sum(math.isfinite(value.value) for value in self.coefficients)


def load_identified(dive: Path, receipts: Path, unkept: Any = None) -> Identified | None:
    """Load the identification of a dive; None if it is missing or not an identification.

    `unkept` is a new result that could not be written there. It has no parameters to upload: any file there belongs
    to an earlier result, or lacks a matching result. A parameter file older than the result is not its own either, for
    an identification without values writes none.
    """
    at = results_beside(dive)
    result, param = at["--json"], at["--param"]
    try:
        accepted = accepted_before(param, receipts)
        if unkept is not None:
            return _parsed(unkept, accepted, None, math.nan)
        data = from_json(read_small(result))
        return _parsed(data, accepted, param if newer(param, result) else None, result.stat().st_mtime)
    except (OSError, ValueError, KeyError, TypeError):
        return None


def accepted_before(param: Path, receipts: Path) -> dict[str, float]:
    """Last accepted values by coefficient, for the configuration of the file `param`."""
    try:
        ids = read_parameters(param)
    except ParamError:
        return {}
    accepted = last_accepted(receipts)
    known = {name: coefficient_of(name) for name in ids if name in accepted}
    return {
        coefficient.name: accepted[name].value
        for name, coefficient in known.items()
        if coefficient is not None
    }


def _parsed(
    data: Mapping[str, Any], accepted: Mapping[str, float], param: Path | None, written_unix_s: float
) -> Identified:
    doubts = tuple(dict.fromkeys(str(doubt["sentence"]) for doubt in data["doubts"]))
    scale = data["thrust_scale"]
    sentences = [entry["sentence"] for entry in (*data["null_directions"], *([scale] if scale else []))]
    notes = dict.fromkeys((*sentences, *data["notes"]))
    second = data.get("comparison")
    return Identified(
        str(data["dive"]["name"]),
        str(data["configuration"]),
        str(data["method"]),
        str(data["outcome"]),
        tuple(_value(entry, accepted) for entry in data["parameters"]),
        doubts,
        tuple(str(note) for note in notes if note not in doubts),
        Comparison(str(second["method"]), str(second["outcome"]), tuple(map(str, second["sentences"])))
        if second
        else None,
        param,
        written_unix_s,
    )


def _value(data: Mapping[str, Any], accepted: Mapping[str, float]) -> Value:
    numbers = (data[key] for key in ("value", "low95", "high95", "given_thrust_low95", "given_thrust_high95"))
    value, low, high, *given = (
        math.nan if number is None or not data["identifiable"] else float(number) for number in numbers
    )
    name = str(data["name"])
    accepted_value = accepted.get(name, math.nan)
    return Value(
        name,
        str(data["unit"]),
        value,
        low,
        high,
        (given[0], given[1]),
        data.get("reason", ""),
        accepted_value,
    )


@dataclass(frozen=True)
class Passes:
    """One parameter: `value` after each pass and `half` of its interval, both of the same length, in its own unit."""

    name: str
    value: Array
    half: Array


def passes_of(reports: Sequence[Report]) -> tuple[Passes, ...]:
    """Collect the passes of each parameter from the reports; NaN for a pass that omits it."""
    steps = [values for report in reports if not report.answered and (values := report.values)]
    names = dict.fromkeys(name for values in steps for name in values)
    nothing = (np.nan, np.nan)
    return tuple(
        Passes(name, *np.array([values.get(name, nothing) for values in steps], dtype=float).T)
        for name in names
    )


def converging(
    passes: Passes, unit: str, cells: int, rows: int, others: str = "", *, refused: bool = False
) -> Lines:
    """The present value and interval, and curves of both: the value as a solid step curve, the interval's ends
    dotted. `others` are the values by other methods; while they are "", the number of passes takes their place.
    `refused`: the method has answered, and does not tell this parameter: its last pass is no value.
    """
    value, half = passes.value, passes.half
    head: Line = ((f"{passes.name:<6}", "plain"),)
    if refused:
        head = (*head, (f"{NOTHING:>8} {REFUSED}", "warn"))
    else:
        head = (
            *head,
            (f"{significant(float(value[-1])):>8}", "strong"),
            (f" ± {significant(float(half[-1]), 2)}", "reference"),
            (f" {unit}", "quiet"),
        )
    if width(head) > cells:
        # Where a column is too narrow for a table of values, the unit is worth more than their places.
        head = ((passes.name, "plain"), *((f" {text.strip()}", role) for text, role in head[1:]))
    across = cells - AXIS_CELLS
    if rows < 2 or across < 1:
        return (_cut(head, cells),)
    head = apart(head, ((others or f"pass {len(value)}", "reference" if others else "quiet"),), cells)
    bottom, top = _range(value, half)
    count = max(len(value), LEAST_PASSES)
    low, middle, high = (
        _dots(curve, count, across, bottom, top, rows - 1) for curve in (value - half, value, value + half)
    )
    measured, asked = braille(middle), braille(dotted(low | high))
    # An interval narrower than a row shows only in the cells of the value.
    measured = np.where(measured != BLANK, measured | asked, measured)
    # A single row can't carry labels for both ends.
    labels = {0: significant(top), rows - 2: significant(bottom)} if rows > 2 else {}
    return (_cut(head, cells), *framed(measured, asked, labels, "accent"))


def _range(value: Array, half: Array) -> tuple[float, float]:
    """Lowest and highest end of any interval, so that all rows are used."""
    low, high = float(np.nanmin(value - half)), float(np.nanmax(value + half))
    least = max(LEAST_SPAN * max(abs(low), abs(high)), SMALLEST)
    return (low, high) if high - low >= least else (low - least / 2, high + least / 2)


def _dots(curve: Array, count: int, across: int, low: float, high: float, rows: int) -> Dots:
    """Dots of a step curve over `count` passes, with vertical joints; blank for passes that have not happened yet."""
    padded = np.append(curve, np.full(count - len(curve), np.nan))
    columns = padded[(np.arange(ACROSS * across) * count) // (ACROSS * across)]
    before = np.append(columns[:1], columns[:-1])
    known = np.isfinite(columns)
    bottom = np.where(known, np.fmin(columns, before), np.nan)
    return dots(bottom, np.where(known, np.fmax(columns, before), np.nan), low, high, rows)


def _cut(line: Line, cells: int) -> Line:
    room, spans = cells, []
    for text, role in line:
        spans.append((text[:room], role))
        room -= len(spans[-1][0])
    return tuple(span for span in spans if span[0])


def progress(state: JobState, now_s: float, cells: int, goes_on: bool = False) -> Lines:
    """A bar per method and the elapsed time; once the values exist, a bar for the page being written.

    `goes_on`: the screen Parameters opens as soon as the values exist.
    """
    newest = {report.of: report for report in state.reports}
    page = newest.pop(PAGE, None)
    newest.pop(UNKEPT, None)
    if page is not None and state.runs:
        return (_bar(PAGE, page, cells),)
    clock = stopwatch((state.ended_s if state.ended_s is not None else now_s) - state.began_s)
    then = "then parameters, " if goes_on and state.runs else ""
    lines: list[Line] = [*titled(f"{_stage(state)} {_dive(state)}", then + clock, cells)]
    if not newest and state.runs:
        lines.append((("reading the dive", "quiet"),))
    if any(report.answered for report in newest.values()):
        newest = {method: _beside(report, newest) for method, report in newest.items()}
    return (*lines, *(_bar(method, report, cells) for method, report in newest.items()))


def _beside(report: Report, all_of: Mapping[str, Report]) -> Report:
    """The report of a method that has answered, with where its values stand while another is still at work."""
    waits = report.answered and not all(other.answered for other in all_of.values())
    return replace(report, words=f"{report.words}: its values stand behind vs") if waits else report


def _stage(state: JobState) -> str:
    if state.done is None:
        return "STOPPING" if state.cancelled else "IDENTIFYING"
    if state.cancelled and not state.draws:
        return "STOPPED"
    answered = state.draws or state.unkept is not None
    return "IDENTIFIED" if answered or state.done.code in AFTER_A_RUN else "FAILED"


def _dive(state: JobState) -> str:
    return Path(state.words[1]).name if len(state.words) > 1 else ""


def _bar(method: str, report: Report, cells: int) -> Line:
    full = round(min(max(report.share, 0.0), 1.0) * BAR_CELLS)
    line: Line = (
        (f"{cut(method, NAME_CELLS):<{NAME_CELLS}}", "plain"),
        ("█" * full, "accent"),
        ("░" * (BAR_CELLS - full), "rule"),
        (f" {100 * report.share:>3.0f} %  ", "strong"),
    )
    return (*line, (cut(report.words, max(cells - width(line), 0)), "quiet"))


def curves(reports: Sequence[Report], cells: int, rows: int) -> Lines:
    """A chart per reported parameter in a grid that fills the space, next to it the values of other methods."""
    passes, answered = passes_of(reports), answers(reports)
    if not passes:
        return _answers(answered, cells)
    method_shown = next(item.of for item in reports if item.values and not item.answered)
    compared = {method: values for method, values in answered.items() if method != method_shown}
    told = answered.get(method_shown)
    columns = 4 if cells >= WIDE else 2
    below = -(-len(passes) // columns)
    each, (high, left) = cells // columns, divmod(rows, below)
    lines: list[Line] = []
    for row in range(below):
        charts = [
            converging(
                item,
                _unit(item.name),
                each - BETWEEN_CHARTS,
                high + (row < left),
                _values(compared, item.name),
                refused=told is not None and item.name not in told,
            )
            for item in passes[row * columns : (row + 1) * columns]
        ]
        for y in range(max(map(len, charts))):
            lines.append(_abreast([chart[y] if y < len(chart) else () for chart in charts], each))
    return tuple(lines)


def answers(reports: Sequence[Report]) -> dict[str, dict[str, tuple[float, float]]]:
    """Answers by method: each value with half of its 95 % interval."""
    return {report.of: dict(report.values) for report in reports if report.answered and report.values}


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


def _values(answered: Mapping[str, Mapping[str, tuple[float, float]]], name: str) -> str:
    """Values of a parameter by the other methods that have answered."""
    return ", ".join(
        f"vs {significant(by_name[name][0]) if name in by_name else NOTHING}" for by_name in answered.values()
    )


def _unit(name: str) -> str:
    return OF_HULL[name].unit if name in OF_HULL else ""


def _abreast(parts: Sequence[Line], each: int) -> Line:
    *before, last = parts
    return (*(span for part in before for span in (*part, (" " * (each - width(part)), "plain"))), *last)


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
    return hanging(state.failure, "bad", cells)


def result(shown: Identified, cells: int) -> Lines:
    """The outcome in a sentence, the doubts in full, parameters next to last accepted values; then reasons and notes,
    beside the parameters as far as there is room.
    """
    good = shown.outcome == "converged" and not shown.doubts
    lines: list[Line] = [
        *titled(f"{shown.dive} {shown.configuration}", f"{day(shown.written_unix_s)} UTC", cells)
    ]
    lines += hanging(_outcome(shown), "strong" if good else "warn", cells)
    for sentence in shown.comparison.sentences if shown.comparison else ():
        lines += hanging(sentence, "plain", cells)
    for doubt in shown.doubts:
        lines += hanging(f"▲ {doubt}", "warn", cells)
    reasons = list(dict.fromkeys(value.reason for value in shown.values if value.reason))
    rows: list[Line] = []
    if shown.count:
        again = any(math.isfinite(value.accepted) for value in shown.values)
        columns = (NAMED, ACCEPTED, *AFTER) if again else (NAMED, AFTER[0], *AFTER[2:])
        rows.append(_fitting(tuple((head, "quiet") for head in columns), cells))
        rows += [_fitting(_row(value, reasons, again=again), cells) for value in shown.values]
    left = max(map(width, rows), default=0) + BETWEEN
    height = len(rows) if cells - left >= LEAST_SIDE_CELLS else 0
    side: list[Line] = []
    below: list[Line] = []
    remarks: list[tuple[str, Role]] = [(f"{n}: {reason}", "warn") for n, reason in enumerate(reasons, 1)]
    for remark, role in (*remarks, *((note, "quiet") for note in shown.notes)):
        if len(side) < height:
            side += hanging(remark, role, cells - left)
        else:
            below += hanging(remark, role, cells)
    return (*lines, *(_abreast(pair, left) for pair in zip_longest(rows, side, fillvalue=())), *below)


def _outcome(shown: Identified) -> str:
    second = shown.comparison
    other = f"; by {second.method}: {second.outcome}" if second else ""
    counts = f"{shown.count} of {len(shown.coefficients)}"
    return f"{capital(shown.outcome)}: {counts} coefficients identified by {shown.method}{other}."


def _fitting(columns: Line, cells: int) -> Line:
    return tuple(span for n, span in enumerate(columns) if width(columns[: n + 1]) <= cells)


def _row(value: Value, reasons: Sequence[str], *, again: bool) -> Line:
    """A row of the table; `again`: some values were accepted before."""
    blank: Line = ((" " * len(ACCEPTED), "quiet"),) if again else ()
    if not math.isfinite(value.value):
        why = f"no, see {1 + reasons.index(value.reason)}" if value.reason else "no"
        return ((f"{value.name:<7}", "plain"), *blank, (f"{'--':>8}  ", "quiet"), (why, "warn"))
    interval = f"{significant(value.low95, 3)} … {significant(value.high95, 3)}"
    given = " … ".join(map(significant, value.given))
    was, change = blank, ((" " * len(AFTER[1]), "quiet"),) if again else ()
    if math.isfinite(value.accepted):
        was = ((f"{significant(value.accepted):>8}", "plain"), (" →", "quiet"))
        change = ((f"{_signed(100 * value.change):>7} %", "warn" if value.is_news else "plain"),)
    return (
        (f"{value.name:<7}", "plain"),
        *was,
        (f"{significant(value.value):>8}", "strong"),
        *change,
        (f"  {value.unit:<12}", "quiet"),
        (f"  {interval:<15}", "plain"),
        (f"  {given:<17}", "quiet"),
    )


def _signed(value: float) -> str:
    text = number(value, 1)
    return f"+{text}" if value > 0 and float(text) else text


def words_for(dive: str, vehicle: str, at: Mapping[str, object]) -> tuple[str, ...]:
    """The command line of the verb: both methods, and results where `at` says."""
    targets = [word for option, path in at.items() for word in (option, str(path))]
    return ("identify", dive, "--vehicle", vehicle, *targets)
