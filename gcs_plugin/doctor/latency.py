"""Each sensor's latency by its response to the commanded thrust; and the frames of a wet check as findings.

A speed x responds to a force F as x' = F - x / T. The time constant T of the real vehicle is unknown, so it is fitted
together with the latency over all pulses at once; for each pair, the best gain and offset follow by least squares. Only
axes without a righting moment are used: surge, sway and heave for the DVL, yaw for the gyros.
"""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.optimize import minimize

from bridge.arrays import Array
from bridge.vehicle.config import Configuration, Vehicle, VehicleFile
from bridge.vehicle.thrusters import Curve, thrust_curve
from bridge.wire.framing import Frame
from gcs_plugin.doctor import response
from gcs_plugin.doctor.checks import Finding, ok, warn
from gcs_plugin.doctor.wet import LABELS, TURNED_IN, Diagnosis, diagnose, findings
from gcs_plugin.doctor.wet_record import Pulse, Series, WetRecord, record_of

EARLIEST_S: Final = -0.1
LATEST_S: Final = 0.6
GRID_S: Final = 0.02
TIME_CONSTANTS_S: Final = (0.2, 0.5, 1.2, 3.0, 8.0)
LOG_TAU: Final = (-2.5, 3.5)
BEFORE_S: Final = 0.5
AFTER_S: Final = 1.2
LEAST_SHARE: Final = 0.3  # of the largest expected response: weaker pulses give no timing
LATE_S: Final = 0.05
EDGE_STD_S: Final = 0.004  # how well the edges of the pulses and the thrusters' lag are known


@dataclass(frozen=True, slots=True)
class Latency:
    """How late a sensor's readings are against their own time stamps; `std_s` from the curvature of the fit."""

    sensor: str
    latency_s: float
    std_s: float


def latencies(
    vehicle: Vehicle, configuration: Configuration, curve: Curve, record: WetRecord, diagnosis: Diagnosis
) -> list[Latency]:
    """Estimate the latency of every sensor with data, using the thrusters and mountings found by the diagnosis."""
    want = response.expected(vehicle, configuration, curve, diagnosis.pulses)
    lag_s = vehicle.thrust_curve.lag_s
    estimates = []
    for sensor, turn in diagnosis.turn.items():
        feature = TURNED_IN[sensor]
        series = record.series[feature]
        true = Series(series.time_s, series.value @ turn)
        directions = _directions(want[feature], diagnosis, sensor)
        latency = _fit(true, diagnosis.pulses, directions, lag_s)
        if latency is not None:
            estimates.append(Latency(sensor, *latency))
    return estimates


def _directions(expected: Array, diagnosis: Diagnosis, sensor: str) -> Array:
    """Direction (pulses, k) in which each pulse moves the sensor; zero if the response is too small to show a time."""
    channels = np.arange(len(diagnosis.pulses))
    effect = diagnosis.sign[:, None] * expected[channels, diagnosis.thruster_of]
    if sensor == "imu":
        effect = effect * np.array([0.0, 0.0, 1.0])
    size = np.linalg.norm(effect, axis=1)
    strong = (size > LEAST_SHARE * size.max(initial=0.0)) & diagnosis.responds & (size > 0)
    unit = effect / np.maximum(size, 1e-12)[:, None]
    return np.where(strong[:, None], unit, 0.0)


def _fit(
    series: Series, pulses: Sequence[Pulse], directions: Array, lag_s: float
) -> tuple[float, float] | None:
    """Latency and its standard deviation; None if no pulse shows it, or the fit ends at the edge of the range."""
    stretches = []
    for pulse, direction in zip(pulses, directions, strict=True):
        part = series.between(pulse.start_s - BEFORE_S, pulse.end_s + AFTER_S)
        if direction.any() and len(part.time_s) >= 8:
            stretches.append((pulse, part.time_s, part.value @ direction))
    if not stretches:
        return None

    def left(x: Array) -> float:
        shift_s, tau_s = float(x[0]), float(np.exp(np.clip(x[1], *LOG_TAU)))
        return sum(_unexplained(stretch, shift_s, tau_s, lag_s) for stretch in stretches)

    shifts = np.arange(EARLIEST_S, LATEST_S, GRID_S)
    starts = [np.array([shift, np.log(tau)]) for tau in TIME_CONSTANTS_S for shift in shifts]
    start = min(starts, key=left)
    simplex = start + np.array([[0.0, 0.0], [GRID_S, 0.0], [0.0, 0.3]])
    best = minimize(left, start, method="Nelder-Mead", options={"initial_simplex": simplex, "xatol": 1e-4})
    if not EARLIEST_S < best.x[0] < LATEST_S:
        return None
    samples = sum(len(times) for _, times, _ in stretches)
    noise = best.fun / max(samples - 2 * len(stretches) - 2, 1)
    variance = 2 * noise * np.linalg.pinv(_curvature(left, best.x))[0, 0]
    return (float(best.x[0]), float(np.hypot(np.sqrt(variance), EDGE_STD_S))) if variance > 0 else None


def _curvature(function: Callable[[Array], float], x: Array) -> Array:
    """Second derivatives (2, 2) by central differences."""
    steps = np.diag([0.005, 0.1])
    second = np.empty((2, 2))
    for i in range(2):
        for j in range(2):
            a, b = steps[i], steps[j]
            corners = function(x + a + b) - function(x + a - b) - function(x - a + b) + function(x - a - b)
            second[i, j] = corners / (4 * a[i] * b[j])
    return second


def _unexplained(stretch: tuple[Pulse, Array, Array], shift_s: float, tau_s: float, lag_s: float) -> float:
    """Sum of squares left in a stretch after the best gain and offset."""
    pulse, time_s, value = stretch
    shape = speed_shape(time_s - pulse.start_s - shift_s, pulse.end_s - pulse.start_s, tau_s, lag_s)
    shape, value = shape - shape.mean(), value - value.mean()
    power = float(shape @ shape)
    return float(value @ value) - (float(shape @ value) ** 2 / power if power > 0 else 0.0)


def speed_shape(time_s: Array, on_s: float, tau_s: float, lag_s: float) -> Array:
    """Response of x' = F - x / tau at `time_s`, after F rose to 1 through a lag, to fall back after `on_s`."""
    return _step_response(time_s, tau_s, lag_s) - _step_response(time_s - on_s, tau_s, lag_s)


def _step_response(time_s: Array, tau_s: float, lag_s: float) -> Array:
    t = np.maximum(time_s, 0.0)
    if lag_s <= 0.0:
        return np.asarray(tau_s * (1.0 - np.exp(-t / tau_s)))
    lag_s = lag_s if abs(lag_s - tau_s) > 1e-3 * tau_s else 1.01 * lag_s
    slow, fast = np.exp(-t / tau_s), np.exp(-t / lag_s)
    return np.asarray(tau_s * (1.0 - (tau_s * slow - lag_s * fast) / (tau_s - lag_s)))


def latency_findings(estimates: Sequence[Latency]) -> list[Finding]:
    sentences = []
    for latency in estimates:
        name, label = f"{latency.sensor} latency", LABELS[latency.sensor]
        is_early, off_s = latency.latency_s < 0, abs(latency.latency_s)
        sentence = (
            f"{label}: {off_s * 1e3:.0f} ms {'early' if is_early else 'late'}, give or take "
            f"{2 * latency.std_s * 1e3:.0f} ms"
        )
        change = f"take {off_s:.3f} off" if is_early else f"add {off_s:.3f} to"
        is_off = off_s > max(LATE_S, 3 * latency.std_s)
        advice = f"{sentence}; {change} its latency_s in the vehicle file"
        sentences.append(warn(name, advice) if is_off else ok(name, sentence))
    return sentences


def wet_findings(file: VehicleFile, configuration: str, frames: Iterable[Frame]) -> list[Finding]:
    """Findings on thrusters, mountings and latencies. Raises LogError if the frames hold no wet check."""
    vehicle = file.vehicle
    shape = vehicle.configurations[vehicle.configuration_named(configuration)]
    curve = thrust_curve(vehicle.thrust_curve, file.path.parent)
    record = record_of(frames, len(shape.thrusters))
    diagnosis = diagnose(vehicle, shape, curve, record)
    late = latency_findings(latencies(vehicle, shape, curve, record, diagnosis))
    return [*findings(diagnosis, vehicle), *late]
