"""What the forms of causes leave of a dive, as far as a further cause could take it up: no evidence for that one.

No form of a library is quite true. What it leaves is no larger, cell by cell of axis and piece, than some share of what
its cause adds there, nor than what other forms of it save there: so many nats are the most of it that a further cause
can have to do with (Cauchy and Schwarz).
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DOFS
from identify.diagnose.cause import Cause
from identify.diagnose.evidence import inverse
from identify.diagnose.ground import Fitted, Ground

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Rest:
    """Of the causes of a fit."""

    ground: Ground
    fit: Fitted

    def met(self, cause: Cause) -> float:
        """Nats of what the causes add, as far as a further cause shows in the same axes at the same times."""
        course = self.ground.now.course
        acts = [cause.act(course), *(one.act(course) for one in self.fit.causes)]
        own, *before = self._taken_out(self._nominal, self.ground.rows.columns(acts, course)[self._moving]).T
        return self._shared(own, *before)

    def seen(self, cause: Cause) -> float:
        """Nats that other forms of the causes save, as far as a further cause shows in the same axes at the same times
        by what no form of theirs makes up for."""
        course = self.ground.now.course
        column = self.ground.rows.columns([cause.act(course)], course)[self._moving]
        return self._shared(self._taken_out(self._all, column)[:, 0], self._saved)

    @cached_property
    def _moving(self) -> NDArray[np.bool_]:
        return np.asarray(self.ground.rows.dof >= 0)

    @cached_property
    def _known(self) -> Array:
        return self.ground.known(self.fit)

    @cached_property
    def _nominal(self) -> tuple[Array, Array]:
        return self._regressors(0)

    @cached_property
    def _all(self) -> tuple[Array, Array]:
        return self._regressors(self._known.shape[1])

    @cached_property
    def _saved(self) -> Array:
        """(rows,): of what the causes leave, what their other forms take up."""
        value = self.fit.value[self._moving, None]
        own = self._regressors(self.fit.slopes.shape[1])
        return (self._taken_out(own, value) - self._taken_out(self._all, value))[:, 0]

    def _regressors(self, known: int) -> tuple[Array, Array]:
        """The nominal columns with so many of the known ones, where the vehicle moves; the inverse of their square."""
        rows = self.ground.rows
        columns = np.hstack([rows.nominal, self._known[:, :known]])[self._moving]
        precision = np.concatenate([rows.nominal_precision, np.zeros(known)])
        return columns, inverse(columns.T @ columns + np.diag(precision))

    def _taken_out(self, regressors: tuple[Array, Array], columns: Array) -> Array:
        by, square = regressors
        return np.asarray(columns - by @ (square @ (by.T @ columns)))

    def _shared(self, own: Array, *before: Array) -> float:
        """Nats of what was there before, as far as its cells may lie along a column's own."""
        rows = self.ground.rows
        cell = (rows.piece * len(DOFS) + rows.dof)[self._moving]
        mine, *others = (np.bincount(cell, one**2) for one in (own, *before))
        both = np.sqrt(mine * np.sum(others, axis=0)).sum()
        return 0.5 * float(both**2 / max(mine.sum(), 1e-300))
