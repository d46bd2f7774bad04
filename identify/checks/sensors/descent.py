"""Depth against the DVL: a wrong scale, sign or mounting of the velocity."""

import numpy as np

from bridge.vehicle.config import Water
from identify.checks.sensors.scale import FEWEST_WINDOWS, Scale, scale_of
from identify.checks.sensors.windows import edge_means, integral, well_read, within_runs
from identify.dive import Dive
from identify.doubt import Doubt, Outcome, coefficients_of
from identify.ingest.rotation import attitude_at, to_earth

WINDOW_S, STEP_S = 10.0, 0.1

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
    body = velocity.at(time_s)
    u, v, _ = body.T
    down = to_earth(attitude_at(attitude, time_s), body)[:, 2]
    read = np.isfinite(depth.value[:, 0]) & (depth.time_s >= start_s) & (depth.time_s <= time_s[-1])
    at_s = depth.time_s[read]
    ways = np.column_stack([depth.value[read, 0], *(integral(time_s, rate, at_s) for rate in (down, u, v))])
    edges_s = start_s + WINDOW_S * np.arange(count + 1)
    changes = np.diff(edge_means(at_s, ways, edges_s), axis=0)
    kept = well_read(velocity.time_s[np.isfinite(velocity.value).all(axis=1)], edges_s)
    kept &= within_runs(edges_s, dive.breaks_s)
    fallen, integrated, *aside = changes[kept & np.isfinite(changes).all(axis=1)].T
    if not len(fallen) or min(np.std(fallen), np.std(integrated)) < STILL_M:
        return None
    return scale_of(fallen, integrated, np.column_stack([np.ones(len(integrated)), *aside]))


def depth_contradicts(dive: Dive, water: Water) -> bool:
    """Whether depth and the downward velocity can't share a scale."""
    scale = descent(dive, water)
    return scale is not None and scale.contradicts(LARGEST_DESCENT_OFF)


def descent_doubts(dive: Dive, water: Water) -> tuple[Doubt, ...]:
    """Return a doubt about the DVL's scale if depth contradicts it."""
    scale = descent(dive, water)
    if scale is None or not scale.contradicts(LARGEST_DESCENT_OFF):
        return ()
    about = coefficients_of(range(3))
    return (
        Doubt(
            about,
            f"Depth changes by {scale.times} times what the recorded downward velocity comes to",
            f"the DVL's scale, sign or mounting is not as taken, and {', '.join(about)} are as far off where it is all "
            "of the DVL's; check its units and mounting, its speed of sound, and the depth sensor.",
            Outcome.DISAGREES,
        ),
    )
