"""Evidence for candidates: cross-validated likelihood gain, by normal equations of sparse columns.

Most columns are zero on most rows, because a force on one axis shows in that axis alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FOLDS = 5

RIDGE = 1e-7
"""Added to normal equations of unit columns, against rounding."""

SCARCE = 0.02
"""Ridge, relative to a column's square: without it, noise would size a column in a fit without the fold that holds
nearly all of the column's information."""

NOTHING_NEW = 1e-6
"""Least share of a column's square beyond the nominal columns."""


@dataclass(frozen=True)
class Evidence:
    """Evidence of some columns in addition to the nominal columns.

    gain: nats saved on held-out pieces, `std` its standard error over pieces; fitted: nats in sample; size (k,),
    covariance (k, k): of the columns.
    """

    gain: float
    std: float
    fitted: float
    size: Array
    covariance: Array


@dataclass(frozen=True)
class NormalEquations:
    """The candidates' c columns with the nominal columns projected out (Frisch and Waugh 1933).

    square (c, c), right (c,): over all pieces. taught_square (F, c, c), taught_right (F, c): over the training pieces
    of each fold. held_square (P, c, c), held_right (P, c): by held-out piece; a size saves size . right - size .
    square . size / 2 there. Nominal sizes are those of the whole dive: a fold that hardly moves an axis could not
    separate them, and would predict nothing with or without a candidate. telling (c,): columns beyond the span of the
    nominal columns.
    """

    square: Array
    right: Array
    taught_square: Array
    taught_right: Array
    held_square: Array
    held_right: Array
    telling: NDArray[np.bool_]

    def fitted(self, columns: Sequence[int]) -> float:
        """Nats that some columns save in sample."""
        k = np.array([column for column in columns if self.telling[column]], dtype=np.intp)
        return 0.5 * float(self.right[k] @ _solved(self.square[k[:, None], k], self.right[k]))

    def evidence(self, columns: Sequence[int]) -> Evidence:
        """Evidence of some columns together; uninformative columns get no size."""
        k = np.array([column for column in columns if self.telling[column]], dtype=np.intp)
        some_of = k[:, None], k
        scarce = SCARCE * np.diag(np.diag(self.square)[k])
        sizes = _solved(self.taught_square[:, *some_of] + scarce, self.taught_right[:, k])
        size_of = sizes[np.arange(len(self.held_square)) % FOLDS]
        by_square = np.einsum("pi,pij,pj->p", size_of, self.held_square[:, *some_of], size_of)
        gains = np.einsum("pi,pi->p", self.held_right[:, k], size_of) - 0.5 * by_square
        square, right = self.square[some_of], self.right[k]
        solved = _solved(square, right)
        place = [list(columns).index(one) for one in k.tolist()]
        size, covariance = np.zeros(len(columns)), np.full((len(columns), len(columns)), np.inf)
        size[place] = solved
        covariance[np.ix_(place, place)] = inverse(square)
        return Evidence(
            float(gains.sum()),
            float(np.std(gains) * np.sqrt(len(gains))),
            0.5 * float(solved @ right),
            size,
            covariance,
        )


def inverse(square: Array) -> Array:
    """Inverse of normal equations (..., k, k), scaled to unit columns; a singular direction is shared out."""
    diagonal = np.arange(square.shape[-1])
    scale = np.sqrt(np.maximum(square[..., diagonal, diagonal], 1e-300))
    scales = scale[..., :, None] * scale[..., None, :]
    unit = square / scales
    unit[..., diagonal, diagonal] += RIDGE
    return np.asarray(np.linalg.inv(unit) / scales)


def _solved(square: Array, right: Array) -> Array:
    """Sizes (..., k) by the normal equations."""
    return np.asarray((inverse(square) @ right[..., None])[..., 0])


def equations_of(
    value: Array, nominal: Array, precision: Array, candidates: Array, piece: NDArray[np.intp]
) -> NormalEquations:
    """Normal equations of rows `value` (n,), with nominal (n, m) and candidate (n, c) columns, in pieces (n,).

    precision (m,): prior precision of the nominal sizes.
    """
    products = products_of(np.column_stack([nominal, candidates, value]), pieces_of(piece))
    return equations_from_products(products[:, :-1, :-1], products[:, :-1, -1], precision)


@dataclass(frozen=True)
class Pieces:
    """Rows in runs of one piece each: number of pieces, the piece `of` (s,) each run, and the runs' ends (s + 1,)."""

    count: int
    of: NDArray[np.intp]
    ends: NDArray[np.intp]


def pieces_of(piece: NDArray[np.intp], count: int | None = None) -> Pieces:
    """The runs of rows in `piece` (n,); `count`: number of pieces, if the last pieces have no rows."""
    ends = np.concatenate([[0], np.flatnonzero(np.diff(piece)) + 1, [len(piece)]])
    return Pieces(int(piece.max()) + 1 if count is None else count, piece[ends[:-1]], ends)


def products_of(columns: Array, pieces: Pieces, others: Array | None = None) -> Array:
    """Products (P, a, b) of columns (n, a) with others (n, b), or with themselves, within each piece."""
    right = columns if others is None else others
    out = np.zeros((pieces.count, columns.shape[1], right.shape[1]))
    for k, (a, b) in zip(pieces.of.tolist(), pairwise(pieces.ends.tolist()), strict=True):
        out[k] += columns[a:b].T @ right[a:b]
    return out


def equations_from_products(square: Array, right: Array, precision: Array) -> NormalEquations:
    """Normal equations from products within each piece.

    square (P, m + c, m + c): of all columns, nominal columns first; right (P, m + c): of the columns with the value;
    precision (m,): prior precision of the nominal sizes. The prior acts like a reading of each nominal size, spread
    evenly over the pieces, so that a candidate's savings of prior cost count for the candidate.
    """
    m, count = len(precision), len(square)
    every = np.arange(count)
    square = square.copy()
    square[:, :m, :m] += np.diag(precision) / count
    base, leaning = _nominal(square.sum(axis=0), right.sum(axis=0), m)
    leaned = square[:, :m, :m] @ leaning
    projected = square[:, m:, :m] @ leaning
    # Candidate columns with the nominal ones projected out.
    held_square = square[:, m:, m:] - projected - leaning.T @ (square[:, :m, m:] - leaned)
    held_right = (right[:, m:] - square[:, m:, :m] @ base) - (
        right[:, :m] - square[:, :m, :m] @ base
    ) @ leaning
    squares = np.einsum("pii->i", square)[m:]
    telling = np.einsum("pii->i", held_square) > NOTHING_NEW * np.maximum(squares, 1e-300)
    taught = [every % FOLDS != fold for fold in range(min(FOLDS, count))]
    return NormalEquations(
        held_square.sum(axis=0),
        held_right.sum(axis=0),
        np.array([held_square[some].sum(axis=0) for some in taught]),
        np.array([held_right[some].sum(axis=0) for some in taught]),
        held_square,
        held_right,
        telling,
    )


def _nominal(square: Array, right: Array, m: int) -> tuple[Array, Array]:
    """The nominal sizes (m,) without candidates, and their change per unit of each candidate (m, c)."""
    inner = inverse(square[:m, :m])
    return inner @ right[:m], inner @ square[:m, m:]


@dataclass(frozen=True)
class Block:
    """Consecutive rows. values (rows, k): of the nonzero columns `of` (k,)."""

    of: NDArray[np.intp]
    values: Array

    def after(self, columns: Array) -> "Block":
        """The block with its columns placed after other columns (rows, m)."""
        seen = np.flatnonzero(columns.any(axis=0))
        return Block(
            np.concatenate([seen, columns.shape[1] + self.of]), np.hstack([columns[:, seen], self.values])
        )


@dataclass(frozen=True)
class Blocks:
    """Blocks stacked by rows, with `width` columns together."""

    parts: tuple[Block, ...]
    width: int

    @property
    def places(self) -> list[slice]:
        """Rows of each block."""
        ends = [0, *accumulate(len(part.values) for part in self.parts)]
        return [slice(a, b) for a, b in pairwise(ends)]

    def blocks_of(self, columns: Array) -> "Blocks":
        """Other columns (rows, k) in blocks of the same rows."""
        parts = []
        for rows in (columns[place] for place in self.places):
            seen = np.flatnonzero(rows.any(axis=0))
            parts.append(Block(seen, rows[:, seen]))
        return Blocks(tuple(parts), columns.shape[1])

    def beside(self, others: "Blocks") -> "Blocks":
        """These columns, followed by others of the same rows."""
        parts = [
            Block(np.concatenate([left.of, self.width + right.of]), np.hstack([left.values, right.values]))
            for left, right in zip(self.parts, others.parts, strict=True)
        ]
        return Blocks(tuple(parts), self.width + others.width)

    def dense(self) -> Array:
        """All columns as a dense matrix (rows, width)."""
        return self.some(range(self.width))

    def some(self, columns: Sequence[int]) -> Array:
        """Some of the columns (rows, k), each contiguous in memory."""
        places = self.places
        out = np.zeros((len(columns), places[-1].stop))
        for part, place in zip(self.parts, places, strict=True):
            at = {column: i for i, column in enumerate(part.of.tolist())}
            for row, column in zip(out, columns, strict=True):
                if column in at:
                    row[place] = part.values[:, at[column]]
        return out.T

    def after(self, columns: Array) -> "Blocks":
        """The blocks with their columns placed after other columns (rows, m)."""
        parts = [part.after(columns[place]) for part, place in zip(self.parts, self.places, strict=True)]
        return Blocks(tuple(parts), columns.shape[1] + self.width)

    def products(self, piece: NDArray[np.intp]) -> Array:
        """Products (P, width, width) of the columns within each piece, `piece` (rows,)."""
        out = np.zeros((int(piece.max()) + 1, self.width, self.width))
        for part, place in zip(self.parts, self.places, strict=True):
            out[:, part.of[:, None], part.of] += products_of(part.values, pieces_of(piece[place], len(out)))
        return out

    def crossed(self, others: Array) -> Array:
        """Products (width, k) of the columns with others (rows, k) over all rows."""
        out = np.zeros((self.width, others.shape[1]))
        for part, place in zip(self.parts, self.places, strict=True):
            out[part.of] += part.values.T @ others[place]
        return out

    def products_between(self, others: "Blocks", piece: NDArray[np.intp]) -> Array:
        """Products (P, width, k) with the blocks `others` of the same rows, within each piece."""
        out = np.zeros((int(piece.max()) + 1, self.width, others.width))
        for left, right, place in zip(self.parts, others.parts, self.places, strict=True):
            pieces = pieces_of(piece[place], len(out))
            out[:, left.of[:, None], right.of] += products_of(left.values, pieces, right.values)
        return out

    def products_with(self, others: Array, piece: NDArray[np.intp]) -> Array:
        """Products (P, width, k) with the columns `others` (rows, k), within each piece."""
        out = np.zeros((int(piece.max()) + 1, self.width, others.shape[1]))
        for part, place in zip(self.parts, self.places, strict=True):
            out[:, part.of] += products_of(part.values, pieces_of(piece[place], len(out)), others[place])
        return out
