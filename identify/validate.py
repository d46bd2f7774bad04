"""How well a dive followed its reference, phase by phase, as the source paper tells it (Table 5, Figs 10 to
17).

The phases of an axis follow the reference's own derivative: speeding up, steady, slowing down; an axis
whose reference rests is in none. Velocity is the DVL's at its time of validity (yaw: the gyro's), the
reference is interpolated there.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import Vector3
from identify.dive import Array, Dive, Signal

AXES = (0, 1, 5)
PHASES = ("Acceleration", "Steady state", "Deceleration", "Overall")
STEADY_SHARE = 0.05
LEAST_SLOPE = 1e-4
LEAST_SPEED = 1e-3
LAG_STEP_S = 0.05
EARLIEST_S, LATEST_S = -1.0, 4.0

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Phases:
    """Which samples belong to which phase, (n,) each."""

    acceleration: Mask
    steady: Mask
    deceleration: Mask

    @property
    def any(self) -> Mask:
        return self.acceleration | self.steady | self.deceleration


@dataclass(frozen=True)
class AxisErrors:
    """One axis; mean absolute tracking errors in m/s or rad/s, NaN where a phase does not occur.

    `delay_s`: by how much the response lags the reference. `acceleration_less_delay`: the error while
    speeding up against the reference that much later. In steady state, N or N m: `pid_effort` the mean of
    TAU_PID, `pid_magnitude` of its absolute value, `pid_minus_ff` of |TAU_PID - TAU_FF|, which the paper
    uses in shadow mode.
    """

    axis: str
    unit: str
    acceleration: float
    steady_state: float
    deceleration: float
    overall: float
    delay_s: float
    acceleration_less_delay: float
    pid_effort: float
    pid_magnitude: float
    pid_minus_ff: float

    def phase(self, name: str) -> float:
        """The error of one of PHASES."""
        values = (self.acceleration, self.steady_state, self.deceleration, self.overall)
        return values[PHASES.index(name)]


@dataclass(frozen=True)
class TrackingErrors:
    """The axes whose reference moved during the dive."""

    dive: str
    axes: tuple[AxisErrors, ...]

    def axis(self, name: str) -> AxisErrors | None:
        return next((a for a in self.axes if a.axis == name), None)


@dataclass(frozen=True)
class Row:
    """One line of the table: a phase of an axis, one value a run."""

    axis: str
    phase: str
    unit: str
    values: tuple[float, ...]


def tracking_errors(dive: Dive, lever_m: Vector3 = (0.0, 0.0, 0.0)) -> TrackingErrors:
    """The errors of a dive; none where it has no NU_REF. `lever_m`: the DVL's transducer in body axes."""
    axes = (_axis_errors(dive, dof, lever_m) for dof in AXES)
    return TrackingErrors(dive.name, tuple(axis for axis in axes if axis is not None))


def compare(runs: Mapping[str, Dive], lever_m: Vector3 = (0.0, 0.0, 0.0)) -> tuple[Row, ...]:
    """Rows laid out like the paper's Table 5, axis by axis, with one value for each run in the mapping's order."""
    errors = [tracking_errors(dive, lever_m) for dive in runs.values()]
    rows = []
    for dof in AXES:
        of_axis = [e.axis(DOFS[dof]) for e in errors]
        if all(axis is None for axis in of_axis):
            continue
        for phase in PHASES:
            values = tuple(math.nan if axis is None else axis.phase(phase) for axis in of_axis)
            rows.append(Row(DOFS[dof], phase, _unit(dof), values))
    return tuple(rows)


def phases(velocity: Array, slope: Array) -> Phases:
    """The phases of a reference from its velocity and derivative, (n,) each.

    Steady is a slope below a twentieth of its largest magnitude, at a speed that is not zero.
    """
    least = max(STEADY_SHARE * float(np.abs(slope).max(initial=0.0)), LEAST_SLOPE)
    moving = np.abs(slope) > least
    slowing = np.sign(velocity) * slope < 0
    return Phases(moving & ~slowing, ~moving & (np.abs(velocity) > LEAST_SPEED), moving & slowing)


def delay(reference: Signal, response: Signal) -> float:
    """Seconds by which (n, 1) `response` lags `reference`: where their correlation is highest; NaN where undefined."""
    start = max(reference.time_s[0], response.time_s[0]) + LATEST_S
    end = min(reference.time_s[-1], response.time_s[-1]) + EARLIEST_S
    time_s = np.arange(start, end, LAG_STEP_S)
    if len(time_s) < 2:
        return math.nan
    measured = response.at(time_s)[:, 0]
    lags = np.arange(EARLIEST_S, LATEST_S + LAG_STEP_S / 2, LAG_STEP_S)
    likeness = np.array([_correlation(reference.at(time_s - lag)[:, 0], measured) for lag in lags])
    if not np.isfinite(likeness).all():
        return math.nan
    best = int(np.argmax(likeness))
    if best in (0, len(lags) - 1):
        return float(lags[best])
    before, peak, after = likeness[best - 1 : best + 2]
    return float(lags[best] + LAG_STEP_S * 0.5 * (before - after) / (before - 2 * peak + after))


def _axis_errors(dive: Dive, dof: int, lever_m: Vector3) -> AxisErrors | None:
    response = _response(dive, dof, lever_m)
    if dive.nu_ref is None or len(dive.nu_ref) < 2 or response is None or len(response) < 2:
        return None
    reference = Signal(dive.nu_ref.time_s, dive.nu_ref.value[:, dof : dof + 1])
    slope = Signal(dive.nu_ref.time_s, dive.nu_ref.value[:, 6 + dof : 7 + dof])
    time_s = response.time_s
    inside = (time_s >= reference.time_s[0]) & (time_s <= reference.time_s[-1])
    response = Signal(time_s[inside], response.value[inside])
    time_s = response.time_s
    of = phases(reference.at(time_s)[:, 0], slope.at(time_s)[:, 0])
    if not of.any.any():
        return None
    lag_s = delay(reference, response)
    error = np.abs(response.value - reference.at(time_s))[:, 0]
    late = np.abs(response.value - reference.at(time_s - lag_s))[:, 0]
    effort, magnitude, against_ff = _wrenches(dive, dof, reference, slope)
    return AxisErrors(
        axis=DOFS[dof],
        unit=_unit(dof),
        acceleration=_mean(error, of.acceleration),
        steady_state=_mean(error, of.steady),
        deceleration=_mean(error, of.deceleration),
        overall=_mean(error, of.any),
        delay_s=lag_s,
        acceleration_less_delay=_mean(late, of.acceleration),
        pid_effort=effort,
        pid_magnitude=magnitude,
        pid_minus_ff=against_ff,
    )


def _response(dive: Dive, dof: int, lever_m: Vector3) -> Signal | None:
    """What was measured of an axis, (n, 1), without the samples in which it was not."""
    if dof >= 3:
        source = dive.fog if dof == 5 and dive.fog is not None else dive.gyro
        if source is None or len(source) < 2:
            return None
        if source is dive.fog:
            return source
        return Signal(source.time_s, source.value[:, dof - 3 : dof - 2])
    if dive.velocity is None:
        return None
    known = np.isfinite(dive.velocity.value[:, dof])
    time_s, value = dive.velocity.time_s[known], dive.velocity.value[known]
    if dive.gyro is not None and any(lever_m):
        value = value - np.cross(dive.gyro.at(time_s), lever_m)
    return Signal(time_s, value[:, dof : dof + 1])


def _wrenches(dive: Dive, dof: int, reference: Signal, slope: Signal) -> tuple[float, float, float]:
    """Mean of TAU_PID, of its magnitude, and of |TAU_PID - TAU_FF|, in steady state."""
    if dive.tau_pid is None or len(dive.tau_pid) == 0:
        return math.nan, math.nan, math.nan
    time_s, pid = dive.tau_pid.time_s, dive.tau_pid.value[:, dof]
    steady = phases(reference.at(time_s)[:, 0], slope.at(time_s)[:, 0]).steady
    feed_forward = np.full(len(pid), np.nan) if dive.tau_ff is None else dive.tau_ff.held_at(time_s)[:, dof]
    difference = np.abs(pid - feed_forward)
    return _mean(pid, steady), _mean(np.abs(pid), steady), _mean(difference, steady & np.isfinite(difference))


def _correlation(a: Array, b: Array) -> float:
    spread = float(a.std() * b.std())
    return float(np.mean((a - a.mean()) * (b - b.mean()))) / spread if spread > 0 else math.nan


def _mean(value: Array, mask: Mask) -> float:
    return float(value[mask].mean()) if mask.any() else math.nan


def _unit(dof: int) -> str:
    return "m/s" if dof < 3 else "rad/s"
