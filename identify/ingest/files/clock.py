"""Clocks of foreign files: dates and times as ISO 8601 writes them, and clocks that tell whole seconds alone."""

from collections.abc import Sequence
from datetime import UTC, datetime, time, timedelta
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array

EPOCH: Final = datetime(1970, 1, 1, tzinfo=UTC)
TICK: Final = timedelta(microseconds=1)
DAY_S: Final = 86_400.0
LATE_S: Final = 600.0
"""No row comes later than this behind its neighbours: one from before midnight is told from a pause of half a day."""
FEWEST_SECONDS: Final = 3
MOST_WRONG: Final = 0.05
"""Up to this share, stamps that are no time of day count as damage; beyond it the clock is of another kind."""
NEARLY, MOST, ABOUT = 0.15, 0.8, 5
"""Seconds hold about as many rows each if MOST of them are within NEARLY of the usual number, which is the median of
ABOUT seconds, or off by one row."""


def iso_s(words: Sequence[str]) -> Array:
    """Time (n,) in s of dates with times, or of times of day, ISO 8601; NaN for a word that is no such time. A date may
    have slashes, 2026/07/19.

    Of dates it is Unix time; a time without an offset is taken for UTC. Times of day run on past midnight. Raises
    ValueError with the first word that is no such time if more than MOST_WRONG of them are not empty and none.
    """
    filled = sum(map(bool, words))
    of_day = 2 * sum(":" in word[:3] for word in words) > filled
    read = _since_midnight_s if of_day else _unix_s
    time_s = np.full(len(words), np.nan)
    wrong: list[str] = []
    for row, word in enumerate(words):
        if word:
            try:
                time_s[row] = read(word)
            except ValueError:
                wrong.append(word)
    if len(wrong) > MOST_WRONG * filled:
        raise ValueError(wrong[0])
    return _past_midnight(time_s) if of_day else time_s


def _unix_s(word: str) -> float:
    # With the year first, slashes are no question of which is the month.
    at = datetime.fromisoformat(word[:10].replace("/", "-") + word[10:] if word[4:5] == "/" else word)
    return ((at if at.tzinfo else at.replace(tzinfo=UTC)) - EPOCH) / TICK * 1e-6


def _since_midnight_s(word: str) -> float:
    # Python takes 01:23.4 for 1 h 23 min, and who writes it means 1 min 23.4 s.
    if word.count(":") < 2:
        raise ValueError(word)
    at = time.fromisoformat(word.rjust(len(word) + (word[1:2] == ":"), "0"))
    return 3600.0 * at.hour + 60.0 * at.minute + at.second + 1e-6 * at.microsecond


def of_day_s(stamps: Array) -> Array:
    """Time (n,) in s of stamps (n,) that write hours, minutes and seconds as one number, 202459 for 20:24:59; NaN for
    any other number.

    Past midnight it runs on. Raises ValueError with the first stamp that is no such time if more than MOST_WRONG are.
    """
    hours, below = np.divmod(stamps, 10_000)
    minutes, seconds = np.divmod(below, 100)
    wrong = (hours < 0) | (hours > 23) | (minutes > 59) | (seconds >= 61)
    if np.count_nonzero(wrong) > MOST_WRONG * np.count_nonzero(np.isfinite(stamps)):
        raise ValueError(f"{stamps[np.argmax(wrong)]:.10g}")
    return _past_midnight(np.where(wrong, np.nan, 3600 * hours + 60 * minutes + seconds))


def _past_midnight(time_s: Array) -> Array:
    """Times of day (n,) in s that run on past midnight; a row that comes late there is of the day before."""
    known = np.flatnonzero(np.isfinite(time_s))
    steps_s = np.diff(time_s[known])
    days = (steps_s < -0.5 * DAY_S).astype(np.int64) - (steps_s > DAY_S - LATE_S)
    time_s[known[1:]] += DAY_S * np.cumsum(days)
    return time_s


def _usual(count: NDArray[np.int64]) -> Array:
    """The usual number of rows (n,) about each of n seconds; the two ends may be parts of a second and do not count."""
    half = ABOUT // 2
    inner = np.pad(count[1:-1], (half + 1, half + 1), mode="edge")
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(inner, ABOUT), axis=1))


def within_seconds(time_s: Array) -> Array | None:
    """Times (n,) spread evenly over each second, for a clock (n,) of whole seconds with about as many rows in each as
    in those about it.

    A second after a pause, as the first, may have begun before its first row: its rows lie at its end. None for any
    other clock: with fractions of a second, running back, or with numbers of rows that jump from second to second.
    """
    has_time = np.isfinite(time_s)
    known = time_s[has_time]
    if not len(known) or (known != np.rint(known)).any() or (np.diff(known) < 0).any():
        return None
    second, first, count = np.unique(known, return_index=True, return_counts=True)
    if len(second) < FEWEST_SECONDS:
        return None
    usual = _usual(count)
    alike = np.abs(count - usual)[1:-1] <= np.maximum(1.0, NEARLY * usual[1:-1])
    if np.median(usual) < 2 or np.mean(alike) < MOST:
        return None
    pauses = np.diff(second) > 1
    begins, ends = np.concatenate([[True], pauses]), np.concatenate([pauses, [True]])
    rows = np.where(begins | ends, np.maximum(count, usual), count)
    place = np.arange(len(known)) - np.repeat(first, count)
    place += np.repeat(np.where(begins, rows.astype(np.int64) - count, 0), count)
    spread_s = np.full(len(time_s), np.nan)
    spread_s[has_time] = known + place / np.repeat(rows, count)
    return spread_s
