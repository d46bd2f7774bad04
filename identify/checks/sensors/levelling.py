"""Compares roll and pitch of the attitude with the gyro's rates, to find a wrong sign, axis or time stamp.

A vehicle that is held level rolls and pitches quickly, by fractions of a degree. So windows are short here, and a
difference that noise may explain raises no doubt. Heading turns far and slowly; `heading` checks it.
"""

from dataclasses import dataclass
from itertools import starmap

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import DOFS
from identify.checks.sensors.scale import DOUBTFUL_SCORE, FEWEST_WINDOWS, Scale, scale_of
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
from identify.ingest.rotation import euler_angles
from identify.statistics import left_of
from identify.words import capital

WINDOW_S, EDGE_S = 1.0, 0.25

LARGEST_OFF, LARGEST_SHARE = 0.2, 0.2
"""Shares of the angle turned through, and of the other axis's angle. Filters and mountings of healthy sensors cause
less."""

LATEST_S, STEP_S = 1.0, 0.1
LARGEST_LATE_S = 0.15

LEAST_UPRIGHT = 0.5
"""Cosine of pitch below which roll is hardly defined."""

ABOUT = coefficients_of((2, 3, 4))
"""The attitude turns gravity and the downward direction into body axes, so these rest on roll and pitch; so do roll
and pitch themselves if nothing else pushes."""


@dataclass(frozen=True)
class Followed:
    """How an angle of the attitude, roll or pitch, follows the gyro.

    scale: of the angle by its own rate, with the bounds of `Scale`. share: of the other axis's rate that the angle
    follows in addition to its own rate; 0 if noise may explain it.
    """

    scale: Scale | None
    share: float

    @property
    def contradicts(self) -> bool:
        """Whether both bounds of the scale differ from 1, each beyond its noise."""
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
    """Delay of the attitude's stamps behind the gyro's, 0 if noise may explain it; and roll and pitch with that
    delay."""

    late_s: float
    roll: Followed
    pitch: Followed


@dataclass(frozen=True)
class _Changes:
    """Changes over windows. seen: roll and pitch of the attitude (n, 2), without the contribution of yawing. said:
    integrals of the gyro rates that turn them, (n, 2). regressors: other regressors, ones for a bias and yaw for a
    mounting error, (n, 2)."""

    seen: Array
    said: Array
    regressors: Array

    @property
    def left(self) -> Array:
        """Mean square (2,) of the part of each angle that no gyro signal explains."""
        left = left_of(np.column_stack([self.said, self.regressors]), self.seen)
        return np.asarray(np.mean(left**2, axis=0), dtype=np.float64)

    def followed(self, axis: int) -> Followed:
        seen, rate, other_rate = self.seen[:, axis], self.said[:, axis], self.said[:, 1 - axis]
        # Where both rates move alike, noise on a rate looks like a share of the other rate; but then the angle's
        # residual against its own rate does not follow the other rate. A wrong scale does the opposite. So both
        # regressions must agree.
        alone = scale_of(seen - rate, other_rate, self.regressors)
        both = scale_of(seen, other_rate, np.column_stack([self.regressors, rate]))
        shares = [0.0 if scale is None or not scale.is_known else scale.least for scale in (alone, both)]
        share = min(shares, key=abs) if shares[0] * shares[1] > 0 else 0.0
        return Followed(scale_of(seen, rate, self.regressors), share)


def levelling(dive: Dive) -> Levelling | None:
    """Return how roll and pitch of the attitude follow the gyro; None if either signal is missing or too short.

    Angles change by phi_dot = p + (q sin phi + r cos phi) tan theta and theta_dot = q cos phi - r sin phi (Fossen
    2011, eq. 2.28).
    """
    gyro, attitude = finite_readings(dive.gyro), finite_readings(dive.attitude)
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
    kept = within_runs(edges_s, dive.breaks_s, LATEST_S)
    tables = tables[:, kept & np.isfinite(tables).all(axis=(0, 2))]
    if tables.shape[1] < FEWEST_WINDOWS:
        return None
    # A gyro's bias drifts, in all axes alike as it warms.
    tables -= slow(tables)
    ones = np.ones(tables.shape[1])
    changes = [
        _Changes(table[:, :2], table[:, 2:4], np.column_stack([ones, table[:, 4]])) for table in tables
    ]
    best = _latest(late_s, np.stack([each.left for each in changes]), tables.shape[1])
    return Levelling(float(late_s[best]), changes[best].followed(0), changes[best].followed(1))


def levelling_doubts(dive: Dive) -> tuple[Doubt, ...]:
    """Doubts about the coefficients that rest on roll and pitch, if attitude and gyro contradict each other."""
    levels = levelling(dive)
    if levels is None:
        return ()
    doubts = []
    if levels.late_s:
        first, second = "the attitude", "the gyro's rates in roll and pitch"
        late, by = (first, second) if levels.late_s > 0 else (second, first)
        are = "is" if late == first else "are"
        problem = f"{capital(late)} {are} stamped some {1000 * abs(levels.late_s):.0f} ms late, by {by}"
        remedy = (
            f"{', '.join(ABOUT)} may be off by more than their intervals; mend the clocks of both: seatrial doctor "
            "--wet tells how late each sensor is."
        )
        doubts.append(Doubt(ABOUT, problem, remedy, Outcome.DISAGREES))
    parts = [part for part in starmap(_said, ((3, levels.roll), (4, levels.pitch))) if part]
    if parts:
        remedy = (
            f"the sign, axes or scale of the attitude or of the gyro are not as taken, and {', '.join(ABOUT)} may be "
            "off by more than their intervals; check the mounting of the IMU, and what passes its attitude and rates "
            "on."
        )
        doubts.append(Doubt(ABOUT, f"By the attitude {' and '.join(parts)}", remedy, Outcome.DISAGREES))
    return tuple(doubts)


def _said(dof: int, followed: Followed) -> str:
    """The contradiction in an angle, as part of a sentence; empty if there is none."""
    name, other_axis = DOFS[dof], DOFS[7 - dof]
    if followed.contradicts and followed.scale is not None:
        return f"{name} turns by {followed.scale.times} times what the gyro says"
    return (
        f"{name} follows the gyro's rate in {other_axis} (by {followed.share:+.1f} of it at least)"
        if followed.crosses
        else ""
    )


def _table(gyro: Signal, attitude: Signal, edges_s: Array, late_s: float) -> Array:
    """Changes over the windows between the edges (n + 1,), as (n, 5), for a gyro stamped `late_s` later; NaN if
    readings are missing."""
    gyro = Signal(gyro.time_s + late_s, gyro.value)
    time_s, (roll, pitch, _) = attitude.time_s, euler_angles(attitude.value)
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


def _latest(late_s: Array, left: Array, windows: int) -> int:
    """Index of the lag, of (n,), with the smallest residuals (n, 2); the index of zero lag if noise may explain the
    gain."""
    none = int(np.argmin(np.abs(late_s)))
    moved = np.all(left > 0, axis=0)
    costs = windows * np.log(left[:, moved]).sum(axis=1)
    best = int(np.argmin(costs))
    gained = float(costs[np.abs(late_s) < LARGEST_LATE_S].min() - costs[best])
    return best if gained > DOUBTFUL_SCORE**2 else none
