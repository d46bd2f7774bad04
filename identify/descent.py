"""The DVL's downward velocity held against depth: a scale or a sign that both can't have."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DAMPINGS, MASSES
from bridge.vehicle.config import Water
from identify.dive import Dive
from identify.identification import Doubt, Outcome
from identify.ingest.rotation import attitude_at

Array = NDArray[np.float64]

WINDOW_S, STEP_S = 10.0, 0.1
FEWEST_WINDOWS = 10
LEAST_READ = 0.8
"""Share of a window's readings that must be there."""

STILL_M = 0.02
"""Over a window: what moves no more tells nothing of a scale, nor does a sensor that stands still."""

LARGEST_OFF = 0.1
"""Of the depth gone through: a scale of pressure, by the water's density, or of a healthy DVL is off by less."""

DOUBTFUL_SCORE = 5.0


@dataclass(frozen=True)
class Descent:
    """Depth gone through by what the velocity says of it, over windows: what one metre of the DVL's is in depth.

    The truth lies between `least` and `most`, whatever the noise of either (Frisch 1934): all of it in the depth, or
    all of it in the velocity. std: of `least`.
    """

    least: float
    most: float
    std: float

    @property
    def contradicts(self) -> bool:
        """Whether the two can't have the same scale: beyond noise, and beyond LARGEST_OFF."""
        least, most = self.least - 1.0, self.most - 1.0
        beyond_noise = abs(least) > DOUBTFUL_SCORE * self.std
        return least * most > 0 and min(abs(least), abs(most)) > LARGEST_OFF and beyond_noise


def descent(dive: Dive, water: Water) -> Descent | None:
    """None where velocity, attitude or depth is missing, or there is too little of them.

    What horizontal speed adds to the downward one, through a mounting that is not level, is projected out, and what
    stands still.
    """
    depth, velocity, attitude = dive.depth_by(water), dive.velocity, dive.attitude
    if (
        depth is None
        or velocity is None
        or attitude is None
        or min(map(len, (depth, velocity, attitude))) < 2
    ):
        return None
    signals = (depth, velocity, attitude)
    start_s, end_s = max(s.time_s[0] for s in signals), min(s.time_s[-1] for s in signals)
    count = int((end_s - start_s) / WINDOW_S)
    if count < FEWEST_WINDOWS:
        return None
    time_s = start_s + STEP_S * np.arange(count * round(WINDOW_S / STEP_S) + 1)
    u, v, w = velocity.at(time_s).T
    qw, x, y, z = attitude_at(attitude, time_s).T
    down = 2 * (x * z - qw * y) * u + 2 * (y * z + qw * x) * v + (1 - 2 * (x * x + y * y)) * w
    edges = start_s + WINDOW_S * np.arange(count + 1)
    # Both sides are averaged over the same moments about each edge: what goes down and up within one cancels alike.
    gone = [np.diff(_near(depth.time_s, _gone(time_s, rate, depth.time_s), edges)) for rate in (down, u, v)]
    fallen = np.diff(_near(depth.time_s, depth.value[:, 0], edges))
    good = np.asarray(np.isfinite(velocity.value).all(axis=1))
    kept = _read(velocity.time_s, good, edges)
    kept &= np.isfinite(fallen) & np.isfinite(np.array(gone)).all(axis=0)
    if np.count_nonzero(kept) < FEWEST_WINDOWS:
        return None
    beside = np.column_stack([np.ones(count), *gone[1:]])[kept]
    said, fallen = _without(beside, gone[0][kept]), _without(beside, fallen[kept])
    both = float(said @ fallen)
    own = float(said @ said)
    if both == 0.0 or own == 0.0 or min(np.std(said), np.std(fallen)) < STILL_M:
        return None
    least = both / own
    left = fallen - least * said
    free = len(fallen) - beside.shape[1] - 1
    return Descent(least, float(fallen @ fallen) / both, math.sqrt(float(left @ left) / free / own))


def descent_doubts(dive: Dive, water: Water) -> tuple[Doubt, ...]:
    """A doubt of the DVL's scale where depth contradicts it."""
    found = descent(dive, water)
    if found is None or not found.contradicts:
        return ()
    about = tuple(group[dof].name for group in (MASSES, DAMPINGS) for dof in range(3))
    ends = [f"{end:.2g}" for end in sorted((found.least, found.most))]
    times = " to ".join(dict.fromkeys(ends))
    return (
        Doubt(
            about,
            f"Depth changes by {times} times what the recorded downward velocity comes to: the DVL's "
            f"scale, sign or mounting is not as taken, and {', '.join(about)} are as far off where it is all of the "
            "DVL's; check its units and mounting, its speed of sound, and the depth sensor.",
            Outcome.DISAGREES,
        ),
    )


def _gone(time_s: Array, rate: Array, at_s: Array) -> Array:
    """The integral of a rate up to each of the times (n,); NaN outside."""
    total = np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * np.diff(time_s))])
    return np.asarray(np.interp(at_s, time_s, total, left=np.nan, right=np.nan))


def _near(time_s: Array, value: Array, at_s: Array) -> Array:
    """The mean of what was read within half a second of each time; NaN where nothing was."""
    good = np.isfinite(value)
    time_s, total = time_s[good], np.concatenate([[0.0], np.cumsum(value[good])])
    first = np.searchsorted(time_s, at_s - 0.5)
    last = np.searchsorted(time_s, at_s + 0.5)
    count = last - first
    return np.where(count > 0, (total[last] - total[first]) / np.maximum(count, 1), np.nan)


def _read(time_s: Array, good: NDArray[np.bool_], edges: Array) -> NDArray[np.bool_]:
    """Whether each window has its share of readings."""
    count = np.histogram(time_s[good], edges)[0]
    return np.asarray(count >= LEAST_READ * np.median(np.histogram(time_s, edges)[0]))


def _without(beside: Array, value: Array) -> Array:
    """What no combination of the columns gives of a value (n,)."""
    fitted, *_ = np.linalg.lstsq(beside, value, rcond=None)
    return np.asarray(value - beside @ fitted)
