"""Averages many samples into fewer messages, so that the samples in between still count."""

import math

import numpy as np

from bridge.sensors.samples import FogBlock, ImuSample

EARLY = 0.25  # of a period: a sample this early counts as the due sample
LONGEST_GAP_S = 0.1  # a mean starts anew after a longer gap, of which it would say nothing


class ImuMean:
    """Means of specific force and rates over intervals of 1 / `rate_hz`, stamped with their samples' mean time.

    Attitude, temperature and field are those of the last sample. If samples come slower than `rate_hz`, each passes
    on its own.
    """

    def __init__(self, rate_hz: float) -> None:
        self._period_s = 1.0 / rate_hz
        self._due_s = -math.inf
        self._held: list[ImuSample] = []

    def take(self, sample: ImuSample) -> ImuSample | None:
        """Add `sample` and return the mean that it completes, if any."""
        held = self._held
        if held and not 0.0 < sample.time_s - held[-1].time_s < LONGEST_GAP_S:
            held.clear()
            self._due_s = -math.inf
        held.append(sample)
        if self._due_s == -math.inf:
            self._due_s = sample.time_s
        if sample.time_s < self._due_s - EARLY * self._period_s:
            return None
        self._due_s = max(self._due_s, sample.time_s - self._period_s) + self._period_s
        self._held = []
        return sample if len(held) == 1 else _mean(held)


def _mean(samples: list[ImuSample]) -> ImuSample:
    share = 1.0 / len(samples)
    last = samples[-1]
    fx = fy = fz = p = q = r = since_s = 0.0
    for sample in samples:
        force, rate = sample.specific_force, sample.rate
        fx, fy, fz = fx + force[0], fy + force[1], fz + force[2]
        p, q, r = p + rate[0], q + rate[1], r + rate[2]
        since_s += sample.time_s - last.time_s
    return ImuSample(
        last.time_s + since_s * share,
        (fx * share, fy * share, fz * share),
        (p * share, q * share, r * share),
        last.attitude,
        last.temperature_c,
        last.magnetic_field,
        any(sample.clipped for sample in samples),
    )


class FogMean:
    """Mean rates over intervals of 1 / `rate_hz`, each stamped with the middle of its interval, when it was true.

    Stamped with its end, a mean would lag by half an interval, which a fit takes for inertia. Samples marked invalid
    are left out; an interval without valid samples gives no mean.
    """

    def __init__(self, rate_hz: float) -> None:
        self._period_s = 1.0 / rate_hz
        self._begin_s = math.nan
        self._end_s = math.nan
        self._last_s = math.nan
        self._sum = 0.0
        self._count = 0

    def take(self, block: FogBlock) -> list[tuple[float, float]]:
        """Add `block` and return (middle of interval, mean rate) of each interval that it completes."""
        times = block.time_s
        if not len(times):
            return []
        means: list[tuple[float, float]] = []
        if not -self._period_s < float(times[0]) - self._last_s < LONGEST_GAP_S:
            self._begin_s = float(times[0])
            self._end_s = self._begin_s + self._period_s
            self._sum, self._count = 0.0, 0
        begin = 0
        while True:
            # The first sample at or after the end of the interval belongs to it: a sample covers the time before it.
            last = int(np.searchsorted(times, self._end_s - 1e-9))
            until = min(last + 1, len(times))
            self._add(block, begin, until)
            if last >= len(times):
                break
            end_s = float(times[last])
            if self._count:
                means.append((0.5 * (self._begin_s + end_s), self._sum / self._count))
            self._sum, self._count = 0.0, 0
            self._begin_s = end_s
            self._end_s = max(self._end_s, end_s - self._period_s) + self._period_s
            begin = until
        self._last_s = float(times[-1])
        return means

    def _add(self, block: FogBlock, begin: int, until: int) -> None:
        valid = block.valid[begin:until]
        rates = block.rate[begin:until]
        if valid.all():
            self._sum += float(rates.sum())
            self._count += until - begin
        else:
            self._sum += float(rates[valid].sum())
            self._count += int(valid.sum())
