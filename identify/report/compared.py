"""Comparison of two methods in a report, including why either gives fewer values than the other."""

import re

from identify.comparison import Comparison
from identify.identification import Doubt, Estimate, Identification, Outcome
from identify.report.page import Section, Table
from identify.words import MISSING, capital, significant, unit, with_interval

WHY_STANDS = "Why, as far as it can be told, stands in the warning beside the parameters above."


def comparison_section(compared: Comparison) -> Section:
    """Results of both methods for each parameter; a warning names the parameters on which they disagree."""
    first, second = compared.first, compared.second
    columns = ("Parameter", first.method, second.method, "Unit", "Apart, standard errors", "")
    rows = tuple(
        (
            d.first.symbol,
            _told(d.first),
            _told(d.second),
            unit(d.first.unit),
            significant(d.distance, 2),
            "DISAGREE" if d.disagrees else "",
        )
        for d in compared.differences
        if d.first.identifiable or d.second.identifiable
    )
    heading = f"{first.method} beside {second.method}: {first.dive}"
    caption = (
        "Values with 95 % intervals. Apart: their difference over the larger of the two standard errors."
    )
    apart = ", ".join(d.first.symbol for d in compared.disagreements)
    warning = f"Warning: the methods disagree on {apart}\n\n{WHY_STANDS}" if apart else ""
    return Section(
        capital(heading),
        "\n\n".join((*(() if warning else compared.sentences), *told_beside(compared))),
        (Table(columns, rows, caption),) if rows else (),
        (),
        warning,
    )


def told_beside(compared: Comparison) -> tuple[str, ...]:
    """Further statements on both methods: outcome, doubts, reasons for missing values.

    That is: the outcome of the second if it did not converge, the doubts that only the second raises, and why either
    method gives no value, grouped by reason. If the first method gives no value at all, its own section already says
    why.
    """
    first, second = compared.first, compared.second
    ended = (
        ()
        if second.outcome is Outcome.CONVERGED
        else (f"{capital(second.method)} ended with '{second.outcome.value}'.",)
    )
    known = {_kind(doubt) for doubt in first.doubts}
    doubts_of_second = dict.fromkeys(doubt.sentence for doubt in second.doubts if _kind(doubt) not in known)
    doubts = tuple(f"{capital(second.method)}: {sentence}" for sentence in doubts_of_second)
    return (*ended, *doubts, *(_gaps(first, compared) if first.values() else ()), *_gaps(second, compared))


def _kind(doubt: Doubt) -> tuple[tuple[str, ...], str]:
    """Subject of a doubt and its words up to the first figure: from there on the same doubt of two methods differs."""
    return doubt.about, re.split(r"\d", doubt.sentence, maxsplit=1)[0]


def _gaps(method: Identification, compared: Comparison) -> tuple[str, ...]:
    """Why a method has no value while the other has one, or no value at all; a line for each reason."""
    names: dict[str, list[str]] = {}
    bare = not method.values()
    for d in compared.differences:
        ours, theirs = (d.first, d.second) if method is compared.first else (d.second, d.first)
        if not ours.identifiable and (bare or theirs.identifiable):
            names.setdefault(ours.reason, []).append(d.name)
    nothing = bare and len(names) == 1
    return tuple(
        f"{capital(method.method)} gives {'nothing' if nothing else 'no ' + ', '.join(missing)}: {reason}"
        for reason, missing in names.items()
    )


def _told(one: Estimate) -> str:
    if not one.identifiable:
        return MISSING
    value, interval = with_interval(one.value, one.low95, one.high95)
    return value if interval == MISSING else f"{value} ({interval})"
