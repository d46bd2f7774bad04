"""Whether velocity follows thrust.

A sensor mounted the other way round, or with swapped axes, breaks that: no cause can be relied on until it is mended.
"""

from collections.abc import Sequence

import numpy as np
from numba import njit

from bridge.arrays import Array
from bridge.vehicle.coefficients import DOFS
from identify.estimators.axes.axis import Axis
from identify.estimators.filter.state import POSITION

AGAINST = -0.5
"""Correlation of a speed with its own lagged thrust: near 1 with thruster signs as in the file."""

LAGS_S = (0.5, 1.0, 3.0, 10.0)
"""Candidate time constants of a vehicle, mass over damping."""

SWAPPED = 0.3
"""Margin in correlation by which each of two velocities follows the other's thrust if the axes are swapped."""

PUSHED = (0, 1, 2, 5)
"""Degrees of freedom driven by thrust: roll and pitch right themselves."""


def mirrored(axes: Sequence[Axis]) -> tuple[int, ...]:
    """The degrees of freedom whose velocity or rate of turn runs against the thrust."""
    return tuple(axis.dof for axis in axes if axis.dof in PUSHED and _goes_with(axis, axis) < AGAINST)


def swapped(axes: Sequence[Axis]) -> tuple[tuple[int, int], ...]:
    """Pairs of degrees of freedom whose velocities each follow the other's thrust."""
    read = [axis for axis in axes if axis.dof < 3]
    return tuple(
        (first.dof, second.dof)
        for i, first in enumerate(read)
        for second in read[i + 1 :]
        if min(_rather(first, second), _rather(second, first)) > SWAPPED
    )


def mounted_otherwise(
    dofs: Sequence[int], pairs: Sequence[tuple[int, int]], wiring: Sequence[str] = ()
) -> tuple[str, ...]:
    """Warnings that precede any verdict on a dive with such a mounting; empty if motion follows thrust.

    wiring: sentences on miswired thrusters, which explain such a motion.
    """
    hints = wiring or mounting_hints(dofs, pairs)
    if not hints:
        return ()
    return (
        "The recorded motion does not go the way the thrust pushes, and no cause can be relied on until that is "
        "mended.",
        *hints,
    )


def mounting_hints(dofs: Sequence[int], pairs: Sequence[tuple[int, int]]) -> tuple[str, ...]:
    """A sentence for each mirrored degree of freedom and each swapped pair."""
    crossed = tuple(
        f"The recorded velocity in {DOFS[first]} goes with the thrust in {DOFS[other]}, and that in {DOFS[other]} with "
        f"the thrust in {DOFS[first]}: the axes of the DVL, or of the thrusters, are not as the vehicle file has them; "
        "check both (seatrial doctor --wet tells of them)."
        for first, other in pairs
    )
    return crossed + tuple(
        f"In {DOFS[dof]} the recorded {'velocity' if dof < 3 else 'rate of turn'} runs against the thrust: the "
        f"mounting of the {'DVL' if dof < 3 else 'gyro'}, or the sign of the thrusters, is not as the vehicle file has "
        "it; check both (seatrial doctor --wet tells of them)."
        for dof in dofs
    )


def _rather(axis: Axis, other: Axis) -> float:
    """Correlation of a velocity with another axis' thrust, less that with its own."""
    return abs(_goes_with(axis, other)) - abs(_goes_with(axis, axis))


def _goes_with(axis: Axis, pushed: Axis) -> float:
    """Correlation of an axis' velocity with the thrust of `pushed` behind its best lag; 0 without readings."""
    moving = np.isfinite(axis.reading) & (axis.state_read != POSITION)
    force, speed = pushed.force.mean(axis=1), axis.reading[moving]
    if len(speed) < 2 or np.std(speed) == 0.0:
        return 0.0
    at_s = axis.time_s[moving]
    lagged = [np.interp(at_s, pushed.time_s, behind(force, pushed.step_s, lag_s)) for lag_s in LAGS_S]
    correlations = [
        float(np.corrcoef(speed, lagged_thrust)[0, 1])
        for lagged_thrust in lagged
        if np.std(lagged_thrust) > 0.0
    ]
    return max(correlations, key=abs, default=0.0)


@njit(cache=True, nogil=True)
def behind(force: Array, step_s: Array, lag_s: float) -> Array:
    """Forces (n,) over steps, behind a first-order lag."""
    out = np.empty(len(force))
    state = 0.0
    for i in range(len(force)):
        state = force[i] + (state - force[i]) * np.exp(-step_s[i] / lag_s)
        out[i] = state
    return out
