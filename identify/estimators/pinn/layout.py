"""A dive on the network's instants: forces and readings between them, and Fossen's equations over each interval.

The weak form with a test function per interval, momentum gained less impulse:

    R = M (nu1 - nu0) + h (C(nu_m) nu_m + D nu_m + K x_m - push - trim - (d0 + d1) / 2),

with nu_m and x_m the means of the network's velocity and of its integral: the trapezium rule, plus the
Euler-Maclaurin correction for forces that differ between the ends. No velocity is differentiated, so noise does no
harm. Each line is a polynomial, so its slopes are written out; a test checks them against automatic differentiation.
"""

from dataclasses import dataclass, fields, replace
from functools import cache
from itertools import pairwise
from typing import Literal

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from bridge.arrays import Array
from bridge.vehicle.coefficients import HEAVE
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.dynamics import coriolis
from identify.dive import Dive
from identify.estimators.axes.axis import Axes, Axis
from identify.estimators.filter.state import INCREMENT, POSITION
from identify.thrust.wrench import wrench

MANY = 3
"""From this many readings of a channel in an interval on, their mean counts as the mean over the interval."""


@dataclass(frozen=True)
class Readings:
    """Readings of a channel, one per interval, as defined in `Layout`: before, after (N, s), all else (N,). Or of all
    channels, with an axis C for them after N."""

    value: Array
    before: Array
    after: Array
    swung: Array
    bent: Array
    open: Array
    scale: Array


def readings_in(axis: Axis, channel: int, time_s: Array, width: int, first: int, integral: int) -> Readings:
    """Return the readings of a channel of an axis between the nodes' times; readings in the same interval become
    their mean.

    `first` and `integral` are the indices of velocity and its integral among the `width` values of a state.
    """
    count = len(time_s) - 1
    mine = (axis.channel == channel) & np.isfinite(axis.reading)
    reads = axis.channels[channel].state_read
    at, reading, scale = axis.time_s[mine], axis.reading[mine], axis.scale[mine]
    # An increment lies before its own end; other readings lie after the node that they follow.
    side: Literal["left", "right"] = "left" if reads == INCREMENT else "right"
    k = np.clip(np.searchsorted(time_s, at, side=side) - 1, 0, count - 1)
    h = time_s[k + 1] - time_s[k]
    s = np.clip((at - time_s[k]) / h, 0.0, 1.0)
    before, after = np.zeros((len(at), width)), np.zeros((len(at), width))
    if reads == POSITION:
        bow = 0.5 * s * (1 - s) * h
        before[:, integral], after[:, integral] = 1 - s, s
        before[:, first], after[:, first] = bow, -bow
        swung = curved = np.zeros(len(at))
    elif reads == INCREMENT:
        # Increments are summed below to the interval's whole increment; each reading is a share of it.
        before[:, first] = after[:, first] = 0.5 * h
        swung, curved = 0.5 * h, h**2 / 12
    else:
        before[:, first], after[:, first] = 1 - s, s
        swung, curved = 1 - np.abs(2 * s - 1), 0.5 * s * (1 - s) * h
    number = np.bincount(k, minlength=count).astype(np.float64)
    total, step_s = np.maximum(number, 1.0), np.diff(time_s)

    def mean(values: Array) -> Array:
        return np.asarray(np.bincount(k, values, minlength=count) / total)

    if reads == INCREMENT:
        value = np.bincount(k, reading, minlength=count).astype(np.float64)
        spread = np.sqrt(np.bincount(k, scale**2, minlength=count))
        covered = np.bincount(k, scale, minlength=count)
        whole = np.abs(covered - step_s) < 0.02 * step_s
        value = np.where((number > 0) & whole, value, np.nan)
        left_open = step_s**5 / 720
    else:
        # Variance of integrated Brownian motion that is fixed at both ends: at a point, or of its mean.
        alone = step_s**3 * mean((s * (1 - s)) ** 3 / 3)
        left_open = np.where(number >= MANY, step_s**3 / 720, alone / total) * (reads != POSITION)
        value = np.where(number > 0, mean(reading), np.nan)
        spread = np.sqrt(mean(scale**2) / total)
    return Readings(
        value,
        np.column_stack([mean(before[:, i]) for i in range(width)]),
        np.column_stack([mean(after[:, i]) for i in range(width)]),
        mean(swung),
        mean(curved),
        left_open,
        np.where(number > 0, spread, 1.0),
    )


NEAREST = 0.75
"""Share of a step from which on the end of a gyro's interval may be the next instant."""


@dataclass(frozen=True)
class Layout:
    """A dive as the network takes it: n axes, N intervals between N + 1 instants, C channels of readings.

    A node's state is (nu (n), d (n), x (placed)): velocity, disturbance, and, if a sensor reads a position, the
    integral of velocity; s values in all. In interval k, with nu0, d0 and nu1, d1 at its ends and s = t / h,

        nu(t) = nu0 + (nu1 - nu0) s + (1 - |2 s - 1|) swing_k / M + s (1 - s) / 2 h (d0 - d1) / M

    is the velocity under a thrust whose halves differ and a disturbance that goes from d0 to d1.

    time_s (N + 1,), step_s (N,). push (N, n): mean force less restoring force. swing (N, n): a quarter of the step
    times the excess of its first half's force over the second's. others (N, 6): mean velocity of the axes that are
    not fitted, 0 for fitted axes. stiffness (n,): moment per angle.

    A reading in interval k of channel c is before . s_k + after . s_k+1 + (swung swing + bent (d0 - d1)) / M_axis,
    with noise of standard deviation scale sigma_c. A disturbance that wanders within the interval adds a variance of
    open q / M^2, with q its spectral density. before, after (N, C, s); value, swung, bent, open, scale (N, C), value
    NaN if nothing was read. channel_share (C,): intervals with a reading over the number of readings, because
    readings in one interval become one.
    """

    dofs: tuple[int, ...]
    placed: tuple[int, ...]
    time_s: Array
    step_s: Array
    push: Array
    swing: Array
    others: Array
    stiffness: Array
    read: Readings
    channel_axis: NDArray[np.int64]
    channel_name: tuple[str, ...]
    channel_reads: NDArray[np.int64]
    channel_noise: Array
    channel_spread: Array
    channel_share: Array

    @property
    def width(self) -> int:
        """Number of values in a node's state."""
        return 2 * len(self.dofs) + len(self.placed)


def lay_out(dive: Dive, file: VehicleFile, configuration_name: str, built: Axes, step_s: float) -> Layout:
    """Return the layout of the readings of a dive's axes, at least one."""
    axes = built.axes
    time_s = instants(axes, step_s)
    start_s, end_s = time_s[:-1], time_s[1:]
    dofs = tuple(axis.dof for axis in axes)
    halves = wrench(dive, file, configuration_name).halves_between(start_s, end_s)[:, :, list(dofs)]
    held = [built.motion.mean_between(built.restoring[dof], start_s, end_s) for dof in dofs]
    push = halves.mean(axis=1) - np.column_stack(held)
    others = np.column_stack([built.motion.mean_between(nu, start_s, end_s) for nu in built.motion.nu.T])
    others[:, list(dofs)] = 0.0
    placed = tuple(
        i for i, axis in enumerate(axes) if axis.dof == HEAVE or axis.stiffness > 0 or _is_placed(axis)
    )
    width = 2 * len(axes) + len(placed)
    columns, names, readings = [], [], []
    for i, axis in enumerate(axes):
        for c, channel in enumerate(axis.channels):
            names.append((i, channel))
            readings.append(np.count_nonzero(np.isfinite(axis.reading[axis.channel == c])))
            integral = 2 * len(axes) + placed.index(i) if i in placed else -1
            columns.append(readings_in(axis, c, time_s, width, i, integral))

    read = Readings(
        *(np.stack([getattr(column, part.name) for column in columns], axis=1) for part in fields(Readings))
    )
    return Layout(
        dofs,
        placed,
        time_s,
        np.diff(time_s),
        push,
        0.25 * np.diff(time_s)[:, None] * (halves[:, 0] - halves[:, 1]),
        others,
        np.array([axis.stiffness for axis in axes]),
        read,
        np.array([i for i, _ in names]),
        tuple(channel.name for _, channel in names),
        np.array([channel.state_read for _, channel in names]),
        np.array([channel.noise for _, channel in names]),
        np.array([channel.noise_spread for _, channel in names]),
        np.isfinite(read.value).sum(axis=0) / np.maximum(readings, 1),
    )


def instants(axes: tuple[Axis, ...], step_s: float) -> Array:
    """The nodes' times (N + 1,): every `step_s`, or at the interval ends of an integrating gyro."""
    start = min(float(axis.time_s[0]) for axis in axes)
    end = max(float(axis.time_s[-1]) for axis in axes)
    for axis in axes:
        ends = axis.time_s[axis.state_read == INCREMENT]
        if len(ends) > 1:
            known = np.isfinite(axis.reading[axis.state_read == INCREMENT])
            return _filled(_thinned(ends, known, step_s), start, end, step_s)
    count = max(int(np.ceil((end - start) / step_s)), 1)
    return start + step_s * np.arange(count + 1, dtype=np.float64)


def _thinned(ends: Array, known: NDArray[np.bool_], step_s: float) -> Array:
    """Every few of the ends, about `step_s` apart; ends next to a gap are all kept."""
    kept = [0]
    for i in range(1, len(ends)):
        next_to_gap = not known[i] or (i + 1 < len(ends) and not known[i + 1])
        if next_to_gap or ends[i] - ends[kept[-1]] >= NEAREST * step_s:
            kept.append(i)
    chosen: Array = ends[kept]
    return np.asarray(chosen[np.concatenate([[True], np.diff(chosen) > 1e-6])])


def _filled(times: Array, start: float, end: float, step_s: float) -> Array:
    """`times`, extended from start to end, with long gaps divided into steps of about `step_s`."""
    bounds = np.concatenate([[start], times[(times > start) & (times < end)], [end]])
    pieces = [bounds[:1]]
    for left, right in pairwise(bounds.tolist()):
        if right - left > 1e-6:
            count = max(round((right - left) / step_s), 1) if right - left > 2.5 * step_s else 1
            pieces.append(left + (right - left) * np.arange(1, count + 1) / count)
    return np.asarray(np.concatenate(pieces), dtype=np.float64)


def _is_placed(axis: Axis) -> bool:
    """Whether the integral of an axis's speed is read, such as heading if no signal shows the controller's input."""
    return any(channel.state_read == POSITION for channel in axis.channels)


SIX = range(6)


@cache
def coriolis_forms() -> NDArray[np.float64]:
    """Coriolis tensor (6, 6, 6, 6): c_i = sum_jkl M_j forms[i, j, k, l] nu_k nu_l, symmetric in k and l; from
    `bridge`'s own C."""
    forms = np.zeros((6, 6, 6, 6))
    unit = np.eye(6)
    for j in SIX:
        unit_mass = unit[j].tolist()
        for k in SIX:
            for m in range(k, 6):
                both = np.array(coriolis(unit_mass, (unit[k] + unit[m]).tolist()))
                separate = np.array(coriolis(unit_mass, unit[k].tolist())) + np.array(
                    coriolis(unit_mass, unit[m].tolist())
                )
                squared = 2 * np.array(coriolis(unit_mass, unit[k].tolist()))
                forms[:, j, k, m] = forms[:, j, m, k] = 0.5 * (squared if k == m else both - separate)
    return forms


@dataclass(frozen=True)
class Coefficients:
    """Coefficients in SI units: mass (6,) of all degrees of freedom, damping and trim (n,) of the fitted axes."""

    mass: Tensor
    damping: Tensor
    trim: Tensor


@dataclass(frozen=True)
class Data:
    """A `Layout` and its readings as tensors, and the forms of `coriolis_forms`. known (N, C): whether something was
    read."""

    dofs: tuple[int, ...]
    placed: tuple[int, ...]
    stiffness: Tensor
    forms: Tensor
    channel_axis: Tensor
    step_s: Tensor
    push: Tensor
    swing: Tensor
    others: Tensor
    known: Tensor
    value: Tensor
    before: Tensor
    after: Tensor
    swung: Tensor
    bent: Tensor
    open: Tensor
    scale: Tensor

    @property
    def axes(self) -> int:
        return len(self.dofs)


OF_INTERVALS = ("step_s", "push", "swing", "others", "known", *(each.name for each in fields(Readings)))
"""What `Data` holds for every interval."""


def data_of(layout: Layout, device: torch.device) -> Data:
    """The layout on a device, in float64."""

    def tensors(*all_values: NDArray[np.generic]) -> list[Tensor]:
        return [torch.as_tensor(np.ascontiguousarray(values), device=device) for values in all_values]

    read = layout.read
    known = np.isfinite(read.value)
    return Data(
        layout.dofs,
        layout.placed,
        *tensors(layout.stiffness, coriolis_forms(), layout.channel_axis),
        *tensors(layout.step_s, layout.push, layout.swing, layout.others),
        *tensors(known, np.where(known, read.value, 0.0), read.before, read.after),
        *tensors(read.swung, read.bent, read.open, read.scale),
    )


def between(data: Data, cut: slice) -> Data:
    """The data of some of the intervals."""
    return replace(data, **{name: getattr(data, name)[cut] for name in OF_INTERVALS})


@dataclass(frozen=True)
class Balance:
    """The residual R (N, n) in N s or N m s and its slopes.

    before, after (N, n, s): slopes in the states at both ends. mean (N, 6): nu_m. by_mean (N, n, n): slope of R in
    the fitted axes' nu_m. by_mass (N, n, 6): slope of C(nu_m) nu_m in the masses. swung (N, n): difference of nu_m
    from the trapezium rule, times mass.
    """

    residual: Tensor
    before: Tensor
    after: Tensor
    mean: Tensor
    by_mean: Tensor
    by_mass: Tensor
    swung: Tensor


def balance(data: Data, given: Coefficients, state: Tensor) -> Balance:
    """Momentum balance of every interval; `state` (N + 1, s)."""
    axes, n, width = list(data.dofs), len(data.dofs), state.shape[1]
    first, second, h = state[:-1], state[1:], data.step_s[:, None]
    mass = given.mass[axes]
    eye = torch.eye(n, width, dtype=state.dtype, device=state.device)
    force = bending(data, given.damping, width)
    bent = (first - second) @ force.mT
    mean = data.others.clone()
    swung = 0.5 * data.swing + h / 12 * bent
    mean[:, axes] = mean[:, axes] + 0.5 * (first[:, :n] + second[:, :n]) + swung / mass
    by_mass = torch.einsum("ajkl,Nk,Nl->Naj", data.forms[axes], mean, mean)
    turned = 2 * torch.einsum("akl,Nl->Nak", torch.einsum("ajkl,j->akl", data.forms[axes], given.mass), mean)
    gain = second[:, :n] - first[:, :n]
    angle = torch.zeros(n, width, dtype=state.dtype, device=state.device)
    for i, axis in enumerate(data.placed):
        angle[axis, 2 * n + i] = 1.0
    held = data.stiffness * (0.5 * (first + second) @ angle.mT - h / 12 * gain)
    d = 0.5 * (first[:, n : 2 * n] + second[:, n : 2 * n])
    total = by_mass @ given.mass + given.damping * mean[:, axes] + held - data.push - given.trim - d
    slope = h[:, :, None] * (turned[:, :, axes] + torch.diag(given.damping))
    bend = h[:, :, None] / 12 * (force / mass[:, None])
    pull = 0.5 * h[:, :, None] * (data.stiffness[:, None] * angle - eye.roll(n, dims=1))
    turn = h[:, :, None] ** 2 / 12 * data.stiffness[:, None] * eye
    return Balance(
        mass * gain + h * total,
        slope @ (0.5 * eye + bend) + pull + turn - mass[:, None] * eye,
        slope @ (0.5 * eye - bend) + pull - turn + mass[:, None] * eye,
        mean,
        slope,
        by_mass,
        swung,
    )


def by_coefficients(data: Data, given: Coefficients, state: Tensor, balance: Balance) -> Tensor:
    """Slopes (N, n, 6 + 2 n) of the balance `own` at `state` in masses, dampings and trims."""
    axes, n = list(data.dofs), len(data.dofs)
    h = data.step_s[:, None]
    mass, gain = given.mass[axes], state[1:, :n] - state[:-1, :n]
    eye = torch.eye(n, dtype=state.dtype, device=state.device)
    in_mass = h[:, :, None] * balance.by_mass
    in_mass[:, range(n), axes] += gain
    # The lighter the vehicle, the further its velocity swings and bends.
    in_mass[:, :, axes] -= balance.by_mean * (balance.swung / mass**2)[:, None, :]
    in_damping = h[:, :, None] * torch.diag_embed(balance.mean[:, axes])
    in_damping = in_damping + balance.by_mean * (h / 12 * gain / mass)[:, None, :]
    return torch.cat([in_mass, in_damping, -h[:, :, None] * eye.expand(len(h), n, n)], dim=2)


def bending(data: Data, damping: Tensor, width: int) -> Tensor:
    """Force at an instant that varies within an interval and bends the velocity, as a matrix (n, s) on the state
    there."""
    n = len(data.dofs)
    out = torch.zeros(n, width, dtype=damping.dtype, device=damping.device)
    each = torch.arange(n, device=damping.device)
    out[each, each] = -damping
    out[each, n + each] = 1.0
    for i, axis in enumerate(data.placed):
        out[axis, 2 * n + i] = -data.stiffness[axis]
    return out
