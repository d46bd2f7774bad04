"""Marks of a run that begins at rest and then holds one command for seconds.

Its thrust has a single step, so it determines neither masses nor dampings. Its marks are the depth read at rest, the
speed of sinking once settled, the lean, and how it begins to turn.

Of accepted runs only mean and scatter of the marks are fitted. Masses, drag and righting moment come from the vehicle
file, to turn marks into forces; their errors are the same in accepted and further runs.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from bridge.arrays import Array
from bridge.errors import FitError, LogError
from bridge.vehicle.coefficients import HEAVE
from bridge.vehicle.config import GRAVITY_M_S2, Configuration, VehicleFile
from bridge.vehicle.thrusters import allocation_matrix
from identify.dive import Dive, Signal
from identify.ingest.rotation import euler_angles
from identify.thrust.wrench import asked_thrusts, tells_thrusters

SETTLED_S: Final = 3.0
"""A small hull has settled to its speed and its lean so long after the push began."""

TURNS_S: Final = 1.1
"""So long the vehicle turns about its still place by the moment of the push alone."""

FAR: Final = 1e3
LEAST_SETTLED_S: Final = 2.0
STEADY: Final = 0.2
"""The thrust of a steady push changes by less than this share, from one twentieth of it to the last."""

LEAST_SHARE: Final = 0.02
"""Thrust below this share of a thruster's limit counts as none."""


@dataclass(frozen=True)
class Run:
    """Marks of a run as they are read, SI units, body axes FRD.

    rest_depth_m: depth read before the push. sinking_m_s: rate of depth after SETTLED_S. thrust_n (k,): mean thrust of
    each thruster then, by the vehicle file's curve. voltage_v: mean then, NaN if unknown. wrench_n (6,): of that
    thrust. leans (2,): roll and pitch then, beyond those at rest, rad. turning: the moment about z that turns the
    vehicle file's inertia as the vehicle began to turn, N m.
    """

    name: str
    rest_depth_m: float
    sinking_m_s: float
    thrust_n: Array
    voltage_v: float
    wrench_n: Array
    leans: Array
    turning_nm: float


def run_of(dive: Dive, file: VehicleFile, configuration: str) -> Run:
    """Marks of a run. Raises FitError for a run that does not go from rest into a steady push of seconds, or lacks
    the thrusters' commands, depth or attitude."""
    depth, shape = dive.depth_by(file.vehicle.water), file.vehicle.configurations[configuration]
    if not tells_thrusters(dive, shape) or depth is None or dive.attitude is None:
        raise FitError("a run needs the commands of its thrusters, depth and attitude", of=dive.name)
    depth, attitude = depth.finite(), dive.attitude.finite()
    asked = asked_thrusts(dive, file, configuration)
    pushed = np.abs(asked.value).max(axis=1) > LEAST_SHARE * shape.thruster_limit_n
    if pushed[0] or not pushed.any():
        raise FitError("a run has to begin with its thrusters at rest and then push", of=dive.name)
    began = int(np.argmax(pushed))
    began_s, end_s = float(asked.time_s[began]), float(asked.time_s[-1])
    if end_s - began_s < SETTLED_S + LEAST_SETTLED_S:
        raise FitError(
            f"it pushes for {end_s - began_s:.1f} s, and has to for {SETTLED_S + LEAST_SETTLED_S:.0f} s and more",
            of=dive.name,
        )
    push = asked.between(began_s, end_s).value
    low, high = np.percentile(push, [5, 95], axis=0)
    if (high - low > STEADY * np.abs(push).max()).any():
        raise FitError("a run has to push steadily, and its thrust changes", of=dive.name)
    held = asked.between(began_s + SETTLED_S, end_s)
    if not len(held):
        raise FitError("the commands of its thrusters have to be heard during the push", of=dive.name)
    thrust_n = held.value.mean(axis=0)
    euler = np.column_stack(euler_angles(attitude.value))
    euler[:, 2] = np.unwrap(euler[:, 2])
    at_s = attitude.time_s
    at_rest, settled = at_s < began_s, at_s > began_s + SETTLED_S
    still = depth.time_s < began_s
    later = depth.between(began_s + SETTLED_S, end_s)
    if not (at_rest.any() and settled.any() and still.any() and len(later) > 2):
        raise FitError("depth and attitude have to be read at rest and during the push", of=dive.name)
    return Run(
        dive.name,
        float(np.median(depth.value[still])),
        float(np.polyfit(later.time_s, later.value[:, 0], 1)[0]),
        thrust_n,
        _middle(dive.voltage, began_s + SETTLED_S, end_s),
        allocation_matrix(shape) @ thrust_n,
        np.median(euler[settled, :2], axis=0) - np.median(euler[at_rest, :2], axis=0),
        _moment(
            at_s - began_s,
            euler[:, 2] - euler[at_rest, 2][-1],
            shape.model.get("I_r", shape.inertia_kgm2[2]),
            shape.model.get("D_r", 0.0),
        ),
    )


def _middle(signal: Signal | None, start_s: float, end_s: float) -> float:
    """Median of a signal (n, 1) between two times; NaN if nothing is known of it there."""
    known = None if signal is None else signal.between(start_s, end_s).finite()
    return float(np.median(known.value)) if known is not None and len(known) else np.nan


def _moment(since_s: Array, turned: Array, inertia: float, damping: float) -> float:
    """Steady moment from `since_s` = 0 on that turns a body at rest most nearly as it turned (n,) in TURNS_S."""
    first = (since_s > 0) & (since_s <= TURNS_S)
    s = since_s[first]
    settles_s = inertia / max(damping, 1e-6 * inertia)
    # Long before it settles the two terms of the formula are nearly equal: then by its series.
    by_unit = s**2 / (2.0 * inertia)
    if settles_s < FAR * TURNS_S:
        by_unit = settles_s / inertia * (s + settles_s * np.expm1(-s / settles_s))
    return float(by_unit @ turned[first] / max(float(by_unit @ by_unit), 1e-300))


MARKS: Final = ("rest depth", "heave", "roll", "pitch", "yaw")
UNITS: Final = ("m", "N", "N m", "N m", "N m")
DEPTH, FORCE, ROLL, PITCH, YAW = range(5)

FEWEST: Final = 20
"""The scatter of five marks, and which of them go together, takes some twenty runs."""


@dataclass(frozen=True)
class Usual:
    """Accepted runs. mean (5,) and scatter (5, 5) of their marks (MARKS, in UNITS), of `count` runs.

    voltage_v: mean voltage of those that tell it, at which the vehicle file's thrust holds; NaN if none does.
    thrust_n (k,): mean thrust of each thruster.
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
            mean, scatter, int(plain["count"]), np.nan if voltage is None else float(voltage), thrust_n
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
    voltages = [run.voltage_v for run in runs if np.isfinite(run.voltage_v)]
    voltage_v = float(np.mean(voltages)) if voltages else np.nan
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
