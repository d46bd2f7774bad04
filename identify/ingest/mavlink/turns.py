"""Relates the clocks of two recordings of one vehicle by its turns.

First by the shift at which the rates of turn of both agree (normalised cross-correlation), then by a line through the
delays (least squares) of windows of ten seconds in which the vehicle turned. If the delays do not agree, the recordings
are of two vehicles or of two dives.
"""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.errors import LogError
from bridge.wire.clock_line import ClockLine, fit_clock
from identify.dive import Signal
from identify.ingest import rotation
from identify.statistics import bulk_std

GRID_S: Final = 0.1
SHORTEST_S: Final = 30.0
"""Shortest overlap: shorter turns may agree by chance."""
LONGEST_S: Final = 86_400.0
"""Longest recording that is compared; the times of a damaged recording may lie years apart."""
LEAST_HZ: Final = 4.0
ALIKE: Final = 0.8
GAIN: Final = 1.5
"""Largest ratio between the two recordings' turns: the same vehicle turned once."""
WINDOW_S: Final = 10.0
WINDOW_SAMPLES: Final = 20
MOST_WINDOWS: Final = 500
SEARCH_S: Final = 1.5
TURNED_RAD_S: Final = 0.01
FASTEST_RAD_S: Final = 50.0
"""Faster rates are damage: gyros end at 35 rad/s."""
STRONG: Final = 0.25
"""Windows with at least this share of the strongest turning are those in which both recordings must agree."""
LEAST_SHARE: Final = 0.5
MOST_STD_S: Final = 0.3
MOST_SCATTER_S: Final = 0.02
MOST_SCATTERS: Final = 3.0
"""Delays within a dive scatter as their own errors predict; those of a mission that was dived twice scatter more."""
MOST_UNSURE_S: Final = 0.05
"""A larger error of the dates would blur the relation between force and motion."""
OF_A_STEP: Final = 0.05
"""Least error of a delay, as a share of the slower signal's step: readings are interpolated linearly."""
STEPS: Final = 8
SLOWER_THAN_S: Final = 1.0
"""Turns take longer than this: all readings within a second count as a single independent reading."""

UNRELATED: Final = "nothing tells how its clock reads"
STRANGERS: Final = (
    "it turned otherwise than the vehicle of this dive did: it is of another vehicle, or of another dive"
)


@dataclass(frozen=True)
class Match:
    """The other clock against this one, with the half width of the line's 95 % interval over their common time, s."""

    line: ClockLine
    within_s: float


def match(mine: dict[str, Any], other: dict[str, Any]) -> Match:
    """Relate the clock of `other` to that of `mine`, both fields of a dive, by rates of turn and by attitude.

    The more accurate of the two results is taken. Raises LogError, worded as the end of a sentence, if neither gives
    a result or if the two recordings disagree in either.
    """
    kinds = ((_rates(mine, kind), _rates(other, kind)) for kind in ("gyro", "attitude"))
    pairs = [(a, b) for a, b in kinds if a is not None and b is not None]
    if not pairs:
        raise LogError(
            f"{UNRELATED}; both must hold rates of turn or attitude, {LEAST_HZ:.0f} Hz of it or more, for "
            f"{SHORTEST_S:.0f} s in common"
        )
    results = [each for each in (_match(*pair) for pair in pairs) if each is not None]
    if not results:
        raise LogError(
            f"{UNRELATED}: it and the telemetry have no {SHORTEST_S:.0f} s in common in which the vehicle turns"
        )
    best = min(results, key=lambda each: each.within_s)
    if best.within_s > MOST_UNSURE_S:
        raise LogError(
            f"{UNRELATED} to better than {1e3 * best.within_s:.0f} ms: the vehicle turned too little, or it is of "
            "another dive"
        )
    return best


def _match(mine: Signal, other: Signal) -> Match | None:
    """Compare by one kind of reading; None if it gives no result. Raises LogError if the recordings disagree."""
    shift_s = _shift(mine, other)
    if shift_s is None:
        return None
    # The faster signal is interpolated at the samples of the slower one.
    swapped = mine.rate_hz > other.rate_hz
    slow, fast = (other, mine) if swapped else (mine, other)
    time_s, ahead_s, std_s = _delays(slow, fast, -shift_s if swapped else shift_s)
    if swapped:
        time_s, ahead_s = time_s + ahead_s, -ahead_s
    line = fit_clock(time_s, ahead_s, std_s)
    scatter_s = bulk_std(ahead_s - line.ahead_s(time_s))
    if scatter_s > max(MOST_SCATTER_S, MOST_SCATTERS * float(np.median(std_s))):
        raise LogError(STRANGERS)
    span_s = max(mine.time_s[0], other.time_s[0] - shift_s), min(mine.time_s[-1], other.time_s[-1] - shift_s)
    return Match(line, line.within_s(*span_s))


def _rates(fields: dict[str, Any], kind: str) -> Signal | None:
    """Rates of turn (n, 3) in rad/s, measured or from the attitude; None if they come too rarely."""
    signal = fields.get(kind)
    if signal is None or len(signal) < WINDOW_SAMPLES or not signal.rate_hz >= LEAST_HZ:
        return None
    bound = FASTEST_RAD_S if kind == "gyro" else 1.0 + 1e-3
    known = (np.abs(signal.value) <= bound).all(axis=1)
    signal = Signal(signal.time_s[known], signal.value[known])
    if len(signal) < WINDOW_SAMPLES or not signal.time_s[-1] - signal.time_s[0] <= LONGEST_S:
        return None
    return signal if kind == "gyro" else _rates_of_turn(signal)


def _rates_of_turn(attitude: Signal) -> Signal | None:
    """Mean body rates between readings of attitude at most a second apart, dated at the middle."""
    step_s = np.diff(attitude.time_s)
    near = (step_s > 0) & (step_s < SLOWER_THAN_S)
    turn = rotation.to_body_turn(attitude.value[:-1], attitude.value[1:])
    middle_s = attitude.time_s[:-1] + step_s / 2
    if np.count_nonzero(near) < WINDOW_SAMPLES:
        return None
    return Signal(middle_s[near], turn[near] / step_s[near, None])


def _shift(mine: Signal, other: Signal) -> float | None:
    """Lead of `other` to a tenth of a second; None if they have too little in common. Raises LogError if they do not
    agree.
    """
    start_s, start_other_s = mine.time_s[0], other.time_s[0]
    (a, has_a), (b, has_b) = _grid(mine), _grid(other)
    size = 1 << int(len(has_a) + len(has_b)).bit_length()

    def spectrum(x: Array) -> NDArray[np.complex128]:
        return np.fft.rfft(x, size)

    def correlate(x: NDArray[np.complex128], y: NDArray[np.complex128]) -> Array:
        return np.fft.irfft(np.conj(x) * y, size)

    mask_a, mask_b = spectrum(has_a), spectrum(has_b)
    both = sum(correlate(spectrum(a[:, k]), spectrum(b[:, k])) for k in range(a.shape[1]))
    energy_a = correlate(spectrum((a**2).sum(axis=1)), mask_b)
    energy_b = correlate(mask_a, spectrum((b**2).sum(axis=1)))
    count = correlate(mask_a, mask_b)
    still = TURNED_RAD_S**2 * np.maximum(count, 1.0)
    enough = (count * GRID_S >= SHORTEST_S) & (energy_a > still) & (energy_b > still)
    if not enough.any():
        return None
    alike = np.where(enough, both / np.sqrt(np.where(enough, energy_a * energy_b, 1.0)), 0.0)
    # A high correlation is less likely by chance in long recordings than in short ones (Fisher 1921).
    seconds = np.where(enough, count * GRID_S / SLOWER_THAN_S, 0.0)
    significance = np.arctanh(np.clip(alike, 0.0, 0.999)) * np.sqrt(seconds)
    best = int(np.argmax(significance))
    gain = np.sqrt(energy_b[best] / energy_a[best])
    if alike[best] < ALIKE or not 1 / GAIN <= gain <= GAIN:
        raise LogError(STRANGERS)
    lag = best if best < len(has_b) else best - size
    return float(lag * GRID_S + start_other_s - start_s)


def _grid(rates: Signal) -> tuple[Array, Array]:
    """Rates (n, 3) minus their median on a regular grid from the first reading on, and (n,) 1 for filled cells, else
    0.
    """
    place = np.floor((rates.time_s - rates.time_s[0]) / GRID_S).astype(np.int64)
    length = int(place[-1]) + 1
    count = np.bincount(place, minlength=length).astype(np.float64)
    value = rates.value - np.median(rates.value, axis=0)
    sums = np.column_stack([np.bincount(place, value[:, k], minlength=length) for k in range(value.shape[1])])
    has = (count > 0).astype(np.float64)
    means = sums / np.maximum(count, 1.0)[:, None]
    # A slow signal leaves cells between its readings empty: fill them with the last reading.
    near = rates.held_at(GRID_S * np.arange(length) + rates.time_s[0] + GRID_S / 2)
    recent = np.arange(length) - np.maximum.accumulate(np.where(has > 0, np.arange(length), 0)) <= 1.0 / (
        LEAST_HZ * GRID_S
    )
    empty = (has == 0) & recent & np.isfinite(near).all(axis=1)
    means[empty] = near[empty] - np.median(rates.value, axis=0)
    has[empty] = 1.0
    return means * has[:, None], has


def _delays(slow: Signal, fast: Signal, shift_s: float) -> tuple[Array, Array, Array]:
    """Delays by windows of `slow` in which the vehicle turns and both agree: middles, lead of `fast`, its std, in s.

    Raises LogError if too few windows agree.
    """
    delays = []
    strength: list[float] = []
    agreed: list[bool] = []
    first_s = max(slow.time_s[0], fast.time_s[0] - shift_s + SEARCH_S)
    last_s = min(slow.time_s[-1], fast.time_s[-1] - shift_s - SEARCH_S)
    every_s = max(WINDOW_S, (last_s - first_s) / MOST_WINDOWS)
    for begin_s in np.arange(first_s, last_s - WINDOW_S / 2, every_s):
        part = slow.between(begin_s, begin_s + WINDOW_S)
        around = fast.between(begin_s + shift_s - SEARCH_S, begin_s + WINDOW_S + shift_s + SEARCH_S)
        if min(len(part), len(around)) < WINDOW_SAMPLES or np.diff(around.time_s).max() > SLOWER_THAN_S:
            continue
        delay = _delay(part, around, shift_s)
        strength.append(float(np.std(part.value, axis=0).max()))
        agreed.append(delay is not None)
        if delay is not None:
            delays.append((float(part.time_s.mean()), *delay))
    strong = np.array(strength) >= max(TURNED_RAD_S, STRONG * max(strength, default=0.0))
    if not delays or not strong.any() or np.mean(np.array(agreed)[strong]) < LEAST_SHARE:
        raise LogError(STRANGERS)
    time_s, ahead_s, std_s = np.array(delays).T
    return time_s, ahead_s, std_s


def _delay(part: Signal, around: Signal, shift_s: float) -> tuple[float, float] | None:
    """Least-squares delay near `shift_s` and its standard error in s; None if the two do not agree there."""
    mine = part.value - part.value.mean(axis=0)

    def off(delay_s: float) -> Array:
        there = around.at(part.time_s + delay_s)
        apart: Array = there - there.mean(axis=0) - mine
        return apart

    tries = shift_s + np.arange(-SEARCH_S, SEARCH_S + GRID_S / 2, GRID_S / 2)
    delay_s = float(tries[np.argmin([float((off(candidate_s) ** 2).sum()) for candidate_s in tries])])
    slope, left = mine, mine
    for _ in range(STEPS):
        left = off(delay_s)
        half_s = GRID_S / 4
        slope = (off(delay_s + half_s) - off(delay_s - half_s)) / (2 * half_s)
        step_s = float((slope * left).sum() / max(float((slope**2).sum()), 1e-12))
        delay_s -= float(np.clip(step_s, -GRID_S / 2, GRID_S / 2))
    if abs(delay_s - shift_s) > SEARCH_S or (left**2).sum() > (1 - ALIKE) * 2 * (mine**2).sum():
        return None
    # Residuals of neighbouring readings in a turn are correlated, so fewer of them are independent.
    std_s = float(np.sqrt(left.var() * _alike_next(left) / max(float((slope**2).sum()), 1e-12)))
    return (delay_s, float(np.hypot(std_s, OF_A_STEP / part.rate_hz))) if std_s <= MOST_STD_S else None


def _alike_next(left: Array) -> float:
    """Number of residuals (n, k) per independent residual, by the correlation of each with the next (Bartlett 1946)."""
    power = float((left**2).sum())
    correlation = float((left[1:] * left[:-1]).sum()) / power if power > 0 else 0.0
    correlation = min(max(correlation, 0.0), 0.9)
    return (1 + correlation) / (1 - correlation)
