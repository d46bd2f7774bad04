"""The marks of accepted runs: their mean and how they scatter from run to run, with the drag that they share."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from bridge.errors import FitError
from bridge.vehicle.config import GRAVITY_M_S2, Configuration
from identify.dive import Array
from identify.repeats.marks import HEAVE, Run

MARKS: Final = ("rest depth", "heave", "roll", "pitch", "yaw")
UNITS: Final = ("m", "N", "N m", "N m", "N m")
DEPTH, FORCE, ROLL, PITCH, YAW = range(5)

FEWEST: Final = 20
"""The scatter of five marks, and what goes with what, takes some twenty runs."""

DRAG_SPREAD: Final = 1.0
"""Prior standard deviation of the drag, as a share of the vehicle file's."""


@dataclass(frozen=True)
class Usual:
    """Accepted runs. mean (5,) and scatter (5, 5) of their marks (MARKS, in UNITS), of `count` runs.

    drag_n_s_m: force per speed of sinking, fitted to all of them together. voltage_v: their mean voltage, at which the
    vehicle file's thrust holds; NaN if unknown. thrust_n (k,): mean thrust of each thruster.
    """

    mean: Array
    scatter: Array
    count: int
    drag_n_s_m: float
    voltage_v: float
    thrust_n: Array

    def marks_of(self, runs: Sequence[Run], shape: Configuration) -> Array:
        """Marks (n, 5) of runs: depth read at rest, and the force and moments that the model lacks in heave, roll,
        pitch and yaw to move as the runs did."""
        return _marks(runs, shape, self.drag_n_s_m, self.voltage_v)


def usual_of(runs: Sequence[Run], shape: Configuration) -> Usual:
    """Fit what accepted runs have in common. Raises FitError for fewer than FEWEST runs."""
    if len(runs) < FEWEST:
        raise FitError(f"{len(runs)} runs are too few to tell how far runs scatter; give {FEWEST} or more")
    voltages = np.array([run.voltage_v for run in runs])
    voltage_v = float(voltages.mean())
    factor = _by_voltage(runs, voltage_v)
    drag = _shared_drag(
        np.array([run.sinking_m_s for run in runs]),
        factor * np.array([run.wrench_n[HEAVE] for run in runs]),
        shape.model.get("D_w", 0.0),
    )
    marks = _marks(runs, shape, drag, voltage_v)
    thrust_n = np.mean([by * run.thrust_n for run, by in zip(runs, factor, strict=True)], axis=0)
    return Usual(marks.mean(axis=0), np.cov(marks.T), len(runs), drag, voltage_v, thrust_n)


def _shared_drag(sinking_m_s: Array, push_n: Array, known: float) -> float:
    """Slope of the push by the speed of sinking over all runs, with the vehicle file's drag as its prior."""
    w, z = sinking_m_s - sinking_m_s.mean(), push_n - push_n.mean()
    if known <= 0:
        return max(float(w @ z / max(w @ w, 1e-12)), 0.0)
    noise = float(np.var(z)) / (DRAG_SPREAD * known) ** 2
    return max(float((w @ z + noise * known) / (w @ w + noise)), 0.0)


def _by_voltage(runs: Sequence[Run], voltage_v: float) -> Array:
    """Factor (n,) on the thrust: a shaft turns by its voltage, and thrust goes by the square of its speed."""
    ratio = np.array([run.voltage_v for run in runs]) / voltage_v
    return np.where(np.isfinite(ratio), ratio, 1.0) ** 2


def _marks(runs: Sequence[Run], shape: Configuration, drag: float, voltage_v: float) -> Array:
    push = _by_voltage(runs, voltage_v)[:, None] * np.array([run.wrench_n for run in runs])
    leans = np.array([run.leans for run in runs])
    righting = shape.dry_mass_kg * GRAVITY_M_S2 * shape.centre_of_gravity_below_buoyancy_m
    return np.column_stack(
        [
            [run.rest_depth_m for run in runs],
            drag * np.array([run.sinking_m_s for run in runs]) - push[:, HEAVE],
            righting * leans - push[:, 3:5],
            np.array([run.turning_nm for run in runs]) - push[:, 5],
        ]
    )
