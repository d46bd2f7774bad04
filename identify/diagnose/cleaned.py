"""Recordings that are too short, and readings that are wrong for certain: velocities that stand still, and spikes.

A fit drops some outliers itself. Many of them inflate its noise levels, and their apparent motion turns into causes, so
velocity spikes are removed first: readings that no motion links to their neighbours, as when a DVL loses its echo.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.errors import FitError
from bridge.vehicle.coefficients import DOFS
from identify.dive import Dive, Signal
from identify.estimators.refusals import longest_common_s

LEAST_S = 20.0
LEAST_RUN_S = 8.0

MOST_STILL = 0.5
"""Share of a dive with a frozen velocity from which the remaining velocity is not used either."""

NEIGHBOURS = 2
"""Neighbours on either side of a reading."""

FAR = 8.0
"""Least deviation of a spike from its neighbours' median, in standard deviations of sound readings."""

LEAST_SPIKE_M_S = 0.05
"""Least size of a spike: coarse or noiseless readings have next to no deviation."""

AGREE = 0.5
"""Largest span of a spike's neighbours, relative to its size: a start or a stop is no spike."""

MANY = 0.005
"""Share of spikes from which the verdict mentions them."""

NORMAL = 0.6745
"""Median magnitude of a standard normal variable."""


@dataclass(frozen=True)
class Spikes:
    """Count of spikes among the readings of a degree of freedom."""

    dof: int
    count: int
    of: int

    @property
    def share(self) -> float:
        return self.count / self.of


@dataclass(frozen=True)
class Cleaned:
    """A dive without readings that are wrong for certain: a sentence on a velocity left out whole, and the spikes.
    name: of another dive than the one diagnosed, in these sentences."""

    dive: Dive
    still: tuple[str, ...]
    spikes: tuple[Spikes, ...]
    name: str = ""

    @property
    def is_spiky(self) -> bool:
        """Whether the verdict has to mention the spikes."""
        return any(item.share >= MANY for item in self.spikes)

    @property
    def sentences(self) -> tuple[str, ...]:
        """A sentence on the spikes; none without any."""
        return (spikes_sentence(self.spikes, self.name),) if self.spikes else ()


def cleaned(dive: Dive, name: str = "") -> Cleaned:
    """The dive without readings that are wrong for certain. name: of another dive.

    Raises FitError for a dive shorter than LEAST_S, or of short runs alone.
    """
    refuse_short(dive, LEAST_S)
    refuse_short_runs(dive)
    dive, still = without_still_velocity(dive, name)
    dive, spikes = without_spikes(dive)
    if dive.attitude is not None:
        dive = replace(dive, attitude=dive.attitude.finite())
    return Cleaned(dive, still, spikes, name)


def refuse_short(dive: Dive, least_s: float) -> None:
    """Raise FitError for a recording that is too short."""
    if dive.duration_s < least_s:
        cut = "ends in the middle of a record, and what comes before " if dive.counts.get("cut") else ""
        mend = "copy the whole file, or " if cut else ""
        raise FitError(
            f"{cut}lasts {math.floor(dive.duration_s)} s, too short to tell one cause from another; "
            f"{mend}record {least_s:.0f} s or more, with starts, stops and turns",
            of=dive.source,
        )
    together_s = longest_common_s(dive)
    if round(together_s) < least_s:
        raise FitError(
            f"thruster commands and readings of motion are both in it for {together_s:.0f} s of "
            f"{dive.duration_s:.0f} s, too short to tell one cause from another; record both for {least_s:.0f} s or "
            "more, with starts, stops and turns",
            of=dive.source,
        )


def refuse_short_runs(dive: Dive) -> None:
    """Raise FitError if no run of a dive made of several lasts for LEAST_RUN_S."""
    longest_s = max((run.duration_s for run in dive.runs), default=LEAST_S)
    if longest_s < LEAST_RUN_S:
        raise FitError(
            f"the longest of its {len(dive.runs)} runs lasts {longest_s:.1f} s, too short to tell how a model drifts; "
            f"give runs of {LEAST_RUN_S:.0f} s or more",
            of=dive.source,
        )


def without_still_velocity(dive: Dive, name: str = "") -> tuple[Dive, tuple[str, ...]]:
    """The dive without a velocity that stands still for most of it, and a sentence on that. name: of another dive."""
    still_s = sum(end_s - start_s for start_s, end_s in dive.frozen.get("velocity", ()))
    if dive.velocity is None or still_s <= MOST_STILL * dive.duration_s:
        return dive, ()
    return replace(dive, velocity=None), (
        f"The velocity{f' of {name}' if name else ''} repeats one value for {still_s:.0f} s of {dive.duration_s:.0f} s "
        "while the vehicle goes on, and was left out whole; check the DVL, and what passes its readings on.",
    )


def without_spikes(dive: Dive) -> tuple[Dive, tuple[Spikes, ...]]:
    """The dive without velocity spikes, and their counts.

    An autopilot's filter smears spikes, so its velocity is left alone.
    """
    if dive.velocity is None or dive.velocity_is_filtered:
        return dive, ()
    value, spikes = dive.velocity.value.copy(), []
    for dof in range(3):
        read = np.flatnonzero(np.isfinite(value[:, dof]))
        spiky = _spikes(value[read, dof])
        if spiky.any():
            spikes.append(Spikes(dof, int(spiky.sum()), len(read)))
            value[read[spiky], dof] = np.nan
    return (replace(dive, velocity=Signal(dive.velocity.time_s, value)) if spikes else dive), tuple(spikes)


def spikes_sentence(spikeses: Sequence[Spikes], name: str = "") -> str:
    """A sentence on the spikes dropped. name: of another dive."""
    counts = ", ".join(
        f"{spikes.count} in {DOFS[spikes.dof]} ({100 * spikes.share:.2g} %)" for spikes in spikeses
    )
    return (
        f"Velocities{f' of {name}' if name else ''} stand off from those before and after as no motion does: these "
        f"spikes were left out: {counts}; look at the DVL, and at what passes its readings on."
    )


def _spikes(value: Array) -> NDArray[np.bool_]:
    """Whether each reading (n,) of a velocity is a spike; no reading at either end is."""
    out = np.zeros(len(value), dtype=np.bool_)
    width = 2 * NEIGHBOURS + 1
    if len(value) < 2 * width:
        return out
    windows = sliding_window_view(value, width)
    neighbours = np.delete(windows, NEIGHBOURS, axis=1)
    off = np.abs(windows[:, NEIGHBOURS] - np.median(neighbours, axis=1))
    least = max(FAR * float(np.median(off)) / NORMAL, LEAST_SPIKE_M_S)
    # One neighbour may be a spike, too: the span of the others is the vehicle's motion.
    inner = np.sort(neighbours, axis=1)
    span = np.minimum(inner[:, -2] - inner[:, 0], inner[:, -1] - inner[:, 1])
    out[NEIGHBOURS:-NEIGHBOURS] = (off > least) & (span < AGREE * off)
    return out
