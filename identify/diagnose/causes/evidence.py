"""Evidence for candidates: cross-validated likelihood gain, by normal equations of sparse columns.

Most columns are zero on most rows, because a force on one axis shows in that axis alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, pairwise

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.threads import side_by_side

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

    def fitted(self, sets: Sequence[Sequence[int]]) -> Array:
        """Nats (n,) that each of n sets of columns saves in sample."""
        informative = [[column for column in columns if self.telling[column]] for columns in sets]
        out = np.zeros(len(sets))
        for width in {len(columns) for columns in informative}:
            # Sets of as many columns are solved together.
            at = [i for i, columns in enumerate(informative) if len(columns) == width]
            k = np.array([informative[i] for i in at], dtype=np.intp).reshape(len(at), width)
            right = self.right[k]
            out[at] = 0.5 * np.sum(right * _solved(self.square[k[:, :, None], k[:, None, :]], right), axis=1)
        return out

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
        indices = [list(columns).index(item) for item in k.tolist()]
        size, covariance = np.zeros(len(columns)), np.full((len(columns), len(columns)), np.inf)
        size[indices] = solved
        covariance[np.ix_(indices, indices)] = inverse(square)
        return Evidence(
            float(gains.sum()),
            float(np.std(gains) * np.sqrt(len(gains))),
            0.5 * float(solved @ right),
            size,
            covariance,
        )


def inverse(square: Array, unit: Array | None = None) -> Array:
    """Inverse of normal equations (..., k, k), scaled to unit columns; a singular direction is shared out.

    unit (..., k): squares of the columns, before others were projected out; the diagonal of `square` if None.
    """
    diagonal = np.arange(square.shape[-1])
    scale = np.sqrt(np.maximum(square[..., diagonal, diagonal] if unit is None else unit, 1e-300))
    scales = scale[..., :, None] * scale[..., None, :]
    scaled = square / scales
    scaled[..., diagonal, diagonal] += RIDGE
    return np.asarray(np.linalg.inv(scaled) / scales)


def _solved(square: Array, right: Array) -> Array:
    """Sizes (..., k) by the normal equations."""
    return np.asarray((inverse(square) @ right[..., None])[..., 0])


@dataclass(frozen=True)
class Candidates:
    """Columns (n, c) of candidates in pieces (n,), with their products, which hold for any nominal columns and rows."""

    columns: Array
    piece: NDArray[np.intp]

    @cached_property
    def pieces(self) -> "Pieces":
        return pieces_of(self.piece)

    @cached_property
    def square(self) -> Array:
        """Products (P, c, c) of the columns within each piece."""
        return products_of(self.columns, self.pieces)


def equations_of(value: Array, nominal: Array, precision: Array, candidates: Candidates) -> NormalEquations:
    """Normal equations of rows `value` (n,), with nominal columns (n, m) and candidates.

    precision (m,): prior precision of the nominal sizes.
    """
    pieces = candidates.pieces
    # The prior acts like a reading of each nominal size, spread evenly over the pieces, so that a candidate's savings
    # of prior cost count for the candidate.
    known = products_of(nominal, pieces) + np.diag(precision) / pieces.count
    cross, of_value = (
        products_of(nominal, pieces, others) for others in (candidates.columns, value[:, None])
    )
    free = inverse(known.sum(axis=0))
    by_candidates, by_value = (cross, free @ cross.sum(axis=0)), (of_value, free @ of_value.sum(axis=0))
    square, right = candidates.square, products_of(candidates.columns, pieces, value[:, None])
    return equations_beyond(
        np.einsum("pii->i", square),
        projected_out(square, known, by_candidates, by_candidates),
        projected_out(right, known, by_candidates, by_value)[:, :, 0],
    )


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


def projected_out(
    products: Array, known: Array, left: tuple[Array, Array], right: tuple[Array, Array]
) -> Array:
    """Products (P, a, b) of columns less their shares of known columns.

    products (P, a, b): of the left with the right columns, in full; known (P, k, k): of the known columns; left,
    right: products (P, k, .) of the known columns with each, and the sizes (k, .) to be taken off.
    """
    (by_left, off_left), (by_right, off_right) = left, right
    shares = np.concatenate([np.broadcast_to(off_left, by_left.shape), by_left], axis=1)
    remainder = by_right - known @ off_right
    taken = shares.mT @ np.concatenate([remainder, np.broadcast_to(off_right, remainder.shape)], axis=1)
    return np.asarray(np.subtract(products, taken, out=taken))


def equations_beyond(squares: Array, held_square: Array, held_right: Array) -> NormalEquations:
    """Normal equations of candidates whose nominal columns are projected out; squares (c,): of the candidates in
    full."""
    telling = np.einsum("pii->i", held_square) > NOTHING_NEW * np.maximum(squares, 1e-300)
    square, square_by_fold = _over_folds(held_square)
    right, right_by_fold = _over_folds(held_right)
    return NormalEquations(
        square,
        right,
        square - square_by_fold,
        right - right_by_fold,
        held_square,
        held_right,
        telling,
    )


def _over_folds(held: Array) -> tuple[Array, Array]:
    """Sums of a term of each piece (P, ...): over all pieces (...), and over those of each fold (F, ...)."""
    by_fold = np.array([held[k::FOLDS].sum(axis=0) for k in range(min(FOLDS, len(held)))])
    return by_fold.sum(axis=0), by_fold


@njit(cache=True, nogil=True)
def _add(out: Array, left: NDArray[np.intp], right: NDArray[np.intp], products: Array) -> None:
    """Add products (P, a, b) at some rows and columns of `out`, several times as fast as by arrays of indices."""
    for p in range(len(products)):
        for i in range(len(left)):
            for j in range(len(right)):
                out[p, left[i], right[j]] += products[p, i, j]


@dataclass(frozen=True)
class Block:
    """Consecutive rows. values (rows, k): of the nonzero columns `of` (k,)."""

    of: NDArray[np.intp]
    values: Array

    @classmethod
    def of_columns(cls, columns: Array) -> "Block":
        """The nonzero columns of dense ones (rows, k)."""
        seen = np.flatnonzero(columns.any(axis=0))
        return cls(seen, columns if len(seen) == columns.shape[1] else columns[:, seen])

    def with_columns(self, other: "Block", width: int) -> "Block":
        """The block with the columns of another, which come after `width` columns."""
        of = np.concatenate([self.of, width + other.of])
        if not (len(self.of) and len(other.of)):
            return Block(of, self.values if len(self.of) else other.values)
        return Block(of, np.hstack([self.values, other.values]))


@dataclass(frozen=True)
class Blocks:
    """Blocks stacked by rows, with `width` columns together."""

    parts: tuple[Block, ...]
    width: int

    @property
    def slices(self) -> list[slice]:
        """Rows of each block."""
        ends = [0, *accumulate(len(part.values) for part in self.parts)]
        return [slice(a, b) for a, b in pairwise(ends)]

    @classmethod
    def nothing(cls, rows: "Blocks") -> "Blocks":
        """No columns, in blocks of the same rows."""
        nothing = np.zeros(0, dtype=np.intp)
        return cls(tuple(Block(nothing, np.zeros((len(part.values), 0))) for part in rows.parts), 0)

    def blocks_of(self, columns: Array) -> "Blocks":
        """Other columns (rows, k) in blocks of the same rows."""
        return Blocks(tuple(Block.of_columns(columns[slice_]) for slice_ in self.slices), columns.shape[1])

    @classmethod
    def joined(cls, every: Sequence["Blocks"]) -> "Blocks":
        """The columns of blocks (at least one) of the same rows, one after the other."""
        starts = list(accumulate((blocks.width for blocks in every), initial=0))

        def part(k: int) -> Block:
            parts = [blocks.parts[k] for blocks in every]
            of = [start + part.of for start, part in zip(starts, parts, strict=False)]
            return Block(np.concatenate(of), np.hstack([part.values for part in parts]))

        return cls(tuple(map(part, range(len(every[0].parts)))), starts[-1])

    def with_columns(self, others: "Blocks") -> "Blocks":
        """These columns, followed by others of the same rows."""
        parts = [
            left.with_columns(right, self.width) for left, right in zip(self.parts, others.parts, strict=True)
        ]
        return Blocks(tuple(parts), self.width + others.width)

    def dense(self) -> Array:
        """All columns as a dense matrix (rows, width)."""
        return self.some(range(self.width))

    def some(self, columns: Sequence[int]) -> Array:
        """Some of the columns (rows, k), each contiguous in memory."""
        slices = self.slices
        out = np.zeros((len(columns), slices[-1].stop))
        for part, slice_ in zip(self.parts, slices, strict=True):
            at = {column: i for i, column in enumerate(part.of.tolist())}
            for row, column in zip(out, columns, strict=True):
                if column in at:
                    row[slice_] = part.values[:, at[column]]
        return out.T

    def first(self, count: int) -> "Blocks":
        """The first blocks."""
        return Blocks(self.parts[:count], self.width)

    def combined(self, by: Array) -> "Blocks":
        """Combinations of the columns, by their shares (width, k)."""
        parts = []
        for part in self.parts:
            shares = by[part.of]
            seen = np.flatnonzero(shares.any(axis=0))
            parts.append(Block(seen, part.values @ shares[:, seen]))
        return Blocks(tuple(parts), by.shape[1])

    def times(self, sizes: Array) -> Array:
        """Sums (rows, k) of the columns times sizes (width, k)."""
        return np.concatenate([part.values @ sizes[part.of] for part in self.parts])

    def square(self) -> Array:
        """Products (width, width) of the columns over all rows."""
        out = np.zeros((self.width, self.width))
        for part in self.parts:
            out[part.of[:, None], part.of] += part.values.T @ part.values
        return out

    def products(self, piece: NDArray[np.intp]) -> Array:
        """Products (P, width, width) of the columns within each piece, `piece` (rows,)."""
        return self.products_between(self, piece)

    def crossed(self, others: Array) -> Array:
        """Products (width, k) of the columns with others (rows, k) over all rows."""
        out = np.zeros((self.width, others.shape[1]))
        for part, slice_ in zip(self.parts, self.slices, strict=True):
            out[part.of] += part.values.T @ others[slice_]
        return out

    def products_between(self, others: "Blocks", piece: NDArray[np.intp]) -> Array:
        """Products (P, width, k) with the blocks `others` of the same rows, within each piece."""
        out = np.zeros((int(piece.max()) + 1, self.width, others.width))
        slices = self.slices

        def products(k: int) -> Array:
            pieces = pieces_of(piece[slices[k]], len(out))
            return products_of(self.parts[k].values, pieces, others.parts[k].values)

        def size(k: int) -> float:
            return float(self.parts[k].values.size * others.parts[k].values.shape[1])

        every = range(len(self.parts))
        for left, right, part in zip(
            self.parts, others.parts, side_by_side(products, every, size), strict=True
        ):
            _add(out, left.of, right.of, part)
        return out

    def products_with(self, others: Array, piece: NDArray[np.intp]) -> Array:
        """Products (P, width, k) with the columns `others` (rows, k), within each piece."""
        out = np.zeros((int(piece.max()) + 1, self.width, others.shape[1]))
        for part, slice_ in zip(self.parts, self.slices, strict=True):
            out[:, part.of] += products_of(part.values, pieces_of(piece[slice_], len(out)), others[slice_])
        return out
