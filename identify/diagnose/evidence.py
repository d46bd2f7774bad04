"""What speaks for a cause: how much better it foretells pieces of the dive that it was not fitted on."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FOLDS = 5


@dataclass(frozen=True)
class Evidence:
    """Of some columns beside the nominal ones. gain: nats that they save on pieces held out, `std` its standard error
    over pieces; fitted: nats on all pieces, in sample; size, covariance (k,), (k, k): of the columns."""

    gain: float
    std: float
    fitted: float
    size: Array
    covariance: Array


@dataclass(frozen=True)
class Sums:
    """Normal equations of all columns by piece: square (P, K, K), right (P, K); the first `nominal` columns are the
    nominal model's, with `precision` (nominal,) known beforehand."""

    square: Array
    right: Array
    nominal: int
    precision: Array

    def evidence(self, columns: Sequence[int]) -> Evidence:
        """Of some of the candidates' columns, counted from the first after the nominal ones."""
        base = np.arange(self.nominal)
        chosen = np.concatenate([base, self.nominal + np.asarray(columns, dtype=np.intp)])
        with_it, without = self._saved(chosen), self._saved(base)
        gains = with_it - without
        theta, covariance = self._solved(chosen, np.arange(len(self.square)))
        bare, _ = self._solved(base, np.arange(len(self.square)))
        right = self.right.sum(axis=0)
        fitted = 0.5 * float(theta @ right[chosen] - bare @ right[base])
        kept = slice(self.nominal, None)
        spread = float(np.std(gains) * np.sqrt(len(gains)))
        return Evidence(float(gains.sum()), spread, fitted, theta[kept], covariance[kept, kept])

    def _solved(self, chosen: NDArray[np.intp], pieces: NDArray[np.intp]) -> tuple[Array, Array]:
        square = self.square[pieces].sum(axis=0)[np.ix_(chosen, chosen)]
        known = np.zeros(len(chosen))
        known[: self.nominal] = self.precision
        scale = np.sqrt(np.diag(square) + known) + 1e-12
        inverse = np.linalg.pinv(
            (square + np.diag(known)) / np.outer(scale, scale), rcond=1e-10, hermitian=True
        )
        covariance = inverse / np.outer(scale, scale)
        return np.asarray(covariance @ self.right[pieces].sum(axis=0)[chosen]), np.asarray(covariance)

    def _saved(self, chosen: NDArray[np.intp]) -> Array:
        """Nats (P,) that each piece is better foretold by columns fitted on the others than by none."""
        out = np.zeros(len(self.square))
        every = np.arange(len(self.square))
        for fold in range(FOLDS):
            held = every[every % FOLDS == fold]
            theta, _ = self._solved(chosen, every[every % FOLDS != fold])
            for piece in held.tolist():
                square = self.square[piece][np.ix_(chosen, chosen)]
                out[piece] = theta @ self.right[piece, chosen] - 0.5 * theta @ square @ theta
        return out


def sums_of(
    value: Array, nominal: Array, precision: Array, candidates: Array, piece: NDArray[np.intp]
) -> Sums:
    """The sums of rows `value` (n,), with nominal (n, m) and candidates' (n, c) columns, in pieces (n,)."""
    columns = np.column_stack([nominal, candidates])
    count = int(piece.max()) + 1
    square = np.zeros((count, columns.shape[1], columns.shape[1]))
    right = np.zeros((count, columns.shape[1]))
    order = np.argsort(piece, kind="stable")
    ends = np.searchsorted(piece[order], np.arange(count + 1))
    for k in range(count):
        rows = order[ends[k] : ends[k + 1]]
        square[k] = columns[rows].T @ columns[rows]
        right[k] = columns[rows].T @ value[rows]
    return Sums(square, right, nominal.shape[1], precision)
