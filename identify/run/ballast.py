"""Whether runs that are taken for one vehicle weigh alike in the water: ballast that changed between two of them."""

from typing import Final

import numpy as np

from bridge.arrays import Array
from bridge.errors import FitError
from bridge.vehicle.coefficients import HEAVE
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.estimators.alike_runs import FEWEST_RUNS, split
from identify.forces import wrench
from identify.ingest.streams import some_of
from identify.statistics import left_of
from identify.words import significant

WINDOW_S, STEP_S = 2.0, 0.1
"""Long against the delays of thrust and readings, short against a run."""
LEAST_SHARE: Final = 0.003
"""Of the dry weight, by which two kinds of runs differ: less is a trapped bubble, or the sea."""


def ballast_note(dive: Dive, file: VehicleFile, configuration_name: str) -> tuple[str, ...]:
    """A sentence on runs that are heavier in the water than the others; () if all are alike, or that can't be told.

    Over windows, the thrust in heave is a steady push of each run, and shares of acceleration, drag and turning that
    all runs have in common.
    """
    numbers, thrust, shapes = _windows(dive, file, configuration_name)
    runs = np.unique(numbers)
    if len(runs) < FEWEST_RUNS:
        return ()
    of_run = (numbers[:, None] == runs).astype(np.float64)
    columns = np.hstack([of_run, shapes])
    fitted, *_ = np.linalg.lstsq(columns, thrust, rcond=None)
    noise = float(np.var(left_of(columns, thrust)))
    precisions = of_run.sum(axis=0) / max(noise, np.finfo(np.float64).tiny)
    weight_n = file.vehicle.configurations[configuration_name].dry_mass_kg * file.vehicle.water.gravity_m_s2
    kinds = split(-fitted[: len(runs)], precisions, LEAST_SHARE * weight_n)
    if kinds is None:
        return ()
    heavy, by_n = kinds
    names = some_of([dive.runs[int(runs[k])].name for k in heavy])
    return (
        f"In the water, {names} {'is' if len(heavy) == 1 else 'are'} heavier by {significant(by_n, 2)} N than the "
        "other runs, as after a change of ballast, and one model is fitted to all; if ballast was changed, give each "
        "kind a folder.",
    )


def _windows(dive: Dive, file: VehicleFile, configuration_name: str) -> tuple[Array, Array, Array]:
    """The run (n,) of each window, its mean thrust in heave (n,), N, and the mean motion (n, k) that thrust is needed
    for; empty if a signal is missing."""
    nothing = np.zeros(0), np.zeros(0), np.zeros((0, 1))
    velocity, gyro = dive.velocity, dive.gyro
    if velocity is None or gyro is None or dive.velocity_is_filtered:
        return nothing
    velocity, gyro = velocity.finite(), gyro.finite()
    if min(len(velocity), len(gyro)) < 2:
        return nothing
    try:
        thrust = wrench(dive, file, configuration_name).along(HEAVE)
    except FitError:
        return nothing
    steps = round(WINDOW_S / STEP_S)
    numbers, means, shapes = [], [], []
    for number, run in enumerate(dive.runs):
        count = int((run.end_s - run.start_s) / WINDOW_S)
        time_s = run.start_s + STEP_S * np.arange(count * steps + 1, dtype=np.float64)
        edges_s = time_s[::steps]
        (u, v, w), (p, q, _) = velocity.at(time_s).T, gyro.at(time_s).T
        inside = np.column_stack([w, np.abs(w) * w, u * q, v * p])[:-1]
        numbers.append(np.full(count, number))
        means.append(thrust.mean_between(edges_s[:-1], edges_s[1:])[:, 0])
        shapes.append(
            np.column_stack([np.diff(w[::steps]), inside.reshape(count, steps, inside.shape[1]).mean(axis=1)])
        )
    return np.concatenate(numbers), np.concatenate(means), np.vstack(shapes)
