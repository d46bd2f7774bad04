"""Does a vehicle move the way in which its thrust pushes? A sensor that is mounted another way round says that it does
not, and a fit then gives that axis up."""

from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DOFS
from identify.estimators.axes import Axis
from identify.estimators.innovations import POSITION

Array = NDArray[np.float64]

AGAINST = -0.5
"""Correlation of a speed with its own thrust behind a lag: near 1 where thrusters push the way that the file says."""

LAGS_S = (0.5, 1.0, 3.0, 10.0)
"""A vehicle's mass over its damping is somewhere among these."""

PUSHED = (0, 1, 2, 5)
"""Where thrust makes the motion: roll and pitch are righted."""


def mirrored(axes: Sequence[Axis]) -> tuple[int, ...]:
    """The degrees of freedom whose velocity or rate of turn runs against the thrust."""
    return tuple(axis.dof for axis in axes if axis.dof in PUSHED and _runs_against(axis))


def mounting_hints(dofs: Sequence[int]) -> tuple[str, ...]:
    """A sentence for each of those."""
    return tuple(
        f"In {DOFS[dof]} the recorded {'velocity' if dof < 3 else 'rate of turn'} runs against the thrust: the "
        f"mounting of the {'DVL' if dof < 3 else 'gyro'}, or the sign of the thrusters, is not as the vehicle file has "
        "it; check both (seatrial doctor --wet tells of them) before you rely on any cause."
        for dof in dofs
    )


def _runs_against(axis: Axis) -> bool:
    moving = np.isfinite(axis.reading) & (axis.state_read != POSITION)
    force, speed = axis.force.mean(axis=1), axis.reading[moving]
    if len(speed) < 2 or np.std(speed) == 0.0:
        return False
    behind = [_behind(force, axis.step_s, lag_s)[moving] for lag_s in LAGS_S]
    found = [float(np.corrcoef(speed, one)[0, 1]) for one in behind if np.std(one) > 0.0]
    return bool(found) and max(found, key=abs) < AGAINST


@njit(cache=True, nogil=True)
def _behind(force: Array, step_s: Array, lag_s: float) -> Array:
    """Forces (n,) over steps behind a first-order lag."""
    out = np.empty(len(force))
    state = 0.0
    for i in range(len(force)):
        state = force[i] + (state - force[i]) * np.exp(-step_s[i] / lag_s)
        out[i] = state
    return out
