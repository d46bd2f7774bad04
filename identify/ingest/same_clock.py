"""The clocks of two recordings of one dive, by how the vehicle turned: both felt it, whatever their clocks read.

First the one shift at which the rates of turn of both agree, out of all there could be (normalised cross-correlation
of what both hold); then, every ten seconds in which the vehicle turned, the delay that brings both closest together
(least squares); through these a line. Where they do not agree, the recordings are of two vehicles, or of two dives.
"""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from bridge.clock_line import NORMAL, ClockLine, fit_clock
from bridge.errors import LogError
from identify.dive import Array, Signal
from identify.ingest import rotation

GRID_S: Final = 0.1
SHORTEST_S: Final = 30.0
"""Of what both hold: turns that last for less may be alike by chance."""
LONGEST_S: Final = 86_400.0
"""Of a recording that is compared; the times of a damaged one may lie years apart."""
LEAST_HZ: Final = 4.0
ALIKE: Final = 0.8
GAIN: Final = 1.5
"""By how much the larger of both turns may be the larger: the same vehicle turned once."""
WINDOW_S: Final = 10.0
WINDOW_SAMPLES: Final = 20
MOST_WINDOWS: Final = 500
SEARCH_S: Final = 1.5
TURNED_RAD_S: Final = 0.01
FASTEST_RAD_S: Final = 50.0
"""More is damage: gyros end at 35 rad/s."""
STRONG: Final = 0.25
"""Of the strongest turning of ten seconds: where there is so much, both must agree."""
LEAST_SHARE: Final = 0.5
MOST_STD_S: Final = 0.3
MOST_SCATTER_S: Final = 0.02
MOST_SCATTERS: Final = 3.0
"""Delays of one dive scatter as their own errors say; those of a mission that was dived twice scatter more."""
MOST_UNSURE_S: Final = 0.05
"""What is dated worse than so would blur the force that belongs to a motion."""
OF_A_STEP: Final = 0.05
"""Of the slower one's step: no delay is told better, for between readings a line is all that is known."""
STEPS: Final = 8
SLOWER_THAN_S: Final = 1.0
"""Turns take longer than so: what a second holds counts as one reading."""

UNTOLD: Final = "nothing tells how its clock reads"
STRANGERS: Final = (
    "it turned otherwise than the vehicle of this dive did: it is of another vehicle, or of another dive"
)


@dataclass(frozen=True)
class Match:
    """`line`: the other clock against this one; `alike`: correlation at the best shift; for how long both hold
    something; half the width of the 95 % interval of the line in there, in s."""

    line: ClockLine
    alike: float
    overlap_s: float
    within_s: float


def match(own: dict[str, Any], other: dict[str, Any]) -> Match:
    """How the clock of `other` reads against that of `own`, fields of dives: by rates of turn and by attitude, of
    which the one that tells it better is taken, and neither may gainsay.

    Raises LogError, the end of a sentence, where nothing in both tells it.
    """
    kinds = ((_rates(own, kind), _rates(other, kind)) for kind in ("gyro", "attitude"))
    pairs = [(a, b) for a, b in kinds if a is not None and b is not None]
    if not pairs:
        raise LogError(
            f"{UNTOLD}; both must hold rates of turn or attitude, {LEAST_HZ:.0f} Hz of it or more, for "
            f"{SHORTEST_S:.0f} s in common"
        )
    told = [one for one in (_match(*pair) for pair in pairs) if one is not None]
    if not told:
        raise LogError(
            f"{UNTOLD}: it and the telemetry have no {SHORTEST_S:.0f} s in common in which the vehicle turns"
        )
    found = min(told, key=lambda one: one.within_s)
    if found.within_s > MOST_UNSURE_S:
        raise LogError(
            f"{UNTOLD} to better than {1e3 * found.within_s:.0f} ms: the vehicle turned too little, or it is of "
            "another dive"
        )
    return found


def _match(own: Signal, other: Signal) -> Match | None:
    """By one kind of reading; None where it tells nothing. Raises LogError where both gainsay each other."""
    shifted = _shift(own, other)
    if shifted is None:
        return None
    shift_s, alike, overlap_s = shifted
    # Into the slower one's samples the faster one is interpolated.
    swapped = own.rate_hz > other.rate_hz
    slow, fast = (other, own) if swapped else (own, other)
    time_s, ahead_s, std_s = _delays(slow, fast, -shift_s if swapped else shift_s)
    if swapped:
        time_s, ahead_s = time_s + ahead_s, -ahead_s
    line = fit_clock(time_s, ahead_s, std_s)
    scatter_s = NORMAL * float(np.median(np.abs(ahead_s - line.ahead_s(time_s))))
    if scatter_s > max(MOST_SCATTER_S, MOST_SCATTERS * float(np.median(std_s))):
        raise LogError(STRANGERS)
    span_s = max(own.time_s[0], other.time_s[0] - shift_s), min(own.time_s[-1], other.time_s[-1] - shift_s)
    return Match(line, alike, overlap_s, line.within_s(*span_s))


def _rates(fields: dict[str, Any], kind: str) -> Signal | None:
    """Rates of turn (n, 3) in rad/s, measured or of the attitude; None where they come too rarely."""
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
    """Mean body rates between readings of attitude no farther apart than a second, at the middle."""
    step_s = np.diff(attitude.time_s)
    near = (step_s > 0) & (step_s < SLOWER_THAN_S)
    turn = rotation.to_body_turn(attitude.value[:-1], attitude.value[1:])
    middle_s = attitude.time_s[:-1] + step_s / 2
    if np.count_nonzero(near) < WINDOW_SAMPLES:
        return None
    return Signal(middle_s[near], turn[near] / step_s[near, None])


def _shift(own: Signal, other: Signal) -> tuple[float, float, float] | None:
    """How far `other` is ahead to a tenth of a second, the correlation there, and for how long both hold something.

    None where they have too little in common. Raises LogError where they do not agree.
    """
    start_s, start_other_s = own.time_s[0], other.time_s[0]
    (a, has_a), (b, has_b) = _grid(own), _grid(other)
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
    # A high correlation of long recordings is less likely by chance than one of short ones (Fisher 1921).
    seconds = np.where(enough, count * GRID_S / SLOWER_THAN_S, 0.0)
    sure = np.arctanh(np.clip(alike, 0.0, 0.999)) * np.sqrt(seconds)
    best = int(np.argmax(sure))
    gain = np.sqrt(energy_b[best] / energy_a[best])
    if alike[best] < ALIKE or not 1 / GAIN <= gain <= GAIN:
        raise LogError(STRANGERS)
    lag = best if best < len(has_b) else best - size
    return lag * GRID_S + start_other_s - start_s, float(alike[best]), float(count[best] * GRID_S)


def _grid(rates: Signal) -> tuple[Array, Array]:
    """Rates (n, 3) about their mean on an even grid from the first on, and 1 where there are any, else 0."""
    place = np.floor((rates.time_s - rates.time_s[0]) / GRID_S).astype(np.int64)
    length = int(place[-1]) + 1
    count = np.bincount(place, minlength=length).astype(np.float64)
    value = rates.value - np.median(rates.value, axis=0)
    sums = np.column_stack([np.bincount(place, value[:, k], minlength=length) for k in range(value.shape[1])])
    has = (count > 0).astype(np.float64)
    means = sums / np.maximum(count, 1.0)[:, None]
    # A slower signal leaves cells between its readings empty: they are what lies between.
    near = rates.held_at(GRID_S * np.arange(length) + rates.time_s[0] + GRID_S / 2)
    recent = np.arange(length) - np.maximum.accumulate(np.where(has > 0, np.arange(length), 0)) <= 1.0 / (
        LEAST_HZ * GRID_S
    )
    empty = (has == 0) & recent & np.isfinite(near).all(axis=1)
    means[empty] = near[empty] - np.median(rates.value, axis=0)
    has[empty] = 1.0
    return means * has[:, None], has


def _delays(slow: Signal, fast: Signal, shift_s: float) -> tuple[Array, Array, Array]:
    """By windows of `slow` in which the vehicle turns and both agree: middles, how far `fast` is ahead, its std; in s.

    Raises LogError where too few agree.
    """
    found = []
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
            found.append((float(part.time_s.mean()), *delay))
    strong = np.array(strength) >= max(TURNED_RAD_S, STRONG * max(strength, default=0.0))
    if not found or not strong.any() or np.mean(np.array(agreed)[strong]) < LEAST_SHARE:
        raise LogError(STRANGERS)
    time_s, ahead_s, std_s = np.array(found).T
    return time_s, ahead_s, std_s


def _delay(part: Signal, around: Signal, shift_s: float) -> tuple[float, float] | None:
    """The delay of least squares near `shift_s`, and its standard error in s; None where both do not agree there."""
    own = part.value - part.value.mean(axis=0)

    def off(delay_s: float) -> Array:
        there = around.at(part.time_s + delay_s)
        apart: Array = there - there.mean(axis=0) - own
        return apart

    tries = shift_s + np.arange(-SEARCH_S, SEARCH_S + GRID_S / 2, GRID_S / 2)
    delay_s = float(tries[np.argmin([float((off(one) ** 2).sum()) for one in tries])])
    slope, left = own, own
    for _ in range(STEPS):
        left = off(delay_s)
        half_s = GRID_S / 4
        slope = (off(delay_s + half_s) - off(delay_s - half_s)) / (2 * half_s)
        step_s = float((slope * left).sum() / max(float((slope**2).sum()), 1e-12))
        delay_s -= float(np.clip(step_s, -GRID_S / 2, GRID_S / 2))
    if abs(delay_s - shift_s) > SEARCH_S or (left**2).sum() > (1 - ALIKE) * 2 * (own**2).sum():
        return None
    # Residuals of neighbouring readings of one turn are alike, so that fewer of them tell than there are.
    std_s = float(np.sqrt(left.var() * _alike_next(left) / max(float((slope**2).sum()), 1e-12)))
    return (delay_s, float(np.hypot(std_s, OF_A_STEP / part.rate_hz))) if std_s <= MOST_STD_S else None


def _alike_next(left: Array) -> float:
    """How many residuals (n, k) count as one, by the correlation of each with the next (Bartlett 1946)."""
    power = float((left**2).sum())
    one = float((left[1:] * left[:-1]).sum()) / power if power > 0 else 0.0
    one = min(max(one, 0.0), 0.9)
    return (1 + one) / (1 - one)
