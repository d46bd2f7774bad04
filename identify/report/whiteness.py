"""Are a filter's innovations white? Over time, and by their autocorrelation."""

import numpy as np

from identify.dive import Array, Signal
from identify.report import plot
from identify.report.axes import close_axis, roomy_axis
from identify.report.figures import TIME_TITLE, time_panel
from identify.report.page import Figure
from identify.report.plot import Line, Panel

LAGS = 40


def innovations(name: str, normalised: Signal) -> Figure:
    """Normalised innovations of one degree of freedom over time, and their autocorrelation."""
    time_s, value = normalised.time_s, normalised.value[:, 0]
    start_s = float(time_s[0])
    bound = np.array([1.96, 1.96])
    x = close_axis(TIME_TITLE, 0.0, float(time_s[-1]) - start_s)
    ends = np.array([x.low, x.high])
    over_time = time_panel(
        f"{name}: normalised innovation",
        x,
        [
            Line(time_s - start_s, value),
            Line(ends, bound, "95 % limits of white noise", 1),
            Line(ends, -bound, style=1),
        ],
    )
    rho = autocorrelation(value, LAGS)
    limit = 1.96 / np.sqrt(max(int(np.isfinite(value).sum()), 1))
    lags = np.arange(1.0, len(rho) + 1)
    lag_x = close_axis("lag, samples", 0.0, max(float(len(rho)), 1.0))
    lag_ends = np.array([lag_x.low, lag_x.high])
    level = np.array([limit, limit])
    lag_lines = (Line(lags, rho), Line(lag_ends, level, style=1), Line(lag_ends, -level, style=1))
    # Never magnified until nothing looks like something.
    lag_y = roomy_axis(f"{name}: autocorrelation", [np.array([-0.2, 0.2]), level, rho])
    lag_panel = Panel(lag_x, lag_y, lag_lines)
    words = plot.legend(over_time.lines)
    caption = (
        f"{name}: what the filter did not foresee, over what it expected. White noise crosses the dashed "
        "lines in one sample of twenty."
    )
    return Figure(caption, words + plot.side_by_side([over_time, lag_panel]))


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
