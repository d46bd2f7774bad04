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
from identify.estimators.likelihood_axis import (
    DAMPING_RATIO,
    DISTURBANCE_SHARE,
    MASS_RATIO,
    PRIOR_STD,
    TIME_S,
    TRIM_SHARE,
    UNMEASURED_SHARE,
    rigid_mass,
)
from identify.estimators.pinn.drag import missing_drag
from identify.estimators.pinn.layout import Layout, lay_out
from identify.estimators.pinn.network import Raw, data_of, wild, without
from identify.estimators.pinn.noise import DISTURBANCE_SPREAD, TIME_SPREAD, Noise
from identify.estimators.pinn.start import Filters, Levels, filters_of
from identify.estimators.pinn.training import Pass, Point, Prior, Trainer
from identify.estimators.smoothing import smoothed_velocity

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

MOST_WILD = 0.02
"""Share of wild readings up to which they are the sensor's fault, and left out; more than that is the model's."""

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


def fit_network(dive: Dive, file: VehicleFile, configuration: str, built: Axes, progress: Progress) -> Fit:
    """Train a network on what the axes of a dive read; there is at least one. On CUDA where there is a card."""
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    shape = file.vehicle.configurations[configuration]
    layout = lay_out(dive, file, configuration, built, STEP_S)
    filters = filters_of(built, shape)
    map_ = _map(shape, layout.dofs, device)
    prior = _prior(shape, layout, device)
    view = _View(layout, map_, filters, prior)
    data = data_of(layout, device)
    trainer = Trainer(data, map_, prior, view.curvature, _Watch(map_, layout.dofs, progress))
    raw, noise = view.start()
    state = torch.zeros(len(layout.time_s), layout.width, dtype=raw.dtype, device=device)
    nu = smoothed_velocity(dive, layout.time_s)[:, list(layout.dofs)]
    state[:, : len(layout.dofs)] = torch.as_tensor(nu, device=device)
    point = trainer.at(raw, noise, trainer.at(raw, noise, state).equations.state)
    strange = wild(data, map_, raw, noise, point.equations.state)
    if 0 < float(strange.sum()) <= MOST_WILD * float(data.known.sum()):
        trainer = replace(trainer, data=without(data, strange))
        point = trainer.at(raw, noise, point.equations.state)
    trained = trainer.train(point)
    missing = missing_drag(trainer.data, map_, trained)
    raw, noise = trained.point.raw, trained.point.noise
    to_log = map_.to_logarithm(raw)
    count = len(raw)
    ends = torch.cat([1 / to_log, torch.ones(len(trained.curvature) - count, dtype=raw.dtype, device=device)])
    alone = trained.curvature - view.prior_curvature(trained.point)
    covariance = torch.linalg.inv(trained.curvature)[:count, :count] * torch.outer(to_log, to_log)
    progress(1.0, f"the network has settled: {trained.reason}" if trained.settled else trained.reason)
    return Fit(
        layout,
        _array(map_.values(raw)),
        _array(covariance),
        _array(alone * torch.outer(ends, ends)),
        missing.score,
        missing.shift * _array(to_log),
        _array(noise.sensor),
        _array(noise.disturbance),
        _array(noise.time_constant_s),
        trained.settled,
        trained.reason,
    )


class _Watch:
    """Tells of every pass: the coefficients so far with their 95 % intervals."""

    def __init__(self, map_: Raw, dofs: tuple[int, ...], progress: Progress) -> None:
        self._map, self._progress, self._passes = map_, progress, 0
        names = {dof: MASSES[dof].name for dof in dofs}
        names |= {6 + axis: DAMPINGS[dof].name for axis, dof in enumerate(dofs)}
        self._names = names

    def __call__(self, one: Pass) -> None:
        self._passes += 1
        values = self._map.values(one.point.raw).tolist()
        half = (1.96 * one.covariance.diagonal().sqrt() * self._map.slope(one.point.raw)).tolist()
        told = ", ".join(f"{name} {values[i]:.4g} ± {half[i]:.2g}" for i, name in self._names.items())
        self._progress(self._passes / (self._passes + USUAL_PASSES), f"pass {self._passes}: {told}")


def _map(shape: Configuration, dofs: tuple[int, ...], device: torch.device) -> Raw:
    rigid = np.array([rigid_mass(shape, dof) for dof in range(6)])
    own = rigid[list(dofs)]
    trim = np.array(
        [max(TRIM_SHARE * shape.thruster_limit_n * (1.0 if dof < 3 else 0.2), 1e-3) for dof in dofs]
    )
    mass_spread = [PRIOR_STD[0] if dof in dofs else UNMEASURED_SHARE / MASS_RATIO for dof in range(6)]
    scale = np.concatenate([rigid, DAMPING_RATIO * own, trim])
    middle = np.concatenate([MASS_RATIO * rigid, DAMPING_RATIO * own, np.zeros(len(dofs))])
    spread = np.concatenate([mass_spread, [PRIOR_STD[1]] * len(dofs), trim])
    tensors = [torch.as_tensor(part, device=device) for part in (scale, middle, spread)]
    return Raw(tensors[0], tensors[1], tensors[2], len(dofs))


def _prior(shape: Configuration, layout: Layout, device: torch.device) -> Prior:
    own = np.array([rigid_mass(shape, dof) for dof in layout.dofs])
    parts = (layout.channel_noise, DISTURBANCE_SHARE * own, np.full(len(own), TIME_S), layout.channel_spread)
    sensor, disturbance, time_s, spread = (torch.as_tensor(part, device=device) for part in parts)
    return Prior(Noise(sensor, disturbance, time_s), spread)


@dataclass(frozen=True)
class _View:
    """The network's raw parameters and noise levels as the filters see them."""

    layout: Layout
    map_: Raw
    filters: Filters
    prior: Prior

    def start(self) -> tuple[Tensor, Noise]:
        """Raw parameters and noise levels where the filters start the network."""
        like = self.prior.middle.disturbance
        values = self.map_.values(self.map_.start()).cpu().numpy()
        begin = self.filters.start
        values[list(self.layout.dofs)] = begin.mass
        values[6:] = np.concatenate([begin.damping, begin.trim])
        levels = (begin.sensor, begin.disturbance, begin.time_constant_s)
        noise = Noise(*(torch.as_tensor(level, dtype=like.dtype, device=like.device) for level in levels))
        return self.map_.raw(torch.as_tensor(values, dtype=like.dtype, device=like.device)), noise

    def curvature(self, point: Point) -> Tensor:
        """Of half the loss, in raw parameters and logarithms of noise levels: the filters' with the priors, and what
        the network's own equations say of masses that are not fitted."""
        n, count = len(self.layout.dofs), len(point.raw)
        values, noise = _array(self.map_.values(point.raw)), point.noise
        at = Levels(
            values[list(self.layout.dofs)],
            values[6 : 6 + n],
            values[6 + n :],
            _array(noise.disturbance),
            _array(noise.time_constant_s),
            _array(noise.sensor),
        )
        found = torch.as_tensor(self.filters.curvature(at), dtype=point.raw.dtype, device=point.raw.device)
        sensors = len(at.sensor)
        # Of the filters' order, where the network has it: sensors come before disturbances there.
        place = [
            *self.layout.dofs,
            *range(6, 6 + 2 * n),
            *range(count + sensors, count + sensors + 2 * n),
            *range(count, count + sensors),
        ]
        unit = torch.cat([self.map_.to_logarithm(point.raw), torch.ones_like(point.slope[count:])])
        out = torch.zeros(len(point.slope), len(point.slope), dtype=point.raw.dtype, device=point.raw.device)
        others = [dof for dof in range(6) if dof not in self.layout.dofs]
        out[others, others] = point.equations.information[others, others]
        out[np.ix_(place, place)] = found * torch.outer(unit[place], unit[place])
        return out + self.prior_curvature(point)

    def prior_curvature(self, point: Point) -> Tensor:
        """What of it the priors make."""
        spread = self.prior.sensor_spread
        level = torch.ones_like(point.noise.disturbance)
        of_levels = torch.cat([spread**-2, level / DISTURBANCE_SPREAD**2, level / TIME_SPREAD**2])
        return torch.diag(torch.cat([point.equations.prior.diagonal(), of_levels]))


def _array(values: Tensor) -> Array:
    return np.asarray(values.cpu().numpy(), dtype=np.float64)
