"""Nats that the causes of a fit leave to others because no form of a library is exact."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.coefficients import DOFS
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.causes.evidence import (
    Blocks,
    inverse,
)
from identify.diagnose.causes.weighing import Fitted, Key, Weighing, key_of
from identify.diagnose.filters.regression import Regression


@dataclass(frozen=True)
class FormRemainder:
    """Bound on the nats that a further cause may save by the remainder of a fit's forms."""

    weighing: Weighing
    fit: Fitted

    def overlap(self, cause: Cause) -> float:
        """Nats of the fit's causes that a further cause could share, in the same axes and pieces; kept, because it is
        asked for several times."""
        key = key_of(cause)
        if key not in self._overlaps:
            shared = self._shared(self._in_cells(self._nominal, [cause])[0], self._cells_of_fit)
            self._overlaps[key] = shared
        return self._overlaps[key]

    def saved_overlap(self, cause: Cause) -> float:
        """Nats saved by other forms of the causes that a further cause could share, with its own share of these forms
        projected out."""
        return self._shared(self._in_cells(self._all, [cause])[0], self._saved_cells)

    @cached_property
    def _overlaps(self) -> dict[Key, float]:
        return {}

    @cached_property
    def _cells_of_fit(self) -> Array:
        """Squares of the fit's causes, summed in each cell."""
        return np.asarray(np.sum(self._in_cells(self._nominal, self.fit.causes), axis=0))

    @cached_property
    def _saved_cells(self) -> Array:
        """Squares, summed in each cell, of the part of the residual that other forms absorb."""
        value = self.rows.nuisance.blocks_of(self.fit.value[:, None]).first(self._axes)
        saved = self._taken_out(self._slopes_alone, value) - self._taken_out(self._all, value)
        return np.asarray(np.bincount(self._cell, saved[:, 0] ** 2), dtype=np.float64)

    @property
    def rows(self) -> Regression:
        return self.weighing.rows

    @property
    def _axes(self) -> int:
        """Number of the axes, whose blocks come before those of the witnesses."""
        return len(self.rows.axes)

    @cached_property
    def _cell(self) -> NDArray[np.intp]:
        """Cell of axis and piece of each row of the axes."""
        inside = self.rows.dof >= 0
        return self.rows.piece[inside] * len(DOFS) + self.rows.dof[inside]

    @cached_property
    def _slopes(self) -> Blocks:
        return self.rows.nuisance.blocks_of(self.fit.slopes)

    @cached_property
    def _nominal(self) -> tuple[Blocks, Array]:
        return self._regressors(self.rows.nuisance)

    @cached_property
    def _slopes_alone(self) -> tuple[Blocks, Array]:
        return self._regressors(self.rows.nuisance.with_columns(self._slopes))

    @cached_property
    def _all(self) -> tuple[Blocks, Array]:
        forms = self.weighing.forms_of(self.fit)
        return self._regressors(self.rows.nuisance.with_columns(self._slopes).with_columns(forms))

    def _regressors(self, known: Blocks) -> tuple[Blocks, Array]:
        """Nuisance columns, the nominal ones first, on the axes' rows, and the inverse of their square."""
        columns, precision = known.first(self._axes), self.rows.nominal_precision
        free = np.zeros(columns.width - len(precision))
        return columns, inverse(columns.square() + np.diag(np.concatenate([precision, free])))

    def _in_cells(self, regressors: tuple[Blocks, Array], causes: Sequence[Cause]) -> list[Array]:
        """Squares, summed in each cell, of each cause's column with regressors projected out."""
        course = self.weighing.now.course
        acts = [cause.act(course) for cause in causes]
        columns = self._taken_out(regressors, self.rows.blocks(acts, course).first(self._axes))
        return [np.asarray(np.bincount(self._cell, column**2), dtype=np.float64) for column in columns.T]

    def _taken_out(self, regressors: tuple[Blocks, Array], columns: Blocks) -> Array:
        known, square = regressors
        dense = columns.dense()
        return np.asarray(dense - known.times(square @ known.crossed(dense)))

    def _shared(self, remainder: Array, others: Array) -> float:
        """Cauchy-Schwarz bound, in nats, of a column's overlap with others, by their squares in each cell."""
        both = np.sqrt(remainder * others).sum()
        return 0.5 * float(both**2 / max(remainder.sum(), 1e-300))
