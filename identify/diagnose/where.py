"""Where a gap lies: its squared size, split over degree of freedom and what the vehicle does there and then."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.vehicle.coefficients import DOFS
from identify.diagnose.diagnosis import Phase, Share, Slice
from identify.diagnose.drift import Drift
from identify.diagnose.generic import Left
from identify.diagnose.whitened import LEVELLED

Array = NDArray[np.float64]

PHASES: tuple[Phase, ...] = ("rest", "accelerating", "decelerating", "steady", "turning", "reversing")
REST, ACCELERATING, DECELERATING, STEADY, TURNING, REVERSING = range(6)

SLOW, QUICK = 0.15, 0.25
"""Shares of the speed, and of the acceleration, that 95 % of a dive stays below: slower is rest, quicker no steady
motion."""

LEAST_SPEED_M_S, LEAST_TURN_RAD_S = 0.02, 0.03
MEANT_S = 0.5
PUSHED = tuple(dof for dof in range(6) if dof not in LEVELLED)
NORMAL = 0.6745
"""Median of the sizes of normal values, in their standard deviation."""

LEAST_QUIET = 0.01
"""No disturbance is told from rounding where most of a dive drifts by less of its floor."""

OCTANTS = np.deg2rad(np.arange(-180.0, 181.0, 45.0))
LEAST_SHARE = 0.001


def phases_of(course: Course, every: int) -> NDArray[np.intp]:
    """(n,) which of PHASES each of every so many instants lies in."""
    return phases_of_motion(course.nu[::every], course.step_s * every)


def phases_of_motion(nu: Array, step_s: float) -> NDArray[np.intp]:
    """(n,) which of PHASES velocities (n, 6) belong to; turning comes before reversing, that before the change of
    speed."""
    kernel = np.ones(max(round(MEANT_S / step_s), 1))
    kernel /= len(kernel)
    speed = np.convolve(np.linalg.norm(nu[:, :3], axis=1), kernel, mode="same")
    gaining = np.gradient(speed, step_s)
    turn = np.abs(np.convolve(nu[:, 5], kernel, mode="same"))
    slow = max(SLOW * float(np.percentile(speed, 95)), LEAST_SPEED_M_S)
    turns = max(SLOW * float(np.percentile(turn, 95)), LEAST_TURN_RAD_S)
    quick = max(QUICK * float(np.percentile(np.abs(gaining), 95)), 1e-6)
    out = np.full(len(nu), STEADY)
    out[gaining > quick] = ACCELERATING
    out[gaining < -quick] = DECELERATING
    out[nu[:, 0] < -slow] = REVERSING
    out[turn > turns] = TURNING
    out[(speed < slow) & (turn <= turns) & (np.abs(gaining) <= quick)] = REST
    return out


def shares_of(power: Array, phases: NDArray[np.intp]) -> tuple[Share, ...]:
    """The shares of a power (n, 6) by degree of freedom and phase, largest first; they sum to 1."""
    table = np.stack([power[phases == k].sum(axis=0) for k in range(len(PHASES))])
    total = float(table.sum())
    if total <= 0:
        return ()
    # What is less than a tenth of a per cent is left out, and what is left told so that it sums to 1.
    kept = table > LEAST_SHARE * total
    shares = table * kept / float(table[kept].sum())
    found = [
        Share(DOFS[dof], PHASES[k], float(shares[k, dof])) for k, dof in zip(*np.nonzero(kept), strict=True)
    ]
    return tuple(sorted(found, key=lambda one: -one.share))


def slices_of(power: Array, course: Course, every: int) -> tuple[Slice, ...]:
    """The shares of each degree of freedom's own power by speed, heading, depth, time, voltage and distance."""
    total = power.sum(axis=0)
    speed = np.linalg.norm(course.nu[::every, :3], axis=1)
    by = {
        "speed": speed,
        "depth": course.depth_m[::every],
        "time": course.since_s[::every],
        "voltage": course.voltage_v[::every],
        "distance": np.hypot(*course.position_m[::every].T),
    }
    out = []
    for name, values in by.items():
        if np.isfinite(values).all() and np.ptp(values) > 0:
            out += _cut(name, values, np.quantile(values, [0.0, 1 / 3, 2 / 3, 1.0]), power, total)
    heading = np.remainder(course.euler[::every, 2] + np.pi, 2 * np.pi) - np.pi
    return tuple(out + _cut("heading", heading, OCTANTS, power, total))


def _cut(name: str, values: Array, edges: Array, power: Array, total: Array) -> list[Slice]:
    """The slices between the edges (k + 1,)."""
    place = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
    out = []
    for dof in np.flatnonzero(total > LEAST_SHARE * total.sum()).tolist():
        inside = np.bincount(place, power[:, dof], len(edges) - 1) / total[dof]
        out += [
            Slice(DOFS[dof], name, float(low), float(high), float(share))
            for low, high, share in zip(edges[:-1], edges[1:], inside, strict=True)
        ]
    return out


def power_of_left(left: Left, every: int) -> Array:
    """(n, 6) at every so many instants: the squares of the generic forces that foretell most of what is left, each as
    large as the nats that it saves; (0, 6) without any.

    Not in roll and pitch: what is too little there to be sure of tells of what levels the vehicle.
    """
    shapes = [(one, gain) for one, gain in zip(left.shapes, left.gains, strict=True) if one.dof in PUSHED]
    out = np.zeros((len(shapes[0][0].force[::every]) if shapes else 0, 6))
    for shape, gain in shapes:
        square = shape.force[::every] ** 2
        out[:, shape.dof] += gain * square / max(float(np.mean(square)), 1e-300)
    return out


def power_of_drift(drift: Drift, time_s: Array, dofs: Sequence[int]) -> Array:
    """(n, 6): by how much the squared drift of the window around each instant exceeds its floor's in some axes; at
    least 0 over the whole dive in each, and all that there is where none exceeds it."""
    square = np.nan_to_num((drift.off / drift.floor) ** 2)
    square *= np.isin(np.arange(6), list(dofs))
    over = _over(square)
    return (over if over.any() else square)[_nearest(drift, time_s)]


def power_of_rest(after: Drift, time_s: Array, dofs: Sequence[int]) -> Array:
    """(n, 6): by how much, in some axes, the squared drift with the causes in exceeds what most of the dive drifts by.

    What nobody explains is noise to a fit, and a floor that is drawn from that noise holds it, too. Where it comes and
    goes, most windows are without it: the median of their sizes gives the spread of what is always there (Rousseeuw
    and Croux 1993, section 1).
    """
    usual = np.median(np.abs(after.off), axis=0) / NORMAL
    quiet = np.clip(usual, LEAST_QUIET * after.floor, after.floor)
    square = np.nan_to_num((after.off / quiet) ** 2) * np.isin(np.arange(6), list(dofs))
    return _over(square)[_nearest(after, time_s)]


def _over(square: Array) -> Array:
    """Squares (w, 6), made less by as much as leaves of their means what exceeds 1."""
    mean = np.mean(square, axis=0)
    return np.asarray(square * np.maximum(mean - 1.0, 0.0) / np.maximum(mean, 1e-300))


def _nearest(drift: Drift, time_s: Array) -> NDArray[np.intp]:
    """Which window's middle lies next to each time."""
    middle = drift.starts_s + 0.5 * drift.horizon_s
    return np.clip(np.searchsorted(middle, time_s), 0, len(middle) - 1)
