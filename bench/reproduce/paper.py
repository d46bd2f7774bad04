"""`paper`: Algorithm 1 of the source paper (Vangi et al., "Deep physics for deep seas"), to the letter.

An LSTM predicts the velocity, and the same optimiser trains physical parameters alongside, on mean |tau_pred - tau|^2
+ alpha mean |v_hat - v|^2, with tau_pred = M v_dot + C(v) v + D v + g. The first term depends on measured velocity and
acceleration only and is linear in the parameters, so they tend to `closed_form`, a least-squares fit bounded below by
zero, whatever the network does; noise in the acceleration pulls the masses towards zero.
"""

import math
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.optimize import lsq_linear
from torch import Tensor, nn

from bridge.arrays import Array
from bridge.errors import FitError
from bridge.vehicle.coefficients import BY_NAME, COEFFICIENTS, DAMPINGS, DOFS, MASSES
from bridge.vehicle.config import Configuration, VehicleFile
from bridge.vehicle.dynamics import coriolis, restoring
from identify.align import AlignedDive, aligned
from identify.dive import Dive
from identify.doubt import Outcome
from identify.estimators.refusals import refuse_unpushed
from identify.identification import Identification, added_mass
from identify.identification import estimate as one_estimate
from identify.progress import Progress

PAPER_DOFS = (0, 1, 5)
DAMPING_START = 1.0
LEAST_RMS = {0: (0.02, 1.0), 1: (0.02, 1.0), 5: (0.02, 0.2)}  # velocity (m/s, rad/s) and wrench (N, N m)


@dataclass(frozen=True)
class Samples:
    """Inputs of the physical loss: `nu`, `nu_dot`, `tau`, `g`, all (n, 6), of which the loss uses the axes `dofs`."""

    nu: Array
    nu_dot: Array
    tau: Array
    g: Array
    dofs: tuple[int, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters: masses of the axes, then dampings."""
        return tuple(MASSES[d].name for d in self.dofs) + tuple(DAMPINGS[d].name for d in self.dofs)


def excited(dive: AlignedDive) -> tuple[dict[int, str], tuple[int, ...]]:
    """Reasons why axes can't be learnt, by axis, and the axes that can be: those of surge, sway and yaw that moved."""
    reasons = {}
    for dof in range(6):
        if dof not in PAPER_DOFS:
            reasons[dof] = "the paper's method learns surge, sway and yaw alone"
        elif not dive.has[dof]:
            reasons[dof] = f"no velocity in {DOFS[dof]} is recorded"
        else:
            moved, pushed = (_rms(a[dive.valid, dof]) for a in (dive.nu, dive.tau))
            least_moved, least_pushed = LEAST_RMS[dof]
            if moved < least_moved or pushed < least_pushed:
                reasons[dof] = f"{DOFS[dof]} was not excited in this dive"
    return reasons, tuple(dof for dof in PAPER_DOFS if dof not in reasons)


def samples(
    dive: AlignedDive, rows: NDArray[np.intp], configuration: Configuration, dofs: Sequence[int]
) -> Samples:
    """The rows of an aligned dive that the loss uses."""
    g = np.column_stack(
        [np.broadcast_to(x, len(rows)) for x in restoring(configuration, list(dive.attitude[rows].T))]
    )
    return Samples(dive.nu[rows], dive.nu_dot[rows], dive.tau[rows], g, tuple(dofs))


def starting_values(configuration: Configuration, dofs: Sequence[int]) -> dict[str, float]:
    """Start values: masses at the rigid body's (the paper: at the dry mass), dampings at 1."""
    masses = {MASSES[d].name: _rigid_body(configuration)[d] for d in dofs}
    return masses | {DAMPINGS[d].name: DAMPING_START for d in dofs}


def fixed_values(configuration: Configuration) -> dict[str, float]:
    """All twelve coefficients before learning: from the vehicle file's model, otherwise the rigid body's mass and no
    damping."""
    rigid = _rigid_body(configuration)
    return {c.name: rigid[c.dof] if c.kind == "mass" else 0.0 for c in BY_NAME.values()} | configuration.model


def predicted_wrench(
    values: Mapping[str, Any], nu_dot: Sequence[Any], nu: Sequence[Any], g: Sequence[Any]
) -> tuple[Any, ...]:
    """tau_pred of the six axes, for arrays or tensors; `values` holds all twelve coefficients by name."""
    mass = [values[c.name] for c in MASSES]
    damping = [values[c.name] for c in DAMPINGS]
    c = coriolis(mass, nu)
    return tuple(mass[i] * nu_dot[i] + c[i] + damping[i] * nu[i] + g[i] for i in range(6))


def closed_form(data: Samples, fixed: Mapping[str, float]) -> dict[str, float]:
    """The parameters that minimise the physical loss with every parameter at or above zero (`lsq_linear`)."""

    def stacked(values: Mapping[str, float]) -> Array:
        wrench = predicted_wrench(values, list(data.nu_dot.T), list(data.nu.T), list(data.g.T))
        return np.concatenate([np.broadcast_to(wrench[dof], len(data.nu)) for dof in data.dofs])

    none = stacked({**fixed, **dict.fromkeys(data.names, 0.0)})
    columns = [stacked({**fixed, **dict.fromkeys(data.names, 0.0), name: 1.0}) - none for name in data.names]
    target = np.concatenate([data.tau[:, dof] for dof in data.dofs]) - none
    fit = lsq_linear(np.column_stack(columns), target, bounds=(0.0, np.inf), method="bvls")
    return dict(zip(data.names, (float(x) for x in fit.x), strict=True))


def _rigid_body(configuration: Configuration) -> tuple[float, ...]:
    return (configuration.dry_mass_kg,) * 3 + configuration.inertia_kgm2


def _rms(value: Array) -> float:
    return float(np.sqrt(np.mean(value**2))) if len(value) else 0.0


INPUTS, OUTPUTS = 7, 6


class PaperNetwork(nn.Module):
    """Maps a window of time steps and velocities (batch, window, 7) to the velocity at its last sample, (batch, 6).

    Table 1: LSTM 5 levels of 1024; linear 1024 to 512, dropout 0.2; Tanh; linear 512 to 6, dropout 0.2.
    """

    def __init__(self, hidden: int, depth: int, dropout: float) -> None:
        super().__init__()
        self.lstm = nn.LSTM(INPUTS, hidden, num_layers=depth, batch_first=True)
        self.head = nn.Sequential(
            nn.Linear(hidden, hidden // 2),
            nn.Dropout(dropout),
            nn.Tanh(),
            nn.Linear(hidden // 2, OUTPUTS),
            nn.Dropout(dropout),
        )

    def forward(self, windows: Tensor) -> Tensor:
        states, _ = self.lstm(windows)
        predicted: Tensor = self.head(states[:, -1])
        return predicted


@contextmanager
def repeatable(seed: int, threads: int) -> Iterator[None]:
    """Context in which the same seed gives the same numbers; torch's settings are restored afterwards."""
    os.environ.setdefault("CUBLAS_WORKSPACE_CONFIG", ":4096:8")  # CUDA's matrix products repeat with it alone
    threads_before = torch.get_num_threads()
    strict_before = torch.are_deterministic_algorithms_enabled()
    torch.set_num_threads(threads)
    torch.use_deterministic_algorithms(True)
    try:
        with torch.random.fork_rng():
            torch.manual_seed(seed)
            yield
    finally:
        torch.use_deterministic_algorithms(strict_before)
        torch.set_num_threads(threads_before)


FEWEST_WINDOWS = 50
WIDE = 256
AT_ZERO = 1e-3
SETTLED = 5e-3
SETTLED_VALUE, SETTLED_LOSS = 0.01, 0.05
NO_INTERVAL = "The paper's method states no interval: std and limits are left empty."


@dataclass(frozen=True)
class PaperOptions:
    """The paper's network (its Table 1), with our choices for all that the paper leaves open.

    `learning_rate` (network) and `physical_rate` (parameters, whose units are kg and N/(m/s)) fall geometrically to a
    thousandth over the epochs. `cutoff_hz`: the zero-phase filter applied first.
    """

    hidden: int = 1024
    depth: int = 5
    window: int = 20
    dropout: float = 0.2
    alpha: float = 1.0
    epochs: int = 100
    batch: int = 256
    learning_rate: float = 1e-3
    physical_rate: float = 2.0
    rate_hz: float = 10.0
    cutoff_hz: float = 1.0
    seed: int = 0
    threads: int = 2

    @property
    def device(self) -> torch.device:
        """A graphics card if there is one; the processor for a narrow network, which is quicker there."""
        return torch.device("cuda" if self.hidden >= WIDE and torch.cuda.is_available() else "cpu")


PAPER = PaperOptions()
SMALL = PaperOptions(hidden=16, depth=1, threads=1)


def sized(network: Sequence[int] | None) -> PaperOptions:
    """The network of that many hidden units, layers and epochs; None for the small one."""
    if network is None:
        return SMALL
    return PaperOptions(hidden=network[0], depth=network[1], epochs=network[2])


@dataclass(frozen=True)
class TrainingCurves:
    """Training history, a row per epoch: `values` (e, p) of the parameters `names`, the two losses (e,), the learning
    rate (e,).

    The first row is the start. The paper's Figs 7 and 9 show these curves.
    """

    names: tuple[str, ...]
    values: Array
    physics_loss: Array
    data_loss: Array
    learning_rate: Array

    @property
    def settled_at(self) -> int:
        """The first epoch from which every parameter stays within SETTLED_VALUE of where it ends."""
        far = np.abs(self.values / self.values[-1] - 1.0).max(axis=1) > SETTLED_VALUE
        return int(np.flatnonzero(far)[-1]) + 1 if far.any() else 0

    @property
    def loss_settled_at(self) -> int:
        """The first epoch from which the network's own loss stays within SETTLED_LOSS of where it ends."""
        far = np.abs(self.data_loss[1:] / self.data_loss[-1] - 1.0) > SETTLED_LOSS
        return int(np.flatnonzero(far)[-1]) + 2 if far.any() else 1


def estimate(
    dive: Dive,
    file: VehicleFile,
    configuration: str,
    progress: Progress,
    options: PaperOptions = SMALL,
) -> Identification:
    """Return the result of the paper's method for a dive. Raises FitError if the dive holds too little.

    By default the network is small: on two idle cores a network of the paper's size takes some 150 s an epoch, and
    the parameters hardly depend on it. A wide network trains on CUDA if there is a card.
    """
    return estimate_with_curves(dive, file, configuration, progress, options)[0]


def estimate_with_curves(
    dive: Dive,
    file: VehicleFile,
    configuration: str,
    progress: Progress,
    options: PaperOptions = SMALL,
) -> tuple[Identification, TrainingCurves]:
    """As `estimate`, together with the training curves."""
    started = time.perf_counter()
    refuse_unpushed(dive, file, configuration)
    learnt = lessons(dive, file, configuration, options)
    if len(learnt.ends) < FEWEST_WINDOWS:
        raise FitError(
            f"only {len(learnt.ends)} windows of {options.window} samples have no gap in velocity, "
            f"at least {FEWEST_WINDOWS} are needed; dive longer or nearer to the bottom",
            of=dive.source,
        )
    shape = file.vehicle.configurations[configuration]
    curves = train(learnt, shape, options, progress)
    values = dict(zip(curves.names, curves.values[-1].tolist(), strict=True))
    answer = identification("paper", values, learnt, dive, file, configuration, started)
    identified = replace(
        answer,
        parameters=(
            *answer.parameters,
            *(added_mass(each, shape) for each in answer.parameters[: len(MASSES)]),
        ),
        settings={"alpha": options.alpha, "cutoff_hz": options.cutoff_hz, "rate_hz": options.rate_hz},
        notes=(*learnt.grid.notes, *_notes(options, curves)),
    )
    return identified, curves


@dataclass(frozen=True)
class Lessons:
    """What the method learns a dive from: the aligned dive, why axes can't be learnt, the rows at which its windows
    end, and the samples of these."""

    grid: AlignedDive
    reasons: dict[int, str]
    ends: NDArray[np.intp]
    data: Samples


def lessons(dive: Dive, file: VehicleFile, configuration: str, options: PaperOptions) -> Lessons:
    """Raises FitError if the dive excites none of the method's axes."""
    grid = aligned(dive, file, configuration, options.rate_hz, options.cutoff_hz)
    reasons, dofs = excited(grid)
    if not dofs:
        raise FitError(
            f"the paper's method finds nothing to learn "
            f"({'; '.join(reasons[d] for d in PAPER_DOFS)}); dive with changes of speed and heading",
            of=dive.source,
        )
    ends = window_ends(grid, options.window)
    return Lessons(grid, reasons, ends, samples(grid, ends, file.vehicle.configurations[configuration], dofs))


def identification(
    method: str,
    values: Mapping[str, float],
    learnt: Lessons,
    dive: Dive,
    file: VehicleFile,
    configuration: str,
    started: float,
) -> Identification:
    """Learnt values as a result, without intervals, which the method does not state."""
    nan = math.nan
    return Identification(
        method=method,
        outcome=Outcome.AT_BOUND if min(values.values()) < AT_ZERO else Outcome.CONVERGED,
        parameters=tuple(
            one_estimate(c.name, values.get(c.name, nan), nan, nan, nan, learnt.reasons.get(c.dof, ""))
            for c in COEFFICIENTS
        ),
        configuration=configuration,
        dive=dive.name,
        dive_sha256=dive.sha256,
        vehicle=file.vehicle.name,
        vehicle_sha256=file.sha256,
        duration_s=dive.duration_s,
        samples=len(learnt.ends),
        wall_s=time.perf_counter() - started,
    )


def window_ends(grid: AlignedDive, window: int) -> NDArray[np.intp]:
    """The rows at which a window of valid samples ends."""
    valid = np.concatenate(([0], np.cumsum(grid.valid)))
    full = valid[window:] - valid[:-window] == window
    return np.flatnonzero(full) + window - 1


def train(
    learnt: Lessons, configuration: Configuration, options: PaperOptions, progress: Progress
) -> TrainingCurves:
    """Algorithm 1, lines 1 to 17."""
    data = learnt.data
    fixed = fixed_values(configuration)
    start = starting_values(configuration, data.dofs)
    device = options.device
    with repeatable(options.seed, options.threads):
        network = PaperNetwork(options.hidden, options.depth, options.dropout).to(device)
        raw = inverse_softplus(torch.tensor([start[name] for name in data.names], dtype=torch.float64))
        raw.requires_grad_(True)
        groups = [
            {"params": list(network.parameters()), "lr": options.learning_rate},
            {"params": [raw], "lr": options.physical_rate},
        ]
        optimiser = torch.optim.Adam(groups)
        decay = 1e-3 ** (1 / max(options.epochs, 1))
        schedule = torch.optim.lr_scheduler.ExponentialLR(optimiser, decay)
        series = torch.tensor(_inputs(learnt.grid), dtype=torch.float32, device=device)
        back = torch.arange(1 - options.window, 1)
        rows = torch.tensor(learnt.ends)
        physics = tensors(data)
        history = [(_values(raw), math.nan, math.nan, options.physical_rate)]
        for epoch in range(options.epochs):
            sums, count = np.zeros(2), 0
            rate = optimiser.param_groups[1]["lr"]
            listed = ", ".join(f"{n} {v:.4g}" for n, v in zip(data.names, history[-1][0], strict=True))
            for batch in torch.split(torch.randperm(len(rows)), options.batch):
                progress((epoch + count / len(rows)) / options.epochs, f"epoch {epoch + 1}: {listed}")
                windows = series[(rows[batch][:, None] + back).to(device)]
                measured = windows[:, -1, 1:]
                l_physics = physics_loss(raw, fixed, data, physics, batch)
                l_data = data_loss(network(windows), measured)
                loss = l_physics + options.alpha * l_data.double().cpu()
                optimiser.zero_grad()
                torch.autograd.backward(loss)
                optimiser.step()
                sums += len(batch) * np.array([l_physics.item(), l_data.item()])
                count += len(batch)
            schedule.step()
            history.append((_values(raw), sums[0] / count, sums[1] / count, rate))
        progress(1.0, f"trained for {options.epochs} epochs")
    values, l_physics_all, l_data_all, rates = zip(*history, strict=True)
    return TrainingCurves(
        data.names, np.array(values), np.array(l_physics_all), np.array(l_data_all), np.array(rates)
    )


def inverse_softplus(value: Tensor) -> Tensor:
    """The raw parameter whose softplus is `value`."""
    return value + torch.log(-torch.expm1(-value))


def physics_loss(
    raw: Tensor, fixed: dict[str, float], data: Samples, tensors: tuple[Tensor, ...], rows: Tensor
) -> Tensor:
    """mean |tau_pred - tau|^2 over the samples `rows`, summed over the learnt axes."""
    theta = torch.nn.functional.softplus(raw)
    values = {**fixed, **{name: theta[i] for i, name in enumerate(data.names)}}
    nu, nu_dot, tau, g = (t[:, rows] for t in tensors)
    wrench = predicted_wrench(values, list(nu_dot), list(nu), list(g))
    residual = torch.stack([wrench[dof] - tau[dof] for dof in data.dofs])
    return (residual**2).sum(dim=0).mean()


def data_loss(predicted: Tensor, measured: Tensor) -> Tensor:
    """mean |v_hat - v|^2."""
    return ((predicted - measured) ** 2).sum(dim=1).mean()


def tensors(data: Samples) -> tuple[Tensor, ...]:
    """nu, nu_dot, tau and g as (6, n), in double precision."""
    return tuple(torch.tensor(a.T, dtype=torch.float64) for a in (data.nu, data.nu_dot, data.tau, data.g))


def _inputs(grid: AlignedDive) -> Array:
    """Inputs (n, 7): the time since the sample before, and the velocities."""
    step_s = np.diff(grid.time_s, prepend=grid.time_s[0] - (grid.time_s[1] - grid.time_s[0]))
    return np.column_stack((step_s, grid.nu))


def _values(raw: Tensor) -> Array:
    values: Array = torch.nn.functional.softplus(raw).detach().numpy().copy()
    return values


def _notes(options: PaperOptions, curves: TrainingCurves) -> tuple[str, ...]:
    notes = [
        NO_INTERVAL,
        f"Network: LSTM of {options.depth} x {options.hidden} (the paper's: {PAPER.depth} x {PAPER.hidden}); "
        "the parameters do not depend on it.",
        f"Before it a zero-phase Butterworth low-pass at {options.cutoff_hz:g} Hz; the noise that it leaves in the "
        "acceleration makes the masses too low.",
    ]
    settled_from = curves.values[-max(len(curves.values) // 10, 2)]
    change = np.abs(curves.values[-1] / settled_from - 1)
    restless = [name for name, c in zip(curves.names, change, strict=True) if c > SETTLED]
    if restless:
        notes.append(f"{', '.join(restless)} had not settled when the training ended: give it more epochs.")
    return tuple(notes)
