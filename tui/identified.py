"""Show an identification in the terminal: its table, its reasons, its doubts, and a comparison with a second method."""

from collections.abc import Sequence

from rich.console import Console

from identify.comparison import Comparison
from identify.dive import Dive
from identify.identification import Estimate, Identification
from identify.report.compared import told_beside
from identify.report.tables import standard_error
from tui import show

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
    for sentence in told_beside(compared):
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
