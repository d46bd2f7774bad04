"""Two methods beside each other in a report."""

from identify.comparison import Comparison
from identify.identification import Estimate
from identify.report.page import Section, Table
from identify.report.text import MISSING, significant, unit, with_interval

WHY_STANDS = "Why, as far as it can be told, stands in the warning beside the parameters above."


def comparison_section(compared: Comparison) -> Section:
    """What both methods say of each parameter; a warning names what they disagree on."""
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
        f"{heading[0].upper()}{heading[1:]}",
        "" if warning else "\n\n".join(compared.sentences),
        (Table(columns, rows, caption),) if rows else (),
        (),
        warning,
    )


def _told(one: Estimate) -> str:
    if not one.identifiable:
        return MISSING
    value, interval = with_interval(one.value, one.low95, one.high95)
    return value if interval == MISSING else f"{value} ({interval})"
