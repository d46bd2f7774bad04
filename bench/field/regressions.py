"""Plain methods to predict a field dive, for comparison: regressions with quadratic drag and a delay of thrust.

Each learns from the dive and predicts the check dive from the same measured velocities, in the same windows.
"""

import contextlib
import io
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench.baselines.regression import PRODUCTS
from bridge.arrays import Array
from bridge.vehicle.config import Configuration, VehicleFile, load_vehicle
from bridge.vehicle.dynamics import restoring
from identify.align import AlignedDive, aligned
from identify.dive import Dive
from identify.ingest.open import read_dive
from identify.ingest.rotation import attitude_at
from identify.thrust.wrench import wrench

NAMES = (
    "`seatrial diagnose`, with its causes",
    "its nominal model",
    "least squares, linear and quadratic drag, delay by grid",
    "PySINDy, linear and quadratic drag, the same delay",
    "the true coefficients, without the cause",
)
AXES = (0, 1, 2, 5)
RATE_HZ, CUTOFF_HZ = 20.0, 0.5
DELAYS_S = tuple(round(0.02 * k, 2) for k in range(21))
STEP_S = 0.02
RUNAWAY = 5.0
HORIZONS_S = (1.0, 5.0)


@dataclass(frozen=True)
class ForecastRow:
    """The check dive at (n,) times: window of each, and velocities (n, 6) measured and predicted.

    The first time of a window is a step after the measured velocity that its prediction begins with.
    """

    time_s: Array
    window: NDArray[np.int64]
    measured: Array
    before: Array
    after: Array


@dataclass(frozen=True)
class Regressed:
    """nu_dot_i = (tau_i - g_i) gain - drag nu - square |nu| nu - products - rest, for the axes AXES; tau comes
    delay_s late."""

    gain: Array
    drag: Array
    square: Array
    products: Array
    rest: Array
    delay_s: float


def foretold_by(folder: Path, foretold: ForecastRow, truth: dict[str, Any]) -> dict[str, Array]:
    """Velocities (n, 6) by each plain method and by the truth; by PySINDy if the extra `bench` is installed."""
    file = load_vehicle(str(folder / "vehicle.yaml"))
    name = next(iter(file.vehicle.configurations))
    dive, check = (read_dive(folder / f"{recording}.tlog", None, file) for recording in ("dive", "check"))
    squares = least_squares(dive, file, name)
    models = {NAMES[2]: squares, NAMES[4]: true_one(truth)}
    if find_spec("pysindy"):
        models[NAMES[3]] = sindy(dive, file, name, squares.delay_s)
    return {title: fly(model, check, file, name, foretold) for title, model in models.items()}


def _pushed(grid: AlignedDive, shape: Configuration, delay_s: float) -> Array:
    """The wrench less restoring force (n, 6), delayed by `delay_s`."""
    push = np.column_stack([np.interp(grid.time_s - delay_s, grid.time_s, column) for column in grid.tau.T])
    return push - _restoring(shape, grid.attitude)


def _restoring(shape: Configuration, attitude: Array) -> Array:
    return np.column_stack([np.broadcast_to(x, len(attitude)) for x in restoring(shape, list(attitude.T))])


def _columns(nu: Array, dof: int) -> Array:
    """Columns (n, 5): velocity, its square, the two products, a constant."""
    velocity = nu[:, dof]
    return np.column_stack(
        [
            velocity,
            np.abs(velocity) * velocity,
            *(nu[:, a] * nu[:, b] for a, b in PRODUCTS[dof]),
            np.ones(len(nu)),
        ]
    )


def least_squares(dive: Dive, file: VehicleFile, name: str) -> Regressed:
    """Regress force on acceleration and drag terms axis by axis, with the delay of least residual over all axes."""
    best: tuple[float, Regressed] | None = None
    grid = aligned(dive, file, name, RATE_HZ, CUTOFF_HZ)
    for delay_s in DELAYS_S:
        push = _pushed(grid, file.vehicle.configurations[name], delay_s)
        left, rows = 0.0, []
        for dof in AXES:
            table = np.column_stack([grid.nu_dot[:, dof], _columns(grid.nu, dof)])[grid.valid]
            force = push[grid.valid, dof]
            coefficients, *_ = np.linalg.lstsq(table, force, rcond=None)
            left += float(np.var(force - table @ coefficients) / max(np.var(force), 1e-12))
            rows.append(coefficients)
        if best is None or left < best[0]:
            best = left, _regressed([np.concatenate([[1.0], row[1:]]) / row[0] for row in rows], delay_s)
    assert best is not None
    return best[1]


def sindy(dive: Dive, file: VehicleFile, name: str, delay_s: float) -> Regressed:
    """Regress acceleration on force and drag terms by PySINDy with a threshold, on smoothed finite differences."""
    import pysindy

    grid = aligned(dive, file, name, RATE_HZ, RATE_HZ / 2)
    push = _pushed(grid, file.vehicle.configurations[name], delay_s)
    rows = []
    for dof in AXES:
        inputs = np.column_stack([push[:, dof], _columns(grid.nu, dof)[:, 1:4]])
        scale = np.maximum(np.std(inputs, axis=0), 1e-9)
        model = pysindy.SINDy(
            optimizer=pysindy.STLSQ(threshold=0.002, alpha=1e-8),
            feature_library=pysindy.PolynomialLibrary(degree=1),
            differentiation_method=pysindy.SmoothedFiniteDifference(),
        )
        with warnings.catch_warnings(), contextlib.redirect_stdout(io.StringIO()):
            warnings.simplefilter("ignore")
            model.fit(grid.nu[:, dof : dof + 1], t=1.0 / RATE_HZ, u=inputs / scale)
        by = dict(zip(model.get_feature_names(), np.asarray(model.coefficients())[0], strict=True))
        u = [float(by[f"u{k}"]) / float(scale[k]) for k in range(4)]
        rows.append(np.array([u[0], -by["x0"], -u[1], -u[2], -u[3], -by["1"]]))
    return _regressed(rows, delay_s)


def true_one(truth: dict[str, Any]) -> Regressed:
    """The true coefficients of the vehicle, without its hidden effect."""
    mass, linear, square = (
        np.array(truth[name]) for name in ("total_mass_and_inertia", "linear_damping", "quadratic_damping")
    )
    carried = {0: (mass[2], -mass[1]), 1: (mass[0], -mass[2]), 2: (mass[1], -mass[0])}
    carried[5] = (mass[1] - mass[0], mass[4] - mass[3])
    rows = [
        np.array([1.0, linear[dof], square[dof], *carried[dof], 0.0]) / mass[dof] for dof in AXES
    ]  # fmt: skip
    return _regressed(rows, 0.0)


def _regressed(rows: Sequence[Array], delay_s: float) -> Regressed:
    """Build the model from rows of gain, drag, square, two products, rest."""
    gain, drag, square, first_product, second_product, offset = np.array(rows).T
    return Regressed(gain, drag, square, np.column_stack([first_product, second_product]), offset, delay_s)


def fly(model: Regressed, check: Dive, file: VehicleFile, name: str, foretold: ForecastRow) -> Array:
    """Velocities (n, 6) by the recorded thrust and attitude alone, each window from the measured velocity at its start.

    Rates of roll and pitch are the measured ones. NaN once the model has run away, and in roll and pitch.
    """
    assert check.attitude is not None
    history, shape = wrench(check, file, name), file.vehicle.configurations[name]
    starts = np.flatnonzero(np.diff(foretold.window, prepend=-1))
    length = len(foretold.window) // len(starts)
    step_s = float(foretold.time_s[1] - foretold.time_s[0])
    at_s = foretold.time_s[starts] - step_s
    nu = begun_with(foretold, starts, step_s)
    out = np.full((len(starts), length, 6), np.nan)
    each = max(round(step_s / STEP_S), 1)
    h = step_s / each
    measured = np.nan_to_num(foretold.measured).reshape(len(starts), length, 6)
    for row in range(length):
        nu[:, 3:5] = measured[:, row, 3:5]
        for part in range(each):
            now_s = at_s + h * (each * row + part + 0.5)
            push = history.at(now_s - model.delay_s) - _restoring(shape, attitude_at(check.attitude, now_s))
            half = nu + 0.5 * h * _rate(model, nu, push)
            nu = nu + h * _rate(model, half, push)
        nu[np.abs(nu).max(axis=1) > RUNAWAY] = np.nan
        out[:, row, list(AXES)] = nu[:, list(AXES)]
    return out.reshape(-1, 6)


def begun_with(foretold: ForecastRow, starts: NDArray[np.int64], step_s: float) -> Array:
    """The measured velocities (w, 6), a step before the first rows (w,) of the windows, that they begin with: the last
    of the window before where that ends there, or else what the first two of the window come from."""
    measured = np.nan_to_num(foretold.measured)
    before = 2.0 * measured[starts] - measured[starts + 1]
    follows = np.flatnonzero(np.diff(foretold.time_s)[starts[1:] - 1] < 1.5 * step_s) + 1
    before[follows] = measured[starts[follows] - 1]
    return np.asarray(before)


def _rate(model: Regressed, nu: Array, push: Array) -> Array:
    out = np.zeros_like(nu)
    for k, dof in enumerate(AXES):
        velocity = nu[:, dof]
        (a, b), (c, d) = PRODUCTS[dof]
        out[:, dof] = (
            model.gain[k] * push[:, dof]
            - model.drag[k] * velocity
            - model.square[k] * np.abs(velocity) * velocity
        )
        out[:, dof] -= model.products[k, 0] * nu[:, a] * nu[:, b] + model.products[k, 1] * nu[:, c] * nu[:, d]
        out[:, dof] -= model.rest[k]
    return out


def drifts_of(foretold: ForecastRow, way: Array) -> list[list[float | None]]:
    """For each horizon and axis: rms drift, m/s and rad/s, or None without data or if half the windows ran away."""
    starts = np.flatnonzero(np.diff(foretold.window, prepend=-1))
    length = len(foretold.window) // len(starts)
    step_s = float(foretold.time_s[1] - foretold.time_s[0])
    rows: list[list[float | None]] = []
    for horizon_s in HORIZONS_S:
        at = starts + min(round(horizon_s / step_s), length) - 1
        off = way[at] - foretold.measured[at]
        rows.append([_rms(off[:, dof]) for dof in AXES])
    return rows


def _rms(off: Array) -> float | None:
    known = off[np.isfinite(off)]
    return float(f"{np.sqrt(np.mean(known**2)):.6g}") if len(known) > 0.5 * len(off) else None
