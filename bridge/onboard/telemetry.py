"""Samples of the sensors and control ticks to readings: means of many samples, shaft speeds with their sign."""

import math
from collections.abc import Sequence

import numpy as np

from bridge.sensors.samples import DvlSample, EscSample, FogBlock, GnssSample, ImuSample, PressureSample
from bridge.vehicle.autopilot import Actuation
from bridge.vehicle.thrusters import NEUTRAL_US
from bridge.wire.readings import Reading

EARLY = 0.25  # of a period: a sample this early counts as the due sample
LONGEST_GAP_S = 0.1  # a mean starts anew after a longer gap, of which it would say nothing


class ImuMean:
    """Means of specific force and rates over intervals of 1 / `rate_hz`, stamped with their samples' mean time.

    Attitude and temperature are those of the last sample. If samples come slower than `rate_hz`, each passes on its
    own.
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


NAN = math.nan


def imu_reading(sample: ImuSample) -> Reading:
    """Specific force, rates and temperature."""
    temperature = NAN if sample.temperature_c is None else sample.temperature_c
    return Reading("imu", sample.time_s, (*sample.specific_force, *sample.rate, temperature))


def attitude_reading(sample: ImuSample) -> Reading | None:
    """Attitude and rates; None if the device reports no attitude."""
    if sample.attitude is None:
        return None
    return Reading("attitude", sample.time_s, (*sample.attitude, *sample.rate))


def dvl_readings(sample: DvlSample) -> list[Reading]:
    """Velocity at the transducer, and altitude if known."""
    readings = [Reading("dvl", sample.time_s, (*sample.velocity, sample.sigma))]
    if not math.isnan(sample.altitude_m):
        readings.append(Reading("altitude", sample.time_s, (sample.altitude_m,)))
    return readings


def pressure_reading(sample: PressureSample) -> Reading:
    """Absolute pressure and water temperature."""
    return Reading("pressure", sample.time_s, (sample.pressure_pa, sample.temperature_c))


def gnss_reading(sample: GnssSample) -> Reading:
    place = (sample.latitude_deg, sample.longitude_deg, sample.altitude_m, sample.horizontal_sigma_m)
    motion = (sample.speed_m_s, sample.course_rad, float(sample.satellites))
    return Reading("gnss", sample.time_s, (float(sample.fix_type), *place, *motion))


def actuation_readings(actuation: Actuation) -> list[Reading]:
    """Result of a control tick: pulses if it has any, wrenches, the velocity fed back, the reference."""
    time_s, reference = actuation.time_s, actuation.reference
    wanted = (*reference.nu, *reference.nu_dot, reference.heading_rad, reference.depth_m)
    pulses = [Reading("pwm", time_s, actuation.pwm_us)] if actuation.pwm_us else []
    return [
        *pulses,
        Reading("tau_pid", time_s, actuation.tau_pid),
        Reading("tau_ff", time_s, actuation.tau_ff),
        Reading("tau_cmd", time_s, actuation.tau_cmd),
        Reading("nu_fb", time_s, actuation.nu_fb),
        Reading("nu_ref", time_s, wanted),
    ]


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

    @property
    def voltage_time_s(self) -> float:
        """When a controller reported its voltage last; -inf before."""
        return max((sample.time_s for sample in self._latest.values()), default=-math.inf)

    def _heard(self, now_s: float) -> list[EscSample]:
        return [sample for sample in self._latest.values() if now_s - sample.time_s < STALE_S]

    def _speed(self, index: int, time_s: float) -> float:
        sample = self._latest.get(index)
        if sample is None or time_s - sample.time_s > STALE_S:
            return math.nan
        return sample.rpm * (self._signs[index] if index < len(self._signs) else 1.0)
