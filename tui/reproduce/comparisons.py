"""Each number that the paper reads off its validation dives, beside the same from ours."""

import math
from dataclasses import dataclass

from bridge.vehicle.config import Vector3, VehicleFile
from identify.dive import Dive
from identify.validate import AxisErrors, tracking_errors
from tui.reproduce import published
from tui.reproduce.measures import Demand, demand, steady_speed, turned
from tui.reproduce.published import Published
from tui.reproduce.run import Reproduction


@dataclass(frozen=True)
class Comparison:
    """One number: the paper's, ours with the values of its method, ours with those of the default method.

    NaN where there is none.
    """

    figure: str
    what: str
    unit: str
    paper: float
    by_paper: float
    by_ours: float = math.nan


@dataclass(frozen=True)
class Ratio:
    """Hovering over survey: the paper's, ours by its method and by the default method, and the simulated "
    "vehicle's."""

    what: str
    paper: float
    by_paper: float
    by_ours: float
    truth: float


def validation(done: Reproduction) -> tuple[Comparison, ...]:
    """Figs 10 to 17."""
    lever_m = lever(done.file)

    def axis(trial: str, name: str) -> AxisErrors:
        found = tracking_errors(done.dives[trial], lever_m).axis(name)
        assert found is not None
        return found

    p = published
    alone = axis("surge alone", "surge")
    surge, our_surge = (axis(f"hovering alone{whose}", "surge") for whose in ("", " ours"))
    sway, our_sway = (axis(f"hovering alone{whose}", "sway") for whose in ("", " ours"))
    settled, our_settled = (steady_speed(done.dives[f"hovering alone{w}"], 0) for w in ("", " ours"))
    heading = turned(done.dives["heading alone"])
    apart = "mean |PID − feed-forward|"
    return (
        _row("Fig. 10", f"{apart}, steady", p.SHADOW_SURGE, axis("surge shadow", "surge").pid_minus_ff),
        _row("Fig. 11", f"{apart}, on the ramp", p.SHADOW_YAW, axis("heading shadow", "yaw").pid_minus_ff),
        _row("Fig. 12", "delay", p.SURGE_DELAY, alone.delay_s),
        _row("Fig. 13", "error speeding up, delay out", p.SURVEY_ACCELERATION, alone.acceleration_less_delay),
        _row("Fig. 13", "error steady", p.SURVEY_STEADY, alone.steady_state),
        _row("Fig. 14", "heading behind the ramp", p.HEADING_LAG, heading.lag_s),
        Comparison("Fig. 14", "heading past its end", "°", math.nan, heading.overshoot_deg),
        _row(
            "Fig. 15",
            "error speeding up",
            p.HOVERING_ACCELERATION,
            surge.acceleration,
            our_surge.acceleration,
        ),
        _row("Fig. 15", "settled speed for 0.4 m/s", p.HOVERING_SETTLED, settled, our_settled),
        _row("Fig. 15", "error steady", p.HOVERING_STEADY, surge.steady_state, our_surge.steady_state),
        _row("Fig. 16", "error speeding up", p.SWAY_ACCELERATION, sway.acceleration, our_sway.acceleration),
        _row("Fig. 16", "error steady", p.SWAY_STEADY, sway.steady_state, our_sway.steady_state),
        *(
            _row("Fig. 17", f"mean of the PID in {name}, steady", number, *efforts)
            for name, number in (("surge", p.SURGE_PID), ("sway", p.SWAY_PID))
            for efforts in [[axis(f"hovering both{w}", name).pid_effort for w in ("", " ours")]]
        ),
    )


def _row(figure: str, what: str, number: Published, by_paper: float, by_ours: float = math.nan) -> Comparison:
    return Comparison(figure, what, number.unit, number.value, by_paper, by_ours)


def lever(file: VehicleFile) -> Vector3:
    """Where the DVL's transducer sits, body axes."""
    dvl = file.vehicle.sensors.dvl
    return (0.0, 0.0, 0.0) if dvl is None else dvl.mounting.position_m


def table_5(done: Reproduction) -> dict[str, Dive]:
    """The dives in hovering by what steers them, in the order of the table."""
    return {
        "Both, its": done.dives["hovering both"],
        "Both, ours": done.dives["hovering both ours"],
        "PID": done.dives["hovering PID"],
        "FF, its": done.dives["hovering alone"],
        "FF, ours": done.dives["hovering alone ours"],
    }


def configurations(done: Reproduction) -> tuple[tuple[Ratio, ...], Demand, Demand]:
    """Section 4's comparison of the configurations, and what 0.2 m/s took of our thrusters in survey and hovering."""
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
            one["M_u"] - shapes[name].dry_mass_kg
            for name, one in zip(("survey", "hovering"), pair, strict=True)
        )
        for pair in _pairs(done)
    )
    drag = tuple(after["D_u"] / before["D_u"] for before, after in _pairs(done))
    geometry = along_survey / along_hovering
    speed = p.POWER_SPEED.value
    before, after = (demand(one.dive, done.file, one.configuration, speed) for one in (survey, hovering))
    ratios = (
        Ratio("X_u", paper[0], *(hovering_kg / survey_kg for survey_kg, hovering_kg in added)),
        Ratio("D_u", paper[1], *drag),
        Ratio("thrust, eq. 17", p.THRUST_RATIO.value, *(geometry * one for one in drag)),
    )
    return ratios, before, after


def _pairs(done: Reproduction) -> tuple[tuple[dict[str, float], dict[str, float]], ...]:
    """Survey and hovering values by the paper's method, by the default one, and truly."""
    survey, hovering = done.campaigns["survey"], done.campaigns["hovering"]
    return (
        (survey.paper.values(), hovering.paper.values()),
        (survey.ours.values(), hovering.ours.values()),
        (dict(survey.truth), dict(hovering.truth)),
    )


def _along(file: VehicleFile, configuration: str) -> float:
    """The surge share of a newton of each thruster that pushes along: the cosine of their angle."""
    return max(
        abs(thruster.direction[0]) for thruster in file.vehicle.configurations[configuration].thrusters
    )
