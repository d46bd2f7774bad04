"""The paper's two campaigns on the simulated vehicle: dived, recorded, and identified by its method and by ours."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from bridge.simulator.missions import HeadingReference, mission_named
from bridge.simulator.truth import load_truth
from bridge.vehicle.config import VehicleFile, load_vehicle
from identify.dive import Dive
from identify.estimators.paper import PaperOptions, TrainingCurves, estimate_with_curves, window_ends
from identify.estimators.paper_physics import PAPER_DOFS, closed_form, excited, fixed_values, samples
from identify.estimators.table import DEFAULT, estimator
from identify.filters import AlignedDive, aligned
from identify.identification import Identification
from identify.ingest.open import read_dive
from tui import simulated
from tui.reproduce.coupling import Term, matrices

VEHICLE = "ruvifist"
CONFIGURATIONS = ("survey", "hovering")
HEADING: HeadingReference = "linear"
DIVE_SHARE = 0.5
PAPER_SHARE = 0.7
"""Share of the paper's training in the time after the dive."""


@dataclass(frozen=True)
class Campaign:
    """Results of one campaign.

    `paper` and `curves`: the paper's method; `closed`: the minimum of its loss in closed form; `ours`: the default
    method; `truth`: the simulated vehicle's coefficients; `coupling`: the full matrices (empty if the campaign does
    not move sway).
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
    folder = simulated.dive_with_pid(
        file, configuration, mission, root, seed, unix_s, lambda share: progress(DIVE_SHARE * share)
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
    grid = aligned(dive, file, configuration, options.rate_hz, options.cutoff_hz)
    _, dofs = excited(grid)
    return Campaign(
        configuration,
        dive,
        paper,
        curves,
        best_of_loss(grid, file, configuration, options),
        ours,
        load_truth(file, configuration).model,
        matrices(grid) if dofs == PAPER_DOFS else (),
    )


def best_of_loss(
    grid: AlignedDive, file: VehicleFile, configuration: str, options: PaperOptions
) -> dict[str, float]:
    """Parameters at the minimum of the paper's loss, over the very samples that its network trains on."""
    shape = file.vehicle.configurations[configuration]
    _, dofs = excited(grid)
    data = samples(grid, window_ends(grid, options.window), shape, dofs)
    return closed_form(data, fixed_values(shape))
