"""Leaves out the ends of a recording in which the vehicle floats: the surface carries it, and no model of a hull under
water holds that force, so that it would pass for a disturbance of all the dive."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.dive import Signal
from identify.thrust.wrench_history import WrenchHistory

Span = tuple[float, float]

NEAR_M = 0.5
"""A vehicle with thrusters at rest that reads a smaller depth floats: air pressure changes the reading by 0.3 m."""
FLOATS_S = 2.0
"""It floats at the median depth of its readings at rest, if these cover so long."""
BELOW_M = 0.1
"""So far below that depth it is under water."""
STAYS_S = 2.0
"""It is, once it stays there for so long: a wave passes."""
LEAST_TOLD_S = 0.5
"""Less time left out than this is not worth a note."""
MOST_PUSHED = 0.25
"""Manoeuvres this near to the surface are used: no more than this share of the commands that push is left out."""


def under_water(
    spans_s: Sequence[Span], forces: WrenchHistory, depth: Signal | None, least_n: float
) -> tuple[list[Span], tuple[str, ...]]:
    """Return the spans of time, one a run, without the ends in which the vehicle floats, and a note on the
    time left out.

    depth: (n, 1) m, None if unknown. least_n: thrust in an axis that counts as none, N or N m.
    """
    if depth is None:
        return list(spans_s), ()
    pushes: NDArray[np.bool_] = np.asarray((np.abs(forces.asked) > least_n).any(axis=1))
    kept = [_submerged(span_s, forces, pushes, depth) for span_s in spans_s]
    first_s, last_s = (sum(abs(b[i] - a[i]) for a, b in zip(spans_s, kept, strict=True)) for i in range(2))
    ends = [f"the {end} {s:.0f} s" for end, s in (("first", first_s), ("last", last_s)) if s >= LEAST_TOLD_S]
    if not ends:
        return kept, ()
    return kept, (
        "At the surface the vehicle floats as under water it does not: "
        f"{' and '.join(ends)} of thruster commands are left out.",
    )


def _submerged(span_s: Span, forces: WrenchHistory, pushes: NDArray[np.bool_], depth: Signal) -> Span:
    signal = depth.between(*span_s).finite()
    if len(signal) < 2:
        return span_s
    time_s, depth_m = signal.time_s, signal.value[:, 0]
    last = np.searchsorted(forces.time_s, time_s, side="right") - 1
    floats = ~pushes[np.maximum(last, 0)] & (np.abs(depth_m) < NEAR_M)
    if np.count_nonzero(floats) < FLOATS_S * signal.rate_hz:
        return span_s
    deep = depth_m > np.median(depth_m[floats]) + BELOW_M
    start_s, end_s = _stays(time_s, deep), -_stays(-time_s[::-1], deep[::-1])
    inside = (forces.time_s >= span_s[0]) & (forces.time_s <= span_s[1]) & pushes
    kept = inside & (forces.time_s >= start_s) & (forces.time_s <= end_s)
    if end_s <= start_s or np.count_nonzero(kept) < (1.0 - MOST_PUSHED) * np.count_nonzero(inside):
        return span_s
    return start_s, end_s


def _stays(time_s: Array, deep: NDArray[np.bool_]) -> float:
    """The first time from which it is deep for STAYS_S; inf if there is none."""
    shallow_s = np.append(time_s[~deep], np.inf)
    lasts_s = shallow_s[np.searchsorted(shallow_s, time_s)] - time_s
    stays = deep & (np.minimum(lasts_s, time_s[-1] - time_s) >= STAYS_S)
    return float(time_s[np.argmax(stays)]) if stays.any() else float("inf")
