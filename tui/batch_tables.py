"""The tables of a batch in a terminal: the dives, their parameters by configuration, the trends."""

from collections.abc import Mapping, Sequence

from bridge.vehicle.coefficients import BY_NAME
from identify.batch.drift import Drift
from identify.batch.page import MARKS, doubt_mark
from identify.batch.rows import Row, Value, names_in
from identify.dates import utc
from tui import show
from tui.show import Table

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
