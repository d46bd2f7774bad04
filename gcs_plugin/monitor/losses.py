"""Finds the loss of a thruster below the floor: a minute or two of departure, matched with that of such a loss.

One size is fitted to each thruster: the share of its thrust that is missing in the last minute or two, less that
before, as trim, ballast and inertia are never quite those of the model (generalised likelihood ratio of a step,
Basseville and Nikiforov 1993, section 2.4.3). Two parts of the departure are watched. The slow part is the drift: a
vertical thruster that holds a trimmed vehicle at depth gives some tenths of a newton, and without half of them the
vehicle always drifts to the same side, by less than sea and noise do in any five seconds. The quick part is the rates
of turn: the controller answers the noise of its sensors with many times the mean thrust, and the sea is slower. In
depth held alike by all vertical thrusters a sound vehicle neither rolls nor pitches by that; with a weak one it does.
"""

from collections import deque
from dataclasses import dataclass
from typing import Final

import numpy as np

from bridge.arrays import Array

BEFORE_S: Final = 60
KNOWN: Final = 0.05
"""A share to which thrust is known: a thruster's share differs by that from manoeuvre to manoeuvre."""

LEAST, MOST_LOST = 0.1, 1.3
"""Share of a thruster's thrust: less is nothing, and more than all of it is another cause."""


@dataclass(frozen=True)
class Loss:
    """`thruster`, counted from 0, lacks something for `seconds`, in `z` standard errors, the most of all; before (6,):
    the mean drift until then. Of each thruster: share (k,) that is missing, and evidence (k,) for it, in nats."""

    thruster: int
    seconds: int
    z: float
    before: Array
    share: Array
    evidence: Array


class LossWatch:
    """Takes each second; `loss` is the surest loss of a thruster, None where none lacks anything.

    `windows_s`: rising lengths of the time in which a loss is looked for. `alike_s`: seconds that count as one
    independent one; None for as many as the scatter of those before tells. `most`: the largest share.
    """

    def __init__(
        self,
        thrusters: int,
        windows_s: tuple[int, ...],
        *,
        alike_s: float | None = None,
        most: float = MOST_LOST,
    ) -> None:
        # Rows: score and information of each thruster, what their scatter needs, and the drift.
        self._count, self._windows_s, self._alike_s = thrusters, windows_s, alike_s
        self._most = most
        self._recent: deque[Array] = deque(maxlen=windows_s[-1])
        self._learnt, self._seconds = np.zeros(5 * thrusters + 6), 0
        self.loss: Loss | None = None

    @property
    def z(self) -> float:
        """Standard errors of the surest loss; 0 without one."""
        return 0.0 if self.loss is None else self.loss.z

    def add(self, score: Array, known: Array, drift: Array, *, learns: bool) -> None:
        """Take a second's score (k,) and information (k,) of each thruster, and its drift (6,); with `learns`, seconds
        that leave the windows count as before."""
        if learns and len(self._recent) == self._windows_s[-1]:
            self._learnt += self._recent[0]
            self._seconds += 1
        self._recent.append(
            np.hstack([score, known, score**2, score * known, known**2, np.nan_to_num(drift)])
        )
        rows = np.array(self._recent)
        losses = [self._lost(rows, window) for window in self._windows_s]
        self.loss = max(filter(None, losses), key=lambda loss: loss.z, default=None)

    def _lost(self, rows: Array, window: int) -> Loss | None:
        seconds = self._seconds + len(rows) - window
        if seconds < BEFORE_S:
            return None
        earlier = self._learnt + rows[:-window].sum(axis=0)
        score, known, *_ = self._parts(rows[-window:].sum(axis=0))
        score_before, known_before, square, product, known_square = self._parts(earlier)
        before = score_before / known_before
        alike_s: float | Array = self._alike_s or np.maximum(
            (square - 2.0 * before * product + before**2 * known_square) / known_before, 1.0
        )
        share, variance = score / known - before, alike_s * (1.0 / known + 1.0 / known_before)
        share = np.where((share > LEAST) & (share < self._most), share, 0.0)
        score = share / np.sqrt(variance + KNOWN**2)
        best = int(score.argmax())
        evidence = 0.5 * share**2 / variance
        if score[best] <= 0:
            return None
        return Loss(best, window, float(score[best]), earlier[-6:] / seconds, share, evidence)

    def _parts(self, total: Array) -> Array:
        """The sums (5, k) of score, information, score², score times information, and information²."""
        parts = total[:-6].reshape(5, self._count)
        parts[1] = np.maximum(parts[1], 1e-12)
        return parts
