"""How far causes shrink the drift, and which of them count. A screen shows this without loading the mathematics."""

import math
from dataclasses import dataclass

CHANCE = 0.2
"""Chance deviation of a five-minute dive's drift from its floor: two standard errors of an rms over some sixty windows,
and the floor's own uncertainty."""

LIKELY = 0.5
"""A less probable cause is called possible: neither asserted nor accepted."""


@dataclass(frozen=True)
class AxisShrink:
    """The shrink of one degree of freedom.

    before, after, floor: rms 5 s drift, m/s or rad/s. value: as in `Shrink`. nrmse: error of the velocity simulated
    over 5 s windows, over the measured velocity's standard deviation; NaN if that is zero.
    """

    dof: str
    before: float
    after: float
    floor: float
    value: float
    nrmse_before: float
    nrmse_after: float
    nrmse_baseline: float


@dataclass(frozen=True)
class Shrink:
    """How far the drift shrinks with the causes.

    before, after: rms drifts in floors. value = (before - after) / (before - floor), after no less than floor; NaN
    without a gap. low95, high95: of the value, NaN if unknown. floor: near 1, as in `shrink.floor_of`. by_axis: the
    shrink of each fitted degree of freedom, in absolute terms.
    """

    before: float
    after: float
    value: float
    low95: float
    high95: float
    floor: float = 1.0
    by_axis: tuple[AxisShrink, ...] = ()

    @property
    def at_most(self) -> float:
        """The value, or the upper end of its interval where that is known."""
        return self.value if math.isnan(self.high95) else self.high95
