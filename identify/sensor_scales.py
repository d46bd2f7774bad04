"""Compares two sensors of one motion, to find a wrong scale or sign: gyro with heading, DVL with depth.

They are compared window by window, which gives the scale between them and its uncertainty.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DAMPINGS, MASSES
from bridge.vehicle.config import Water
from identify.dive import Array, Dive, Signal
from identify.identification import Doubt, Outcome
from identify.ingest.rotation import attitude_at

LEAST_READ = 0.8
"""Share of the usual number of readings that a window must have."""

EDGE_S = 0.5
"""The value at a window's edge is the mean over this long before and after it."""

FEWEST_WINDOWS = 10
DOUBTFUL_SCORE = 5.0


@dataclass(frozen=True)
class Scale:
    """Scale between two sensors: the motion that the first saw over the motion that the second reported.

    The true scale lies between `least` and `most`, however the noise is split between them (Frisch 1934): the ends
    assign all noise to the first sensor, or all to the second. std: standard error of `least`.
    """

    least: float
    most: float
    std: float

    def contradicts(self, largest_off: float) -> bool:
        """Whether the two sensors can't share a scale: the difference exceeds noise, and the error of healthy
        sensors."""
        least, most = self.least - 1.0, self.most - 1.0
        beyond_noise = abs(least) > DOUBTFUL_SCORE * self.std
        return least * most > 0 and min(abs(least), abs(most)) > largest_off and beyond_noise

    @property
    def is_known(self) -> bool:
        """Whether the scale differs from zero beyond noise."""
        return abs(self.least) > DOUBTFUL_SCORE * self.std

    @property
    def times(self) -> str:
        """The range in words, `1.92 to 2.13`; a single number if both ends round to it."""
        ends = [
            f"{end:.2g}" if abs(end) < 0.1 else f"{round(end, 2):g}"
            for end in sorted((self.least, self.most))
        ]
        return " to ".join(dict.fromkeys(ends))


def whole(signal: Signal | None) -> Signal | None:
    """The finite readings of a signal; None if fewer than two."""
    if signal is None:
        return None
    good = np.isfinite(signal.value).all(axis=1)
    return Signal(signal.time_s[good], signal.value[good]) if np.count_nonzero(good) > 1 else None


def scale_of(seen: Array, said: Array, beside: Array) -> Scale | None:
    """Scale of `seen` (n,) over `said` (n,), with the columns of `beside` (n, k) projected out of both.

    None if there are too few windows, or a sensor did not move.
    """
    if len(seen) < max(FEWEST_WINDOWS, beside.shape[1] + 2):
        return None
    said, seen = left_of(beside, said), left_of(beside, seen)
    both, said_power = float(said @ seen), float(said @ said)
    if both == 0.0 or said_power == 0.0:
        return None
    least = both / said_power
    left = seen - least * said
    free = len(seen) - beside.shape[1] - 1
    return Scale(least, float(seen @ seen) / both, math.sqrt(float(left @ left) / free / said_power))


def well_read(time_s: Array, edges_s: Array) -> NDArray[np.bool_]:
    """Whether each window has its share of the readings at these times."""
    count = np.histogram(time_s, edges_s)[0]
    return np.asarray(count >= max(LEAST_READ * float(np.median(count)), 1.0))


def integral(time_s: Array, rate: Array, at_s: Array) -> Array:
    """Integral of a rate (n,) up to each of the times (m,)."""
    steps = 0.5 * (rate[1:] + rate[:-1]) * np.diff(time_s)
    return np.asarray(np.interp(at_s, time_s, np.concatenate([[0.0], np.cumsum(steps)])))


def edge_means(time_s: Array, value: Array, edges_s: Array, edge_s: float = EDGE_S) -> Array:
    """Mean (m, k) of a value (n, k) within `edge_s` of each edge (m,); NaN if nothing was read there.

    Both sensors are averaged at the same times, so that motion that comes and goes within an edge cancels alike in
    both.
    """
    total = np.concatenate([np.zeros((1, value.shape[1])), np.cumsum(value, axis=0)])
    first, last = np.searchsorted(time_s, edges_s - edge_s), np.searchsorted(time_s, edges_s + edge_s)
    count = (last - first)[:, None]
    return np.where(count > 0, (total[last] - total[first]) / np.maximum(count, 1), np.nan)


def left_of(beside: Array, value: Array) -> Array:
    """Residual of a value, (n,) or (n, k), after a least-squares fit of the columns of `beside`."""
    fitted, *_ = np.linalg.lstsq(beside, value, rcond=None)
    return np.asarray(value - beside @ fitted)


WINDOW_S, SHORTEST_S = 10.0, 4.0
"""Length of a window, and its least length in a short dive."""

SPARE_WINDOWS = 2
"""Windows beyond the required number, because some may lack readings."""

LARGEST_OFF = 0.05
"""Share of the angle turned through. A healthy gyro's scale is off by less, and so is a compass over all headings."""

LEAST_TURNED_RAD = 0.1
"""Root mean square over windows, without steady turning. Below it, the compass's error is as large."""

LEAST_UPRIGHT = 0.5
"""Cosine of pitch below which heading is hardly defined."""

FOG, IMU = "the fibre-optic gyro", "the IMU's gyro"


def turning(dive: Dive, rate: Signal | None) -> Scale | None:
    """Scale of heading over the integral of a rate of turn (n, 1), over windows.

    Body rates give psi_dot = (q sin phi + r cos phi) / cos theta (Fossen 2011, eq. 2.28); the contribution of
    pitching is subtracted from heading. Both sides are averaged over the same instants at the edges of windows, and a
    constant bias of the gyro is projected out. None if heading turned too little or too steadily, or if rate or
    attitude is missing or too short.
    """
    rate, attitude = whole(rate), whole(dive.attitude)
    if rate is None or attitude is None:
        return None
    start_s = max(rate.time_s[0], attitude.time_s[0])
    end_s = min(rate.time_s[-1], attitude.time_s[-1])
    count = max(int((end_s - start_s) / WINDOW_S), FEWEST_WINDOWS + SPARE_WINDOWS)
    if end_s - start_s < SHORTEST_S * count:
        return None
    edges_s = np.linspace(start_s, end_s, count + 1)
    by_yaw, by_pitch, upright = _yawing(dive, rate, attitude)
    within = (attitude.time_s >= start_s) & (attitude.time_s <= end_s)
    time_s, heading = attitude.time_s[within], np.unwrap(_heading(attitude.value[within]))
    by_gyro, pitched = (integral(rate.time_s, part, time_s) for part in (by_yaw, by_pitch))
    ways = np.column_stack([heading - pitched, by_gyro, time_s - start_s])
    changes = np.diff(edge_means(time_s, ways, edges_s), axis=0)
    kept = well_read(rate.time_s[upright], edges_s) & well_read(time_s, edges_s)
    turned, by_gyro, passed_s = changes[kept & np.isfinite(changes).all(axis=1)].T
    if not len(turned):
        return None
    unsteady = turned - passed_s * float(passed_s @ turned) / float(passed_s @ passed_s)
    if np.sqrt(np.mean(unsteady**2)) < LEAST_TURNED_RAD:
        return None
    return scale_of(turned, by_gyro, passed_s[:, None])


def turning_doubts(dive: Dive) -> tuple[Doubt, ...]:
    """Return a doubt about the yaw coefficients if heading contradicts the rate of turn that they were fitted to."""
    by_imu = None if dive.gyro is None else Signal(dive.gyro.time_s, dive.gyro.value[:, 2:])
    by_fog = turning(dive, dive.fog)
    name, scale = (FOG, by_fog) if by_fog is not None else (IMU, turning(dive, by_imu))
    if scale is None or not scale.contradicts(LARGEST_OFF):
        return ()
    inertia, damping, masses = MASSES[5].name, DAMPINGS[5].name, tuple(mass.name for mass in MASSES[:3])
    off = f"{inertia} and {damping} are as far off"
    others = f"by less {', '.join(masses)}, which turning at speed weighs too"
    imu_scale = turning(dive, by_imu) if name == FOG else None
    if imu_scale is not None and not imu_scale.contradicts(LARGEST_OFF):
        also = f", and {IMU} agrees with heading"
        remedy = (
            f"the scale, unit or sign of {name} is not as taken, and {off}, and {others}; check {name} and what passes "
            "its readings on."
        )
    else:
        also = "" if imu_scale is None else f", and {IMU} contradicts heading too"
        remedy = (
            f"the scale, unit or sign of one of them is not as taken, and where it is all of the gyro's {off}, and "
            f"{others}; turn the vehicle once round to see which, and check the gyro's unit and the compass."
        )
    problem = f"Heading turns by {scale.times} times what {name} says{also}"
    return (Doubt((inertia, damping, *masses), problem, remedy, Outcome.DISAGREES),)


def _yawing(dive: Dive, rate: Signal, attitude: Signal) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Contributions of yaw rate and pitch rate to the rate of heading, (n,), at the rate's times, and whether the
    vehicle is upright enough."""
    w, x, y, z = attitude_at(attitude, rate.time_s).T
    aside, down = 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
    level = np.hypot(aside, down)
    squared = np.maximum(level, LEAST_UPRIGHT) ** 2
    pitch = np.zeros(len(rate)) if dive.gyro is None else np.nan_to_num(dive.gyro.at(rate.time_s)[:, 1])
    return rate.value[:, 0] * down / squared, pitch * aside / squared, level > LEAST_UPRIGHT


def _heading(quaternion: Array) -> Array:
    w, x, y, z = quaternion.T
    return np.asarray(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))


STEP_S = 0.1

STILL_M = 0.02
"""Smallest spread over windows. A sensor that moves less, or is frozen, gives no scale."""

LARGEST_DESCENT_OFF = 0.1
"""Share of the depth change. The scale of pressure (water density) and of a healthy DVL are off by less."""


def descent(dive: Dive, water: Water) -> Scale | None:
    """Scale of depth change over the integral of the downward velocity, over windows.

    The contribution of horizontal speed, through a mounting that is not level, and a constant rate are projected out.
    None if velocity, attitude or depth is missing or too short, or if either side hardly moved.
    """
    depth, velocity, attitude = dive.depth_by(water), dive.velocity, dive.attitude
    if depth is None or velocity is None or attitude is None:
        return None
    signals = (depth, velocity, attitude)
    if min(map(len, signals)) < 2:
        return None
    start_s, end_s = max(s.time_s[0] for s in signals), min(s.time_s[-1] for s in signals)
    count = int((end_s - start_s) / WINDOW_S)
    if count < FEWEST_WINDOWS:
        return None
    time_s = start_s + STEP_S * np.arange(count * round(WINDOW_S / STEP_S) + 1)
    u, v, w = velocity.at(time_s).T
    qw, x, y, z = attitude_at(attitude, time_s).T
    down = 2 * (x * z - qw * y) * u + 2 * (y * z + qw * x) * v + (1 - 2 * (x * x + y * y)) * w
    read = np.isfinite(depth.value[:, 0]) & (depth.time_s >= start_s) & (depth.time_s <= time_s[-1])
    at_s = depth.time_s[read]
    ways = np.column_stack([depth.value[read, 0], *(integral(time_s, rate, at_s) for rate in (down, u, v))])
    edges_s = start_s + WINDOW_S * np.arange(count + 1)
    changes = np.diff(edge_means(at_s, ways, edges_s), axis=0)
    kept = well_read(velocity.time_s[np.isfinite(velocity.value).all(axis=1)], edges_s)
    fallen, integrated, *aside = changes[kept & np.isfinite(changes).all(axis=1)].T
    if not len(fallen) or min(np.std(fallen), np.std(integrated)) < STILL_M:
        return None
    return scale_of(fallen, integrated, np.column_stack([np.ones(len(integrated)), *aside]))


def descent_doubts(dive: Dive, water: Water) -> tuple[Doubt, ...]:
    """Return a doubt about the DVL's scale if depth contradicts it."""
    scale = descent(dive, water)
    if scale is None or not scale.contradicts(LARGEST_DESCENT_OFF):
        return ()
    about = tuple(group[dof].name for group in (MASSES, DAMPINGS) for dof in range(3))
    return (
        Doubt(
            about,
            f"Depth changes by {scale.times} times what the recorded downward velocity comes to",
            f"the DVL's "
            f"scale, sign or mounting is not as taken, and {', '.join(about)} are as far off where it is all of the "
            "DVL's; check its units and mounting, its speed of sound, and the depth sensor.",
            Outcome.DISAGREES,
        ),
    )
