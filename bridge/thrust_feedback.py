"""Feedback of the speed controllers: shaft speeds, with the sign that the controllers omit, and the battery."""

import math
from collections.abc import Sequence

from bridge.messages.readings import Reading
from bridge.sensors.samples import EscSample
from bridge.vehicle.thrusters import NEUTRAL_US

STALE_S = 1.0
MOST_THRUSTERS = 58


class ThrustFeedback:
    """Latest sample of each speed controller. The sign of a speed is that of the last command away from neutral."""

    def __init__(self) -> None:
        self._latest: dict[int, EscSample] = {}
        self._signs: list[float] = []
        self._news = False

    def command(self, pwm_us: Sequence[float]) -> None:
        """Take the pulse widths (us) that the thrusters now get."""
        self._signs += [1.0] * (len(pwm_us) - len(self._signs))
        for index, pulse in enumerate(pwm_us):
            if pulse != NEUTRAL_US:
                self._signs[index] = 1.0 if pulse > NEUTRAL_US else -1.0

    def take(self, sample: EscSample) -> None:
        if 0 <= sample.index < MOST_THRUSTERS:
            self._latest[sample.index] = sample
            self._news = True

    def rpm_reading(self) -> Reading | None:
        """Signed shaft speeds (rpm), NaN for a silent controller; None if no sample came since the last call."""
        if not self._news:
            return None
        self._news = False
        time_s = max(sample.time_s for sample in self._latest.values())
        count = max(len(self._signs), 1 + max(self._latest))
        speeds = [self._speed(index, time_s) for index in range(count)]
        return Reading("rpm", time_s, (*speeds, *(0.0,) * (MOST_THRUSTERS - count)))

    def battery_reading(self, now_s: float) -> Reading | None:
        """Mean voltage and total current of the controllers heard recently; None if there are none."""
        heard = self._heard(now_s)
        if not heard:
            return None
        return Reading("battery", now_s, (self.voltage_v(now_s), sum(sample.current_a for sample in heard)))

    def voltage_v(self, now_s: float) -> float:
        """Mean voltage of the controllers heard recently; NaN if there are none."""
        heard = self._heard(now_s)
        return sum(sample.voltage_v for sample in heard) / len(heard) if heard else math.nan

    def _heard(self, now_s: float) -> list[EscSample]:
        return [sample for sample in self._latest.values() if now_s - sample.time_s < STALE_S]

    def _speed(self, index: int, time_s: float) -> float:
        sample = self._latest.get(index)
        if sample is None or time_s - sample.time_s > STALE_S:
            return math.nan
        return sample.rpm * (self._signs[index] if index < len(self._signs) else 1.0)
