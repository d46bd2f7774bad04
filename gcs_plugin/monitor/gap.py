"""Departure of a vehicle from its model, beside its noise floor, and the alarm.

Each second gives the drift of an axis over 5 s (`predictor`), in units of its noise floor. Its mean square over half a
minute is 1 where the model is right; drift is correlated over some 4 s, so that it has about seven independent values,
and it exceeds ALARM by chance once in some hundred thousand half minutes. The alarm is raised when it has for
HOLDS_S, which is half a minute after a large departure began. A second counts for no more than MOST: a kick of a few
seconds is no departure that stays.

The floor is that of the dive itself: drift of its first minute and of all later seconds on which no doubt falls, with
the upper bound of its uncertainty, and a share of the drift that thrust makes: twice the 3 % to which an
identification usually tells a damping. A departure from the first minute on is thus part of the floor.
"""

from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gcs_plugin.monitor.causes import Cause, likeliest
from gcs_plugin.monitor.model import Model
from gcs_plugin.monitor.predictor import OVER_S, Drift

Array = NDArray[np.float64]

SHOWN_S: Final = 10
STAYS_S: Final = 30
LEARNT_S: Final = 60
FITTED_S: Final = 60
FORGOTTEN_S: Final = 900.0
CORRELATED_S: Final = 4.0
HOLDS_S: Final = 15
CLEARS_S: Final = 60
"""The alarm ends once the departure has been gone for so long: at rest a weak thruster shows nothing."""

ALARM: Final = 6.0
DOUBT: Final = 2.5
OVER: Final = 3.0
MOST: Final = 16.0
KNOWN_SHARE: Final = 0.06
LEAST_FLOOR: Final = np.array([0.5e-3] * 3 + [0.2e-3] * 3)
"""Of a dive without noise, m/s and rad/s."""


@dataclass(frozen=True)
class AxisGap:
    """An axis, 0 to 5: its drift over 5 s, rms of the last SHOWN_S seconds, and its floor, m/s or rad/s; whether an
    alarm is about it."""

    dof: int
    drift: float
    floor: float
    high: bool


@dataclass(frozen=True)
class Gap:
    """Departure now. `learns_s`: so long until the floor is known; no axis before that. `since_s`: time for which the
    alarm has lasted, None without one. `causes`: the likeliest first, of an alarm."""

    axes: tuple[AxisGap, ...] = ()
    learns_s: float = 0.0
    since_s: float | None = None
    causes: tuple[Cause, ...] = ()


class GapMonitor:
    """Takes the drift of each second that can be judged; `gap` is the state after the last one. A hole of some seconds,
    as of a DVL without bottom lock, takes nothing back."""

    def __init__(self, model: Model) -> None:
        self._model = model
        self._dofs = list(model.dofs)
        self._square, self._weight, self._seconds = np.zeros(6), 0.0, 0
        self._recent: deque[tuple[Drift, Array]] = deque(maxlen=STAYS_S)
        self._departed: deque[Drift] = deque(maxlen=FITTED_S)
        self._undoubted: deque[Array] = deque()
        self._high_s = self._low_s = 0
        self._since: int | None = None
        self.gap = Gap(learns_s=float(LEARNT_S))

    def add(self, drift: Drift) -> None:
        """Take the next second."""
        self._seconds += 1
        square = drift.drift**2
        if self._seconds <= LEARNT_S:
            self._learn(square)
            self.gap = Gap(learns_s=float(LEARNT_S - self._seconds))
            return
        floor = self._floor(drift)
        self._recent.append((drift, np.minimum(square / floor**2, MOST)))
        size = np.mean([size for _, size in self._recent], axis=0)[self._dofs]
        if self._since is None:
            self._undoubted.append(square)
            if size.max() > DOUBT:
                self._undoubted.clear()
            elif len(self._undoubted) > STAYS_S:
                self._learn(self._undoubted.popleft())
        is_high = len(self._recent) == STAYS_S and size.max() > ALARM
        self._high_s = self._high_s + 1 if is_high else 0
        if self._since is None and self._high_s >= HOLDS_S:
            self._since = self._seconds
            # The windows of these seconds lie behind the onset, which half a minute's mean shows late.
            self._departed.extend(drift for drift, _ in list(self._recent)[-HOLDS_S - OVER_S : -1])
        self._low_s = self._low_s + 1 if size.max() < OVER else 0
        if self._since is not None and self._low_s >= CLEARS_S:
            self._since = None
            self._departed.clear()
        if self._since is not None:
            self._departed.append(drift)
        self.gap = self._gap_of(size)

    def _learn(self, square: Array) -> None:
        keep = 1.0 - 1.0 / FORGOTTEN_S
        self._square = keep * self._square + np.nan_to_num(square)
        self._weight = keep * self._weight + 1.0

    def _floor(self, drift: Drift) -> Array:
        """The floor (6,) of a second: the upper bound of the learnt one, and a share of the drift by the thrust."""
        learnt = self._square / self._weight * (1.0 + 1.5 * np.sqrt(2.0 * CORRELATED_S / self._weight))
        return np.asarray(np.sqrt(np.maximum(learnt, LEAST_FLOOR**2) + (KNOWN_SHARE * drift.driven) ** 2))

    def _gap_of(self, size: Array) -> Gap:
        shown = [drift for drift, _ in self._recent][-SHOWN_S:]
        rms = np.sqrt(np.mean([drift.drift**2 for drift in shown], axis=0))
        floor = np.sqrt(np.mean([self._floor(drift) ** 2 for drift in shown], axis=0))
        alarm = self._since is not None
        axes = tuple(
            AxisGap(dof, float(rms[dof]), float(floor[dof]), alarm and bool(s >= min(ALARM, size.max())))
            for dof, s in zip(self._dofs, size, strict=True)
        )
        if self._since is None:
            return Gap(axes)
        floors = np.array([self._floor(drift) for drift in self._departed])
        causes = likeliest(self._model, list(self._departed), floors)
        return Gap(axes, since_s=float(self._seconds - self._since), causes=causes)
