"""Commands that flip from each sample to the next, faster than a thruster can follow."""

import numpy as np

from bridge.arrays import Array
from identify.dive import Dive, Signal
from identify.words import axes_named, listed

MOST_AUTOCORRELATION = -0.1
"""Commands flip if their autocorrelation over one sample is lower; that of a loop that answers sensor noise is 0.3."""

LEAST_SIZE = 0.1
"""Smallest standard deviation of commands that count, as a share of the largest of all outputs in the same unit."""


def flipping_commands(dive: Dive, commands: Signal) -> list[str]:
    """A sentence on thruster commands, or on the wrench in their place, that flip at each sample; empty if none do."""
    if commands is dive.tau_cmd:
        moments = [3 + dof for dof in _flipping(commands.value[:, 3:])]
        if not (dofs := [*_flipping(commands.value[:, :3]), *moments]):
            return []
        subject, parts = "Commanded forces", axes_named(dofs)
    else:
        if not (outputs := [str(k + 1) for k in _flipping(commands.value)]):
            return []
        subject, parts = "Thruster commands", f"output {listed(outputs)}"
    return [
        f"{subject} flip from each sample to the next ({parts}): thrusters can hardly follow that, so what they gave "
        "is not known, and neither masses nor causes there can be relied on. Calm the controller."
    ]


def _flipping(commands: Array) -> list[int]:
    """Columns of commands (n, k), all in one unit, that swing to the other side at each sample, and are not small."""
    known = [column[np.isfinite(column)] for column in commands.T]
    moved = [column - column.mean() if len(column) > 1 else np.zeros(1) for column in known]
    sizes = np.array([np.std(column) for column in moved])
    autocorrelation = np.array([np.sum(c[1:] * c[:-1]) / max(float(np.sum(c**2)), 1e-300) for c in moved])
    flip = (
        (sizes > 0)
        & (sizes >= LEAST_SIZE * sizes.max(initial=0.0))
        & (autocorrelation < MOST_AUTOCORRELATION)
    )
    return np.flatnonzero(flip).tolist()
