"""Checks a filter's innovations for whiteness: over time, and by their autocorrelation."""

import numpy as np

from identify.dive import Array, Signal
from identify.report.figures import TIME_TITLE
from identify.report.page import Figure
from identify.report.plot import Line, lines_panel, side_by_side

LAGS = 40
LEAST_REACH = 0.2
"""Least extent of the autocorrelation's axis, so that noise is not magnified."""


def innovations(dive: str, name: str, normalised: Signal) -> Figure:
    """Normalised innovations of a degree of freedom over time, and their autocorrelation."""
    time_s, value = normalised.time_s - normalised.time_s[0], normalised.value[:, 0]
    rho = autocorrelation(value, LAGS)
    lags = np.arange(1.0, len(rho) + 1)
    limit = 1.96 / float(np.sqrt(max(int(np.isfinite(value).sum()), 1)))
    panels = (
        lines_panel(
            f"{name}: normalised innovation",
            TIME_TITLE,
            [Line(time_s, value), *_band(1.96, float(time_s[-1]))],
            (0.0, float(time_s[-1])),
        ),
        lines_panel(
            f"{name}: autocorrelation",
            "lag, samples",
            [Line(lags, rho), *_band(limit, float(max(len(rho), 1)))],
            (0.0, float(max(len(rho), 1))),
            (-LEAST_REACH, LEAST_REACH),
        ),
    )
    return Figure(
        f"innovations {name} {dive}".strip(),
        f"{name}: what the filter did not foresee, over what it expected. White noise crosses the dashed "
        "lines in one sample of twenty.",
        side_by_side(panels),
    )


def _band(bound: float, end: float) -> tuple[Line, Line]:
    """Lines from 0 to `end` at the limits that white noise keeps 95 % of the time."""
    ends = np.array([0.0, end])
    return (
        Line(ends, np.full(2, bound), "95 % limits of white noise", 1),
        Line(ends, np.full(2, -bound), style=1),
    )


def autocorrelation(value: Array, lags: int) -> Array:
    """Correlation at lags 1 to `lags` (fewer for a short series); pairs with a NaN are left out."""
    known = np.isfinite(value)
    if known.sum() < 3:
        return np.zeros(0)
    centred = np.where(known, value - value[known].mean(), 0.0)
    power = float((centred**2).sum()) / int(known.sum())
    if power == 0.0:
        return np.zeros(0)
    out = []
    for lag in range(1, min(lags, len(value) - 1) + 1):
        pairs = int((known[lag:] & known[:-lag]).sum())
        out.append(float((centred[lag:] * centred[:-lag]).sum()) / (pairs * power) if pairs else np.nan)
    return np.array(out)
