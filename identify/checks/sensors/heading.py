"""Heading against the gyro: a wrong scale, unit or sign of a rate of turn."""

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.attitude import down_in_body
from bridge.vehicle.coefficients import DAMPINGS, MASSES
from identify.checks.sensors.scale import FEWEST_WINDOWS, Scale, scale_of
from identify.checks.sensors.windows import edge_means, finite_readings, integral, well_read, within_runs
from identify.dive import Dive, Signal
from identify.doubt import Doubt, Outcome
from identify.ingest.rotation import attitude_at, euler_angles

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
    rate, attitude = finite_readings(rate), finite_readings(dive.attitude)
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
    time_s, heading = attitude.time_s[within], np.unwrap(euler_angles(attitude.value[within])[2])
    by_gyro, pitched = (integral(rate.time_s, part, time_s) for part in (by_yaw, by_pitch))
    ways = np.column_stack([heading - pitched, by_gyro, time_s - start_s])
    changes = np.diff(edge_means(time_s, ways, edges_s), axis=0)
    kept = well_read(rate.time_s[upright], edges_s) & well_read(time_s, edges_s)
    kept &= within_runs(edges_s, dive.breaks_s)
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
    _, aside, down = down_in_body(attitude_at(attitude, rate.time_s).T)
    level = np.hypot(aside, down)
    squared = np.maximum(level, LEAST_UPRIGHT) ** 2
    pitch = np.zeros(len(rate)) if dive.gyro is None else np.nan_to_num(dive.gyro.at(rate.time_s)[:, 1])
    return rate.value[:, 0] * down / squared, pitch * aside / squared, level > LEAST_UPRIGHT
