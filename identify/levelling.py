"""Roll and pitch of the attitude held against the gyro's rates: a sign, an axis or a stamp that both can't have.

A vehicle that is held level rolls and pitches by fractions of a degree, and quickly: windows are short here, and what
noise leaves open is no doubt. Heading, which turns by much and slowly, is `turning`'s.
"""

from dataclasses import dataclass
from itertools import starmap

import numpy as np

from bridge.vehicle.coefficients import DAMPINGS, DOFS, MASSES
from identify.dive import Array, Dive, Signal
from identify.identification import Doubt, Outcome
from identify.scale import (
    DOUBTFUL_SCORE,
    FEWEST_WINDOWS,
    Scale,
    edge_means,
    integral,
    left_of,
    scale_of,
    well_read,
    whole,
)

WINDOW_S, EDGE_S = 1.0, 0.25

NEAR = 10
"""Windows before and after one, whose mean is taken off it: a gyro's bias wanders, in all axes alike when it warms."""

LARGEST_OFF, LARGEST_SHARE = 0.2, 0.2
"""Of the angle turned through, and of the other axis's: filters and mountings of healthy sensors are off by less."""

LATEST_S, STEP_S = 1.0, 0.1
LARGEST_LATE_S = 0.15

LEAST_UPRIGHT = 0.5
"""Cosine of pitch, below which roll is hardly defined."""

ABOUT = tuple(group[dof].name for group in (MASSES, DAMPINGS) for dof in (2, 3, 4))
"""Gravity and the way down are turned into body axes by the attitude; where nothing else pushes, roll and pitch rest
on it."""


@dataclass(frozen=True)
class Followed:
    """How an angle of the attitude, roll or pitch, follows the gyro.

    scale: by its own rate, with the bounds of `Scale`. share: by the other axis's rate beside its own; 0 where noise
    may have made it.
    """

    scale: Scale | None
    share: float

    @property
    def contradicts(self) -> bool:
        """Whether the scale is another one by either bound, beyond what noise does to each."""
        scale = self.scale
        if scale is None or not scale.is_known:
            return False
        of_most = scale.std * abs(scale.most / scale.least)
        return scale.contradicts(LARGEST_OFF) and abs(scale.most - 1.0) > DOUBTFUL_SCORE * of_most

    @property
    def crosses(self) -> bool:
        return not self.contradicts and abs(self.share) > LARGEST_SHARE


@dataclass(frozen=True)
class Levelling:
    """How much later than the gyro the attitude is stamped, 0 where noise may have made it; roll and pitch then."""

    late_s: float
    roll: Followed
    pitch: Followed


@dataclass(frozen=True)
class _Changes:
    """Over windows: angles of the attitude (n, 2), roll and pitch, without what yawing does of them; the integrals of
    the gyro's rates that turn them, (n, 2); and beside them one, for a bias, and yaw, for a mounting, (n, 2)."""

    seen: Array
    said: Array
    beside: Array

    @property
    def left(self) -> Array:
        """Mean square (2,) of what nothing that the gyro says gives of each angle."""
        left = left_of(np.column_stack([self.said, self.beside]), self.seen)
        return np.asarray(np.mean(left**2, axis=0), dtype=np.float64)

    def followed(self, axis: int) -> Followed:
        seen, own, other = self.seen[:, axis], self.said[:, axis], self.said[:, 1 - axis]
        # Noise on a rate passes for a share of the other one where their motions are alike, but leaves what the angle
        # does beyond its own rate unlike the other; a wrong scale does it the other way round.
        alone = scale_of(seen - own, other, self.beside)
        both = scale_of(seen, other, np.column_stack([self.beside, own]))
        shares = [0.0 if one is None or not one.is_known else one.least for one in (alone, both)]
        share = min(shares, key=abs) if shares[0] * shares[1] > 0 else 0.0
        return Followed(scale_of(seen, own, self.beside), share)


def levelling(dive: Dive) -> Levelling | None:
    """How roll and pitch of the attitude follow the gyro; None where either is missing or too short.

    Angles change by phi_dot = p + (q sin phi + r cos phi) tan theta and theta_dot = q cos phi - r sin phi (Fossen
    2011, eq. 2.28).
    """
    gyro, attitude = whole(dive.gyro), whole(dive.attitude)
    if gyro is None or attitude is None:
        return None
    start_s = max(gyro.time_s[0], attitude.time_s[0]) + LATEST_S
    end_s = min(gyro.time_s[-1], attitude.time_s[-1]) - LATEST_S
    count = int((end_s - start_s) / WINDOW_S)
    if count < FEWEST_WINDOWS:
        return None
    edges_s = start_s + WINDOW_S * np.arange(count + 1)
    steps = round(LATEST_S / STEP_S)
    late_s = STEP_S * np.arange(-steps, steps + 1, dtype=np.float64)
    tables = np.stack([_table(gyro, attitude, edges_s, by_s) for by_s in late_s.tolist()])
    tables = tables[:, np.isfinite(tables).all(axis=(0, 2))]
    if tables.shape[1] < FEWEST_WINDOWS:
        return None
    tables -= _slow(tables)
    one = np.ones(tables.shape[1])
    changes = [_Changes(table[:, :2], table[:, 2:4], np.column_stack([one, table[:, 4]])) for table in tables]
    best = _latest(late_s, np.stack([one.left for one in changes]), tables.shape[1])
    return Levelling(float(late_s[best]), changes[best].followed(0), changes[best].followed(1))


def levelling_doubts(dive: Dive) -> tuple[Doubt, ...]:
    """Doubts of what rests on roll and pitch where attitude and gyro contradict each other."""
    found = levelling(dive)
    if found is None:
        return ()
    told = []
    if found.late_s:
        first, second = "the attitude", "the gyro's rates in roll and pitch"
        late, by = (first, second) if found.late_s > 0 else (second, first)
        are = "is" if late == first else "are"
        told.append(
            f"{late[0].upper()}{late[1:]} {are} stamped some {1000 * abs(found.late_s):.0f} ms late, by {by}: "
            f"{', '.join(ABOUT)} may be off by more than their intervals; mend the clocks of both: seatrial doctor "
            "--wet tells how late each sensor is."
        )
    parts = [part for part in starmap(_said, ((3, found.roll), (4, found.pitch))) if part]
    if parts:
        told.append(
            f"By the attitude {' and '.join(parts)}: the sign, axes or scale of the attitude or of the gyro are not as "
            f"taken, and {', '.join(ABOUT)} may be off by more than their intervals; check the mounting of the IMU, "
            "and what passes its attitude and rates on."
        )
    return tuple(Doubt(ABOUT, sentence, Outcome.DISAGREES) for sentence in told)


def _said(dof: int, followed: Followed) -> str:
    """What contradicts in an angle, as part of a sentence; empty where nothing does."""
    name, other = DOFS[dof], DOFS[7 - dof]
    if followed.contradicts and followed.scale is not None:
        return f"{name} turns by {followed.scale.times} times what the gyro says"
    return (
        f"{name} follows the gyro's rate in {other} (by {followed.share:+.1f} of it at least)"
        if followed.crosses
        else ""
    )


def _table(gyro: Signal, attitude: Signal, edges_s: Array, late_s: float) -> Array:
    """Changes over the windows between edges (n + 1,), (n, 5), were the gyro stamped so much later; NaN where
    readings lack."""
    gyro = Signal(gyro.time_s + late_s, gyro.value)
    time_s, (roll, pitch) = attitude.time_s, _roll_and_pitch(attitude.value)
    _, q, r = gyro.at(time_s).T
    upright = np.cos(pitch)
    tangent = np.sin(pitch) / np.maximum(upright, LEAST_UPRIGHT)
    yawing = np.column_stack([(q * np.sin(roll) + r * np.cos(roll)) * tangent, -r * np.sin(roll)])
    by_roll, yaw = (integral(gyro.time_s, gyro.value[:, axis], time_s) for axis in (0, 2))
    ways = np.column_stack([
        np.unwrap(roll) - integral(time_s, yawing[:, 0], time_s),
        pitch - integral(time_s, yawing[:, 1], time_s),
        by_roll,
        integral(time_s, q * np.cos(roll), time_s),
        yaw,
    ])  # fmt: skip
    changes = np.diff(edge_means(time_s, ways, edges_s, EDGE_S), axis=0)
    lying_s = time_s[upright <= LEAST_UPRIGHT]
    lay = np.searchsorted(lying_s, edges_s[1:] + EDGE_S) > np.searchsorted(lying_s, edges_s[:-1] - EDGE_S)
    changes[lay | ~(well_read(time_s, edges_s) & well_read(gyro.time_s, edges_s))] = np.nan
    return changes


def _slow(tables: Array) -> Array:
    """The mean over a window and the NEAR ones before and after it, of (k, n, columns); of fewer at the ends, as many
    on either side, so that a trend is none."""
    count = tables.shape[1]
    total = np.concatenate([np.zeros_like(tables[:, :1]), np.cumsum(tables, axis=1)], axis=1)
    at = np.arange(count)
    near = np.minimum(NEAR, np.minimum(at, count - 1 - at))
    return np.asarray((total[:, at + near + 1] - total[:, at - near]) / (2 * near + 1)[:, None])


def _latest(late_s: Array, left: Array, windows: int) -> int:
    """Which of the lags (n,) leaves least (n, 2); that of none where noise may have made the difference."""
    none = int(np.argmin(np.abs(late_s)))
    moved = np.all(left > 0, axis=0)
    costs = windows * np.log(left[:, moved]).sum(axis=1)
    best = int(np.argmin(costs))
    gained = float(costs[np.abs(late_s) < LARGEST_LATE_S].min() - costs[best])
    return best if gained > DOUBTFUL_SCORE**2 else none


def _roll_and_pitch(quaternion: Array) -> tuple[Array, Array]:
    w, x, y, z = quaternion.T
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    return np.asarray(roll), np.asarray(np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0)))
