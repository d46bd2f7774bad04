"""The numbers that the paper reads from its validation dives next to ours, and the questions that it leaves open."""

import math
from dataclasses import dataclass

from bench.reproduce import figures, published
from bench.reproduce.dives import SWAY_M_S
from bench.reproduce.measures import Demand, Term, demand, steady_speed, turned
from bench.reproduce.published import Published
from bench.reproduce.run import Reproduction
from bridge.vehicle.config import VehicleFile
from identify.report import cells
from identify.report.page import Section, Table
from identify.validation.tracking import AxisErrors, TrackingErrors, lever_of, tracking_errors
from identify.words import MISSING, fixed, significant, unit, with_interval

APART_STEADY, APART_TURNING = "mean |PID − feed-forward|, steady", "mean |PID − feed-forward|, on the ramp"
SPEEDING_UP, SPEEDING_UP_LATE = "error speeding up", "error speeding up, delay out"
STEADY = "error of the mean speed, steady"
BEHIND, PAST = "heading behind the ramp", "heading past its end"
NOT_STATED = Published(math.nan, "m/s", "not stated")
PID_SURGE, PID_SWAY = "mean of the PID in surge, steady", "mean of the PID in sway, steady"


@dataclass(frozen=True)
class Comparison:
    """One number: the paper's, ours with the values of its method, ours with those of the default method.

    NaN means that there is no such number.
    """

    figure: str
    what: str
    unit: str
    paper: float
    by_paper: float
    by_ours: float = math.nan


@dataclass(frozen=True)
class Ratio:
    """Hovering over survey: the paper's ratio, ours by its method and by the default method, the true one."""

    what: str
    paper: float
    by_paper: float
    by_ours: float
    truth: float


def validation(done: Reproduction) -> tuple[Comparison, ...]:
    """Figs 10 to 17."""
    p = published
    alone = _axis(done, "surge alone", "surge")
    heading = turned(done.dives["heading alone"])
    surge, sway = (_both_axes(done, "hovering alone", name) for name in ("surge", "sway"))
    settled = [steady_speed(done.dives[name], 0) for name in ("hovering alone", "hovering alone ours")]
    swayed = [steady_speed(done.dives[name], 1) for name in ("hovering alone", "hovering alone ours")]
    top, target = p.TOP_SPEED.value, p.HOVERING_TARGET.value
    rows = (
        ("Fig. 10", APART_STEADY, p.SHADOW_SURGE, [_axis(done, "surge shadow", "surge").pid_minus_ff]),
        ("Fig. 11", APART_TURNING, p.SHADOW_YAW, [_axis(done, "heading shadow", "yaw").pid_minus_ff]),
        ("Fig. 12", "delay", p.SURGE_DELAY, [alone.delay_s]),
        ("Fig. 13", SPEEDING_UP_LATE, p.SURVEY_ACCELERATION, [alone.acceleration_less_delay]),
        ("Fig. 13", STEADY, p.SURVEY_STEADY, [abs(steady_speed(done.dives["surge alone"], 0) - top)]),
        ("Fig. 14", BEHIND, p.HEADING_LAG, [heading.lag_s]),
        (
            "Fig. 14",
            PAST,
            Published(math.nan, "°", "Fig. 14: significant, no number"),
            [heading.overshoot_deg],
        ),
        ("Fig. 15", SPEEDING_UP, p.HOVERING_ACCELERATION, [axis.acceleration for axis in surge]),
        ("Fig. 15", SPEEDING_UP_LATE, NOT_STATED, [axis.acceleration_less_delay for axis in surge]),
        ("Fig. 15", f"settled speed for {target:g} m/s", p.HOVERING_SETTLED, settled),
        ("Fig. 15", STEADY, p.HOVERING_STEADY, [abs(speed - target) for speed in settled]),
        ("Fig. 16", SPEEDING_UP, p.SWAY_ACCELERATION, [axis.acceleration for axis in sway]),
        ("Fig. 16", SPEEDING_UP_LATE, NOT_STATED, [axis.acceleration_less_delay for axis in sway]),
        ("Fig. 16", STEADY, p.SWAY_STEADY, [abs(speed - SWAY_M_S) for speed in swayed]),
        (
            "Fig. 17",
            PID_SURGE,
            p.SURGE_PID,
            [a.pid_effort for a in _both_axes(done, "hovering both", "surge")],
        ),
        ("Fig. 17", PID_SWAY, p.SWAY_PID, [a.pid_effort for a in _both_axes(done, "hovering both", "sway")]),
    )
    return tuple(
        Comparison(figure, quantity, number.unit, number.value, *ours)
        for figure, quantity, number, ours in rows
    )


def _axis(done: Reproduction, trial: str, name: str) -> AxisErrors:
    errors = tracking_errors(done.dives[trial], lever_of(done.file)).axis(name)
    assert errors is not None
    return errors


def _both_axes(done: Reproduction, trial: str, name: str) -> tuple[AxisErrors, AxisErrors]:
    """Errors flown with the values of the paper's method, and with ours."""
    return _axis(done, trial, name), _axis(done, f"{trial} ours", name)


def table_5(done: Reproduction) -> dict[str, TrackingErrors]:
    """Errors of the hovering dives by controller and coefficients, in the order of the table."""
    trials = {
        "Both, its": "hovering both",
        "Both, ours": "hovering both ours",
        "PID": "hovering PID",
        "FF, its": "hovering alone",
        "FF, ours": "hovering alone ours",
    }
    return {name: tracking_errors(done.dives[trial], lever_of(done.file)) for name, trial in trials.items()}


def configurations(done: Reproduction) -> tuple[tuple[Ratio, ...], Demand, Demand]:
    """Section 4's comparison of the configurations, and the thruster demand at 0.2 m/s in survey and in hovering."""
    survey, hovering = done.campaigns["survey"], done.campaigns["hovering"]
    along_survey, along_hovering = (_along(done.file, name) for name in ("survey", "hovering"))
    p = published
    paper = (
        p.TABLE_4["X_udot"].value / p.TABLE_3["X_udot"].value,
        p.TABLE_4["D_u"].value / p.TABLE_3["D_u"].value,
    )
    shapes = done.file.vehicle.configurations
    added = tuple(
        tuple(
            values["M_u"] - shapes[name].dry_mass_kg
            for name, values in zip(("survey", "hovering"), pair, strict=True)
        )
        for pair in _pairs(done)
    )
    drag = tuple(after["D_u"] / before["D_u"] for before, after in _pairs(done))
    geometry = along_survey / along_hovering
    speed = p.POWER_SPEED.value
    before, after = (
        demand(campaign.dive, done.file, campaign.configuration, speed) for campaign in (survey, hovering)
    )
    ratios = (
        Ratio("X_u", paper[0], *(hovering_kg / survey_kg for survey_kg, hovering_kg in added)),
        Ratio("D_u", paper[1], *drag),
        Ratio("thrust, eq. 17", p.THRUST_RATIO.value, *(geometry * ratio for ratio in drag)),
    )
    return ratios, before, after


def _pairs(done: Reproduction) -> tuple[tuple[dict[str, float], dict[str, float]], ...]:
    """Survey and hovering values by the paper's method, by the default method, and of the simulated vehicle."""
    survey, hovering = done.campaigns["survey"], done.campaigns["hovering"]
    return (
        (survey.paper.values(), hovering.paper.values()),
        (survey.ours.values(), hovering.ours.values()),
        (dict(survey.truth), dict(hovering.truth)),
    )


def _along(file: VehicleFile, configuration: str) -> float:
    """Cosine of the angle between surge and the thrusters that drive it: surge force per newton of thrust."""
    return max(
        abs(thruster.direction[0]) for thruster in file.vehicle.configurations[configuration].thrusters
    )


HEAVE = ("M_w", "D_w")
TURNS = {
    "linear reference, no inertia": "heading alone",
    "smooth reference, no inertia": "heading smooth",
    "smooth reference, inertia": "heading inertia",
}


def heave_section(done: Reproduction) -> Section:
    rows = []
    for name, campaign in done.campaigns.items():
        for coefficient in HEAVE:
            estimate = campaign.ours[coefficient]
            value, interval = cells.with_interval(estimate.value, estimate.low95, estimate.high95)
            shown = (value, interval) if estimate.identifiable else (MISSING, estimate.reason)
            rows.append(
                (
                    f"{coefficient}, {unit(estimate.unit)}",
                    name,
                    *shown,
                    cells.significant(campaign.truth[coefficient], 4),
                )
            )
    return Section(
        "Left open: heave",
        "Both campaigns go down to 0.6 m and come up again, 0.4 m each way. That is enough for heave, if "
        "with wider intervals than surge; the feed-forward leaves heave to its PID.",
        (
            Table(
                ("Parameter", "Campaign", "Ours", "95 % interval", "Simulated vehicle"),
                tuple(rows),
                "Heave, from the changes of depth alone.",
            ),
        ),
    )


def yaw_section(done: Reproduction) -> Section:
    runs = {label: turned(done.dives[trial]) for label, trial in TURNS.items()}
    rows = tuple(
        (
            label,
            cells.fixed(run.lag_s, 2),
            cells.fixed(run.error_deg, 1),
            cells.fixed(run.overshoot_deg, 1),
        )
        for label, run in runs.items()
    )
    inertia = done.campaigns["survey"].ours["I_r"]
    value, interval = with_interval(inertia.value, inertia.low95, inertia.high95)
    truth = done.campaigns["survey"].truth["I_r"]
    return Section(
        "Left open: yaw inertia in the feed-forward",
        f"The survey campaign tells I_r = {value} kg m² ({interval}; the simulated vehicle has "
        f"{significant(truth, 4)}). Under eq. 16 the heading trails its reference. A smooth reference has "
        "the acceleration that the inertia needs; a linear one has none to give, so there inertia changes "
        "nothing. What trails with inertia is the thrusters' dead zone. An overshoot takes more than "
        "missing inertia: see above.",
        (
            Table(
                ("Feed-forward alone", "Behind the ramp, s", "Mean |error|, °", "Past its end, °"),
                rows,
                "Half a turn in survey. No inertia: the least that the vehicle's parameters take.",
            ),
        ),
        (
            figures.heading_errors(
                {label: done.dives[trial] for label, trial in TURNS.items()},
                "heading behind its reference",
                "How far the heading trails its reference.",
            ),
        ),
    )


def coupling_section(terms: tuple[Term, ...]) -> Section:
    off = [term for term in terms if not term.diagonal]
    rows = tuple(
        (
            term.name,
            cells.joined(cells.Form.SPREAD, cells.significant(term.value, 2), cells.significant(term.std, 2)),
            cells.percent(term.share, 1),
            cells.fixed(abs(term.value) / term.std, 1),
        )
        for term in off
    )
    beyond = sum(abs(term.value) > 1.96 * term.std for term in off)
    return Section(
        "Left open: terms off the diagonal",
        "Full matrices of mass (symmetric) and damping for surge, sway and yaw, fitted to the hovering "
        "campaign by least squares, each with its Coriolis terms. The simulated vehicle has none off the "
        f"diagonal, so this shows what such a dive can tell: {beyond} of {len(off)} lie beyond 1.96 of their "
        f"standard errors, and the largest is {fixed(100 * max(abs(term.share) for term in off), 1)} % of "
        "its diagonal neighbours.",
        (
            Table(
                ("Term, SI", "Value ± standard error", "Share of the diagonal", "|value| / error"),
                rows,
                "Share: over the root of the product of the diagonal terms of its row and column.",
            ),
        ),
    )
