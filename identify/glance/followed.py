"""Curves that show how a dive followed its reference, for one axis, with few points, and their form in a file."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

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
