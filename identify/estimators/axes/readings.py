"""Readings of each degree of freedom as channels with a noise level each, and the other axes' part in them."""

from dataclasses import dataclass, replace

import numpy as np

from bridge.arrays import Array
from bridge.attitude import down_in_body
from bridge.vehicle.coefficients import HEAVE, PITCH, ROLL, YAW
from bridge.vehicle.config import GRAVITY_M_S2, Configuration, VehicleFile
from bridge.vehicle.dynamics import restoring
from identify.dive import Dive, Signal
from identify.estimators.axes.motion import Motion, smoothed, smoothed_velocity
from identify.estimators.filter.state import INCREMENT, POSITION, VELOCITY
from identify.ingest.rotation import euler_angles, to_body_turn

FEWEST, FEWEST_POSES = 5, 8
NOISE_SPREAD = 1.0
LEAST_NOISE = 1e-6
MOST_HZ = 100.0
"""Faster readings are averaged down to about this rate: a vehicle does nothing within 10 ms that this would miss."""

TELLING = 3.0
"""A position or angle gives the speed only if it moves in a second by more than this many times its noise."""

LEAST_ANGLE = 1e-4
"""Noise of an angle of attitude, rad, at least: less than the best devices have. A simulated attitude may have none,
and all that a model lacks would be wild, or a force beyond all doubt."""

FILTERED_M_S, FILTERED_SPREAD, FILTERED_COLOURED_M_S, FILTERED_HZ = 2e-3, 0.2, 0.015, 10.0
"""Start of the fit for an autopilot's own velocity: a little white noise, with the prior standard deviation of its
logarithm, and a slow error of its filter, which dominates. The velocity is thinned to FILTERED_HZ, because a reading
adds little to the reading 20 ms earlier."""


@dataclass(frozen=True)
class Channel:
    """Readings of a state by a sensor, (n,) each; the standard deviation of a reading is `scale` times the noise.

    A NaN reading only marks the start of a new increment. `noise` is the start value of the fitted noise,
    `noise_spread` the prior standard deviation of its logarithm, `noise_least` its lower bound. coloured: start
    value of the velocity's slow error, 0 if it has none.
    """

    name: str
    time_s: Array
    value: Array
    scale: Array
    state_read: int
    noise: float
    noise_spread: float = NOISE_SPREAD
    noise_least: float = 0.0
    coloured: float = 0.0


def channels(dive: Dive, dof: int, velocity: Signal | None, pose: Signal | None) -> list[Channel]:
    """Return all measurements of an axis, the velocity reading first. If that is missing, return the position or
    angle alone, if it gives the velocity; otherwise nothing.

    `velocity` (n, 3) at the body's origin; `pose` (n, 1) the integral of the axis's own velocity: depth, roll, pitch
    or heading.
    """
    if dof < 3:
        sensors = [
            _filtered(velocity, dof) if dive.velocity_is_filtered else _direct("dvl", velocity, dof, VELOCITY)
        ]
        if dof == HEAVE:
            # The controller acts on depth, so depth has to be among the readings.
            sensors.append(_direct("depth", pose, 0, POSITION))
    else:
        sensors = [_rate(dive, dof)]
        # The controller holds the heading, and samples of a gyro's rate do not add up to it; a fibre-optic gyro's
        # increments do.
        if dof in (ROLL, PITCH) or not reads_fog(dive):
            sensors.append(_angle(pose))
    if sensors[0] is None:
        alone = _direct("depth", pose, 0, POSITION) if dof < 3 else _angle(pose)
        return [alone] if alone is not None and _tells_of_speed(alone) else []
    return [channel for channel in sensors if channel is not None]


def _tells_of_speed(pose: Channel) -> bool:
    """Whether a position or angle moves in a second by clearly more than its noise."""
    after = np.searchsorted(pose.time_s, pose.time_s + 1.0)
    inside = after < len(after)
    # After a gap, as between two runs, the next reading is of another motion.
    inside[inside] = pose.time_s[after[inside]] - pose.time_s[inside] < 2.0
    if np.median(np.diff(pose.time_s)) > 1.0 or not inside.any():
        return False
    moved = pose.value[after[inside]] - pose.value[inside]
    return bool(np.sqrt(np.mean(moved**2)) > TELLING * np.sqrt(2.0) * pose.noise)


def reads_fog(dive: Dive) -> bool:
    """Whether a fibre-optic gyro tells the turn in yaw. If not, the heading is among the readings."""
    rate = _rate(dive, YAW)
    return rate is not None and rate.state_read == INCREMENT


def noise_std(values: Array) -> float:
    """Standard deviation of the white noise on a smooth signal (n,), whose third difference is noise alone.

    At least the standard deviation that the signal's resolution causes.
    """
    steps = np.abs(np.diff(values))
    resolution = float(np.min(steps[steps > 0], initial=np.inf))
    white = float(np.median(np.abs(np.diff(values, 3))) / (0.6745 * np.sqrt(20.0)))
    return max(white, resolution / np.sqrt(12.0) if np.isfinite(resolution) else 0.0, LEAST_NOISE)


def increments(name: str, signal: Signal) -> Channel:
    """Convert mean rates, dated at the middle of their intervals, to angle increments, dated at the ends.

    Intervals meet halfway between two readings; an interval after a gap has the usual length.
    """
    middle, rate = signal.time_s, signal.value[:, 0]
    usual = float(np.median(np.diff(middle)))
    halfway = 0.5 * (middle[1:] + middle[:-1])
    gap = np.diff(middle) > 1.5 * usual
    start = np.concatenate([middle[:1] - usual / 2, np.where(gap, middle[1:] - usual / 2, halfway)])
    end = np.concatenate([np.where(gap, middle[:-1] + usual / 2, halfway), middle[-1:] + usual / 2])
    fresh = start[np.concatenate([[True], gap])]
    time_s = np.concatenate([end, fresh])
    order = np.argsort(time_s, kind="stable")
    value = np.concatenate([rate * (end - start), np.full(len(fresh), np.nan)])
    scale = np.concatenate([end - start, np.full(len(fresh), usual)])
    return Channel(name, time_s[order], value[order], scale[order], INCREMENT, noise_std(rate))


def _rate(dive: Dive, dof: int) -> Channel | None:
    """The more informative of fibre-optic gyro and IMU: it contains all that the other could add."""
    gyro = _direct("gyro", dive.gyro, dof - 3, VELOCITY)
    if dof != YAW or dive.fog is None or len(dive.fog) < FEWEST or np.ptp(dive.fog.value) == 0.0:
        return gyro
    fog = increments("fog", averaged(dive.fog)[0])
    return fog if gyro is None or _information(fog) > _information(gyro) else gyro


def _filtered(velocity: Signal | None, dof: int) -> Channel | None:
    """The velocity of an autopilot's own filter."""
    if velocity is None or len(velocity) < FEWEST:
        return None
    every = max(1, round(velocity.rate_hz / FILTERED_HZ))
    thin = Signal(velocity.time_s[::every], velocity.value[::every])
    read = _direct("filter", thin, dof, VELOCITY)
    if read is None:
        return None
    return replace(read, noise=FILTERED_M_S, noise_spread=FILTERED_SPREAD, coloured=FILTERED_COLOURED_M_S)


def _direct(name: str, signal: Signal | None, column: int, state_read: int) -> Channel | None:
    if signal is None:
        return None
    known = np.isfinite(signal.value[:, column])
    value = signal.value[known, column]
    if len(value) < FEWEST or np.ptp(value) == 0.0:
        return None
    mean, count = averaged(Signal(signal.time_s[known], value[:, None]))
    scale = np.sqrt(np.median(count) / count)
    return Channel(name, mean.time_s, mean.value[:, 0], scale, state_read, noise_std(mean.value[:, 0]))


def _angle(pose: Signal | None) -> Channel | None:
    read = _direct("attitude", pose, 0, POSITION)
    return (
        None if read is None else replace(read, noise=max(read.noise, LEAST_ANGLE), noise_least=LEAST_ANGLE)
    )


def averaged(signal: Signal) -> tuple[Signal, Array]:
    """Means (m, k) over bins of equal duration, dated at the mean of the samples' times, and the number of samples in
    each (m,).

    The signal itself if it is not much faster than MOST_HZ.
    """
    each = round(signal.rate_hz / MOST_HZ)
    if each < 2:
        return signal, np.ones(len(signal))
    # The bins' edges lie between samples.
    since = (signal.time_s - signal.time_s[0]) * signal.rate_hz + 0.5
    _, bin_of = np.unique(np.floor(since / each), return_inverse=True)
    count = np.bincount(bin_of).astype(np.float64)
    time_s = np.bincount(bin_of, signal.time_s) / count
    columns = [np.bincount(bin_of, column) / count for column in signal.value.T]
    return Signal(time_s, np.column_stack(columns)), count


def _information(channel: Channel) -> float:
    rate_hz = 1.0 / max(float(np.median(np.diff(channel.time_s))), 1e-9)
    return rate_hz / channel.noise**2


LEAST_COSINE = 0.1
"""Smallest cosine of pitch used: closer to vertical, heading does not show how a vehicle turns."""

TILTED, OFTEN = 0.5, 5
"""Cosine of the tilt below which a vehicle lies on its side, and the number of such readings from which it counts as
tumbling."""


def tumbles(dive: Dive) -> bool:
    """Whether a vehicle turns over. The angles of roll, pitch and heading then wrap, fold and swap, and none of them
    is the integral of a rate of turn."""
    if dive.attitude is None or not len(dive.attitude):
        return False
    return bool(np.count_nonzero(down_in_body(dive.attitude.value.T)[2] < TILTED) >= OFTEN)


def turned_by(attitude: Signal) -> Signal:
    """Integrals of the rates of turn (n, 3) about the body's own axes: the sum of the turns between readings. They
    neither wrap nor fold at any attitude."""
    turns = to_body_turn(attitude.value[:-1], attitude.value[1:])
    return Signal(attitude.time_s, np.vstack([np.zeros((1, 3)), np.cumsum(turns, axis=0)]))


def at_origin(dive: Dive, time_s: Array, lever: Array) -> tuple[Signal | None, Motion]:
    """Return the recorded velocity (n, 3) at the body's origin, with the DVL at `lever` (3,), and the motion at times
    (m,)."""
    motion = Motion(time_s, smoothed_velocity(dive, time_s), dive.breaks_s)
    velocity = dive.velocity
    if velocity is None or len(velocity) < FEWEST_POSES or not lever.any():
        return velocity, motion
    by_turning = np.cross(motion.nu[:, 3:], lever)
    carried = np.column_stack([np.interp(velocity.time_s, time_s, column) for column in by_turning.T])
    velocity = Signal(velocity.time_s, velocity.value - carried)
    return velocity, replace(motion, nu=smoothed_velocity(replace(dive, velocity=velocity), time_s))


def with_rates_of_poses(dive: Dive, file: VehicleFile, motion: Motion) -> Motion:
    """Return the motion with velocities from depth and attitude where no other sensor read them (Fossen 2011, eq.
    2.28)."""
    nu = motion.nu.copy()
    depth, over = dive.depth_by(file.vehicle.water), tumbles(dive)
    if depth is not None and len(depth) >= FEWEST_POSES and not nu[:, HEAVE].any() and not over:
        nu[:, HEAVE] = _slope(depth, 0, motion)
    if dive.attitude is not None and len(dive.attitude) >= FEWEST_POSES and not nu[:, 3:].all(axis=1).any():
        if over:
            turned = turned_by(dive.attitude)
            for i in range(3):
                if not nu[:, ROLL + i].any():
                    nu[:, ROLL + i] = _slope(turned, i, motion)
            return replace(motion, nu=nu)
        roll, pitch, heading = euler_angles(dive.attitude.value)
        euler = np.column_stack([roll, pitch, np.unwrap(heading)])
        angles = Signal(dive.attitude.time_s, euler)
        roll, pitch = (np.interp(motion.time_s, angles.time_s, euler[:, i]) for i in range(2))
        by_roll, by_pitch, by_heading = (_slope(angles, i, motion) for i in range(3))
        body = (
            by_roll - np.sin(pitch) * by_heading,
            np.cos(roll) * by_pitch + np.cos(pitch) * np.sin(roll) * by_heading,
            np.cos(pitch) * np.cos(roll) * by_heading - np.sin(roll) * by_pitch,
        )
        for dof, rate in enumerate(body, start=ROLL):
            if not nu[:, dof].any():
                nu[:, dof] = rate
    return replace(motion, nu=nu)


def _slope(pose: Signal, column: int, motion: Motion) -> Array:
    """Slope (m,) of a smoothed column at the times of the motion, each run between breaks by itself."""
    values = smoothed(pose, column, motion.time_s, motion.breaks_s)
    cut = np.searchsorted(motion.time_s, motion.breaks_s)
    runs = zip(np.split(values, cut), np.split(motion.time_s, cut), strict=True)
    return np.concatenate(
        [np.gradient(value, at_s) if len(at_s) > 1 else np.zeros(len(at_s)) for value, at_s in runs]
    )


@dataclass(frozen=True)
class Pose:
    """Integral of one axis's own velocity: the reading, (n, 1), less the contribution of the other axes.

    `carried` (m,) is that contribution at the times of the motion.
    """

    reading: Signal
    carried: Array


def poses_of(dive: Dive, file: VehicleFile, motion: Motion, attitude: Array | None) -> dict[int, Pose]:
    """Return depth, roll, pitch and heading by degree of freedom, as far as they are recorded (Fossen 2011, 2.18,
    2.26).

    For a vehicle that tumbles, return its turns about each of its own axes; its depth is then not the integral of a
    single axis.
    """
    still = np.zeros(len(motion.time_s))
    if tumbles(dive) and dive.attitude is not None:
        turned = turned_by(dive.attitude)
        parts = (Signal(turned.time_s, turned.value[:, i : i + 1]) for i in range(3))
        return {dof: Pose(part, still) for dof, part in zip((ROLL, PITCH, YAW), parts, strict=True)}
    depth = dive.depth_by(file.vehicle.water)
    poses: dict[int, tuple[Signal, Array]] = {}
    if attitude is None or dive.attitude is None:
        if depth is not None:
            poses[HEAVE] = depth, still
    else:
        u, v, w, _, q, r = motion.nu.T
        down_x, down_y, down_z = down_in_body(attitude.T)
        if depth is not None:
            poses[HEAVE] = depth, down_x * u + down_y * v + (down_z - 1.0) * w
        roll, pitch, _ = euler_angles(attitude)
        read_roll, read_pitch, heading = euler_angles(dive.attitude.value)
        turned = q * np.sin(roll) + r * np.cos(roll)
        poses[ROLL] = Signal(dive.attitude.time_s, read_roll[:, None]), turned * np.tan(pitch)
        level = q * (np.cos(roll) - 1.0) - r * np.sin(roll)
        turning = (q * np.sin(roll) + r * np.cos(roll)) / np.maximum(np.cos(pitch), LEAST_COSINE)
        poses[YAW] = Signal(dive.attitude.time_s, np.unwrap(heading)[:, None]), turning - r
        poses[PITCH] = Signal(dive.attitude.time_s, read_pitch[:, None]), level
    out = {}
    for dof, (read, rate) in poses.items():
        carried = motion.integral(rate)
        at = np.interp(read.time_s, motion.time_s, carried)
        out[dof] = Pose(Signal(read.time_s, read.value - at[:, None]), carried)
    return out


def with_heave_of_depth(motion: Motion, depth: Pose) -> Motion:
    """Return the motion with the slow errors of its heave velocity mended by depth: by the slope of depth less the
    integral of that velocity, which is the error's integral and the white noise of depth."""
    sunk = motion.integral(motion.nu[:, HEAVE])
    read = depth.reading
    at = np.interp(read.time_s, motion.time_s, sunk)
    nu = motion.nu.copy()
    nu[:, HEAVE] += _slope(Signal(read.time_s, read.value - at[:, None]), 0, motion)
    return replace(motion, nu=nu)


def restoring_force(
    configuration: Configuration,
    dof: int,
    motion: Motion,
    attitude: Array | None,
    pose: Pose | None,
    stiffness: float,
) -> Array:
    """Restoring force (m,) at the times of the motion; for roll and pitch without the part that the `stiffness`
    makes."""
    if attitude is None:
        return np.full(len(motion.time_s), configuration.net_buoyancy_n if dof == HEAVE else 0.0)
    g = np.asarray(restoring(configuration, tuple(attitude.T))[dof])
    if stiffness == 0.0 or pose is None:
        return g
    roll, pitch, _ = euler_angles(attitude)
    return np.asarray(g - stiffness * ((roll if dof == ROLL else pitch) - pose.carried))


def stiffness_of(dive: Dive, configuration: Configuration, dof: int) -> float:
    """Righting moment per angle, N m/rad. 0 for other axes, and for a vehicle that tumbles: its righting moment is
    not proportional to its turns, and comes from the recorded attitude alone."""
    if dof not in (ROLL, PITCH) or tumbles(dive):
        return 0.0
    return configuration.centre_of_gravity_below_buoyancy_m * configuration.dry_mass_kg * GRAVITY_M_S2
