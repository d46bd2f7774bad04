"""A dive through the network: laid out, started, cleared of wild readings, trained, asked for a missing drag."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from bridge.vehicle.coefficients import DAMPINGS, MASSES
from bridge.vehicle.config import Configuration, VehicleFile
from identify.dive import Dive
from identify.estimators.axes import Axes
from identify.estimators.likelihood_axis import DISTURBANCE_SHARE, MOST_WILD, TIME_S, rigid_mass
from identify.estimators.pinn.drag import missing_drag
from identify.estimators.pinn.guide import Guide
from identify.estimators.pinn.layout import Layout, lay_out
from identify.estimators.pinn.network import data_of, wild, without
from identify.estimators.pinn.noise import Noise, Prior
from identify.estimators.pinn.raw import Raw, raw_of
from identify.estimators.pinn.start import filters_of
from identify.estimators.pinn.training import Pass, Point, Trained, Trainer
from identify.estimators.smoothing import smoothed_velocity
from identify.identification import Z95

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

STEP_S = 0.1
"""Between two instants of the network."""

USUAL_PASSES = 8
"""For the progress bar alone."""


@dataclass(frozen=True)
class Fit:
    """What training came to.

    values (6 + 2 n,): six masses, n dampings, n trims, SI units. covariance: of their logarithms, trims as they are;
    information (p, p): what the dive alone tells of these and of the noise levels. drag_score (n,), drag_shift (n, p):
    see `drag.Missing`, in the same logarithms. sensor (C,), disturbance, time_constant_s (n,): the noise levels.
    """

    layout: Layout
    values: Array
    covariance: Array
    information: Array
    drag_score: Array
    drag_shift: Array
    sensor: Array
    disturbance: Array
    time_constant_s: Array
    settled: bool
    reason: str

    def information_of(self, places: list[int]) -> Array:
        """The information of these values with all else projected out."""
        others = [i for i in range(len(self.information)) if i not in places]
        cross = self.information[np.ix_(places, others)]
        return np.asarray(
            self.information[np.ix_(places, places)]
            - cross @ np.linalg.pinv(self.information[np.ix_(others, others)], hermitian=True) @ cross.T
        )


@dataclass(frozen=True)
class Task:
    """A dive ready to be trained on: its layout, the trainer, and the point where training starts."""

    layout: Layout
    trainer: Trainer
    start: Point


def task_of(
    dive: Dive, file: VehicleFile, configuration: str, built: Axes, device: torch.device, progress: Progress
) -> Task:
    """The task that a dive sets, its wild readings left out; there is at least one axis."""
    shape = file.vehicle.configurations[configuration]
    layout = lay_out(dive, file, configuration, built, STEP_S)
    map_ = raw_of(shape, layout.dofs, device)
    guide = Guide(layout.dofs, map_, filters_of(built, shape))
    prior = _prior(shape, layout, device)
    watch = _telling(map_, layout.dofs, progress)
    trainer = Trainer(data_of(layout, device), map_, prior, guide.curvature, watch)
    raw, noise = guide.start()
    state = torch.zeros(len(layout.time_s), layout.width, dtype=raw.dtype, device=device)
    nu = smoothed_velocity(dive, layout.time_s)[:, list(layout.dofs)]
    state[:, : len(layout.dofs)] = torch.as_tensor(nu, device=device)
    point = trainer.at(raw, noise, trainer.at(raw, noise, state).equations.state)
    strange = wild(trainer.data, map_, raw, noise, point.equations.state)
    if 0 < float(strange.sum()) <= MOST_WILD * float(trainer.data.known.sum()):
        trainer = replace(trainer, data=without(trainer.data, strange))
        point = trainer.at(raw, noise, point.equations.state)
    return Task(layout, trainer, point)


def fit_network(dive: Dive, file: VehicleFile, configuration: str, built: Axes, progress: Progress) -> Fit:
    """Train a network on what the axes of a dive read; there is at least one. On CUDA where there is a card."""
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    task = task_of(dive, file, configuration, built, device, progress)
    trained = task.trainer.train(task.start)
    progress(1.0, f"the network has settled: {trained.reason}" if trained.settled else trained.reason)
    return _fit(task, trained)


def _fit(task: Task, trained: Trained) -> Fit:
    map_, raw, noise = task.trainer.map_, trained.point.raw, trained.point.noise
    missing = missing_drag(task.trainer.data, map_, trained)
    to_log = map_.to_logarithm(raw)
    count = len(raw)
    per_unit = torch.cat([1 / to_log, torch.ones_like(trained.point.slope[count:])])
    covariance = torch.linalg.inv(trained.curvature)[:count, :count] * torch.outer(to_log, to_log)
    return Fit(
        task.layout,
        _array(map_.values(raw)),
        _array(covariance),
        _array(trained.told * torch.outer(per_unit, per_unit)),
        missing.score,
        missing.shift * _array(to_log),
        _array(noise.sensor),
        _array(noise.disturbance),
        _array(noise.time_constant_s),
        trained.settled,
        trained.reason,
    )


def _telling(map_: Raw, dofs: tuple[int, ...], progress: Progress) -> Callable[[Pass], None]:
    """Tells `progress` of every pass: the coefficients so far with their 95 % intervals."""
    names = {dof: MASSES[dof].name for dof in dofs}
    names |= {6 + axis: DAMPINGS[dof].name for axis, dof in enumerate(dofs)}

    def watch(one: Pass) -> None:
        values = map_.values(one.point.raw).tolist()
        half = (Z95 * one.covariance.diagonal().sqrt() * map_.slope(one.point.raw)).tolist()
        told = ", ".join(f"{name} {values[i]:.4g} ± {half[i]:.2g}" for i, name in names.items())
        progress(one.number / (one.number + USUAL_PASSES), f"pass {one.number}: {told}")

    return watch


def _prior(shape: Configuration, layout: Layout, device: torch.device) -> Prior:
    own = np.array([rigid_mass(shape, dof) for dof in layout.dofs])
    parts = (layout.channel_noise, DISTURBANCE_SHARE * own, np.full(len(own), TIME_S), layout.channel_spread)
    sensor, disturbance, time_s, spread = (torch.as_tensor(part, device=device) for part in parts)
    return Prior(Noise(sensor, disturbance, time_s), spread)


def _array(values: Tensor) -> Array:
    return np.asarray(values.cpu().numpy(), dtype=np.float64)
