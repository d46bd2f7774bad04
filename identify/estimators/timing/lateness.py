"""Change of a force with the time at which it acts, also for thrust behind a velocity that is late or smoothed."""

from dataclasses import dataclass

import numpy as np
from numba import njit

from bridge.arrays import Array

LATER_S = 0.03
"""Short compared with the motion of a vehicle, and about as long as a thruster's lag."""

APART_S = 0.03
LATENESS_SPREAD_S, SMOOTHING_SPREAD_S, HEAVE_SPREAD_S = 0.03, 0.1, 0.15
"""Prior standard deviations of an autopilot's timing in a single axis: of its lateness about the value that surge
and sway gave, and of its filter's time constant. That was found with the file's lag: a longer lag looks like more
smoothing until the causes have it. In heave, where other sensors feed that filter, both may be further off."""


@dataclass(frozen=True)
class Timing:
    """Change of an axis's force (n,) per second of lateness or of smoothing; `spread`: prior standard deviation of
    that time, s."""

    force: Array
    spread: float


def by_lateness(force: Array, half_s: Array, lag_s: float = LATER_S) -> Array:
    """Change of each step's mean force (n,), per second that the forces (n, 2) of its halves come later.

    half_s (n,): half of each step. The change is minus the slope of the forces behind a first-order lag; if `lag_s`
    is a thruster's whole lag, this is exactly the effect of the last part of that lag, whatever its size. It is made
    of earlier forces alone: a force that came sooner would respond, through the controller, to noise in later
    readings.
    """
    return np.asarray(_slope(force, half_s, lag_s))


@njit(cache=True, nogil=True, error_model="numpy")
def _slope(force: Array, half_s: Array, lag_s: float) -> Array:
    out = np.zeros(len(half_s))
    # An empty step holds no force of the attitude, which in a later run can be far from none.
    first = 0
    while first < len(half_s) - 1 and half_s[first] <= 0:
        first += 1
    after = force[first, 0]
    for i in range(len(half_s)):
        if half_s[i] > 0:
            before = after
            keep = np.exp(-half_s[i] / lag_s)
            for k in range(2):
                after = force[i, k] + (after - force[i, k]) * keep
            out[i] = (before - after) / (2 * half_s[i])
    return out


def behind_filter(values: Array, step_s: float, smoothing_s: float) -> Array:
    """Columns (n, k) at uniform times, straight between them, after a first-order filter, whose state starts at the
    first row."""
    if smoothing_s <= 0:
        return values
    keep = float(np.exp(-step_s / smoothing_s))
    return np.asarray(_smoothed(np.ascontiguousarray(values), keep, smoothing_s / step_s * (1.0 - keep)))


@njit(cache=True, nogil=True)
def means_behind_filter(values: Array, step_s: Array, smoothing_s: float) -> Array:
    """Mean (n,) over each step (n,), s, of values (n,) that hold for a step, after a first-order filter, whose state
    starts at the first value; 0 for an empty step."""
    out, state = np.zeros(len(values)), values[0]
    for i in range(len(values)):
        if step_s[i] > 0:
            keep = np.exp(-step_s[i] / smoothing_s)
            out[i] = values[i] + (state - values[i]) * (1.0 - keep) * smoothing_s / step_s[i]
            state = values[i] + (state - values[i]) * keep
    return out


@njit(cache=True, nogil=True)
def _smoothed(values: Array, keep: float, mean: float) -> Array:
    """`mean`: of the filter's decay over a step, of which `keep` is left at its end."""
    out, at_start, at_end = np.empty_like(values), mean - keep, 1.0 - mean
    for c in range(values.shape[1]):
        out[0, c] = values[0, c]
    for i in range(1, values.shape[0]):
        for c in range(values.shape[1]):
            out[i, c] = at_start * values[i - 1, c] + at_end * values[i, c] + keep * out[i - 1, c]
    return out


@dataclass(frozen=True)
class FilteredForce:
    """An axis's force (m,) at the uniform times (m,), as it appears in the readings of an autopilot's own filter."""

    time_s: Array
    force: Array

    def behind(self, smoothing_s: float, later_s: float = 0.0) -> "FilteredForce":
        """The same force behind a filter of that time constant, `later_s` later."""
        step_s = float(self.time_s[1] - self.time_s[0])
        smooth = behind_filter(self.force[:, None], step_s, smoothing_s)[:, 0]
        return FilteredForce(self.time_s, np.interp(self.time_s - later_s, self.time_s, smooth))

    def mean_between(self, start_s: Array, end_s: Array) -> Array:
        """Mean (n,) over each interval; the value itself for an empty interval."""
        step_s = float(self.time_s[1] - self.time_s[0])
        total = np.concatenate([[0.0], np.cumsum(0.5 * step_s * (self.force[1:] + self.force[:-1]))])
        span_s = end_s - start_s
        area = np.interp(end_s, self.time_s, total) - np.interp(start_s, self.time_s, total)
        here = np.interp(end_s, self.time_s, self.force)
        return np.asarray(np.where(span_s > 0, area / np.where(span_s > 0, span_s, 1.0), here))


def timing_of(
    force: FilteredForce, smoothing_s: float, start_s: Array, end_s: Array, in_heave: bool = False
) -> tuple[Timing, ...]:
    """Change of an axis's force over each step, per second of extra lateness, and per second of smoothing in place of
    as much lateness. A filter delays by its time constant, so only its other effects separate the two."""
    spreads = (HEAVE_SPREAD_S, HEAVE_SPREAD_S) if in_heave else (LATENESS_SPREAD_S, SMOOTHING_SPREAD_S)
    now, late, smoother = (
        force.behind(*by).mean_between(start_s, end_s)
        for by in ((smoothing_s, 0.0), (smoothing_s, APART_S), (smoothing_s + APART_S, 0.0))
    )
    return Timing((late - now) / APART_S, spreads[0]), Timing((smoother - late) / APART_S, spreads[1])
