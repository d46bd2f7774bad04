"""The autopilot between sticks and pulses, compiled: depth hold, heading hold or turn, mixer.

As ArduSub in ALT_HOLD: surge and sway go straight to the mixer, a heave stick sets a rate of sinking, a yaw stick a
rate of turning; depth and heading are held while their stick is at neutral.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numba import njit
from scipy.signal import lfilter

from bench.field.mission import TICK_S, Pilot
from bench.field.vehicle import FieldVehicle
from bridge.arrays import Array
from bridge.vehicle.thrusters import allocation_matrix, thrust_curve
from identify.challenge.dive import pulse
from identify.challenge.scenario import coloured


@dataclass(frozen=True)
class VelocityFilter:
    """late_s: age of its readings; smooth_s: time constant of a first-order smoothing; noise_m_s: standard deviation
    of its error along each axis, with a correlation time of `memory_s`."""

    late_s: float
    smooth_s: float
    noise_m_s: float
    memory_s: float


def draw_filter(rng: np.random.Generator) -> VelocityFilter:
    return VelocityFilter(
        rng.uniform(0.02, 0.12),
        rng.uniform(0.03, 0.2),
        float(np.exp(rng.uniform(np.log(0.005), np.log(0.025)))),
        float(np.exp(rng.uniform(np.log(0.5), np.log(3.0)))),
    )


def estimated(
    moving: Array, step_s: float, every: int, velocity_filter: VelocityFilter, rng: np.random.Generator
) -> Array:
    """Estimated velocity (m, 3), m/s, at every `every` steps, from the true velocity (n, 3) at each step."""
    steps = np.arange(len(moving), dtype=np.float64)
    late = np.column_stack(
        [np.interp(steps - velocity_filter.late_s / step_s, steps, column) for column in moving.T]
    )
    if velocity_filter.smooth_s > 0:
        keep = float(np.exp(-step_s / velocity_filter.smooth_s))
        late = lfilter([1.0 - keep], [1.0, -keep], late, axis=0, zi=keep * late[:1])[0]
    seen = late[::every]
    noise = coloured(
        rng, len(seen), every * step_s, velocity_filter.memory_s, 1, np.full(3, velocity_filter.noise_m_s)
    )
    return np.asarray(seen + noise)


def reckoned(velocity: Array, tick_s: float) -> Array:
    """Position (m, 3), m, by dead reckoning on a velocity (m, 3), from its starting point."""
    between = 0.5 * (velocity[1:] + velocity[:-1]) * tick_s
    return np.concatenate([np.zeros((1, 3)), np.cumsum(between, axis=0)])


LOWEST_US, NEUTRAL = 1100, 400
"""First pulse of a table of thrust by whole microseconds, and the place of 1500 us in it."""

SHALLOWEST_M, DEEPEST_M = 1.2, 8.0
FULL_US = 380.0


class Autopilot(NamedTuple):
    """Gains in N and N m per unit of each axis.

    held (2,): rate by error of depth and of heading; damp, gather (6,): wrench by error of rate and by its integral,
    of heave and yaw; bound (6,): limit of the integral's wrench; level (2,), still (2,): roll and pitch moment by
    angle and by rate. matrix (6, k), inverse (k, 6); reach (6,): N and N m with one newton of every thruster.
    straight: 1 if the mixer adds up pulses, as the stock mixer does, with `us_per_n` microseconds per newton for the
    held axes; 0 if it converts thrust into pulses.
    """

    held: Array
    damp: Array
    gather: Array
    bound: Array
    level: Array
    still: Array
    matrix: Array
    inverse: Array
    reach: Array
    thrust_at: Array
    us_per_n: float
    straight: int
    limit_n: float


class Memory(NamedTuple):
    """Memory of the controller: integral (6,) N and N m; aim (2,): depth and heading; before (2,): sink and turn
    stick."""

    integral: Array
    aim: Array
    before: Array


def draw_autopilot(rng: np.random.Generator, vehicle: FieldVehicle, pilot: Pilot) -> Autopilot:
    """Draw gains that a crew would have found: some 0.8 to 1.8 rad/s in yaw, a little less in heave."""
    shape = vehicle.configuration
    matrix = allocation_matrix(shape)
    reach = np.abs(matrix).sum(axis=1)
    damp, gather = np.zeros(6), np.zeros(6)
    damp[2], damp[5] = vehicle.mass[2] * rng.uniform(0.6, 1.2), vehicle.mass[5] * rng.uniform(0.8, 1.8)
    gather[2], gather[5] = damp[2] * rng.uniform(0.1, 0.3), damp[5] * rng.uniform(0.1, 0.3)
    eight = len(shape.thrusters) > 6
    level, still = np.zeros(2), np.zeros(2)
    if eight and rng.random() < 0.5:
        level, still = vehicle.mass[3:5] * 1.0, vehicle.mass[3:5] * 1.0
    curve = thrust_curve(vehicle.file.vehicle.thrust_curve, vehicle.file.path.parent)
    thrust_at = curve.thrust(LOWEST_US + np.arange(2 * NEUTRAL + 1))
    # Exact at half of a level thruster's thrust at full stick: the curve is flatter below, steeper above.
    half = pulse(0.5 * pilot.surge_n / float(reach[0]), thrust_at, NEUTRAL)
    us_per_n = 20.0 / float(thrust_at[half + 10] - thrust_at[half - 10])
    return Autopilot(
        np.array([rng.uniform(0.25, 0.6), rng.uniform(0.4, 1.0)]),
        damp,
        gather,
        0.3 * reach * shape.thruster_limit_n,
        level,
        still,
        matrix,
        np.ascontiguousarray(np.linalg.pinv(matrix, rcond=1e-6)),
        reach,
        thrust_at,
        us_per_n * rng.uniform(0.7, 1.1),
        int(rng.random() < 0.5),
        shape.thruster_limit_n,
    )


def fresh(depth_m: float, heading: float) -> Memory:
    return Memory(np.zeros(6), np.array([depth_m, heading]), np.zeros(2))


@njit(cache=True, error_model="numpy")
def wrench(asked: Array, seen: Array, pilot: Autopilot, memory: Memory, out: Array) -> None:
    """Fill the wrench (6,) for the sticks (5,) and the readings `seen` (9,): roll, pitch, heading, p, q, r, depth,
    sinking m/s, and a spare."""
    depth, heading = seen[6], seen[2]
    sink, turn = asked[2], asked[3]
    if (depth < SHALLOWEST_M and sink < 0.0) or (depth > DEEPEST_M and sink > 0.0):
        sink = 0.0
    if sink != 0.0 or memory.before[0] != 0.0:
        memory.aim[0] = depth
    if turn != 0.0 or memory.before[1] != 0.0:
        memory.aim[1] = heading
    memory.before[0], memory.before[1] = sink, turn
    off = memory.aim[1] - heading
    off -= 2 * np.pi * np.round(off / (2 * np.pi))
    out[0], out[1] = asked[0], asked[1]
    for i in range(2):
        out[3 + i] = -pilot.level[i] * seen[i] - pilot.still[i] * seen[3 + i]
    for axis in (2, 5):
        if axis == 2:
            error = sink + pilot.held[0] * (memory.aim[0] - depth) - seen[7]
        else:
            error = turn + pilot.held[1] * off - seen[5]
        grown = memory.integral[axis] + pilot.gather[axis] * error * TICK_S
        memory.integral[axis] = min(max(grown, -pilot.bound[axis]), pilot.bound[axis])
        out[axis] = pilot.damp[axis] * error + memory.integral[axis]
    out[5] += asked[4]


@njit(cache=True, error_model="numpy")
def pulses(want: Array, pilot: Autopilot, out: Array) -> None:
    """Fill the places (k,) of the pulses in the table of thrust for a wrench (6,)."""
    k = pilot.matrix.shape[1]
    if pilot.straight == 0:
        thrust = pilot.inverse @ want
        worst = max(1.0, np.abs(thrust).max() / (0.95 * pilot.limit_n))
        for i in range(k):
            out[i] = pulse(thrust[i] / worst, pilot.thrust_at, NEUTRAL)
        return
    for i in range(k):
        total = 0.0
        for axis in range(6):
            if pilot.reach[axis] < 1e-9 or want[axis] == 0.0 or pilot.matrix[axis, i] == 0.0:
                continue
            share = want[axis] / pilot.reach[axis]
            offset = pilot.us_per_n * share
            if axis < 2:
                # A stick is a pulse: the pulse that gives its force if no other axis is used.
                offset = float(pulse(share, pilot.thrust_at, NEUTRAL) - NEUTRAL)
            total += np.sign(pilot.matrix[axis, i]) * offset
        out[i] = NEUTRAL + np.round(min(max(total, -FULL_US), FULL_US))
