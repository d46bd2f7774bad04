"""A dive through the network: laid out coarse to come near, then fine to finish; wild readings left out on the way."""

from collections.abc import Callable
from dataclasses import dataclass

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
from identify.estimators.pinn.layout import COARSE_S, FINE_S, Layout, lay_out
from identify.estimators.pinn.network import Data, Raw, data_of, wild, without
from identify.estimators.pinn.noise import Noise
from identify.estimators.pinn.training import Pass, Point, Prior, approach, begin, settle
from identify.estimators.smoothing import smoothed_velocity

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

MOST_WILD = 0.02
"""Share of wild readings up to which they are the sensor's fault, and left out; more than that is the model's."""

USUAL_PASSES = 16
"""For the progress bar alone."""


@dataclass(frozen=True)
class Fit:
    """What training came to, on the fine layout.

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
    coarse = lay_out(dive, file, configuration, built.axes, COARSE_S)
    fine = lay_out(dive, file, configuration, built.axes, FINE_S)
    map_ = _map(shape, fine.dofs, device)
    prior = _prior(shape, fine, device)
    watch = _Watch(map_, fine.dofs, progress)
    state = np.zeros((len(coarse.time_s), coarse.width))
    state[:, : len(coarse.dofs)] = smoothed_velocity(dive, coarse.time_s)[:, list(coarse.dofs)]
    data = data_of(coarse, device)
    point = begin(data, map_, map_.start(), prior.middle, torch.as_tensor(state, device=device))
    point = approach(data, map_, point, prior, watch)
    point, data = _refined(map_, point, coarse, fine, device)
    point = approach(data, map_, point, prior, watch)
    strange = wild(data, map_, point.raw, point.noise, point.equations.state)
    if 0 < float(strange.sum()) <= MOST_WILD * float(data.known.sum()):
        data = without(data, strange)
        point = begin(data, map_, point.raw, point.noise, point.equations.state)
    trained = settle(data, map_, point, prior, watch)
    missing = missing_drag(data, map_, trained)
    raw, noise = trained.point.raw, trained.point.noise
    to_log = map_.to_logarithm(raw)
    count = len(raw)
    ends = torch.cat([1 / to_log, torch.ones(len(trained.curvature) - count, dtype=raw.dtype, device=device)])
    alone = trained.curvature.clone()
    alone[:count, :count] -= trained.point.equations.prior
    covariance = torch.linalg.inv(trained.curvature)[:count, :count] * torch.outer(to_log, to_log)
    progress(1.0, f"the network has settled: {trained.reason}" if trained.settled else trained.reason)
    return Fit(
        fine,
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
    trim = np.array([max(TRIM_SHARE * shape.thruster_limit_n * (1.0 if dof < 3 else 0.2), 1e-3) for dof in dofs])
    mass_spread = [PRIOR_STD[0] if dof in dofs else UNMEASURED_SHARE / MASS_RATIO for dof in range(6)]
    parts = (
        np.concatenate([rigid, DAMPING_RATIO * own, trim]),
        np.concatenate([MASS_RATIO * rigid, DAMPING_RATIO * own, np.zeros(len(dofs))]),
        np.concatenate([mass_spread, [PRIOR_STD[1]] * len(dofs), trim]),
    )
    return Raw(*(torch.as_tensor(part, device=device) for part in parts), len(dofs))


def _prior(shape: Configuration, layout: Layout, device: torch.device) -> Prior:
    own = np.array([rigid_mass(shape, dof) for dof in layout.dofs])
    parts = (layout.channel_noise, DISTURBANCE_SHARE * own, np.full(len(own), TIME_S), layout.channel_spread)
    sensor, disturbance, time_s, spread = (torch.as_tensor(part, device=device) for part in parts)
    return Prior(Noise(sensor, disturbance, time_s), spread)


def _refined(map_: Raw, point: Point, coarse: Layout, fine: Layout, device: torch.device) -> tuple[Point, Data]:
    """The same point on the fine layout."""
    state = _array(point.equations.state)
    between = np.column_stack([np.interp(fine.time_s, coarse.time_s, column) for column in state.T])
    data = data_of(fine, device)
    return begin(data, map_, point.raw, point.noise, torch.as_tensor(between, device=device)), data


def _array(values: Tensor) -> Array:
    return np.asarray(values.cpu().numpy(), dtype=np.float64)
