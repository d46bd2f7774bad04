"""A thruster's loss that stays below the floor: the drift of a minute or two, matched with the drift that it makes.

A vertical thruster that holds a trimmed vehicle at depth gives some tenths of a newton. Without half of them the
vehicle drifts by less than sea and noise make it in any five seconds, but always to the same side, and in heave, roll
and pitch at once. One size is fitted, with seconds weighted by the floor: the share of its thrust that is missing in
the last minute or two, less that before, as trim and ballast are never quite those of the model (generalised likelihood
ratio of a step, Basseville and Nikiforov 1993, section 2.4.3).
"""

from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from gcs_plugin.monitor.predictor import CORRELATED_S

Array = NDArray[np.float64]

WINDOWS_S: Final = (60, 120)
BEFORE_S: Final = 60
KNOWN: Final = 0.05
"""A share to which thrust is known: a thruster's share differs by that from manoeuvre to manoeuvre."""

MOST_FLOORS: Final = 3.0
"""Of the drift of a second: a kick is no loss."""

LEAST, MOST = 0.1, 1.3
"""Share of a thruster's thrust: less is nothing, and more than all of it is another cause."""


@dataclass(frozen=True)
class Loss:
    """A thruster lacks something for `seconds`: how many standard errors that is, and the mean drift (6,) before."""

    seconds: int
    z: float
    before: Array


class SlowWatch:
    """Takes each second; `loss` is the surest loss of a thruster, None where none lacks anything."""

    def __init__(self, thrusters: int) -> None:
        # Rows: score and information of each thruster, and the drift.
        self._recent: deque[Array] = deque(maxlen=WINDOWS_S[-1])
        self._learnt, self._seconds = np.zeros(2 * thrusters + 6), 0
        self.loss: Loss | None = None

    def add(self, drift: Array, floor: Array, columns: Array, *, learns: bool) -> None:
        """Take a second's drift (6,), floor (6,) and drift by each thruster (k, 6), NaN in axes without a model; with
        `learns`, seconds that leave the windows count as before."""
        weighted, drift = np.nan_to_num(columns / floor), np.nan_to_num(drift)
        if learns and len(self._recent) == WINDOWS_S[-1]:
            self._learnt += self._recent[0]
            self._seconds += 1
        score = weighted @ np.clip(drift / floor, -MOST_FLOORS, MOST_FLOORS)
        self._recent.append(np.hstack([score, (weighted**2).sum(axis=1), drift]))
        rows = np.array(self._recent)
        losses = [self._lost(rows, window) for window in WINDOWS_S]
        self.loss = max(filter(None, losses), key=lambda loss: loss.z, default=None)

    def _lost(self, rows: Array, window: int) -> Loss | None:
        seconds = self._seconds + len(rows) - window
        if seconds < BEFORE_S:
            return None
        earlier = self._learnt + rows[:-window].sum(axis=0)
        (score, known), (score_before, known_before) = (
            np.maximum(total[:-6].reshape(2, -1), [[-np.inf], [1e-12]])
            for total in (rows[-window:].sum(axis=0), earlier)
        )
        share = score / known - score_before / known_before
        z = share / np.sqrt(CORRELATED_S / known + CORRELATED_S / known_before + KNOWN**2)
        best = float(np.max(z, where=(share > LEAST) & (share < MOST), initial=0.0))
        return Loss(window, best, earlier[-6:] / seconds) if best > 0 else None
