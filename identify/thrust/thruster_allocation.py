"""The gain of each thruster in the vehicle's own allocation during a dive, from its commands.

The allocation distributes the wrench TAU_CMD over the thrusters, and the pulses show the thrust asked of each. With the
file's gains both agree. A vehicle that compensates a weak thruster asks more of it than the file's gain would, so its
allocation has a lower gain for it, found here by least squares over the dive.
"""

import numpy as np

from bridge.arrays import Array
from bridge.errors import SeatrialError
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.controller import load_gains
from bridge.vehicle.feedforward import FEEDFORWARD_DOFS
from bridge.vehicle.thrusters import NEUTRAL_US, Allocator, Pulses, thrust_curve
from identify.dive import Dive

POINTS = 4001
LEAST_N = 0.5
"""Least rms of a thruster's thrust to determine its gain."""
MOST_LEFT = 0.1
"""Share of the wrench, rms, that may remain unexplained: beyond it the pulses are of another allocation."""
ALIKE, MOST_ALIKE = 1e-3, 0.01
"""Eigenvalue of the columns' correlations below which a combination of gains is undetermined, and the largest share in
such combinations of a gain that still counts as determined."""


def allocated_gains(dive: Dive, file: VehicleFile, configuration: str) -> Array | None:
    """Total gain of each thruster over its curve (n,), NaN if undetermined.

    Accepted effects are part of it while the feed-forward is applied. None without TAU_CMD and pulses, or if the pulses
    don't follow from the wrench.
    """
    if dive.tau_cmd is None or dive.pwm is None or len(dive.tau_cmd) < 2 or len(dive.pwm) < 2:
        return None
    shape = file.vehicle.configurations[configuration]
    try:
        curve = thrust_curve(file.vehicle.thrust_curve, file.path.parent)
        allocator, table = Allocator(shape, curve), load_gains(shape.gains)
    except SeatrialError:
        return None
    count = len(shape.thrusters)
    if dive.pwm.value.shape[1] < count or curve.neutral_us != NEUTRAL_US:
        return None
    acts = dive.feedforward_acts
    driven = np.abs(allocator.matrix[list(FEEDFORWARD_DOFS)]).max(axis=0) > 1e-6
    below_n = np.where(driven & acts, table.fed.straight_below_n, table.straight_below_n)
    grid = np.linspace(allocator.low_n, allocator.high_n, POINTS)
    pulses = Pulses(curve, below_n)
    of_grid = np.stack([pulses(np.full(count, thrust_n)) for thrust_n in grid])
    pwm_us = dive.pwm.value[:, :count]
    thrust_n = np.column_stack([np.interp(pwm_us[:, i], of_grid[:, i], grid) for i in range(count)])
    reach = np.maximum(allocator.reach(), 1e-6)
    wrench = dive.tau_cmd.at(dive.pwm.time_s) / reach
    known = np.isfinite(wrench).all(axis=1) & np.isfinite(thrust_n).all(axis=1)
    wrench, thrust_n = wrench[known], thrust_n[known]
    curve_matrix = allocator.matrix / np.array([thruster.gain for thruster in shape.thrusters])
    columns = (thrust_n[:, None, :] * (curve_matrix / reach[:, None])[None]).reshape(-1, count)
    used = np.sqrt(np.mean(thrust_n**2, axis=0)) >= LEAST_N if len(thrust_n) else np.zeros(count, bool)
    gains = np.full(count, np.nan)
    if not used.any():
        return gains
    # The wrench of thrusters that hardly push is left out with them, in the axes that they alone serve.
    regressors = columns[:, used]
    square = regressors.T @ regressors
    fitted, *_ = np.linalg.lstsq(regressors, wrench.ravel(), rcond=None)
    left = wrench.ravel() - regressors @ fitted
    if np.sqrt(np.mean(left**2)) > MOST_LEFT * np.sqrt(np.mean(wrench**2)):
        return None
    size = np.sqrt(np.diag(square))
    eigenvalues, directions = np.linalg.eigh(square / np.outer(size, size))
    undetermined = np.sum(directions[:, eigenvalues < ALIKE] ** 2, axis=1)
    gains[used] = np.where(undetermined <= MOST_ALIKE, fitted, np.nan)
    return gains
