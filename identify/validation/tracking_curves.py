"""Curves of how a dive followed its reference, axis by axis, with few points (the source paper's Figs 10 to 17)."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from bridge.arrays import Array, Vector3
from bridge.vehicle.coefficients import DOFS
from identify.dive import Dive, Signal
from identify.validation.tracking import LEAST_SPEED, TRACKED_DOFS, measured_speed

CURVES: Final = ("reference", "measured", "tau_ff", "tau_pid")
WRENCH_UNITS: Final = {"m/s": "N", "rad/s": "N m"}
DIGITS: Final = 4
MOST, LEAST_STEP_S = 1e9, 1e-4
"""Limits: more than any speed, force or time of a dive, and less than the time between two points of its curves."""


@dataclass(frozen=True)
class Followed:
    """Means over uniform steps, (n,) each.

    time_s: since the dive's first reading. reference, measured: speeds in `unit`. tau_ff, tau_pid: wrenches of
    feed-forward and PID in `wrench_unit`. NaN if nothing is known.
    """

    axis: str
    unit: str
    wrench_unit: str
    time_s: Array
    reference: Array
    measured: Array
    tau_ff: Array
    tau_pid: Array

    def to_json(self) -> dict[str, Any]:
        """Plain data, with null for NaN."""
        return {
            "axis": self.axis,
            "unit": self.unit,
            "wrench_unit": self.wrench_unit,
            "start_s": float(self.time_s[0]),
            "step_s": float(self.time_s[1] - self.time_s[0]),
            **{name: [_short(value) for value in getattr(self, name).tolist()] for name in CURVES},
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> "Followed":
        """Read the output of `to_json`. Raises KeyError, TypeError or ValueError for anything else."""
        curves = [np.array([math.nan if v is None else float(v) for v in data[name]]) for name in CURVES]
        start_s, step_s = float(data["start_s"]), float(data["step_s"])
        unit, wrench_unit = str(data["unit"]), str(data["wrench_unit"])
        count = len(curves[0])
        largest = np.nanmax(np.abs([start_s, step_s, *np.concatenate(curves)]))
        if (
            count < 2
            or any(len(curve) != count for curve in curves)
            or not (largest < MOST and step_s > LEAST_STEP_S)
        ):
            raise ValueError("no curves of a dive")
        if WRENCH_UNITS.get(unit) != wrench_unit:
            raise ValueError(f"no curves in {unit} and {wrench_unit}")
        time_s = start_s + step_s * np.arange(count, dtype=np.float64)
        return cls(str(data["axis"]), unit, wrench_unit, time_s, *curves)


def _short(value: float) -> float | None:
    """Few significant digits, to keep a file of many points small; None for NaN."""
    return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None


POINTS: Final = 600
FINE_S: Final = 0.05


def followed(dive: Dive, lever_m: Vector3 = (0.0, 0.0, 0.0), points: int = POINTS) -> tuple[Followed, ...]:
    """Curves of the axes that the reference moves along; `lever_m`: position of the DVL's transducer in body axes."""
    reference = dive.nu_ref
    if reference is None or len(reference) < 2:
        return ()
    first_s, last_s = reference.time_s[0], reference.time_s[-1]
    step_s = max((last_s - first_s) / points, FINE_S)
    edges_s = first_s + step_s * np.arange(math.floor((last_s - first_s) / step_s) + 1)
    if len(edges_s) < 3:
        return ()
    return tuple(
        Followed(
            DOFS[dof],
            "m/s" if dof < 3 else "rad/s",
            "N" if dof < 3 else "N m",
            (edges_s[:-1] + edges_s[1:]) / 2 - dive.span_s[0],
            _means(reference, dof, edges_s),
            _means(measured_speed(dive, dof, lever_m), 0, edges_s),
            _means(dive.tau_ff, dof, edges_s),
            _means(dive.tau_pid, dof, edges_s),
        )
        for dof in TRACKED_DOFS
        if (np.abs(reference.value[:, dof]) > LEAST_SPEED).any()
    )


def _means(signal: Signal | None, column: int, edges_s: Array) -> Array:
    """Mean of the finite samples between consecutive edges; a step without samples holds a recent last sample."""
    out = np.full(len(edges_s) - 1, np.nan)
    if signal is None:
        return out
    known = np.isfinite(signal.value[:, column])
    if not known.any():
        return out
    time_s, value = signal.time_s[known], signal.value[known, column]
    count, _ = np.histogram(time_s, edges_s)
    total, _ = np.histogram(time_s, edges_s, weights=value)
    some = count > 0
    out[some] = total[some] / count[some]
    period_s = 1.5 / signal.rate_hz if signal.rate_hz else 0.0
    before = np.searchsorted(time_s, edges_s[:-1], side="right") - 1
    held = ~some & (before >= 0) & (edges_s[:-1] - time_s[np.maximum(before, 0)] <= period_s)
    out[held] = value[before[held]]
    return out
