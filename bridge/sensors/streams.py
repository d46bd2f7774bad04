"""What parsers share: frames cut out of a byte stream, and times fitted to a device's own counter."""

import math
import re
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

_JITTER_VARIANCE = 1e-3**2  # s2, of the arrivals
_MEMORY_S = 30.0
_GAP_S = 0.1
_LONGEST_FADE = 20.0


def starting(prefix: bytes) -> re.Pattern[bytes]:
    """Return the pattern of `prefix`, or of the part of it that ends the data."""
    parts = (re.escape(prefix[:size]) + rb"\Z" for size in range(len(prefix) - 1, 0, -1))
    return re.compile(b"|".join((re.escape(prefix), *parts)))


class Frames:
    """Cuts a byte stream into frames; after damage it looks for the next frame from byte to byte.

    `starts` matches wherever a frame may begin. `size(buffer, at)` returns the size of the frame at `at`, 0 if there
    can be none, None if more bytes must tell. `is_sound(frame)` checks a checksum.
    """

    def __init__(
        self,
        starts: re.Pattern[bytes],
        size: Callable[[bytearray, int], int | None],
        is_sound: Callable[[bytes], bool],
    ) -> None:
        self._starts, self._size, self._is_sound = starts, size, is_sound
        self._buffer = bytearray()

    def feed(self, data: bytes) -> list[bytes]:
        """Return the frames that `data` completes."""
        buffer, frames, at = self._buffer, list[bytes](), 0
        buffer += data
        while True:
            match = self._starts.search(buffer, at)
            at = match.start() if match else len(buffer)
            size = self._size(buffer, at) if match else None
            if size is None or at + size > len(buffer):
                break
            frame = bytes(buffer[at : at + size])
            if size and self._is_sound(frame):
                frames.append(frame)
                at += size
                continue
            at += 1
        del buffer[:at]
        return frames


class ClockFit:
    """Recursive least squares of arrival over count, with fading memory: estimates time and period of a counter.

    This removes the jitter of a serial line from a device's samples.

    `period_s` is nominal and true to `tolerance` (a fraction). The fit can't see the mean delay of the arrivals, which
    belongs to the latency in the vehicle file. An arrival more than `_GAP_S` off the fit restarts it with the period
    learnt so far. `patience_s` is for a counter that runs on while nothing comes: for so long later arrivals are taken
    for delayed, as where the computer stood still, and are dated by the fit alone.
    """

    def __init__(self, period_s: float, tolerance: float, patience_s: float = 0.0) -> None:
        self.period_s = period_s
        self._patience_s, self._late_since_s = patience_s, math.inf
        self._period_variance = (tolerance * period_s) ** 2
        self._count: int | None = None
        self._time_s, self._latest_s = 0.0, -math.inf
        self._p_tt = self._p_tp = self._p_pp = 0.0

    def time_of(self, count: int, arrival_s: float) -> float:
        """Return the fitted time (s) of the tick `count`, which arrived at `arrival_s`; a count that runs back
        restarts the fit."""
        if self._count is None:
            return self._start(count, arrival_s)
        ticks = count - self._count
        predicted_s = self._time_s + ticks * self.period_s
        surprise_s = arrival_s - predicted_s
        self._late_since_s = min(self._late_since_s, arrival_s) if surprise_s > _GAP_S else math.inf
        if ticks >= 0 and 0.0 <= arrival_s - self._late_since_s < self._patience_s:
            return predicted_s
        if ticks < 0 or not abs(surprise_s) <= _GAP_S:
            return self._start(count, arrival_s)
        fade = math.exp(min(ticks * self.period_s / _MEMORY_S, _LONGEST_FADE))
        p_tt = (self._p_tt + 2 * ticks * self._p_tp + ticks * ticks * self._p_pp) * fade
        p_tp = (self._p_tp + ticks * self._p_pp) * fade
        p_pp = self._p_pp * fade
        gain_t = p_tt / (p_tt + _JITTER_VARIANCE)
        gain_p = p_tp / (p_tt + _JITTER_VARIANCE)
        self._count = count
        self._time_s = predicted_s + gain_t * surprise_s
        self.period_s += gain_p * surprise_s
        self._p_tt = p_tt - gain_t * p_tt
        self._p_tp = p_tp - gain_t * p_tp
        self._p_pp = p_pp - gain_p * p_tp
        return self._time_s

    def times_before(self, last_s: float, ticks: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the times of ticks (n,) so many before one at `last_s`; none runs back behind an earlier answer."""
        times = np.maximum(last_s - ticks * self.period_s, self._latest_s)
        self._latest_s = float(times[-1])
        return times

    def restart(self) -> None:
        """Forget the count but keep the period: for use after the counter was interrupted."""
        self._count = None

    def _start(self, count: int, arrival_s: float) -> float:
        self._count, self._time_s, self._late_since_s = count, arrival_s, math.inf
        self._p_tt, self._p_tp, self._p_pp = _JITTER_VARIANCE, 0.0, self._period_variance
        return arrival_s
