"""How far a vehicle drifts from its model, in units of the noise floor, and the alarm.

Each second gives the drift of an axis over 5 s (`predictor`). Its square over that of the noise floor, averaged over
half a minute (MEAN_S), is the departure: 1 for a right model. Drift is correlated over some 4 s, so half a minute holds
about seven independent values, and the departure exceeds ALARM_ABOVE by chance once in some hundred thousand half
minutes. The alarm is raised once it has done so for CONFIRM_S, half a minute after a large departure began. A single
second counts at most SQUARE_CAP, so that a kick of a few seconds raises no alarm.

A thruster's loss below the floor raises the alarm as well (`losses`), sooner if the model has roll or pitch; without
them its size is not known.

The floor comes from the dive itself: drift of its first minute and of all later undoubted seconds, with the upper bound
of its uncertainty, and a share of the drift by thrust: twice the 3 % to which an identification usually knows a
damping. A departure from the first minute on is thus part of the floor.
"""

import math
from collections import deque
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from bridge.arrays import Array, Mask
from bridge.vehicle.coefficients import DOFS
from gcs_plugin.monitor.causes import Cause, likeliest, likeliest_thruster
from gcs_plugin.monitor.losses import MOST_LOST, LossWatch
from gcs_plugin.monitor.model import Model
from gcs_plugin.monitor.predictor import CORRELATED_S, OVER_S, SECOND, TILTED, Drift

SHOWN_S: Final = 10
"""The drift that is shown is the rms over so long."""
MEAN_S: Final = 30
LEARNING_S: Final = 60
"""From the beginning; there is no floor before."""
FITTED_S: Final = 120
"""Causes are fitted to at most so much of a departure, the newest."""
MEMORY_S: Final = 900.0
"""Time constant with which the floor forgets."""
CONFIRM_S: Final = 15
CLEARS_S: Final = 60
"""The alarm ends once the departure has been gone for so long: at rest a weak thruster shows nothing."""

ALARM_ABOVE: Final = 6.0
CLEARS_BELOW: Final = 3.0
LEARNS_BELOW: Final = 2.5
SQUARE_CAP: Final = 16.0
"""All four of the square of drift over floor: three of its mean over MEAN_S, the cap of a single second's."""
LOSS_ALARM, QUICK_ALARM = 4.0, 5.0
"""Standard errors, of a loss in the drift and in the quick answers; in ten hours of sea and noise the surest loss of
eight thrusters was of 3.7 in the drift, and of 4.5 in the quick answers where roll's and pitch's inertia is guessed."""

LOSS_CLEARS_BELOW: Final = 2.5
SLOW_S, QUICK_S = (60, 120), (20, 40, 80)
"""Windows in which a loss is looked for in the drift, and in the quick answers."""

MOST_LOST_GUESSED: Final = 2.0 * MOST_LOST
"""Largest share of a thruster's thrust that may seem to lack where roll's and pitch's inertia is guessed."""

DRIFT_CAP_FLOORS: Final = 3.0
"""Where a loss is looked for, the drift of a second counts at most so many floors: a kick is no loss."""

LEAST_RATE_RAD_S: Final = 1e-5
"""Added to the noise of the rates, for a gyro without any."""

LEAST_EXPLAINED, LEAST_EXPLAINED_BELOW_FLOOR = 0.5, 0.05
"""Share of the mean square; a cause that explains less isn't named. Below the floor most of a departure is noise."""

LEAST_MOVED: Final = 0.5
"""An axis is part of a loss's alarm if the loss makes this share of the drift there that it makes in its largest axis,
both in floors."""

THRUST_SHARE: Final = 0.06
"""Share of the drift by thrust that is part of the floor: twice the 3 % to which a damping is usually known."""
LEAST_FLOOR: Final = np.array([0.5e-3] * 3 + [0.2e-3] * 3)
"""The floor (6,) of a dive without noise, m/s and rad/s."""


@dataclass(frozen=True)
class AxisGap:
    """The drift of an axis, `dof` 0 to 5, over 5 s: rms of the last SHOWN_S seconds, m/s or rad/s.

    floor: that of noise, in the same unit. high: the alarm is about this axis.
    """

    dof: int
    drift: float
    floor: float
    high: bool


@dataclass(frozen=True)
class Gap:
    """The departure now, by axis; no axis until the floor is known.

    learns_s: time until then. since_s: time for which the alarm has lasted, None without one. causes: those of the
    alarm, the likeliest first.
    """

    axes: tuple[AxisGap, ...] = ()
    learns_s: float = 0.0
    since_s: float | None = None
    causes: tuple[Cause, ...] = ()


class GapMonitor:
    """Takes the drift of each second that can be judged; `gap` is the state after the last one.

    Seconds may be missing, as of a DVL without bottom lock: it goes on from the state before.
    """

    def __init__(self, model: Model) -> None:
        self._model = model
        self._dofs = list(model.dofs)
        self._square, self._weight, self._seconds = np.zeros(6), 0.0, 0
        self._recent: deque[tuple[Drift, Array]] = deque(maxlen=MEAN_S)
        self._departed: deque[Drift] = deque(maxlen=FITTED_S)
        self._undoubted: deque[Drift] = deque()
        self._first: list[Drift] = []
        count = len(model.configuration.thrusters)
        self._sized = set(TILTED) <= set(model.dofs)
        self._slow = LossWatch(count, SLOW_S, alike_s=CORRELATED_S)
        self._quick = LossWatch(count, QUICK_S, most=MOST_LOST if self._sized else MOST_LOST_GUESSED)
        self._quick_square = np.zeros(2)
        # Which of them raised the alarm, where no departure above the floor did, and the mean drift until then.
        self._raised_by: LossWatch | None = None
        self._before = np.zeros(6)
        self._high_s = self._low_s = 0
        self._since: int | None = None
        self.gap = Gap(learns_s=float(LEARNING_S))

    def add(self, drift: Drift) -> None:
        """Take the next second."""
        self._seconds += 1
        square = drift.drift**2
        if self._seconds <= LEARNING_S:
            self._learn(drift)
            self._first.append(drift)
            self.gap = Gap(learns_s=float(LEARNING_S - self._seconds))
            return
        while self._first:
            self._look_for_losses(self._first.pop(0))
        self._look_for_losses(drift)
        floor = self._floor(drift)
        self._recent.append((drift, np.minimum(square / floor**2, SQUARE_CAP)))
        departure = np.mean([square for _, square in self._recent], axis=0)[self._dofs]
        if self._since is None:
            self._undoubted.append(drift)
            if departure.max() > LEARNS_BELOW:
                self._undoubted.clear()
            elif len(self._undoubted) > MEAN_S:
                learnt = self._undoubted.popleft()
                # Else one wrong reading of a DVL would hide all that comes after it.
                self._learn(learnt, SQUARE_CAP * self._floor(learnt) ** 2)
        is_high = len(self._recent) == MEAN_S and departure.max() > ALARM_ABOVE
        self._high_s = self._high_s + 1 if is_high else 0
        self._judge(drift, departure)
        self.gap = self._gap_of(departure)

    def _judge(self, drift: Drift, departure: Array) -> None:
        """Begin or end the alarm, and keep the drifts that it is about."""
        self._departed.append(drift)
        if self._high_s >= CONFIRM_S and (self._since is None or self._raised_by is not None):
            # The windows of these seconds lie behind the onset, which half a minute's mean shows late.
            self._begin(CONFIRM_S + OVER_S, None)
        elif self._since is None:
            watch = self._slow if self._slow.z > LOSS_ALARM else self._quick
            if watch.loss is not None and watch.z > (LOSS_ALARM if watch is self._slow else QUICK_ALARM):
                self._begin(watch.loss.seconds, watch)
        is_low = departure.max() < CLEARS_BELOW and not self._loss_suspected
        self._low_s = self._low_s + 1 if is_low else 0
        if self._low_s >= CLEARS_S:
            self._since = None

    def _begin(self, seconds: int, by: LossWatch | None) -> None:
        """Raise the alarm: the last `seconds` are those of a departure, which `by` watched if it is below the floor."""
        self._since = self._seconds if self._since is None else self._since
        self._raised_by = by
        self._before = np.zeros(6) if by is None or by.loss is None else by.loss.before
        for _ in range(len(self._departed) - seconds):
            self._departed.popleft()

    @property
    def _loss_suspected(self) -> bool:
        return max(self._slow.z, self._quick.z) >= LOSS_CLEARS_BELOW

    def _look_for_losses(self, drift: Drift) -> None:
        learns = self._since is None and not self._loss_suspected
        floor = self._floor(drift, margin=0.0)
        columns = np.nan_to_num(drift.causes[: len(self._model.configuration.thrusters)] / floor)
        score = columns @ np.clip(np.nan_to_num(drift.drift) / floor, -DRIFT_CAP_FLOORS, DRIFT_CAP_FLOORS)
        self._slow.add(score, (columns**2).sum(axis=1), drift.drift, learns=learns)
        variance = self._quick_square / self._weight / SECOND + LEAST_RATE_RAD_S**2
        quick = (drift.quick.score / variance).sum(axis=1), (drift.quick.known / variance).sum(axis=1)
        self._quick.add(*quick, drift.drift, learns=learns)

    def _learn(self, drift: Drift, most: float | Array = np.inf) -> None:
        """Make the drift part of the floor, its square up to `most` (6,)."""
        keep = 1.0 - 1.0 / MEMORY_S
        self._square = keep * self._square + np.fmin(np.nan_to_num(drift.drift**2), most)
        self._quick_square = keep * self._quick_square + drift.quick.square
        self._weight = keep * self._weight + 1.0

    def _floor(self, drift: Drift, margin: float = 1.5) -> Array:
        """The floor (6,) of a second: the upper bound of the learnt one, `margin` standard errors above it, and a share
        of the drift by the thrust."""
        learnt = self._square / self._weight * (1.0 + margin * np.sqrt(2.0 * CORRELATED_S / self._weight))
        return np.asarray(np.sqrt(np.maximum(learnt, LEAST_FLOOR**2) + (THRUST_SHARE * drift.driven) ** 2))

    def _gap_of(self, departure: Array) -> Gap:
        shown = [drift for drift, _ in self._recent][-SHOWN_S:]
        rms = np.sqrt(np.mean([drift.drift**2 for drift in shown], axis=0))
        floor = np.sqrt(np.mean([self._floor(drift) ** 2 for drift in shown], axis=0))
        high = self._high(departure)
        axes = tuple(
            AxisGap(dof, float(rms[dof]), float(floor[dof]), bool(is_high))
            for dof, is_high in zip(self._dofs, high, strict=True)
        )
        if self._since is None:
            return Gap(axes)
        return Gap(axes, since_s=float(self._seconds - self._since), causes=self._causes())

    def _high(self, departure: Array) -> Mask:
        """Of each axis with a model, whether the alarm is about it: of a loss below the floor, those that it moves."""
        if self._since is None:
            return np.zeros(len(departure), bool)
        loss = None if self._raised_by is None else self._raised_by.loss
        if loss is None:
            return np.asarray(departure >= min(ALARM_ABOVE, departure.max()))
        moved = [drift.causes[loss.thruster] / self._floor(drift) for drift in self._departed]
        each = np.sqrt(np.mean(np.square(moved), axis=0))[self._dofs]
        return np.asarray(each >= LEAST_MOVED * each.max())

    def _causes(self) -> tuple[Cause, ...]:
        """The likeliest causes of the departure that the alarm is about."""
        if self._raised_by is self._quick:
            loss = self._quick.loss
            return self.gap.causes if loss is None else likeliest_thruster(loss, sized=self._sized)
        departed = [replace(drift, drift=drift.drift - self._before) for drift in self._departed]
        floors = np.array([self._floor(drift) for drift in departed])
        least = LEAST_EXPLAINED if self._raised_by is None else LEAST_EXPLAINED_BELOW_FLOOR
        return likeliest(self._model, departed, floors, least)


def in_units(axis: AxisGap) -> tuple[str, str, str]:
    """Drift and floor as people read speeds, and their unit."""
    if axis.dof < 3:
        return f"{1e3 * axis.drift:.1f}", f"{1e3 * axis.floor:.1f}", "mm/s"
    return f"{math.degrees(axis.drift):.2f}", f"{math.degrees(axis.floor):.2f}", "deg/s"


def worst(gap: Gap) -> AxisGap | None:
    """The axis that is farthest beyond its floor."""
    return max(gap.axes, key=lambda axis: axis.drift / axis.floor, default=None)


def gap_line(gap: Gap) -> str:
    """The gap in a line: `off its model (floor): surge 5.6 (7.4) mm/s, yaw 0.06 (0.13) deg/s`."""
    if not gap.axes:
        return f"its noise floor is learnt, {gap.learns_s:.0f} s more"
    parts = []
    for axis in gap.axes:
        drift, floor, unit = in_units(axis)
        parts.append(f"{DOFS[axis.dof]} {drift} ({floor}) {unit}")
    return f"off its model (floor): {', '.join(parts)}"
