"""The marks of accepted runs: their mean, and how they scatter from run to run.

Mean and scatter are all that is fitted. Masses, drag and righting moment are the vehicle file's: they turn the
marks of a run into forces, and an error of theirs is the same in accepted and further runs."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from bridge.errors import FitError, LogError
from bridge.vehicle.config import GRAVITY_M_S2, Configuration
from identify.dive import Array
from identify.repeats.marks import HEAVE, Run

MARKS: Final = ("rest depth", "heave", "roll", "pitch", "yaw")
UNITS: Final = ("m", "N", "N m", "N m", "N m")
DEPTH, FORCE, ROLL, PITCH, YAW = range(5)

FEWEST: Final = 20
"""The scatter of five marks, and which of them go together, takes some twenty runs."""


@dataclass(frozen=True)
class Usual:
    """Accepted runs. mean (5,) and scatter (5, 5) of their marks (MARKS, in UNITS), of `count` runs.

    voltage_v: their mean voltage, at which the vehicle file's thrust holds; NaN if unknown. thrust_n (k,): mean thrust
    of each thruster.
    """

    mean: Array
    scatter: Array
    count: int
    voltage_v: float
    thrust_n: Array

    def marks_of(self, runs: Sequence[Run], shape: Configuration) -> Array:
        """Marks (n, 5) of runs: depth read at rest, and the force and moments that the model lacks in heave, roll,
        pitch and yaw to move as the runs did."""
        return _marks(runs, shape, self.voltage_v)

    def to_json(self) -> dict[str, Any]:
        """As plain data, for `usual_from`."""
        held = {name: getattr(self, name) for name in ("mean", "scatter", "thrust_n")}
        voltage = self.voltage_v if np.isfinite(self.voltage_v) else None
        return {
            **{name: value.tolist() for name, value in held.items()},
            "count": self.count,
            "voltage_v": voltage,
        }


def usual_from(plain: dict[str, Any]) -> Usual:
    """Accepted runs from plain data. Raises LogError if it holds none."""
    try:
        mean, scatter, thrust_n = (np.array(plain[name], float) for name in ("mean", "scatter", "thrust_n"))
        voltage = plain["voltage_v"]
        usual = Usual(
            mean,
            scatter,
            int(plain["count"]),
            np.nan if voltage is None else float(voltage),
            thrust_n,
        )
    except (KeyError, TypeError, ValueError):
        usual = None
    sides = len(MARKS)
    if (
        usual is None
        or usual.mean.shape != (sides,)
        or usual.scatter.shape != (sides, sides)
        or usual.count < FEWEST
    ):
        raise LogError("holds no accepted runs; write it from runs of a sound vehicle")
    return usual


def usual_of(runs: Sequence[Run], shape: Configuration) -> Usual:
    """Fit the mean and scatter of accepted runs. Raises FitError for fewer than FEWEST runs, and if their scatter
    is not known."""
    if len(runs) < FEWEST:
        raise FitError(f"{len(runs)} runs are too few to tell how far runs scatter; give {FEWEST} or more")
    voltages = np.array([run.voltage_v for run in runs])
    voltage_v = float(voltages.mean())
    factor = _by_voltage(runs, voltage_v)
    marks = _marks(runs, shape, voltage_v)
    scatter = np.cov(marks.T)
    if np.linalg.matrix_rank(scatter) < len(MARKS):
        raise FitError(
            "the runs do not differ in all that they show, so their scatter is not known; give more runs"
        )
    thrust_n = np.mean([by * run.thrust_n for run, by in zip(runs, factor, strict=True)], axis=0)
    return Usual(marks.mean(axis=0), scatter, len(runs), voltage_v, thrust_n)


def _by_voltage(runs: Sequence[Run], voltage_v: float) -> Array:
    """Factor (n,) on the thrust: a shaft turns by its voltage, and thrust goes by the square of its speed."""
    ratio = np.array([run.voltage_v for run in runs]) / voltage_v
    return np.where(np.isfinite(ratio), ratio, 1.0) ** 2


def _marks(runs: Sequence[Run], shape: Configuration, voltage_v: float) -> Array:
    push = _by_voltage(runs, voltage_v)[:, None] * np.array([run.wrench_n for run in runs])
    drag = shape.model.get("D_w", 0.0)
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
