"""Section of a batch's page about causes: verdict and causes of each dive, and which effects' sizes drift."""

from collections.abc import Sequence

from identify.batch.causes import EffectSize
from identify.batch.effect_drift import EffectDrift, chance_words
from identify.batch.panels import Point, panel
from identify.batch.rows import Row
from identify.ingest.open import utc
from identify.report.page import Figure, Section, Table
from identify.report.plot import Panel, side_by_side
from identify.words import MISSING, fixed, unit_after, with_interval

HOW = (
    "Each dive is diagnosed by itself. A size drifts where a straight line through the sizes of all dives has a slope "
    "that chance would seldom give, among all effects looked at. Dives that do not name the effect count, too: "
    "their intervals hold noise alone, and the line takes what dives scatter beyond it into account."
)


def causes_section(configuration: str, rows: Sequence[Row], drifts: Sequence[EffectDrift]) -> Section:
    """The section of one configuration. `rows`: its dives with a diagnosis; `drifts`: of its effects."""
    tables = [_dives(rows)]
    if drifts:
        tables.insert(0, _drifts(drifts))
    figure = _figure(drifts)
    return Section(
        f"Causes in configuration {configuration}",
        "\n\n".join((*(drift.sentence for drift in drifts if drift.is_real), HOW)),
        tuple(tables),
        (figure,) if figure else (),
    )


def cause_words(item: EffectSize) -> str:
    """`weak thruster 3, 97 % probable: gain 0.83 (0.80 to 0.86)`, with its rivals."""
    alike = f" (or {', '.join(item.also)})" if item.also else ""
    possible = "" if item.named else "possible: "
    return f"{possible}{item.words}{alike}, {fixed(100 * item.probability, 0)} % probable: {item.size_words}"


def _dives(rows: Sequence[Row]) -> Table:
    lines = [
        (
            utc(row.unix_s),
            row.causes.verdict,
            "; ".join(cause_words(item) for item in row.causes.found) or MISSING,
            row.dive,
        )
        for row in rows
        if row.causes is not None
    ]
    return Table(
        ("Date, UTC", "Verdict", "Causes, with 95 % intervals", "Dive"), tuple(lines), "What each dive lacks."
    )


def _drifts(drifts: Sequence[EffectDrift]) -> Table:
    lines = []
    for drift in drifts:
        slope, interval = with_interval(drift.slope, drift.low95, drift.high95)
        word = ("up" if drift.slope > 0 else "down") if drift.is_real else "none shown"
        lines.append((
            drift.words, f"{drift.parameter}{unit_after(drift.unit)}", str(drift.trend.count), str(drift.named),
            f"{slope} per {drift.per}", interval, chance_words(drift.chance), word,
        ))  # fmt: skip
    columns = ("Effect", "Parameter", "Dives", "Named in", "Slope", "95 % interval", "By chance", "Drift")
    return Table(columns, tuple(lines), "How the sizes of effects drift.")


def _figure(drifts: Sequence[EffectDrift]) -> Figure | None:
    if not drifts:
        return None
    panels = [_panel(drift) for drift in drifts]
    words = "Each effect's size over the date of the dive."
    return Figure("sizes of effects over dives", words, side_by_side(panels))


def _panel(drift: EffectDrift) -> Panel:
    points = [
        Point(unix_s, size.value, size.value if size.low95 is None else size.low95,
              size.value if size.high95 is None else size.high95, named)
        for unix_s, size, named in drift.points
    ]  # fmt: skip
    span = drift.trend.first_s, drift.trend.last_s
    title = f"{drift.words}: {drift.parameter}{unit_after(drift.unit)}"
    return panel(title, points, ("named", "not named"), drift.trend, drift.is_real, span)
