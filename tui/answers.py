"""Answers in a terminal: an identification, a comparison of two methods, a diagnosis, the tables of a batch."""

from collections.abc import Mapping, Sequence

from rich.console import Console

from bridge.vehicle.coefficients import BY_NAME
from identify.batch.drift import Drift
from identify.batch.page import MARKS, doubt_mark
from identify.batch.rows import Row, Value, names_in
from identify.comparison import Comparison
from identify.diagnose import against, wording
from identify.diagnose.against import Against
from identify.diagnose.result import Diagnosis
from identify.dive import Dive
from identify.identification import Estimate, Identification
from identify.ingest.open import utc
from identify.report.identification import further_remarks
from identify.report.tables import standard_error
from tui import show
from tui.show import Table

COLUMNS = ("name", "value", "low 95 %", "high 95 %", "unit", "std, %", "strongest partner")
PRIOR_COLUMN = "prior, %"
LAST_COLUMN = "identifiable"


def tell(console: Console, dive: Dive, answer: Identification) -> None:
    """Show the result as a table with its notes; if a single reason left nothing to show, only that reason."""
    reasons = list(dict.fromkeys(p.reason for p in answer.parameters if not p.identifiable))
    title = f"{dive.name}: {answer.method}, configuration {answer.configuration}, {answer.outcome.value}"
    if len(reasons) == 1 and not any(p.identifiable for p in answer.parameters):
        show.say(console, f"{title}\n{reasons[0]}")
    else:
        priors = any(p.share_from_prior for p in answer.parameters)
        columns = (*COLUMNS, *((PRIOR_COLUMN,) if priors else ()), LAST_COLUMN)
        rows = [_row(parameter, reasons, priors) for parameter in answer.parameters]
        numbers = ("value", "low 95 %", "high 95 %", "std, %", PRIOR_COLUMN)
        show.put(console, show.table(title, columns, rows, numbers))
        for number, reason in enumerate(reasons, start=1):
            show.say(console, f"{number}: {reason}")
    doubts = [doubt.sentence for doubt in answer.doubts]
    for doubt in dict.fromkeys(doubts):
        show.say(console, f"warning: {doubt}")
    for note in dict.fromkeys((*answer.sentences, *dive.notes)):
        if note not in doubts:
            show.say(console, f"note: {note}")


def tell_comparison(console: Console, compared: Comparison) -> None:
    """Show both methods' values side by side, and why any is missing; disagreements are among the first's doubts."""
    methods = (compared.first.method, compared.second.method)
    rows = [
        (
            d.name,
            *(
                show.number(estimate.value) if estimate.identifiable else "-"
                for estimate in (d.first, d.second)
            ),
            d.first.unit,
            show.number(d.distance, 2),
            "disagree" if d.disagrees else "",
        )
        for d in compared.differences
        if d.first.identifiable or d.second.identifiable
    ]
    if rows:
        title = f"{methods[0]} beside {methods[1]} ({compared.second.outcome.value})"
        columns = ("name", *methods, "unit", "apart, std", "beyond intervals")
        show.put(console, show.table(title, columns, rows, (*methods, "apart, std")))
    if not compared.disagreements:
        for sentence in compared.sentences:
            show.say(console, f"note: {sentence}")
    for sentence in further_remarks(compared):
        show.say(console, f"note: {sentence}")


def _row(parameter: Estimate, reasons: Sequence[str], priors: bool) -> tuple[str, ...]:
    values = (parameter.value, parameter.low95, parameter.high95)
    partner = parameter.partner if parameter.partner and parameter.partner.is_close else None
    return (
        parameter.name,
        *(show.number(value) for value in values),
        parameter.unit,
        show.number(100 * standard_error(parameter), 2),
        f"{partner.name} {partner.correlation:+.2f}" if partner else "-",
        *(
            (f"{100 * parameter.share_from_prior:.0f}" if parameter.share_from_prior else "-",)
            if priors
            else ()
        ),
        "yes" if parameter.identifiable else f"no, see {1 + reasons.index(parameter.reason)}",
    )


def tell_against(console: Console, comparison: Against) -> None:
    """Print the verdict on a simulator, then all other sentences, indented."""
    show.say(console, against.verdict_sentence(comparison))
    for line in (
        *against.cause_lines(comparison),
        *against.lines(comparison),
        *(f"Where: {line}." for line in wording.where_lines(comparison.vehicle)),
        *wording.shrink_lines(comparison.vehicle),
        *wording.next_lines(comparison.vehicle),
        *comparison.vehicle.notes,
        *(f"Of the simulator: {note}" for note in comparison.simulator.notes),
    ):
        show.say(console, f"  {line}")


def tell_diagnosis(console: Console, diagnosis: Diagnosis) -> None:
    """Print the verdict, the causes and their parameters, where the gap lies, how far it shrinks, the next dive."""
    show.say(console, wording.verdict_sentence(diagnosis))
    lines = (
        *wording.cause_lines(diagnosis),
        *wording.character_lines(diagnosis),
        *_where(diagnosis),
        *wording.disturbance_line(diagnosis.gap.disturbance),
        *wording.shrink_lines(diagnosis),
        *wording.gain_lines(diagnosis),
        *wording.next_lines(diagnosis),
        *diagnosis.notes,
    )
    for line in lines:
        show.say(console, f"  {line}")


def _where(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Lines on the largest parts of the gap; none when the verdict is "no_gap"."""
    if diagnosis.verdict == "no_gap":
        return ()
    lines = (f"Where: {line}." for line in wording.where_lines(diagnosis))
    return (*lines, *filter(None, (wording.where_note(diagnosis.gap),)))


PARAMETERS_WIDE = 4
"""Number of parameters that fit into 80 columns next to number and date."""


def dive_table(rows: Sequence[Row]) -> Table:
    """Every dive, with the number that the other tables use for it, and the reason if it gave no result."""
    lines = [
        (str(number), utc(row.unix_s), row.configuration or "-", f"{row.dive}: {row.error or _ended(row)}")
        for number, row in enumerate(rows, start=1)
    ]
    return show.table("dives", ("no.", "date, UTC", "configuration", "dive"), lines, numbers=("no.",))


def parameter_tables(
    rows: Sequence[Row], group: Sequence[Row], drift: Drift, configuration: str
) -> list[Table]:
    """The parameters of one configuration's dives, with half the width of each 95 % interval."""
    names = names_in(group)
    tables = []
    for first in range(0, len(names), PARAMETERS_WIDE):
        shown = names[first : first + PARAMETERS_WIDE]
        columns = [f"{name} {BY_NAME[name].unit}" for name in shown]
        lines = [
            (
                f"{1 + rows.index(row)}{'' if drift.counts(row) else '*'}",
                utc(row.unix_s),
                *(_cell(row.values.get(name)) + doubt_mark(row, name, drift) for name in shown),
            )
            for row in group
        ]
        title = f"{configuration}: {', '.join(shown)}, with half of their 95 % intervals"
        title += "" if all(map(drift.counts, group)) else "; *: in no trend, for it did not converge"
        title += f"; {MARKS}" if any(name in row.doubted for row in group for name in shown) else ""
        tables.append(show.table(title, ("no.", "date, UTC", *columns), lines, numbers=("no.", *columns)))
    return tables


def trend_table(drift: Drift, configuration: str) -> Table:
    """Change of each parameter from the first dive to the last, in per cent of its value at the first."""
    lines = []
    for name, trend in drift.trends.items():
        change, low, high = (f"{trend.percent(v):+.1f}" for v in (trend.change, trend.low95, trend.high95))
        word = ("up" if trend.change > 0 else "down") if name in drift.real else "none shown"
        lines.append((name, str(trend.count), show.number(trend.mean), change, low, high, word))
    columns = ("name", "dives", "mean", "change %", "low 95 %", "high 95 %", "trend")
    return show.table(f"{configuration}: first dive to last", columns, lines, numbers=columns[1:6])


def drifts_to_json(drifts: Mapping[str, Drift]) -> dict[str, object]:
    """The trends as plain data, by configuration."""
    return {
        configuration: {
            "story": drift.story.name.lower(),
            "sentence": drift.sentence,
            "despite_doubts": drift.despite_doubts,
            "parameters": {
                name: {**vars(trend), "significant": name in drift.real}
                for name, trend in drift.trends.items()
            },
        }
        for configuration, drift in drifts.items()
    }


def _ended(row: Row) -> str:
    """Outcome of a dive: `converged, but doubts M_w`."""
    names = [name for name in names_in([row]) if name in row.doubted]
    if not names:
        return row.outcome
    return f"{row.outcome}, {'but ' if row.converged else ''}doubts {', '.join(names)}"


def _cell(value: Value | None) -> str:
    if value is None:
        return "-"
    half = (value.high95 - value.low95) / 2
    return f"{show.number(value.value)} ±{show.number(half, 2)}"
