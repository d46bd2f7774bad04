"""Tracking errors of a dive, phase by phase, as the source paper reports them (Table 5, Figs 10 to 17).

The phases of an axis follow the reference's own derivative: speeding up, steady, slowing down. An axis whose
reference rests is in no phase. Velocity is the DVL's at its time of validity (yaw: the gyro's); the reference is
interpolated to these times.

A sensor's noise is not a tracking error. So measured less reference velocity goes through the zero-phase low-pass of
`identify.align`, the same in every mode. The white noise that passes below the cut-off is reported, but its power
is not subtracted: a PID that follows its sensor turns noise into true error of the opposite sign, so the two are not
independent. How the source paper treated its noise is not known.

The paper's errors are of an axis that is asked to move. `WholeError` measures every axis over the whole mission,
including motion that was not asked for.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from bridge.arrays import Array, Mask, Vector3
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.feedforward import FEEDFORWARD_DOFS
from bridge.vehicle.mode import Mode
from identify.align import ORDER, low_pass
from identify.dive import Dive, Signal
from identify.statistics import bulk_std

TRACKED_DOFS = (0, 1, 5)
"""Surge, sway and yaw, whose phases the paper reports."""

ALL_DOFS = tuple(range(6))
SETTLED_S = 5.0
"""A vehicle may still move for so long after a reference has come to rest: its PID is late."""
PHASES = ("Acceleration", "Steady state", "Deceleration", "Overall")
STEADY_SHARE = 0.05
LEAST_SLOPE = 1e-4
"""A reference is steady while its derivative is below this share of the largest, or below this, m/s2 or rad/s2."""

LEAST_SPEED = 1e-3
"""A reference moves above this, m/s or rad/s."""

LAG_STEP_S = 0.05
EARLIEST_S, LATEST_S = -1.0, 4.0
"""Lags of the response behind the reference among which `delay` looks, and their step."""

CUTOFF_HZ = 0.5
METHOD = (
    f"Measured less wanted velocity, below {CUTOFF_HZ:g} Hz (zero-phase) because a sensor's noise is no error of "
    "tracking; what the source paper did with its noise is not known."
)
SHORTEST_RUN_S = 2.0
"""A speed counts as held if it is held for so long."""

LEAST_SAMPLES = 10
"""Of an rms: two seconds of a slow DVL."""

SPEED_STEP = {"m/s": 0.01, "rad/s": 0.0025}
"""Held speeds are rounded to a multiple of this step. Rates in steps of 5 deg/s and of 0.05 rad/s stay right to
0.3 %."""


@dataclass(frozen=True)
class Phases:
    """The samples of each phase, masks (n,)."""

    acceleration: Mask
    steady: Mask
    deceleration: Mask

    @property
    def any(self) -> Mask:
        return self.acceleration | self.steady | self.deceleration


@dataclass(frozen=True)
class SteadyError:
    """Mean of measured less reference velocity at one `speed` (m/s or rad/s), positive if the vehicle was too fast.

    Over `runs` stretches that hold that speed, each at least 2 s. `standard_error` comes from their spread; NaN for a
    single run.
    """

    speed: float
    error: float
    standard_error: float
    runs: int


@dataclass(frozen=True)
class AxisErrors:
    """Mean absolute tracking errors of an axis in m/s or rad/s, NaN for a phase that does not occur.

    `delay_s`: lag of the response behind the reference. `acceleration_less_delay`: error while speeding up, against
    the reference delayed by that lag. In steady state, N or N m: `pid_effort` is the mean of TAU_PID, `pid_magnitude`
    the mean of its absolute value, `pid_minus_ff` the mean of |TAU_PID - TAU_FF|, which the paper uses in shadow
    mode. `noise`: standard deviation of the sensor noise that remains in the filtered error. `speeds`: error of the
    mean speed, by which the paper judges feed-forward alone, slowest first.
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
    noise: float = math.nan
    speeds: tuple[SteadyError, ...] = ()

    def phase(self, name: str) -> float:
        values = (self.acceleration, self.steady_state, self.deceleration, self.overall)
        return values[PHASES.index(name)]


@dataclass(frozen=True)
class WholeError:
    """Error of an axis over the whole mission, whether it was asked to move or not; m/s or rad/s, NaN if unknown.

    The mission is the time in which any reference moves and SETTLED_S after each motion; a longer rest is none of it,
    before its start, within it or after its end. rms: of the whole. asked: rms of this axis's reference. unasked: rms
    while the controller has held this axis at rest for SETTLED_S and another has moved; NaN for an axis that nothing
    holds. rest: rms while no reference has moved for SETTLED_S. noise: of the sensor, as it remains in all of these;
    white noise alone.
    """

    axis: str
    unit: str
    rms: float
    asked: float
    unasked: float
    rest: float
    noise: float


@dataclass(frozen=True)
class TrackingErrors:
    """The axes whose reference moved during the dive, and every axis over the whole of it."""

    dive: str
    axes: tuple[AxisErrors, ...]
    whole: tuple[WholeError, ...] = ()

    def axis(self, name: str) -> AxisErrors | None:
        return next((a for a in self.axes if a.axis == name), None)


@dataclass(frozen=True)
class Row:
    """A line of a table: a phase of an axis, or a part of the mission, with a value for each run."""

    axis: str
    phase: str
    unit: str
    values: tuple[float, ...]


def lever_of(file: VehicleFile) -> Vector3:
    """Position of the DVL's transducer in body axes, m; the origin for a vehicle without a DVL."""
    dvl = file.vehicle.sensors.dvl
    return (0.0, 0.0, 0.0) if dvl is None else dvl.mounting.position_m


def tracking_errors(dive: Dive, lever_m: Vector3 = (0.0, 0.0, 0.0)) -> TrackingErrors:
    """Return the errors of a dive; no axes if it has no NU_REF. `lever_m`: the DVL's transducer in body axes."""
    axes = (_axis_errors(dive, dof, lever_m) for dof in TRACKED_DOFS)
    return TrackingErrors(
        dive.name, tuple(axis for axis in axes if axis is not None), whole_errors(dive, lever_m)
    )


def whole_errors(dive: Dive, lever_m: Vector3 = (0.0, 0.0, 0.0)) -> tuple[WholeError, ...]:
    """Errors of every axis that is measured, over the whole mission; none if no reference moves."""
    reference = dive.nu_ref
    if reference is None or len(reference) < 2:
        return ()
    moves = np.abs(np.nan_to_num(reference.value[:, :6])) > LEAST_SPEED
    if not moves.any():
        return ()
    errors = (_whole_error(dive, dof, lever_m, moves) for dof in ALL_DOFS)
    return tuple(error for error in errors if error is not None)


def compare(errors: Mapping[str, TrackingErrors]) -> tuple[Row, ...]:
    """Rows laid out like the paper's Table 5, axis by axis, with a value for each run in the mapping's order."""
    rows = []
    for dof in TRACKED_DOFS:
        of_axis = [run.axis(DOFS[dof]) for run in errors.values()]
        for phase in PHASES if any(of_axis) else ():
            values = tuple(math.nan if axis is None else axis.phase(phase) for axis in of_axis)
            rows.append(Row(DOFS[dof], phase, _unit(dof), values))
    return tuple(rows)


PARTS = {"rms": "whole mission", "unasked": "while others move", "rest": "at rest"}
"""The words for each part of the mission in which every axis is measured."""


def whole_rows(errors: Mapping[str, TrackingErrors]) -> tuple[Row, ...]:
    """Every axis over the whole mission, asked to move or not, in the parts of PARTS; none if no run tells it."""
    rows = []
    for dof in ALL_DOFS:
        of_axis = [next((e for e in run.whole if e.axis == DOFS[dof]), None) for run in errors.values()]
        for part, words in PARTS.items() if any(of_axis) else ():
            values = tuple(math.nan if error is None else getattr(error, part) for error in of_axis)
            rows.append(Row(DOFS[dof], words, _unit(dof), values))
    return tuple(rows)


def with_reference_rates(dive: Dive) -> Dive:
    """The dive, with derivatives of its reference by finite differences for axes where NU_REF states none."""
    if dive.nu_ref is None:
        return dive
    time_s, value = dive.nu_ref.time_s, dive.nu_ref.value.copy()
    unstated = np.flatnonzero(~np.isfinite(value[:, 6:12]).any(axis=0))
    at_s, first = np.unique(time_s, return_index=True)
    if not len(unstated) or len(at_s) < 2:
        return dive
    slopes = np.gradient(value[first][:, unstated], at_s, axis=0)
    value[:, 6 + unstated] = Signal(at_s, slopes).at(time_s)
    return replace(dive, nu_ref=Signal(time_s, value))


def phases(velocity: Array, slope: Array) -> Phases:
    """Return the phases of a reference from its velocity and derivative, (n,) each.

    Steady means a slope below a twentieth of its largest magnitude, at a nonzero speed.
    """
    least = max(STEADY_SHARE * float(np.abs(slope).max(initial=0.0)), LEAST_SLOPE)
    moving = np.abs(slope) > least
    slowing = np.sign(velocity) * slope < 0
    return Phases(moving & ~slowing, ~moving & (np.abs(velocity) > LEAST_SPEED), moving & slowing)


def delay(reference: Signal, response: Signal) -> float:
    """Lag of `response` (n, 1) behind `reference`, s, at their highest correlation.

    NaN if undefined, as for a reference that changes within LATEST_S of its beginning alone.
    """
    start = max(reference.time_s[0], response.time_s[0]) + LATEST_S
    end = min(reference.time_s[-1], response.time_s[-1]) + EARLIEST_S
    time_s = np.arange(start, end, LAG_STEP_S)
    if len(time_s) < 2 or np.ptp(reference.at(time_s)) <= LEAST_SPEED:
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


def measured_speed(dive: Dive, dof: int, lever_m: Vector3) -> Signal | None:
    """Measured speed of an axis, (n, 1), unknown samples included: the DVL's at the origin, or the gyro's rate."""
    if dof == 5:
        return dive.yaw_rate
    if dof >= 3:
        return None if dive.gyro is None else Signal(dive.gyro.time_s, dive.gyro.value[:, dof - 3 : dof - 2])
    if dive.velocity is None or not len(dive.velocity):
        return None
    time_s, value = dive.velocity.time_s, dive.velocity.value
    if dive.gyro is not None and len(dive.gyro) and any(lever_m):
        value = value - np.cross(np.nan_to_num(dive.gyro.at(time_s)), lever_m)
    return Signal(time_s, value[:, dof : dof + 1])


def _reference_and_response(dive: Dive, dof: int, lever_m: Vector3) -> tuple[Signal, Signal] | None:
    """Reference and response of an axis, (n, 1) each, the response within the time of the reference; None if either is
    never known."""
    measured = measured_speed(dive, dof, lever_m)
    if dive.nu_ref is None or len(dive.nu_ref) < 2 or measured is None:
        return None
    response = measured.finite()
    reference = Signal(dive.nu_ref.time_s, dive.nu_ref.value[:, dof : dof + 1])
    inside = (response.time_s >= reference.time_s[0]) & (response.time_s <= reference.time_s[-1])
    if np.count_nonzero(inside) < 2 or not np.isfinite(reference.value).any():
        return None
    return reference, Signal(response.time_s[inside], response.value[inside])


def _whole_error(dive: Dive, dof: int, lever_m: Vector3, moves: Mask) -> WholeError | None:
    """The error of an axis; None if it is not measured. moves (m, 6): whose reference moves at the times of NU_REF."""
    followed = _reference_and_response(dive, dof, lever_m)
    if followed is None or len(followed[1]) < LEAST_SAMPLES:
        return None
    reference, response = followed
    time_s = response.time_s
    smooth, noise = _filtered_error(time_s, (response.value - reference.at(time_s))[:, 0])
    any_moves = np.asarray(moves.any(axis=1))
    since_s = _since_moved_s(reference.time_s, moves[:, dof] | ~_holds(dive, dof, reference.time_s), time_s)
    since_any_s = _since_moved_s(reference.time_s, any_moves, time_s)
    first_s = reference.time_s[np.argmax(any_moves)]
    under_way = (time_s >= first_s) & (since_any_s <= SETTLED_S)
    asked = reference.at(time_s)[under_way, 0]
    return WholeError(
        DOFS[dof],
        _unit(dof),
        _rms(smooth, under_way),
        float(np.sqrt(np.mean(asked**2))) if len(asked) else math.nan,
        _rms(smooth, under_way & (since_s > SETTLED_S)),
        _rms(smooth, since_any_s > SETTLED_S),
        noise,
    )


def _holds(dive: Dive, dof: int, time_s: Array) -> Mask:
    """Whether the controller acts on an axis at these times, (n,).

    A PID that is exactly zero does not act, as where a mission pushes by itself or the gains are zero. In the mode of
    feed-forward alone, surge, sway and yaw are held by the feed-forward.
    """
    if dive.tau_pid is None or not len(dive.tau_pid):
        return np.ones(len(time_s), dtype=bool)
    acts = np.nan_to_num(dive.tau_pid.held_at(time_s)[:, dof]) != 0.0
    if dof in FEEDFORWARD_DOFS and dive.ff_mode is not None and len(dive.ff_mode):
        acts |= dive.ff_mode.held_at(time_s)[:, 0] == float(Mode.ALONE)
    return np.asarray(acts)


def _since_moved_s(reference_s: Array, moving: Mask, time_s: Array) -> Array:
    """Time (n,) at `time_s` since the reference last moved, infinite before it first did.

    moving (m,): whether it moves at the times `reference_s` (m,).
    """
    last_s = np.maximum.accumulate(np.where(moving, reference_s, -np.inf))
    return np.asarray(time_s - last_s[np.searchsorted(reference_s, time_s, side="right") - 1])


def _axis_errors(dive: Dive, dof: int, lever_m: Vector3) -> AxisErrors | None:
    followed = _reference_and_response(dive, dof, lever_m)
    if followed is None or dive.nu_ref is None:
        return None
    reference, response = followed
    slope = Signal(dive.nu_ref.time_s, dive.nu_ref.value[:, 6 + dof : 7 + dof])
    time_s = response.time_s
    masks = phases(reference.at(time_s)[:, 0], slope.at(time_s)[:, 0])
    if not masks.any.any():
        return None
    lag_s = delay(reference, response)
    error = (response.value - reference.at(time_s))[:, 0]
    smooth, noise = _filtered_error(time_s, error)
    late, _ = _filtered_error(time_s, (response.value - reference.at(time_s - lag_s))[:, 0])
    now, late = np.abs(smooth), np.abs(late)
    effort, magnitude, against_ff = _steady_pid(dive, dof, reference, slope)
    return AxisErrors(
        axis=DOFS[dof],
        unit=_unit(dof),
        acceleration=_mean(now, masks.acceleration),
        steady_state=_mean(now, masks.steady),
        deceleration=_mean(now, masks.deceleration),
        overall=_mean(now, masks.any),
        delay_s=lag_s,
        acceleration_less_delay=_mean(late, masks.acceleration),
        pid_effort=effort,
        pid_magnitude=magnitude,
        pid_minus_ff=against_ff,
        noise=noise,
        speeds=_steady_errors(
            time_s, reference.at(time_s)[:, 0], error, masks.steady, SPEED_STEP[_unit(dof)]
        ),
    )


def _filtered_error(time_s: Array, error: Array) -> tuple[Array, float]:
    """The error (n,) below CUTOFF_HZ, and the standard deviation of the noise that remains in it.

    The filter's gain is G = 1 / (1 + x^(2 ORDER)), with x the frequency over the cut-off. Of white noise up to `top`
    it passes the power mean(G^2) and removes mean((1 - G)^2). The removed part is measured robustly, because nothing
    else in the error is that fast for long.
    """
    rate_hz = Signal(time_s, error[:, None]).rate_hz
    top = rate_hz / (2 * CUTOFF_HZ)
    if top <= 1:
        return error, 0.0
    grid_s = np.arange(time_s[0], time_s[-1] + 0.5 / rate_hz, 1 / rate_hz)
    smooth = np.interp(time_s, grid_s, low_pass(np.interp(grid_s, time_s, error), rate_hz, CUTOFF_HZ))
    x = np.linspace(0.0, top, 2001)
    gain = 1 / (1 + x ** (2 * ORDER))
    passed, taken = float(np.mean(gain**2)), float(np.mean((1 - gain) ** 2))
    sigma = bulk_std(error - smooth)
    return smooth, sigma * math.sqrt(passed / taken)


def _steady_errors(
    time_s: Array, wanted: Array, error: Array, steady: Mask, step: float
) -> tuple[SteadyError, ...]:
    edges = np.flatnonzero(np.diff(steady.astype(int), prepend=0, append=0))
    runs: dict[int, list[float]] = {}
    for start, end in zip(edges[::2], edges[1::2], strict=True):
        if time_s[end - 1] - time_s[start] >= SHORTEST_RUN_S:
            speed = float(np.median(wanted[start:end]))
            ahead = math.copysign(1.0, speed) * float(error[start:end].mean())
            runs.setdefault(round(abs(speed) / step), []).append(ahead)
    return tuple(
        SteadyError(
            steps * step,
            float(np.mean(errors)),
            float(np.std(errors, ddof=1) / math.sqrt(len(errors))) if len(errors) > 1 else math.nan,
            len(errors),
        )
        for steps, errors in sorted(runs.items())
        if steps
    )


def _steady_pid(dive: Dive, dof: int, reference: Signal, slope: Signal) -> tuple[float, float, float]:
    """Means of TAU_PID, of its magnitude, and of |TAU_PID - TAU_FF|, in steady state."""
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


def _rms(value: Array, mask: Mask) -> float:
    """NaN for fewer than LEAST_SAMPLES."""
    return float(np.sqrt(np.mean(value[mask] ** 2))) if np.count_nonzero(mask) >= LEAST_SAMPLES else math.nan


def _unit(dof: int) -> str:
    return "m/s" if dof < 3 else "rad/s"
