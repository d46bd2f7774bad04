"""How alike two signals of a recording move over windows, without their means, for coarse checks."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bridge.arrays import Array
from identify.checks.sensors.scales import whole
from identify.dive import Signal

WINDOW_S, EDGE_S = 0.5, 0.25
FEWEST_WINDOWS = 12
CLEAR, UNCLEAR = 0.7, 0.4
"""Correlations from which two signals move alike, and below which they don't."""

NEAR_UNIT, NEARER_UNIT = 1.25, 1.1
"""Factors within which a ratio is that of two units: of a few that lie far apart, and of many."""


@dataclass(frozen=True)
class Match:
    """How alike two signals move: correlation, and spread of the first over that of the second, with its sign."""

    correlation: float
    ratio: float

    @property
    def words(self) -> str:
        return f"correlation {self.correlation:.2f}, ratio {self.ratio:.3g}"


def matched(seen: Array, said: Array, least: float) -> Match | None:
    """How alike two series (n,) move; None if they are short, or if one moves less than `least`."""
    known = np.isfinite(seen) & np.isfinite(said)
    seen, said = seen[known], said[known]
    if len(seen) < FEWEST_WINDOWS or min(float(np.std(seen)), float(np.std(said))) == 0.0:
        return None
    if max(float(np.std(seen)), float(np.std(said))) < least:
        return None
    correlation = float(np.corrcoef(seen, said)[0, 1])
    return Match(correlation, math.copysign(float(np.std(seen) / np.std(said)), correlation))


def clearest(matches: Sequence[Match | None]) -> Match | None:
    """The match of the largest correlation, of either sign; None without any."""
    known = [match for match in matches if match is not None]
    return max(known, key=lambda match: abs(match.correlation), default=None)


def readings(signal: Signal | None) -> Signal | None:
    """The finite readings of a signal, with zeros for axes that nothing read; None if fewer than two."""
    if signal is None:
        return None
    unread = ~np.isfinite(signal.value).any(axis=0)
    return whole(Signal(signal.time_s, np.where(unread, 0.0, signal.value)))


def window_edges(signals: tuple[Signal, ...], longest_s: float = WINDOW_S) -> Array | None:
    """Edges of windows over the time that all signals have, each up to `longest_s`; None if that is short."""
    start_s = max(float(signal.time_s[0]) for signal in signals)
    end_s = min(float(signal.time_s[-1]) for signal in signals)
    if end_s - start_s < FEWEST_WINDOWS * WINDOW_S:
        return None
    window_s = float(np.clip((end_s - start_s) / FEWEST_WINDOWS, WINDOW_S, longest_s))
    # A little more, so that the end of a whole number of windows is none short of it.
    count = int((end_s - start_s) / window_s + 1e-9)
    return start_s + window_s * np.arange(count + 1, dtype=np.float64)


def unit_factor(ratio: float, ratios: tuple[float, ...]) -> float | None:
    """The factor that mends a signal if `ratio` is a ratio of two units; None for any other ratio."""
    for unit in ratios:
        if unit / NEAR_UNIT < abs(ratio) < unit * NEAR_UNIT:
            return 1.0 / unit
    return None
