"""A dive laid out on the network's instants: what pushed between two of them, and what was read there."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.estimators.axes import Axes, Axis
from identify.estimators.innovations import INCREMENT, POSITION
from identify.estimators.readings import HEAVE
from identify.forces import wrench

Array = NDArray[np.float64]

MANY = 3
"""Readings of one channel in an interval from which on their mean is that over the interval."""



@dataclass(frozen=True)
class Layout:
    """n axes, N intervals between N + 1 instants, C channels of readings.

    A node's state is (nu (n), d (n), x (placed)): velocity, disturbance, and where something reads a position the
    integral of velocity; s values in all. In interval k, with the velocity at its ends nu0 and nu1,

        nu(t) = nu0 + (nu1 - nu0) s + (1 - |2 s - 1|) swing_k / M + s (1 - s) / 2 h (d0 - d1) / M,   s = t / h

    is the velocity under a thrust whose halves differ and a disturbance that goes from d0 to d1. time_s (N + 1,), step_s (N,). push (N, n): mean force less
    restoring; swing (N, n): a quarter of step times what its first half exceeds the second by. others (N, 6): mean
    velocity of the axes that are not fitted, 0 in those that are. A reading in interval k of channel c is
    before . s_k + after . s_k+1 + (swung swing + bent (d0 - d1)) / M_axis + noise of standard deviation scale
    sigma_c, and what a disturbance that wanders in between adds, of variance open q / M^2, q its spectral density;
    before and after (N, C, s); value, swung, bent, open, scale (N, C), value NaN where nothing was read. stiffness (n,): moment by
    angle.
    """

    dofs: tuple[int, ...]
    placed: tuple[int, ...]
    time_s: Array
    step_s: Array
    push: Array
    swing: Array
    others: Array
    stiffness: Array
    value: Array
    before: Array
    after: Array
    swung: Array
    bent: Array
    open: Array
    scale: Array
    channel_axis: NDArray[np.int64]
    channel_name: tuple[str, ...]
    channel_reads: NDArray[np.int64]
    channel_noise: Array
    channel_spread: Array

    @property
    def width(self) -> int:
        """Values of one node's state."""
        return 2 * len(self.dofs) + len(self.placed)

    def place_of(self, axis: int) -> int:
        """Where the integral of an axis's velocity lies in the state."""
        return 2 * len(self.dofs) + self.placed.index(axis)


def lay_out(dive: Dive, file: VehicleFile, configuration: str, built: Axes, step_s: float) -> Layout:
    """The layout of what the axes of a dive read, of which there is at least one."""
    axes = built.axes
    time_s = instants(axes, step_s)
    start_s, end_s = time_s[:-1], time_s[1:]
    dofs = tuple(axis.dof for axis in axes)
    halves = wrench(dive, file, configuration).halves_between(start_s, end_s)[:, :, list(dofs)]
    held = [built.motion.mean_between(built.restoring[dof], start_s, end_s) for dof in dofs]
    push = halves.mean(axis=1) - np.column_stack(held)
    others = np.column_stack([built.motion.mean_between(nu, start_s, end_s) for nu in built.motion.nu.T])
    others[:, list(dofs)] = 0.0
    placed = tuple(i for i, axis in enumerate(axes) if axis.dof == HEAVE or axis.stiffness > 0)
    width = 2 * len(axes) + len(placed)
    columns, names = [], []
    for i, axis in enumerate(axes):
        for c, channel in enumerate(axis.channels):
            if channel.state_read == POSITION and i not in placed:
                continue
            names.append((i, channel))
            place = 2 * len(axes) + placed.index(i) if i in placed else -1
            columns.append(_column(axis, c, time_s, width, i, place))
    return Layout(
        dofs,
        placed,
        time_s,
        np.diff(time_s),
        push,
        0.25 * np.diff(time_s)[:, None] * (halves[:, 0] - halves[:, 1]),
        others,
        np.array([axis.stiffness for axis in axes]),
        *(np.stack([column[part] for column in columns], axis=1) for part in range(7)),
        np.array([i for i, _ in names]),
        tuple(channel.name for _, channel in names),
        np.array([channel.state_read for _, channel in names]),
        np.array([channel.noise for _, channel in names]),
        np.array([channel.noise_spread for _, channel in names]),
    )


def instants(axes: tuple[Axis, ...], step_s: float) -> Array:
    """The nodes' times (N + 1,): every `step_s`, or where a gyro that integrates ends its intervals."""
    start = min(float(axis.time_s[0]) for axis in axes)
    end = max(float(axis.time_s[-1]) for axis in axes)
    for axis in axes:
        ends = axis.time_s[axis.state_read == INCREMENT]
        if len(ends) > 1:
            known = np.isfinite(axis.reading[axis.state_read == INCREMENT])
            return _filled(_thinned(ends, known, step_s), start, end, step_s)
    return start + step_s * np.arange(max(int(np.ceil((end - start) / step_s)), 1) + 1)


def _thinned(ends: Array, known: NDArray[np.bool_], step_s: float) -> Array:
    """Every so many of the ends, about `step_s` apart; none of those beside a gap is left out."""
    kept = [0]
    for i in range(1, len(ends)):
        beside_gap = not known[i] or (i + 1 < len(ends) and not known[i + 1])
        if beside_gap or ends[i] - ends[kept[-1]] >= (1 - 1e-3) * step_s:
            kept.append(i)
    chosen = ends[kept]
    return np.asarray(chosen[np.concatenate([[True], np.diff(chosen) > 1e-6])])


def _filled(times: Array, start: float, end: float, step_s: float) -> Array:
    """`times` with what is missing from start to end, and within long gaps, every `step_s`."""
    bounds = np.concatenate([[start], times[(times > start) & (times < end)], [end]])
    pieces = [bounds[:1]]
    for left, right in zip(bounds[:-1], bounds[1:], strict=True):
        if right - left > 1e-6:
            count = max(round((right - left) / step_s), 1) if right - left > 2.5 * step_s else 1
            pieces.append(left + (right - left) * np.arange(1, count + 1) / count)
    return np.concatenate(pieces)


def _column(
    axis: Axis, channel: int, time_s: Array, width: int, own: int, place: int
) -> tuple[Array, ...]:
    """value, before, after, swung, bent, open and scale of one channel; readings of one interval become their mean."""
    count = len(time_s) - 1
    mine = (axis.channel == channel) & np.isfinite(axis.reading)
    reads = axis.channels[channel].state_read
    at, reading, scale = axis.time_s[mine], axis.reading[mine], axis.scale[mine]
    # An increment lies before its own end; all else after the node that it follows.
    side = "left" if reads == INCREMENT else "right"
    k = np.clip(np.searchsorted(time_s, at, side=side) - 1, 0, count - 1)
    h = time_s[k + 1] - time_s[k]
    s = np.clip((at - time_s[k]) / h, 0.0, 1.0)
    before, after = np.zeros((len(at), width)), np.zeros((len(at), width))
    if reads == POSITION:
        bow = 0.5 * s * (1 - s) * h
        before[:, place], after[:, place] = 1 - s, s
        before[:, own], after[:, own] = bow, -bow
        swung = curved = np.zeros(len(at))
    elif reads == INCREMENT:
        # Summed below to the interval's whole increment, which each of them is a share of.
        before[:, own] = after[:, own] = 0.5 * h
        swung, curved = 0.5 * h, h**2 / 12
    else:
        before[:, own], after[:, own] = 1 - s, s
        swung, curved = 1 - np.abs(2 * s - 1), 0.5 * s * (1 - s) * h
    number = np.bincount(k, minlength=count).astype(np.float64)
    total, step_s = np.maximum(number, 1.0), np.diff(time_s)

    def mean(values: Array) -> Array:
        return np.asarray(np.bincount(k, values, minlength=count) / total)

    if reads == INCREMENT:
        value = np.bincount(k, reading, minlength=count)
        spread = np.sqrt(np.bincount(k, scale**2, minlength=count))
        covered = np.bincount(k, scale, minlength=count)
        whole = np.abs(covered - step_s) < 0.02 * step_s
        value = np.where((number > 0) & whole, value, np.nan)
        left_open = step_s**5 / 720
    else:
        # The variance of integrated Brownian motion that is held at both ends: at a point, or of its mean.
        alone = step_s**3 * mean((s * (1 - s)) ** 3 / 3)
        left_open = np.where(number >= MANY, step_s**3 / 720, alone / total) * (reads != POSITION)
        value = np.where(number > 0, mean(reading), np.nan)
        spread = np.sqrt(mean(scale**2) / total)
    return (
        value,
        np.column_stack([mean(before[:, i]) for i in range(width)]),
        np.column_stack([mean(after[:, i]) for i in range(width)]),
        mean(swung),
        mean(curved),
        left_open,
        np.where(number > 0, spread, 1.0),
    )
