"""A mission prepared for training: driven axes of surge, sway, heave and yaw, with forces and readings on even
steps."""

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from bench.missions import Mission
from bridge.vehicle.dynamics import restoring
from identify.dive import Signal
from identify.estimators.motion import smoothed_velocity
from identify.forces import wrench
from identify.ingest.rotation import attitude_at

Array = NDArray[np.float64]

STEP_S = 0.05
FOG_STEPS = 2
"""Means of the fibre-optic gyro are pooled over this many steps, because both of its rates divide them."""

FITTED = (0, 1, 2, 5)
HEAVE, YAW = 2, 5
LEAST_START_S, LAGS_OF_START = 0.5, 10.0
BESIDE_DRY, DAMPING_AT_LEAST = 1.5, 1e-3


@dataclass(frozen=True)
class Instants:
    """R velocity readings, each of one `axis` (its place among the fitted axes) within one step.

    weight (R, 4): cubic weights of velocity and acceleration at the start of the step, then at its end.
    """

    axis: Tensor
    step: Tensor
    weight: Tensor
    value: Tensor
    std: Tensor


@dataclass(frozen=True)
class Means:
    """R readings of the mean velocity of one `axis` over FOG_STEPS steps from `step` on."""

    axis: int
    step: Tensor
    value: Tensor
    std: float


@dataclass(frozen=True)
class Depths:
    """R depths, m, at the instants `at`; `down` (N, n): depth rate per unit of each fitted axis's velocity."""

    at: Tensor
    down: Tensor
    value: Tensor
    std: float


@dataclass(frozen=True)
class Task:
    """N steps between N + 1 instants, with n fitted axes `dofs`; float64, SI.

    force (2 N + 1, n): thrust less restoring force at instants and halfway. others (2 N + 1, 6): smoothed velocity of
    the axes that are not fitted, 0 in the fitted ones. seen (N + 1, n): smoothed readings. mass (6,), damping (n,):
    initial values of training. trim (n,): scale of the trims, which start at 0. disturbance_std, disturbance_time_s
    (n,): of a first-order Gauss-Markov acceleration. These and all standard deviations are the true ones.
    """

    dofs: tuple[int, ...]
    force: Tensor
    others: Tensor
    seen: Tensor
    instants: Instants
    means: Means | None
    depths: Depths | None
    mass: Tensor
    damping: Tensor
    trim: Tensor
    disturbance_std: Tensor
    disturbance_time_s: Tensor

    @property
    def steps(self) -> int:
        return len(self.seen) - 1

    @property
    def duration_s(self) -> float:
        return STEP_S * self.steps


def task_of(mission: Mission) -> Task:
    """Prepare the task, with the noise levels that the mission truly had."""
    dive, shape, sensors = mission.dive, mission.drawn.configuration, mission.sensors
    assert dive.velocity is not None
    assert dive.gyro is not None
    assert dive.attitude is not None
    dofs = tuple(dof for dof in FITTED if dof in mission.drawn.driven)
    forces = wrench(dive, mission.file, mission.configuration)
    pooled_s = FOG_STEPS * STEP_S
    # A form does not know what the thrusters did before the first command; some lags later that no longer matters.
    start_s = pooled_s * np.ceil(max(LAGS_OF_START * forces.lag_s, LEAST_START_S) / pooled_s)
    steps = FOG_STEPS * int((mission.time_s[-1] - start_s) / pooled_s)
    halves_s = start_s + 0.5 * STEP_S * np.arange(2 * steps + 1)
    nodes_s = halves_s[::2]
    attitude = attitude_at(dive.attitude, halves_s)
    g = np.column_stack([np.broadcast_to(f, halves_s.shape) for f in restoring(shape, tuple(attitude.T))])
    force = np.ascontiguousarray((forces.at(halves_s) - g)[:, list(dofs)])
    smooth = smoothed_velocity(dive, halves_s)
    smooth[:, :3] -= np.cross(smooth[:, 3:], lever_of(mission))
    seen = np.ascontiguousarray(smooth[::2, list(dofs)])
    others = smooth.copy()
    others[:, list(dofs)] = 0.0
    rigid = np.array([shape.dry_mass_kg] * 3 + list(shape.inertia_kgm2))
    spread = np.sqrt(np.mean(force**2, axis=0))
    damping = spread / np.maximum(np.sqrt(np.mean(seen**2, axis=0)), DAMPING_AT_LEAST)
    return Task(
        dofs,
        torch.from_numpy(force),
        torch.from_numpy(others),
        torch.from_numpy(seen),
        _instants(mission, dofs, nodes_s),
        _means(dive.fog, dofs, nodes_s, sensors.fog_rad_s),
        _depths(mission, dofs, nodes_s, attitude[1::2]),
        torch.from_numpy(BESIDE_DRY * rigid),
        torch.from_numpy(damping),
        torch.from_numpy(0.1 * spread),
        torch.from_numpy((mission.drawn.disturbance_std / mission.drawn.mass)[list(dofs)]),
        torch.from_numpy(mission.drawn.disturbance_time_s[list(dofs)]),
    )


def _instants(mission: Mission, dofs: tuple[int, ...], nodes_s: Array) -> Instants:
    """DVL readings, carried to the body's origin, and the gyro's yaw rate if no fibre-optic gyro is fitted."""
    dive, sensors = mission.dive, mission.sensors
    assert dive.velocity is not None
    assert dive.gyro is not None
    turning = smoothed_velocity(dive, dive.velocity.time_s)[:, 3:]
    velocity = dive.velocity.value - np.cross(turning, lever_of(mission))
    parts = []
    for axis, dof in enumerate(dofs):
        if dof < YAW:
            good = np.isfinite(velocity[:, dof])
            time_s, value = dive.velocity.time_s[good], velocity[good, dof]
            parts.append((axis, time_s, value, np.full(len(value), sensors.dvl_m_s)))
        elif dive.fog is None:
            time_s, value, count = pooled(dive.gyro, 2, nodes_s)
            parts.append((axis, time_s, value, sensors.gyro_rad_s / np.sqrt(count)))
    steps, weights, values, stds, axes = [], [], [], [], []
    for axis, time_s, value, std in parts:
        inside = (time_s >= nodes_s[0]) & (time_s < nodes_s[-1])
        since = (time_s[inside] - nodes_s[0]) / STEP_S
        step = np.minimum(since.astype(np.int64), len(nodes_s) - 2)
        steps.append(step)
        weights.append(hermite(since - step))
        values.append(value[inside])
        stds.append(std[inside])
        axes.append(np.full(len(step), axis))
    return Instants(
        *(torch.from_numpy(np.concatenate(part)) for part in (axes, steps, weights, values, stds))
    )


def lever_of(mission: Mission) -> Array:
    """Lever (3,) from the body's origin to the DVL, m; zero without a DVL."""
    dvl = mission.file.vehicle.sensors.dvl
    return np.zeros(3) if dvl is None else np.asarray(dvl.mounting.position_m)


def hermite(share: Array) -> Array:
    """Weights (R, 4) of velocity and acceleration at both ends of a step, for the velocity at a share of the step."""
    s, left = share, 1.0 - share
    return np.column_stack(
        [(1 + 2 * s) * left**2, STEP_S * s * left**2, s**2 * (3 - 2 * s), -STEP_S * s**2 * left]
    )


def pooled(signal: Signal, column: int, nodes_s: Array) -> tuple[Array, Array, Array]:
    """Mean time, mean value and number of the finite readings of each step; steps without readings are omitted."""
    value = signal.value[:, column]
    inside = (signal.time_s >= nodes_s[0]) & (signal.time_s < nodes_s[-1]) & np.isfinite(value)
    time_s, value = signal.time_s[inside], value[inside]
    step = np.clip(np.searchsorted(nodes_s, time_s, side="right") - 1, 0, len(nodes_s) - 2)
    count = np.bincount(step, minlength=len(nodes_s) - 1).astype(np.float64)
    filled = count > 0
    mean_s, mean = (
        np.bincount(step, x, minlength=len(count))[filled] / count[filled] for x in (time_s, value)
    )
    return mean_s, mean, count[filled]


def _means(fog: Signal | None, dofs: tuple[int, ...], nodes_s: Array, std: float) -> Means | None:
    if fog is None or YAW not in dofs:
        return None
    at = nodes_s[::FOG_STEPS]
    block = np.searchsorted(at, fog.time_s, side="right") - 1
    count = np.bincount(block[block >= 0], minlength=len(at))[: len(at) - 1]
    total = np.bincount(block[block >= 0], fog.value[block >= 0, 0], minlength=len(at))[: len(at) - 1]
    full = np.flatnonzero(count == count.max())
    return Means(
        dofs.index(YAW),
        torch.from_numpy(FOG_STEPS * full),
        torch.from_numpy(total[full] / count.max()),
        std / float(np.sqrt(count.max())),
    )


def _depths(mission: Mission, dofs: tuple[int, ...], nodes_s: Array, attitude: Array) -> Depths | None:
    """Depth readings of the dive; None if heave is not fitted. attitude (N, 4): in the middle of each step."""
    depth = mission.dive.depth
    if depth is None or HEAVE not in dofs:
        return None
    w, x, y, z = attitude.T
    down = np.column_stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])
    rate = np.column_stack([down[:, dof] if dof < 3 else np.zeros(len(down)) for dof in dofs])
    at = np.rint((depth.time_s - nodes_s[0]) / STEP_S).astype(np.int64)
    near = np.abs(depth.time_s - nodes_s[0] - STEP_S * at) < 1e-6
    good = near & (at >= 0) & (at < len(nodes_s)) & np.isfinite(depth.value[:, 0])
    return Depths(
        torch.from_numpy(at[good]),
        torch.from_numpy(rate),
        torch.from_numpy(depth.value[good, 0]),
        mission.sensors.depth_m,
    )
