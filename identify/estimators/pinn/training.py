"""Fits the network to a dive: layout, start, removal of wild readings, training of coefficients and noise levels.

Fisher scoring: the weights are solved for in every pass, so that the loss depends on coefficients and noise levels
alone. The step is its slope over the expected curvature (Gupta and Mehra 1974, IEEE TAC 19(6), eq. 35), corrected by
the slope's changes over earlier steps, and shortened if it leads uphill. The inverse of the last expected curvature
gives the intervals.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import count

import numpy as np
import torch
from torch import Tensor

from bridge.arrays import Array
from bridge.vehicle.coefficients import DAMPINGS, MASSES
from bridge.vehicle.config import Configuration, VehicleFile
from identify.dive import Dive
from identify.estimators.axes.axis import Axes
from identify.estimators.likelihood.priors import DISTURBANCE_SHARE, TIME_S
from identify.estimators.likelihood.spikes import LARGEST_SHARE
from identify.estimators.likelihood.start import StartFit, StartValues, start_of
from identify.estimators.pinn.equations import Equations, equations
from identify.estimators.pinn.layout import Data, Layout, data_of, lay_out
from identify.estimators.pinn.network import wild, without
from identify.estimators.pinn.parameters import Noise, Prior, Raw, of_logarithm, raw_of, slope
from identify.estimators.refusals import no_solution
from identify.progress import Progress
from identify.statistics import Z95

SETTLED, LEVELS_SETTLED, LEVEL_SHARE = 0.1, 1.0, 0.02
"""Training ends with a step in which no coefficient moves by more than SETTLED of its standard error, and no noise
level by more than LEVELS_SETTLED of its own or LEVEL_SHARE of itself. The remaining error is then several times
smaller."""

PATIENCE, FLAT = 4, 0.02
"""Training also ends once the loss fell by less than FLAT in PATIENCE passes: a fiftieth of the cost of one standard
error."""

SETTLED_TEXT = f"no coefficient moved by {100 * SETTLED:.0f} % of its standard error in the last pass"
FLAT_TEXT = f"the loss fell by less than {FLAT:g} in {PATIENCE} passes"

MOST_PASSES = 40
"""Passes for a dive, over all its trainings."""

UNSETTLED_TEXT = f"the network had not settled after {MOST_PASSES} passes"

NEAR = 1.0
"""Standard errors: the slope's change over a longer step says little about the curvature at the end."""

LARGEST_STEP = 1.0
"""Largest change of a raw parameter or of the logarithm of a noise level in one pass."""

UPHILL, LEAST_SHARE = 5e-3, 0.01
"""Largest rise of the loss that is accepted in a pass, and the smallest share of a step that is tried against a
larger rise."""


FINEST_S, COARSEST_S, MANY_INSTANTS = 0.05, 0.1, 6000
"""Step between two instants of the network: fine enough to follow a light vehicle's roll within a second. In a dive
of more than MANY_INSTANTS it is coarser, because time grows with the number of instants, and the loss of accuracy is
then small."""

MOST_TRAININGS = 6
"""Each training leaves out the readings that are wild at the end of the training before, until they stay the same."""

USUAL_PASSES = 8
"""For the progress bar alone."""


@dataclass(frozen=True)
class Point:
    """A point of training: raw parameters (p,), noise, the equations there with their best state, and the slope of
    half the loss in raw parameters and logarithms of noise levels."""

    raw: Tensor
    noise: Noise
    equations: Equations
    slope: Tensor

    def where(self) -> Tensor:
        """Raw parameters, then logarithms of noise levels."""
        return torch.cat([self.raw, self.noise.logarithm()])


@dataclass(frozen=True)
class Trained:
    """End of training, and the reason for it.

    point: the last that was evaluated. raw (p,): the raw parameters after a last small step from there. curvature,
    curvature_by_data (p + C + 2 n,) squared: of half the loss there, in raw parameters and logarithms of noise levels,
    with the priors and without.
    """

    point: Point
    raw: Tensor
    curvature: Tensor
    curvature_by_data: Tensor
    passes: int
    settled: bool
    reason: str


@dataclass(frozen=True)
class Trainer:
    """Everything that stays the same while a network is trained.

    curvature_at: the expected curvature of half the loss without priors, ordered as `Point.where`. watch: called at
    every pass with its point, and the covariance (p, p) of the raw parameters there.
    """

    data: Data
    map_: Raw
    prior: Prior
    curvature_at: Callable[[Point], Tensor]
    watch: Callable[[Point, Tensor], None]

    def at(self, raw: Tensor, noise: Noise, state: Tensor) -> Point:
        """The point at these values; `state` (N + 1, s) need only be near its best."""
        here = equations(self.data, self.map_, raw, state, noise)
        levels = slope(here.moments, self.data.step_s, noise)
        levels = levels + self.prior.residual(noise) / self.prior.spread()
        return Point(raw, noise, here, torch.cat([here.gradient, levels]))

    def train(self, point: Point, most_passes: int = MOST_PASSES) -> Trained:
        """Train from a point, in at most `most_passes` passes and at least one."""
        count, losses = len(point.raw), [self.loss(point)]
        pairs: list[tuple[Tensor, Tensor]] = []
        for number in range(1, most_passes + 1):
            by_data = self.curvature_at(point)
            curvature = by_data + torch.diag(self._precision(point))
            inverse = torch.linalg.inv(curvature)
            self.watch(point, inverse[:count, :count])
            step = -_bent(inverse, pairs) @ point.slope
            moved = step.abs() / inverse.diagonal().sqrt()
            still = (moved[count:] < LEVELS_SETTLED) | (step[count:].abs() < LEVEL_SHARE)
            if float(moved[:count].max()) < SETTLED and bool(still.all()):
                return Trained(
                    point, point.raw + step[:count], curvature, by_data, number, True, SETTLED_TEXT
                )
            if len(losses) > PATIENCE and 0 <= losses[-1 - PATIENCE] - losses[-1] < FLAT:
                return Trained(point, point.raw, curvature, by_data, number, True, FLAT_TEXT)
            before, point = point, self._down(point, step)
            pairs.append((point.where() - before.where(), point.slope - before.slope))
            if float(moved[:count].max()) > NEAR:
                pairs.clear()
            losses.append(self.loss(point))
        return Trained(point, point.raw, curvature, by_data, most_passes, False, UNSETTLED_TEXT)

    def loss(self, point: Point) -> float:
        """Minus twice the logarithm of the probability of readings and priors, up to a constant."""
        return point.equations.loss + self._cost(point.noise)

    def _cost(self, noise: Noise) -> float:
        return float((self.prior.residual(noise) ** 2).sum())

    def _precision(self, point: Point) -> Tensor:
        """The priors' part of the curvature: its diagonal."""
        return torch.cat([point.equations.tilt**2, self.prior.spread() ** -2])

    def _down(self, point: Point, step: Tensor) -> Point:
        """The point after the step, or after the largest share of it that leads downhill."""
        step = step * min(1.0, LARGEST_STEP / max(float(step.abs().max()), 1e-12))
        count, share = len(point.raw), 1.0
        while True:
            noise = of_logarithm(point.noise.logarithm() + share * step[count:], self.data.axes)
            tried = self.at(point.raw + share * step[:count], noise, point.equations.state)
            if self.loss(tried) < self.loss(point) + UPHILL or share < LEAST_SHARE:
                return tried
            share /= 3


def _bent(inverse: Tensor, pairs: list[tuple[Tensor, Tensor]]) -> Tensor:
    """The inverse curvature corrected by the slope's changes over the steps so far; `pairs` of a step and the slope's
    change.

    If a disturbance drives an axis, the expected curvature is larger than the loss's own, and steps by it alone would
    be too short (Nocedal and Wright 2006, eq. 6.17: Broyden, Fletcher, Goldfarb and Shanno).
    """
    eye = torch.eye(len(inverse), dtype=inverse.dtype, device=inverse.device)
    for step, change in pairs:
        along = step @ change
        if along > 0:
            across = eye - torch.outer(step, change) / along
            inverse = across @ inverse @ across.mT + torch.outer(step, step) / along
    return inverse


@dataclass(frozen=True)
class Guide:
    """The filters of the fitted axes `dofs`, ascending, in the network's parameters. `share` (C,): intervals read per
    reading, for each channel."""

    dofs: tuple[int, ...]
    map_: Raw
    filters: StartFit
    share: Tensor

    def start(self) -> tuple[Tensor, Noise]:
        """Raw parameters and noise levels at which the filters start the network."""
        begin, middle = self.filters.values, self.map_.middle

        def tensor(values: object) -> Tensor:
            return torch.as_tensor(values, dtype=middle.dtype, device=middle.device)

        values = middle.clone()
        values[list(self.dofs)] = tensor(begin.mass)
        values[6:] = tensor(np.concatenate([begin.damping, begin.trim]))
        levels = (begin.sensor, begin.disturbance, begin.time_constant_s)
        return self.map_.raw(values), Noise(*map(tensor, levels))

    def curvature(self, point: Point) -> Tensor:
        """Curvature of half the loss without priors, ordered as `Point.where`: from the filters, and from the
        network's own equations for masses that are not fitted."""
        like, noise, count, n = point.raw, point.noise, len(point.raw), len(self.dofs)
        by_filters = self.filters.curvature(self._values(like, noise))
        # In the network's order the sensors come before the disturbances.
        sensors = len(noise.sensor)
        index = [
            *self.dofs,
            *range(6, count),
            *range(count + sensors, count + sensors + 2 * n),
            *range(count, count + sensors),
        ]
        # A sensor's noise shows in the means of intervals, which are fewer than the readings of a filter.
        ones = torch.ones(2 * n, dtype=like.dtype, device=like.device)
        unit = torch.cat([self.map_.to_logarithm(like), self.share.sqrt(), ones])[index]
        out = torch.zeros(len(point.slope), len(point.slope), dtype=like.dtype, device=like.device)
        others = [dof for dof in range(6) if dof not in self.dofs]
        out[np.ix_(others, others)] = point.equations.information[np.ix_(others, others)]
        out[np.ix_(index, index)] = torch.as_tensor(by_filters, device=like.device) * torch.outer(unit, unit)
        return out

    def near(self, raw: Tensor, noise: Noise) -> StartFit:
        """See `StartFit.near`."""
        return self.filters.near(self._values(raw, noise))

    def _values(self, raw: Tensor, noise: Noise) -> StartValues:
        values, n = self.map_.values(raw), len(self.dofs)
        parts = (values[list(self.dofs)], values[6 : 6 + n], values[6 + n :])
        levels = (noise.disturbance, noise.time_constant_s, noise.sensor)
        return StartValues(*(part.cpu().numpy() for part in (*parts, *levels)))


@dataclass(frozen=True)
class Fit:
    """Result of training.

    values (6 + 2 n,): six masses, n dampings, n trims, SI units. covariance: of their logarithms, trims as they are.
    stretch (2 n, 2): factors on the lower and the upper half of the interval, for each fitted mass and then damping.
    information (p, p): of the dive alone on these values and on the noise levels. filters: filters of all axes at
    these values. sensor (C,), disturbance, time_constant_s (n,): the noise levels.
    """

    layout: Layout
    values: Array
    covariance: Array
    stretch: Array
    information: Array
    filters: StartFit
    sensor: Array
    disturbance: Array
    time_constant_s: Array
    settled: bool
    reason: str

    def information_of(self, indices: list[int]) -> Array:
        """Information of these values with all other parameters projected out."""
        others = [i for i in range(len(self.information)) if i not in indices]
        cross = self.information[np.ix_(indices, others)]
        return np.asarray(
            self.information[np.ix_(indices, indices)]
            - cross @ np.linalg.pinv(self.information[np.ix_(others, others)], hermitian=True) @ cross.T
        )


@dataclass(frozen=True)
class Task:
    """A dive ready to be trained on: its layout, the trainer, and the start point of training."""

    layout: Layout
    trainer: Trainer
    start: Point
    guide: Guide


def task_of(
    dive: Dive,
    file: VehicleFile,
    configuration_name: str,
    built: Axes,
    device: torch.device,
    progress: Progress,
) -> Task:
    """Return the task for a dive; there is at least one axis."""
    configuration = file.vehicle.configurations[configuration_name]
    layout = lay_out(dive, file, configuration_name, built, _step_s(dive))
    map_ = raw_of(configuration, layout.dofs, device)
    share = torch.as_tensor(layout.channel_share, device=device)
    guide = Guide(layout.dofs, map_, start_of(built, configuration), share)
    prior = _prior(configuration, layout, device)
    watch = _telling(map_, layout.dofs, progress)
    trainer = Trainer(data_of(layout, device), map_, prior, guide.curvature, watch)
    raw, noise = guide.start()
    state = torch.zeros(len(layout.time_s), layout.width, dtype=raw.dtype, device=device)
    state[:, : len(layout.dofs)] = torch.as_tensor(guide.filters.velocity(layout.time_s), device=device)
    return Task(layout, trainer, trainer.at(raw, noise, state), guide)


def fit_network(
    dive: Dive, file: VehicleFile, configuration_name: str, built: Axes, progress: Progress
) -> Fit:
    """Train a network on the readings of a dive's axes; there is at least one axis. Runs on CUDA if there is a card.

    Raises FitError if the readings leave its equations without a solution.
    """
    device = torch.device("cuda" if torch.cuda.is_available() else "cpu")
    try:
        with _one_thread():
            task = task_of(dive, file, configuration_name, built, device, progress)
            trainer, trained = _trained(task)
            progress(1.0, f"the network has settled: {trained.reason}" if trained.settled else trained.reason)
            return _fit(task, trainer, trained)
    except torch.linalg.LinAlgError as error:  # type: ignore[attr-defined]
        raise no_solution(dive) from error


@contextmanager
def _one_thread() -> Iterator[None]:
    """Context with one torch thread: the blocks are too small to be worth a second core, which would only wait."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def _step_s(dive: Dive) -> float:
    """Step between instants, no longer than a command holds: a change of thrust within an interval enters only by
    area and moment."""
    commands = dive.thruster_commands if dive.thruster_commands is not None else dive.tau_cmd
    held_s = COARSEST_S if commands is None else 1.0 / max(commands.rate_hz, 1.0 / COARSEST_S)
    return min(max(dive.duration_s / MANY_INSTANTS, FINEST_S), max(held_s, FINEST_S))


def _trained(task: Task) -> tuple[Trainer, Trained]:
    """Train on all readings but those that are wild at the end, in MOST_PASSES over all trainings."""
    trainer, point, passes = task.trainer, task.start, 0
    left_out = torch.zeros_like(trainer.data.known)
    for _ in range(MOST_TRAININGS):
        before, left_out = left_out, _wild(task.trainer, point)
        if not torch.equal(left_out, before):
            trainer = replace(trainer, data=without(task.trainer.data, left_out))
            point = trainer.at(point.raw, point.noise, point.equations.state)
        trained = trainer.train(point, MOST_PASSES - passes)
        point, passes = trained.point, passes + trained.passes
        if not trained.settled or torch.equal(_wild(task.trainer, point), left_out):
            break
        if passes == MOST_PASSES:
            return trainer, replace(trained, settled=False, reason=UNSETTLED_TEXT)
    return trainer, trained


def _wild(trainer: Trainer, point: Point) -> Tensor:
    """The readings (N, C) that are a sensor's errors; none if there are so many that the model must be wrong."""
    wild_readings = wild(trainer.data, trainer.map_, point.raw, point.noise, point.equations.state)
    return wild_readings & (wild_readings.sum() <= LARGEST_SHARE * trainer.data.known.sum())


def _fit(task: Task, trainer: Trainer, trained: Trained) -> Fit:
    layout = task.layout
    map_, raw, noise = trainer.map_, trained.point.raw, trained.point.noise
    to_log = map_.to_logarithm(raw)
    per_unit = torch.cat([1 / to_log, torch.ones_like(noise.logarithm())])
    covariance = torch.linalg.inv(trained.curvature)[: len(raw), : len(raw)] * torch.outer(to_log, to_log)
    std = covariance.diagonal()[[*layout.dofs, *range(6, 6 + len(layout.dofs))]].sqrt()
    filters = task.guide.near(trained.raw, noise)
    return Fit(
        layout,
        _array(map_.values(trained.raw)),
        _array(covariance),
        filters.stretch(std.cpu().numpy()),
        _array(trained.curvature_by_data * torch.outer(per_unit, per_unit)),
        filters,
        _array(noise.sensor),
        _array(noise.disturbance),
        _array(noise.time_constant_s),
        trained.settled,
        trained.reason,
    )


def _telling(map_: Raw, dofs: tuple[int, ...], progress: Progress) -> Callable[[Point, Tensor], None]:
    """Return a watcher that reports each pass to `progress`: the coefficients so far with their 95 % intervals."""
    names = {dof: MASSES[dof].name for dof in dofs}
    names |= {6 + axis: DAMPINGS[dof].name for axis, dof in enumerate(dofs)}

    passes = count(1)

    def watch(point: Point, covariance: Tensor) -> None:
        number = next(passes)
        values = map_.values(point.raw).tolist()
        half = (Z95 * covariance.diagonal().sqrt() * map_.slope(point.raw)).tolist()
        fitted = {name: (values[i], half[i]) for i, name in names.items()}
        progress(number / (number + USUAL_PASSES), f"pass {number}", fitted)

    return watch


def _prior(configuration: Configuration, layout: Layout, device: torch.device) -> Prior:
    rigid = np.array([configuration.rigid_body(dof)[0] for dof in layout.dofs])
    parts = (
        layout.channel_noise,
        DISTURBANCE_SHARE * rigid,
        np.full(len(rigid), TIME_S),
        layout.channel_spread,
    )
    sensor, disturbance, time_s, spread = (torch.as_tensor(part, device=device) for part in parts)
    return Prior(Noise(sensor, disturbance, time_s), spread)


def _array(values: Tensor) -> Array:
    return np.asarray(values.cpu().numpy(), dtype=np.float64)
