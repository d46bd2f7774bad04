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
"""Ridge, relative to a column's square: without it, a fold that holds nearly all of a column's information would be
sized by noise."""

NOTHING_NEW = 1e-6
"""Least share of a column's square beyond the nominal columns."""


@dataclass(frozen=True)
class Evidence:
    """Of some columns beside the nominal ones. gain: nats saved on held-out pieces, `std` its standard error over
    pieces; fitted: nats in sample; size (k,), covariance (k, k): of the columns."""

    gain: float
    std: float
    fitted: float
    size: Array
    covariance: Array


@dataclass(frozen=True)
class NormalEquations:
    """The candidates' c columns with the nominal ones projected out (Frisch and Waugh 1933).

    square (c, c), right (c,): over all pieces. taught_square (F, c, c), taught_right (F, c): over the training pieces
    of each fold. held_square (P, c, c), held_right (P, c): by held-out piece; a size saves size . right - size . square
    . size / 2 there. Nominal sizes are those of the whole dive: a fold that hardly moves an axis could not separate
    them, and would predict nothing with or without a candidate. telling (c,): columns beyond the span of the nominal
    ones.
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
        """Evidence of some columns together; uninformative ones get no size."""
        k = np.array([column for column in columns if self.telling[column]], dtype=np.intp)
        some_of = k[:, None], k
        scarce = SCARCE * np.diag(np.diag(self.square)[k])
        sizes = _solved(self.taught_square[:, *some_of] + scarce, self.taught_right[:, k])
        size_of = sizes[np.arange(len(self.held_square)) % FOLDS]
        by_square = np.einsum("pi,pij,pj->p", size_of, self.held_square[:, *some_of], size_of)
        gains = np.einsum("pi,pi->p", self.held_right[:, k], size_of) - 0.5 * by_square
        square, right = self.square[some_of], self.right[k]
        some = _solved(square, right)
        place = [list(columns).index(one) for one in k.tolist()]
        size, covariance = np.zeros(len(columns)), np.full((len(columns), len(columns)), np.inf)
        size[place] = some
        covariance[np.ix_(place, place)] = inverse(square)
        return Evidence(
            float(gains.sum()),
            float(np.std(gains) * np.sqrt(len(gains))),
            0.5 * float(some @ right),
            size,
            covariance,
        )


def inverse(square: Array) -> Array:
    """Of normal equations (..., k, k), scaled to unit columns; a singular direction is shared out."""
    each = np.arange(square.shape[-1])
    scale = np.sqrt(np.maximum(square[..., each, each], 1e-300))
    scales = scale[..., :, None] * scale[..., None, :]
    own = square / scales
    own[..., each, each] += RIDGE
    return np.asarray(np.linalg.inv(own) / scales)


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
    """Rows in runs of one piece each: `count` pieces, the piece `of` (s,) each run, and the runs' ends (s + 1,)."""

    count: int
    of: NDArray[np.intp]
    ends: NDArray[np.intp]


def pieces_of(piece: NDArray[np.intp], count: int | None = None) -> Pieces:
    """The runs of rows in `piece` (n,); `count`: of pieces, if the last have no rows."""
    ends = np.concatenate([[0], np.flatnonzero(np.diff(piece)) + 1, [len(piece)]])
    return Pieces(int(piece.max()) + 1 if count is None else count, piece[ends[:-1]], ends)


def products_of(columns: Array, pieces: Pieces, others: Array | None = None) -> Array:
    """(P, a, b): the products of columns (n, a) with others (n, b), or with themselves, within each piece."""
    right = columns if others is None else others
    out = np.zeros((pieces.count, columns.shape[1], right.shape[1]))
    for k, (a, b) in zip(pieces.of.tolist(), pairwise(pieces.ends.tolist()), strict=True):
        out[k] += columns[a:b].T @ right[a:b]
    return out


def equations_from_products(square: Array, right: Array, precision: Array) -> NormalEquations:
    """Normal equations from the products (P, m + c, m + c) of all columns, nominal ones first, and theirs with the
    value (P, m + c); precision (m,): prior precision of the nominal sizes, as good as a reading of each, of which every
    piece has a part: what a candidate saves them in going there is its own."""
    m, count = len(precision), len(square)
    every = np.arange(count)
    square = square.copy()
    square[:, :m, :m] += np.diag(precision) / count
    base, leaning = _nominal(square.sum(axis=0), right.sum(axis=0), m)
    lean = square[:, :m, :m] @ leaning
    both = square[:, m:, :m] @ leaning
    # Candidate columns with the nominal ones projected out.
    held_square = square[:, m:, m:] - both - leaning.T @ (square[:, :m, m:] - lean)
    held_right = (right[:, m:] - square[:, m:, :m] @ base) - (
        right[:, :m] - square[:, :m, :m] @ base
    ) @ leaning
    own = np.einsum("pii->i", square)[m:]
    telling = np.einsum("pii->i", held_square) > NOTHING_NEW * np.maximum(own, 1e-300)
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
        """The same behind other columns (rows, m)."""
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
        for own in (columns[place] for place in self.places):
            seen = np.flatnonzero(own.any(axis=0))
            parts.append(Block(seen, own[:, seen]))
        return Blocks(tuple(parts), columns.shape[1])

    def beside(self, others: "Blocks") -> "Blocks":
        """These columns, and others of the same rows behind them."""
        parts = [
            Block(np.concatenate([one.of, self.width + other.of]), np.hstack([one.values, other.values]))
            for one, other in zip(self.parts, others.parts, strict=True)
        ]
        return Blocks(tuple(parts), self.width + others.width)

    def dense(self) -> Array:
        """(rows, width)"""
        return self.some(range(self.width))

    def some(self, columns: Sequence[int]) -> Array:
        """(rows, k): some of the columns, each contiguous in memory."""
        places = self.places
        out = np.zeros((len(columns), places[-1].stop))
        for part, place in zip(self.parts, places, strict=True):
            at = {column: i for i, column in enumerate(part.of.tolist())}
            for own, column in zip(out, columns, strict=True):
                if column in at:
                    own[place] = part.values[:, at[column]]
        return out.T

    def after(self, columns: Array) -> "Blocks":
        """The same behind other columns (rows, m)."""
        parts = [part.after(columns[place]) for part, place in zip(self.parts, self.places, strict=True)]
        return Blocks(tuple(parts), columns.shape[1] + self.width)

    def products(self, piece: NDArray[np.intp]) -> Array:
        """(P, width, width): products of the columns within each piece, `piece` (rows,)."""
        out = np.zeros((int(piece.max()) + 1, self.width, self.width))
        for part, place in zip(self.parts, self.places, strict=True):
            out[:, part.of[:, None], part.of] += products_of(part.values, pieces_of(piece[place], len(out)))
        return out

    def crossed(self, others: Array) -> Array:
        """(width, k): the products of the columns with others (rows, k) over all rows."""
        out = np.zeros((self.width, others.shape[1]))
        for part, place in zip(self.parts, self.places, strict=True):
            out[part.of] += part.values.T @ others[place]
        return out

    def products_between(self, others: "Blocks", piece: NDArray[np.intp]) -> Array:
        """(P, width, k): the same with others of the same rows, within each piece."""
        out = np.zeros((int(piece.max()) + 1, self.width, others.width))
        for one, other, place in zip(self.parts, others.parts, self.places, strict=True):
            pieces = pieces_of(piece[place], len(out))
            out[:, one.of[:, None], other.of] += products_of(one.values, pieces, other.values)
        return out

    def products_with(self, others: Array, piece: NDArray[np.intp]) -> Array:
        """(P, width, k): the same with others (rows, k)."""
        out = np.zeros((int(piece.max()) + 1, self.width, others.shape[1]))
        for part, place in zip(self.parts, self.places, strict=True):
            out[:, part.of] += products_of(part.values, pieces_of(piece[place], len(out)), others[place])
        return out
