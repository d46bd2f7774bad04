"""Velocities that stand off from those before and after as no motion does: a DVL that loses its echo for one reading.

A fit leaves out a reading that is wild beside what it expects, but only some: many make it take them for the sensor's
noise, and what they do to the vehicle's seeming motion for causes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DOFS
from identify.dive import Dive, Signal

Array = NDArray[np.float64]

BESIDE = 2
"""So many readings before and after tell what one should be."""

FAR = 8.0
"""Standard deviations of a sound reading from the middle of those beside it, by which a spike is at least off."""

LEAST_M_S = 0.05
"""No less is a spike: coarse steps, and readings of a simulator without noise, have next to no deviation."""

AGREE = 0.5
"""Of what it is off by, the most that those beside it may differ by among themselves: a start or a stop is no spike."""

MANY = 0.005
"""The share of readings from which on spikes belong to the verdict."""

NORMAL = 0.6745
"""Median of the sizes of normal values, in their standard deviation."""


@dataclass(frozen=True)
class Spikes:
    """How many spikes there are among the readings of a degree of freedom."""

    dof: int
    count: int
    of: int

    @property
    def share(self) -> float:
        return self.count / self.of


def without_spikes(dive: Dive) -> tuple[Dive, tuple[Spikes, ...]]:
    """The dive without its velocity's spikes, and how many there were where there were any.

    What an autopilot's own filter gives has none: it would have smeared them.
    """
    if dive.velocity is None or dive.velocity_is_filtered:
        return dive, ()
    value, found = dive.velocity.value.copy(), []
    for dof in range(3):
        read = np.flatnonzero(np.isfinite(value[:, dof]))
        spiky = _spikes(value[read, dof])
        if spiky.any():
            found.append(Spikes(dof, int(spiky.sum()), len(read)))
            value[read[spiky], dof] = np.nan
    return (replace(dive, velocity=Signal(dive.velocity.time_s, value)) if found else dive), tuple(found)


def spikes_said(found: Sequence[Spikes], name: str = "") -> str:
    """In a sentence, how many were left out. name: of the dive, where there is another."""
    told = ", ".join(f"{one.count} in {DOFS[one.dof]} ({100 * one.share:.2g} %)" for one in found)
    return (
        f"Velocities{f' of {name}' if name else ''} stand off from those before and after as no motion does: these "
        f"spikes were left out: {told}; look at the DVL, and at what passes its readings on."
    )


def _spikes(value: Array) -> NDArray[np.bool_]:
    """Which of the readings (n,) of one velocity are; none of the first and last ones."""
    out = np.zeros(len(value), dtype=np.bool_)
    width = 2 * BESIDE + 1
    if len(value) < 2 * width:
        return out
    windows = sliding_window_view(value, width)
    beside = np.delete(windows, BESIDE, axis=1)
    off = np.abs(windows[:, BESIDE] - np.median(beside, axis=1))
    least = max(FAR * float(np.median(off)) / NORMAL, LEAST_M_S)
    # One of those beside may be a spike, too: what the others span is what the vehicle did.
    inner = np.sort(beside, axis=1)
    span = np.minimum(inner[:, -2] - inner[:, 0], inner[:, -1] - inner[:, 1])
    out[BESIDE:-BESIDE] = (off > least) & (span < AGREE * off)
    return out
