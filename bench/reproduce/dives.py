"""The paper's campaigns and validation dives (Figs 10 to 17) with the simulated vehicle, recorded and identified."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from bench.campaigns import VEHICLE
from bench.reproduce.measures import Term, matrices
from bench.reproduce.paper import (
    PAPER_DOFS,
    PaperOptions,
    TrainingCurves,
    closed_form,
    estimate_with_curves,
    fixed_values,
    lessons,
)
from bench.reproduce.published import HOVERING_TARGET, RAMP, TOP_SPEED, TRANSIENT
from bridge.errors import ParamRejected
from bridge.onboard.parameters import ParameterServer, parameters_of
from bridge.simulator.missions import HeadingReference, mission_named, rest, run, turn
from bridge.simulator.truth import load_truth
from bridge.vehicle.coefficients import BY_NAME
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.vehicle.legs import Leg, Mission
from bridge.vehicle.mode import Mode
from bridge.vehicle.parameters import COMMIT, bounds
from gcs_plugin import simulated
from identify.dive import Dive
from identify.estimators.table import DEFAULT, estimator
from identify.identification import Identification
from identify.ingest.open import read_dive

HEADING: HeadingReference = "linear"
DIVE_SHARE = 0.5
PAPER_SHARE = 0.7
"""Share of the paper's training in the time after the dive."""


@dataclass(frozen=True)
class Campaign:
    """Results of one campaign.

    `paper` and `curves`: the paper's method; `closed`: the minimum of its loss in closed form, over the very samples
    that its network trains on; `ours`: the default method; `truth`: the simulated vehicle's coefficients; `coupling`:
    the full matrices (empty if the campaign does not move sway).
    """

    configuration: str
    dive: Dive
    paper: Identification
    curves: TrainingCurves
    closed: Mapping[str, float]
    ours: Identification
    truth: Mapping[str, float]
    coupling: tuple[Term, ...]


def campaign(
    configuration: str,
    options: PaperOptions,
    root: Path,
    seed: int,
    unix_s: float,
    progress: Callable[[float], None],
) -> Campaign:
    """Dive the paper's mission with its PID alone and its linear heading references, and identify."""
    file = load_vehicle(VEHICLE)
    mission = mission_named(configuration, file.vehicle.configurations[configuration], HEADING)
    folder = simulated.record_dive(
        file,
        configuration,
        mission,
        root,
        seed=seed,
        unix_s=unix_s,
        mode=Mode.OFF,
        progress=lambda share: progress(DIVE_SHARE * share),
    )
    dive = read_dive(folder.path, None, file)
    return identified(
        dive, file, configuration, options, lambda share: progress(DIVE_SHARE + (1 - DIVE_SHARE) * share)
    )


def identified(
    dive: Dive,
    file: VehicleFile,
    configuration: str,
    options: PaperOptions,
    progress: Callable[[float], None],
) -> Campaign:
    """Identify a recorded campaign by the paper's method, by its loss in closed form and by the default method."""
    paper, curves = estimate_with_curves(
        dive, file, configuration, lambda share, *_: progress(PAPER_SHARE * share), options
    )
    ours = estimator(DEFAULT)(
        dive, file, configuration, lambda share, *_: progress(PAPER_SHARE + (1 - PAPER_SHARE) * share)
    )
    learnt = lessons(dive, file, configuration, options)
    return Campaign(
        configuration,
        dive,
        paper,
        curves,
        closed_form(learnt.data, fixed_values(file.vehicle.configurations[configuration])),
        ours,
        load_truth(file, configuration).model,
        matrices(learnt.grid) if learnt.data.dofs == PAPER_DOFS else (),
    )


REST_S, STEADY_S = 4.0, 20.0
HEADING_REST_S = 7.0
TURN_RAD = math.pi
SWAY_M_S = 0.3

Shape = Literal["line", "heading, linear", "heading, smooth", "surge and sway"]


@dataclass(frozen=True)
class Trial:
    """One validation dive: configuration, motion, feed-forward mode, and the coefficients of the feed-forward."""

    name: str
    configuration: str
    shape: Shape
    mode: Mode
    coefficients: Mapping[str, float]

    @property
    def title(self) -> str:
        """The name without its mode, which the recording's folder name contains already."""
        return " ".join(word for word in self.name.split() if word != self.mode.name.lower())


def legs(shape: Shape) -> list[Leg]:
    """Return the legs of a trial.

    A line at the paper's top speed; a half turn in the time of its Fig. 11; or its hovering speed in surge, then
    sway. The turn's angle and the sway speed are our choice: the paper does not give them.
    """
    if shape == "line":
        return rest("start", REST_S) + _straight("ahead", TOP_SPEED.value, 0.0) + rest("end", REST_S)
    if shape == "surge and sway":
        return (
            rest("start", REST_S)
            + _straight("surge", HOVERING_TARGET.value, 0.0)
            + rest("between", REST_S)
            + _straight("sway", 0.0, SWAY_M_S)
            + rest("end", REST_S)
        )
    reference: HeadingReference = "linear" if shape == "heading, linear" else "smooth"
    turned = turn("turn", TURN_RAD, TURN_RAD / RAMP.value, reference)
    return rest("start", HEADING_REST_S) + turned + rest("end", HEADING_REST_S)


def _straight(name: str, surge_m_s: float, sway_m_s: float) -> list[Leg]:
    speed = math.hypot(surge_m_s, sway_m_s)
    return run(name, surge_m_s, sway_m_s, speed * (STEADY_S + TRANSIENT.value))


def dive(trial: Trial, root: Path, seed: int, unix_s: float, progress: Callable[[float], None]) -> Dive:
    """Simulate a trial and read its recording; with feed-forward alone the thrusters keep their dead zone, and so
    their delay, as in the paper.
    """
    file = load_vehicle(VEHICLE)
    mission = Mission(trial.title, tuple(legs(trial.shape)))
    folder = simulated.record_dive(
        in_its_dead_zone(file) if trial.mode is Mode.ALONE else file,
        trial.configuration,
        mission,
        root,
        seed=seed,
        unix_s=unix_s,
        parameters=carrying(file, trial.configuration, trial.coefficients),
        mode=trial.mode,
        progress=progress,
    )
    return read_dive(folder.path, None, file)


def in_its_dead_zone(file: VehicleFile) -> VehicleFile:
    """The vehicle with the gain tables whose feed-forward does not compensate the thrusters' dead zone."""
    shapes = {
        name: replace(shape, gains=f"paper_{shape.gains}")
        for name, shape in file.vehicle.configurations.items()
    }
    return replace(file, vehicle=replace(file.vehicle, configurations=shapes))


def carrying(file: VehicleFile, configuration: str, coefficients: Mapping[str, float]) -> ParameterServer:
    """The vehicle's parameters with these coefficients committed. Raises ParamRejected if the vehicle refuses one."""
    parameters = parameters_of(file, None)
    veh_cfg = file.vehicle.veh_cfg(configuration)
    for name, value in coefficients.items():
        refusal = parameters.write(BY_NAME[name].parameter_id(veh_cfg), value, armed=False)
        if refusal is not None:
            raise ParamRejected(
                f"the simulated vehicle refused {name} = {value:g} in {configuration} ({refusal.name}); "
                "dive another seed, or give --network more epochs"
            )
    parameters.write(COMMIT, float(parameters.staged_crc), armed=False)
    return parameters


def without_inertia(
    coefficients: Mapping[str, float], file: VehicleFile, configuration: str
) -> dict[str, float]:
    """The same coefficients with the least yaw inertia that the vehicle's parameters accept: the closest to eq. 16."""
    least, _ = bounds(BY_NAME["I_r"], file.vehicle.configurations[configuration])
    return {**coefficients, "I_r": least}
