"""How old a value may be: after 3 expected periods it is stale, after 10 it is gone."""

from typing import Final

from gcs_plugin.watch.picture import Freshness

STALE_PERIODS: Final = 3.0
GONE_PERIODS: Final = 10.0
SHORTEST_PERIOD_S: Final = 0.1
"""Links deliver frames in batches: a faster signal is not stale after a pause of a few of its own periods."""


def period_s(expected_hz: float) -> float:
    """Period in which ages are counted."""
    return max(1.0 / expected_hz, SHORTEST_PERIOD_S)


def freshness(age_s: float, expected_hz: float) -> Freshness:
    """Freshness of a value that should come at `expected_hz`; its age is inf if it never came."""
    periods = age_s / period_s(expected_hz)
    if periods > GONE_PERIODS:
        return Freshness.GONE
    return Freshness.STALE if periods > STALE_PERIODS else Freshness.FRESH
