"""Lays a dive out on the network's instants: forces between two instants, and readings there."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.estimators.axes import Axes, Axis
from identify.estimators.innovations import INCREMENT, POSITION
from identify.estimators.pinn.intervals import readings_in
from identify.estimators.readings import HEAVE
from identify.forces import wrench

Array = NDArray[np.float64]

NEAREST = 0.75
"""Share of a step from which on the end of a gyro's interval may be the next instant."""


@dataclass(frozen=True)
class Layout:
    """n axes, N intervals between N + 1 instants, C channels of readings.

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
    channel_share: Array

    @property
    def width(self) -> int:
        """Number of values in a node's state."""
        return 2 * len(self.dofs) + len(self.placed)


def lay_out(dive: Dive, file: VehicleFile, configuration: str, built: Axes, step_s: float) -> Layout:
    """Return the layout of the readings of a dive's axes, of which there is at least one."""
    axes = built.axes
    time_s = instants(axes, step_s)
    start_s, end_s = time_s[:-1], time_s[1:]
    dofs = tuple(axis.dof for axis in axes)
    halves = wrench(dive, file, configuration).halves_between(start_s, end_s)[:, :, list(dofs)]
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
            if channel.state_read == POSITION and i not in placed:
                continue
            names.append((i, channel))
            readings.append(np.count_nonzero(np.isfinite(axis.reading[axis.channel == c])))
            place = 2 * len(axes) + placed.index(i) if i in placed else -1
            columns.append(readings_in(axis, c, time_s, width, i, place))

    def stacked(part: str) -> Array:
        return np.stack([getattr(column, part) for column in columns], axis=1)

    value = stacked("value")
    return Layout(
        dofs,
        placed,
        time_s,
        np.diff(time_s),
        push,
        0.25 * np.diff(time_s)[:, None] * (halves[:, 0] - halves[:, 1]),
        others,
        np.array([axis.stiffness for axis in axes]),
        value,
        stacked("before"),
        stacked("after"),
        stacked("swung"),
        stacked("bent"),
        stacked("open"),
        stacked("scale"),
        np.array([i for i, _ in names]),
        tuple(channel.name for _, channel in names),
        np.array([channel.state_read for _, channel in names]),
        np.array([channel.noise for _, channel in names]),
        np.array([channel.noise_spread for _, channel in names]),
        np.isfinite(value).sum(axis=0) / np.maximum(readings, 1),
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
        beside_gap = not known[i] or (i + 1 < len(ends) and not known[i + 1])
        if beside_gap or ends[i] - ends[kept[-1]] >= NEAREST * step_s:
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
