"""KVH DSP-1750 fibre-optic gyro (not the 1750 IMU): 6-byte frames at about 1 kHz, with neither header nor checksum.

Source: two independent open drivers that agree (LCM "Driver for KVH DSP-1750 gyro"; Univ. Toronto `DSP1750_gyro.c`).
Byte 0: counter 0..3 in the top two bits, incremented in each frame; bit 5 zero; bit 4 valid; the rest zero in normal
operation. Bytes 3..5: rate, 22 bits signed, most significant first. The least significant bit is taken as 1000 / 2^21
deg/s (the drivers round it to 476.8 micro-deg/s). The sense of positive rotation is undocumented: the sign belongs to
the mounting.

Only the first byte distinguishes frames from noise. A frame is therefore passed on once the next frame's counter has
confirmed it. Its rate is valid only if both first bytes show normal operation and if it fits its neighbours: within
LARGEST_STEP_RAD_S of the rate before it, and within SPIKE_RAD_S of the rate before it, the rate after it or their
mean. A spike agrees with none of these. A step agrees with the rate after it and a ramp with the mean, so either
costs two frames at most. A flipped bit goes undetected if it moves the rate by less than SPIKE_RAD_S plus
the true change from frame to frame. numpy processes a chunk of bytes as a whole, not frame by frame.

Time: frames carry none. A fit of arrivals over the running frame count gives the true period (units differ by 2 %
to 3 %) and removes the jitter; the frames of a chunk are dated backwards from its last byte.
"""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bridge.sensors.samples import FogBlock, Sample
from bridge.sensors.streams import ClockFit

LSB_RAD_S = math.radians(1000.0 / 2**21)
RATED_RAD_S = math.radians(490.0)
# In one frame: 52 rad/s2 at 1 kHz. The thrusters of a BlueROV2 Heavy (0.59 kg m2 in yaw) could give it 45 at most.
LARGEST_STEP_RAD_S = math.radians(3.0)
# A rate this far off the mean of its neighbours would mean that the acceleration changed by 3.5 rad/s2 within 1 ms;
# thrusters take tens of milliseconds to do that. The gyro's noise is 5e-3 deg/s.
SPIKE_RAD_S = math.radians(0.1)

FRAME = 6
_STEPS_TO_LOCK = 10
# Bytes kept while no lock is found: one short of a run, so that a run is found whichever byte it starts at.
_HUNTED = FRAME * (_STEPS_TO_LOCK + 1) - 1
_HEALTHY = 0x10  # the low six bits of byte 0 in normal operation
_CLEAR = 0x20  # the bit of byte 0 that is always zero
_BYTE_S = 10 / 115200
_PERIOD_TOLERANCE = 0.03


def encode_kvh1750(rates: ArrayLike, first_count: int = 0, valid: ArrayLike = True) -> bytes:
    """Encode `rates` (n,) in rad/s as frames whose counter starts at `first_count`; `valid` is one flag or (n,)."""
    scaled = np.rint(np.asarray(rates, dtype=float) / LSB_RAD_S)
    raw = np.clip(scaled, -(2**21), 2**21 - 1).astype(np.int64) & 0x3FFFFF
    frames = np.zeros((raw.size, FRAME), dtype=np.uint8)
    counter = (first_count + np.arange(raw.size)) & 3
    frames[:, 0] = counter << 6 | np.where(valid, 0x10, 0)
    frames[:, 3], frames[:, 4], frames[:, 5] = raw >> 16, raw >> 8 & 0xFF, raw & 0xFF
    return frames.tobytes()


class Kvh1750Parser:
    """Parses rates about the gyro's axis, at most one FogBlock per feed."""

    def __init__(self, rate_hz: float = 1000.0, latency_s: float = 0.0) -> None:
        self._latency_s = latency_s
        self._clock = ClockFit(1.0 / rate_hz, _PERIOD_TOLERANCE)
        self._buffer = b""  # locked: starts with the frame that waits to be confirmed
        self._locked = False
        self._frames = 0
        self._last_rate = np.nan

    def feed(self, data: bytes, time_s: float) -> list[Sample]:
        """Return the frames that `data` confirms, as one block; an empty list while no lock is found."""
        buffer = self._buffer + data
        arrival_s = time_s - self._latency_s
        times: list[NDArray[np.float64]] = []
        rates: list[NDArray[np.float64]] = []
        valid: list[NDArray[np.bool_]] = []
        at = 0
        while True:
            if not self._locked:
                at = self._hunt(buffer, at)
            count = (len(buffer) - at) // FRAME
            if not self._locked or count < 2:
                break
            frames = np.frombuffer(buffer, np.uint8, count * FRAME, at).reshape(count, FRAME)
            counters = frames[:, 0] >> 6
            counts_on = (counters[1:] - counters[:-1]) & 3 == 1
            wrong = np.flatnonzero(~(counts_on & (frames[1:, 0] & _CLEAR == 0)))
            confirmed = int(wrong[0]) if wrong.size else count - 1
            if wrong.size:
                to_end = (len(buffer) - at) / FRAME - 1
                last_s = arrival_s - (to_end - confirmed) * self._clock.period_s
            else:
                last_s = self._clock.time_of(self._frames + confirmed, arrival_s - self._behind_s(buffer, at))
            if confirmed:
                rate, flags = self._rates(frames[: confirmed + 1])
                rates.append(rate)
                valid.append(flags)
                times.append(self._clock.times_before(last_s, np.arange(confirmed, 0.0, -1.0)))
            at += FRAME * confirmed
            self._frames += confirmed
            if not wrong.size:
                break
            at = self._slip(at)
        self._buffer = buffer[at:]
        if not rates:
            return []
        return [FogBlock(np.concatenate(times), np.concatenate(rates), np.concatenate(valid))]

    def _behind_s(self, buffer: bytes, at: int) -> float:
        """Time between the end of the last whole frame and the arrival of the last byte.

        A frame is a burst at the start of its period, so the bytes after a whole frame come after a pause.
        """
        tail = (len(buffer) - at) % FRAME
        return self._clock.period_s - (FRAME - tail) * _BYTE_S if tail else 0.0

    def _rates(self, frames: NDArray[np.uint8]) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Return the rates (n,) of `frames` (n + 1, 6) and their validity; the last frame only confirms."""
        words = frames.view(">u2")
        raw = (words[:, 1] & 0x3F).astype(np.int32) << 16 | words[:, 2]
        rates = ((raw ^ 0x200000) - 0x200000) * LSB_RAD_S
        rate = rates[:-1]
        healthy = frames[:, 0] & 0x3F == _HEALTHY
        rated = np.abs(rate) <= RATED_RAD_S
        steady = _steady(np.diff(rates, prepend=self._last_rate))
        self._last_rate = float(rate[-1])
        return rate, healthy[:-1] & healthy[1:] & rated & steady

    def _slip(self, at: int) -> int:
        """Drop the unconfirmed frame and look for the lock from its second byte on."""
        self._locked = False
        self._last_rate = np.nan
        self._clock.restart()
        return at + 1

    def _hunt(self, buffer: bytes, at: int) -> int:
        """Look for a run of frames from `at` on. Return the start of the frames if locked, otherwise the first byte
        to keep."""
        starts = len(buffer) - at - _HUNTED
        best = max(starts, 0)
        if starts > 0:
            heads = np.frombuffer(buffer, np.uint8, offset=at)
            counters, clear, healthy = heads >> 6, heads & _CLEAR == 0, heads & 0x3F == _HEALTHY
            step = ((counters[FRAME:] - counters[:-FRAME]) & 3 == 1) & clear[FRAME:] & clear[:-FRAME]
            run = _all_of(step, _STEPS_TO_LOCK)
            candidates = np.flatnonzero(run[:starts])
            if candidates.size:
                # The bits of a steady ramp can count up like the counter: of the six phases, take the healthiest.
                first = int(candidates[0])
                rivals = [k for k in range(first, first + FRAME) if run[k]]
                best = max(rivals, key=lambda k: int(np.count_nonzero(healthy[k : k + _HUNTED : FRAME])))
                self._locked = True
        return at + best


def _steady(steps: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Which rates fit their neighbours, from the n + 1 steps into and out of each; a missing step is NaN."""
    into, out = steps[:-1], steps[1:]
    near = np.abs(steps) <= SPIKE_RAD_S
    fits = near[:-1] | near[1:] | (np.abs(out - into) <= 2 * SPIKE_RAD_S)
    return fits & ~(np.abs(into) > LARGEST_STEP_RAD_S)


def _all_of(flags: NDArray[np.bool_], count: int) -> NDArray[np.bool_]:
    """Start offsets from which `count` successive flags, spaced by FRAME, are all set."""
    starts = flags.size - FRAME * (count - 1)
    run = np.ones(starts, dtype=bool)
    for k in range(count):
        run &= flags[k * FRAME : k * FRAME + starts]
    return run
