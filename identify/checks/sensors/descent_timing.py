"""Depth against the DVL: a velocity that is stamped later, or earlier, than the depth.

Of two sensors that disagree in time, a fit takes the one for noise, and its mass and damping are far surer than they
are. On one clock, the thrust's delay takes up whichever of them is late by the thrust.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.config import Water
from identify.checks.sensors.scale import DOUBTFUL_SCORE, FEWEST_WINDOWS
from identify.checks.sensors.windows import (
    edge_means,
    finite_readings,
    integral,
    slow,
    well_read,
    within_runs,
)
from identify.dive import Dive, Signal
from identify.doubt import Doubt, Outcome, coefficients_of
from identify.ingest.rotation import attitude_at, to_earth
from identify.statistics import left_of

WINDOW_S, EDGE_S = 1.0, 0.25
LATEST_S, STEP_S = 1.0, 0.05
LARGEST_LATE_S = 0.1
"""Stamps of healthy sensors lie nearer than this."""

LEAST_GAIN = 1.25
"""Least ratio of what is left of the depth's changes, squared, with healthy stamps and with the likeliest."""

STILL_M = 2e-3
"""Smallest spread of the depth's changes over windows."""


def late_s(dive: Dive, water: Water) -> float:
    """By how much the DVL's readings are stamped later than the depth's; 0 if noise may explain it, or if unknown.

    An autopilot's own filter is late by itself, by as much as its fit says (`timing.autopilot_velocity`).
    """
    if dive.velocity_is_filtered:
        return 0.0
    depth, attitude = finite_readings(dive.depth_by(water)), finite_readings(dive.attitude)
    velocity = finite_readings(dive.velocity)
    if depth is None or velocity is None or attitude is None:
        return 0.0
    signals = depth, velocity, attitude
    start_s = max(float(signal.time_s[0]) for signal in signals) + LATEST_S
    end_s = min(float(signal.time_s[-1]) for signal in signals) - LATEST_S
    count = int((end_s - start_s) / WINDOW_S)
    if count < FEWEST_WINDOWS:
        return 0.0
    edges_s = start_s + WINDOW_S * np.arange(count + 1, dtype=np.float64)
    # Turned at the velocity's own times: an attitude moves little in so short a time.
    earth = Signal(velocity.time_s, to_earth(attitude_at(attitude, velocity.time_s), velocity.value))
    body = velocity.value
    steps = round(LATEST_S / STEP_S)
    lates_s = STEP_S * np.arange(-steps, steps + 1, dtype=np.float64)
    tables = np.stack([_changes(depth, earth, body, edges_s, by_s) for by_s in lates_s.tolist()])
    kept = within_runs(edges_s, dive.breaks_s, LATEST_S) & well_read(depth.time_s, edges_s)
    kept &= well_read(velocity.time_s, edges_s)
    tables = tables[:, kept & np.isfinite(tables).all(axis=(0, 2))]
    if tables.shape[1] < FEWEST_WINDOWS or np.std(tables[0, :, 0]) < STILL_M:
        return 0.0
    tables = tables - slow(tables)
    left = np.array([float(np.mean(left_of(table[:, 1:], table[:, :1]) ** 2)) for table in tables])
    if not (left > 0).all():
        return 0.0
    best = int(np.argmin(left))
    gain = float(left[np.abs(lates_s) < LARGEST_LATE_S + 1e-9].min() / left[best])
    is_clear = gain > LEAST_GAIN and tables.shape[1] * np.log(gain) > DOUBTFUL_SCORE**2
    if not is_clear or best in (0, len(left) - 1):
        return 0.0
    before, least, after = left[best - 1 : best + 2].tolist()
    return float(lates_s[best] + STEP_S * 0.5 * (before - after) / (before - 2.0 * least + after))


def _changes(depth: Signal, earth: Signal, body: Array, edges_s: Array, by_s: float) -> Array:
    """Changes over the windows between the edges (n + 1,), as (n, 4): of the depth, and of the integrals of the speed
    down, forward and to starboard, of a velocity that is stamped `by_s` late."""
    time_s = earth.time_s - by_s
    ways = [integral(time_s, rate, depth.time_s) for rate in (earth.value[:, 2], body[:, 0], body[:, 1])]
    means = edge_means(depth.time_s, np.column_stack([depth.value[:, 0], *ways]), edges_s, EDGE_S)
    return np.asarray(np.diff(means, axis=0))


def descent_timing_doubts(dive: Dive, water: Water) -> tuple[Doubt, ...]:
    """A doubt about heave if depth and DVL contradict each other in time."""
    late = late_s(dive, water)
    if late == 0.0:
        return ()
    about = coefficients_of((2,))
    first, second = ("The DVL's velocity", "the depth") if late > 0 else ("The depth", "the DVL's velocity")
    return (
        Doubt(
            about,
            f"{first} is stamped some {1000 * abs(late):.0f} ms late, by {second}",
            f"the fit takes the depth by the DVL's clock, and {' and '.join(about)} may be off by more than their "
            "intervals; mend the clocks of both: seatrial doctor --wet tells how late each sensor is.",
            Outcome.DISAGREES,
        ),
    )


def with_depth_of_the_dvl(dive: Dive, water: Water) -> Dive:
    """The dive with its depth and pressure on the DVL's clock, where both contradict each other in time."""
    late = late_s(dive, water)
    if late == 0.0:
        return dive
    start_s, end_s = dive.span_s
    moved: dict[str, Any] = {}
    for name in ("depth", "pressure"):
        if (signal := dive.signals().get(name)) is None:
            continue
        time_s = signal.time_s + late
        stays = np.searchsorted(dive.breaks_s, time_s) == np.searchsorted(dive.breaks_s, signal.time_s)
        stays &= (time_s >= start_s) & (time_s <= end_s)
        moved[name] = Signal(time_s[stays], signal.value[stays])
    return replace(dive, **moved)
