"""Sections of the page on the campaigns, the validation dives and the configurations."""

import math

from bench.reproduce import figures
from bench.reproduce.comparisons import (
    SPEEDING_UP,
    SPEEDING_UP_LATE,
    Comparison,
    configurations,
    table_5,
)
from bench.reproduce.dives import Campaign
from bench.reproduce.published import PARAMETERS, POWER_RISE, POWER_SPEED, TABLE_5, TRANSIENT
from bench.reproduce.run import Reproduction
from bridge.vehicle.config import Configuration
from identify.report import cells
from identify.report.cells import Cell
from identify.report.figures import track
from identify.report.page import Figure, Section, Table
from identify.validation.tracking import METHOD, compare
from identify.words import MISSING, count, fixed, seconds, unit

OVERSHOOT = (
    "The paper calls the overshoot in Fig. 14 significant and gives no number; a vehicle with linear damping coasts "
    "just the angle by which it lagged, so here the inertia that eq. 16 lacks makes a lag and no overshoot (see below)."
)
TRAINED = 0.05
DECIMALS = {"N": 2, "N m": 2, "m/s": 4, "s": 2, "°": 1}
PLACES = {"survey": ("Table 3", "Fig. 6", "Fig. 7"), "hovering": ("Table 4", "Fig. 8", "Fig. 9")}
ROWS = {"X_udot": "M_u", "Y_vdot": "M_v", "I_r": "I_r", "D_u": "D_u", "D_v": "D_v", "D_r": "D_r"}
"""The tables' parameter names, and the coefficient behind each: the paper's X is M_u, its Y M_v, less the dry mass."""


def campaign_section(campaign: Campaign, shape: Configuration) -> Section:
    table, path, curves = PLACES[campaign.configuration]
    epochs = len(campaign.curves.values) - 1
    drawn = [
        figures.training(
            campaign,
            f"{curves} training",
            f"As {curves}: each parameter over {epochs} epochs. Masses are totals, {shape.dry_mass_kg:g} kg "
            "of them dry; they start there, as the paper's do. The training ends where the loss is least in "
            "closed form.",
        )
    ]
    if walked := track(campaign.dive):
        drawn.insert(0, Figure(f"{path} path", f"As {path}. {walked.caption}", walked.draw))
    words = (
        f"{count(campaign.paper.samples)} windows of samples from {seconds(campaign.dive.duration_s)}. Our values are "
        f"those of the method {campaign.ours.method}: {campaign.ours.outcome.value}."
    )
    tables = (parameter_table(campaign, shape, table),)
    return Section(f"{table}: {campaign.configuration}", words, tables, tuple(drawn), _unended(campaign))


def _unended(campaign: Campaign) -> str:
    """Return a warning while the trained values are still far from the minimum of their loss, otherwise ""."""
    apart = {
        name: abs(value - campaign.closed[name]) / max(value, campaign.closed[name])
        for name, value in campaign.paper.values().items()
    }
    far = [f"{name} by {fixed(100 * share, 0)} %" for name, share in apart.items() if share > TRAINED]
    if not far:
        return ""
    return (
        "Warning: the training had not ended\n\n"
        f"It is off the least of its loss in {', '.join(far)}. The validation dives fly these values: give "
        "--network more epochs."
    )


def parameter_table(campaign: Campaign, shape: Configuration, table: str) -> Table:
    published = PARAMETERS[campaign.configuration]
    by_paper = campaign.paper.values()
    rows = []
    for name, coefficient in ROWS.items():
        if coefficient not in by_paper:
            continue
        less = shape.dry_mass_kg if name != coefficient else 0.0
        ours = campaign.ours[coefficient]
        ends = (cells.significant(end - less, 4) for end in (ours.low95, ours.high95))
        interval = cells.joined(cells.Form.RANGE, *ends)
        values = (
            campaign.truth[coefficient] - less,
            by_paper[coefficient] - less,
            campaign.closed[coefficient] - less,
            ours.value - less,
        )
        rows.append(
            (
                f"{name}, {unit(ours.unit)}",
                cells.significant(published[name].value, 4) if name in published else "not printed",
                *(cells.significant(value, 4) for value in values),
                interval if ours.identifiable else MISSING,
            )
        )
    columns = (
        "Parameter",
        "Paper",
        "Simulated vehicle",
        "Its method, trained",
        "Least of its loss",
        "Ours",
        "95 % interval",
    )
    return Table(columns, tuple(rows), f"{table} beside the same from the simulated vehicle.")


def shadow_section(done: Reproduction, numbers: tuple[Comparison, ...]) -> Section:
    return Section(
        "Feed-forward computed, PID steers: Figs 10 and 11",
        "The turn is half a circle in the 15 s of Fig. 11 (the paper does not give its angle), with the "
        "linear heading reference of the paper and, as in its eq. 16, without inertia.",
        (_numbers(numbers, ("Fig. 10", "Fig. 11")),),
        (
            figures.surge_or_sway(
                done.dives["surge shadow"],
                0,
                "fig 10 surge in shadow",
                "As Fig. 10: survey, surge at 0.5 m/s.",
            ),
            figures.turning(
                done.dives["heading shadow"],
                "fig 11 turn in shadow",
                "As Fig. 11: survey, a linear heading reference.",
            ),
        ),
    )


def alone_section(done: Reproduction, numbers: tuple[Comparison, ...]) -> Section:
    surge, hovering = done.dives["surge alone"], done.dives["hovering alone"]
    return Section(
        "Feed-forward alone: Figs 12 to 16",
        "The simulated vehicle has linear damping and thrusters that are known exactly, as the paper's "
        f"model has it. A real one has neither, so the smaller errors here are no merit of a method. {METHOD} "
        f"{_late_words(numbers)} {OVERSHOOT}",
        (_numbers(numbers, tuple(f"Fig. {n}" for n in range(12, 17))),),
        (
            figures.surge_or_sway(surge, 0, "fig 12 surge alone", "As Fig. 12: survey, surge at 0.5 m/s."),
            figures.phases_apart(
                surge,
                TRANSIENT.value,
                "fig 13 phases of surge",
                "As Fig. 13: the same, speeding up and steady.",
            ),
            figures.turning(
                done.dives["heading alone"],
                "fig 14 turn alone",
                "As Fig. 14: survey, a linear heading reference.",
            ),
            figures.surge_or_sway(
                hovering, 0, "fig 15 surge alone", "As Fig. 15: hovering, surge at 0.4 m/s."
            ),
            figures.surge_or_sway(
                hovering,
                1,
                "fig 16 sway alone",
                "As Fig. 16: hovering, sway at 0.3 m/s (the paper gives no speed).",
            ),
        ),
    )


def _late_words(numbers: tuple[Comparison, ...]) -> str:
    """How much of Fig. 15's error while speeding up is the thrusters' delay, which the paper does not separate."""
    with_it, without = (
        next(n for n in numbers if (n.figure, n.what) == ("Fig. 15", quantity))
        for quantity in (SPEEDING_UP, SPEEDING_UP_LATE)
    )
    by_paper, by_ours = (
        f"from {fixed(before, 4)} to {fixed(after, 4)} m/s"
        for before, after in ((with_it.by_paper, without.by_paper), (with_it.by_ours, without.by_ours))
    )
    return (
        "Of the error while speeding up the paper says in Fig. 13 that the thrusters' delay is out of it, and in Figs "
        f"15 and 16 it says nothing: taking the delay out brings ours in Fig. 15 {by_paper} with its values and "
        f"{by_ours} with ours."
    )


def both_section(done: Reproduction, numbers: tuple[Comparison, ...]) -> Section:
    both = done.dives["hovering both"]
    runs = table_5(done)
    rows = compare(runs)
    shown = tuple(
        (
            f"{row.axis}, {row.phase.lower()}",
            cells.fixed(TABLE_5[row.axis, row.phase], 4),
            *(cells.fixed(value, 4) for value in row.values),
        )
        for row in rows
        if (row.axis, row.phase) in TABLE_5
    )
    caption = (
        "Table 5, mean absolute tracking error in m/s. FF: feed-forward alone; its and ours: the values of "
        f"the paper's method, and ours. {METHOD}"
    )
    return Section(
        "Both: Fig. 17 and Table 5",
        "",
        (_numbers(numbers, ("Fig. 17",)), Table(("Motion and phase", "Paper, both", *runs), shown, caption)),
        (
            figures.surge_or_sway(
                both, 0, "fig 17a surge with both", "As Fig. 17 (a): hovering, surge at 0.4 m/s."
            ),
            figures.surge_or_sway(
                both, 1, "fig 17b sway with both", "As Fig. 17 (b): hovering, sway at 0.3 m/s."
            ),
        ),
    )


def _numbers(numbers: tuple[Comparison, ...], places: tuple[str, ...]) -> Table:
    rows = tuple(
        (
            f"{n.figure}: {n.what}",
            n.unit,
            _fixed(n.paper, n.unit) if math.isfinite(n.paper) else "no number",
            _fixed(n.by_paper, n.unit),
            _fixed(n.by_ours, n.unit),
        )
        for n in numbers
        if n.figure in places
    )
    columns = ("Number", "Unit", "Paper", "Ours, its values", "Ours, our values")
    return Table(columns, rows, "Flown with the values of the paper's method, and with ours.")


def _fixed(value: float, unit_text: str) -> Cell:
    return cells.fixed(value, DECIMALS[unit_text])


def configuration_section(done: Reproduction) -> Section:
    ratios, before, after = configurations(done)
    rows = tuple(
        (
            f"{ratio.what}, hovering over survey",
            *(cells.fixed(value, 3) for value in (ratio.paper, ratio.by_paper, ratio.by_ours, ratio.truth)),
        )
        for ratio in ratios
    )
    thrust, ideal = after.thrust_n / before.thrust_n, after.ideal_power / before.ideal_power
    speed = POWER_SPEED.value
    measured = (
        (
            f"sum of |thrust| at {speed:g} m/s",
            cells.fixed(before.thrust_n, 2, "N"),
            cells.fixed(after.thrust_n, 2, "N"),
            cells.fixed(thrust, 3),
        ),
        (
            f"sum of |thrust|^1.5 at {speed:g} m/s",
            cells.significant(before.ideal_power),
            cells.significant(after.ideal_power),
            cells.fixed(ideal, 3),
        ),
    )
    return Section(
        "The configurations compared: eq. 17",
        "Eq. 17 takes the thrusters of survey for parallel to x. Those of the simulated vehicle stand at 8° "
        f"there and at the paper's 34° in hovering. The paper measured {100 * POWER_RISE.value:.0f} % more "
        "power; the simulator has no batteries to ask, so the second table has thrust alone, from the pulse "
        "widths of the campaigns.",
        (
            Table(
                ("Ratio", "Paper", "Its method", "Ours", "Simulated vehicle"),
                rows,
                "Rise from survey to hovering, as a ratio.",
            ),
            Table(
                ("In the campaigns", "Survey", "Hovering", "Ratio"),
                measured,
                "What steady surge took of the thrusters; |thrust|^1.5 goes with an ideal propeller's power at rest.",
            ),
        ),
    )
