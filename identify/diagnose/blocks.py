"""Columns of a regression most of which are zero on most rows: what pushes one axis shows in that axis alone."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np
from numpy.typing import NDArray

from identify.diagnose.evidence import pieces_of, products_of

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Block:
    """Some rows one after another. values (rows, k): those of their columns `of` (k,) that are not zero."""

    of: NDArray[np.intp]
    values: Array

    def after(self, columns: Array) -> "Block":
        """The same with other columns (rows, m) before its own."""
        seen = np.flatnonzero(columns.any(axis=0))
        return Block(
            np.concatenate([seen, columns.shape[1] + self.of]), np.hstack([columns[:, seen], self.values])
        )


@dataclass(frozen=True)
class Blocks:
    """Blocks one below another, of `width` columns together."""

    parts: tuple[Block, ...]
    width: int

    @property
    def places(self) -> list[slice]:
        """Where among the rows each stands."""
        ends = [0, *accumulate(len(part.values) for part in self.parts)]
        return [slice(a, b) for a, b in pairwise(ends)]

    def dense(self) -> Array:
        """(rows, width)"""
        return self.some(range(self.width))

    def some(self, columns: Sequence[int]) -> Array:
        """(rows, k): some of the columns, each one's rows one after another in memory."""
        places = self.places
        out = np.zeros((len(columns), places[-1].stop))
        for part, place in zip(self.parts, places, strict=True):
            at = {column: i for i, column in enumerate(part.of.tolist())}
            for own, column in zip(out, columns, strict=True):
                if column in at:
                    own[place] = part.values[:, at[column]]
        return out.T

    def after(self, columns: Array) -> "Blocks":
        """The same with other columns (rows, m) before their own."""
        parts = [part.after(columns[place]) for part, place in zip(self.parts, self.places, strict=True)]
        return Blocks(tuple(parts), columns.shape[1] + self.width)

    def products(self, piece: NDArray[np.intp]) -> Array:
        """(P, width, width): the products of the columns within each piece that rows lie in, `piece` (rows,)."""
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

    def products_with(self, others: Array, piece: NDArray[np.intp]) -> Array:
        """(P, width, k): the same with others (rows, k)."""
        out = np.zeros((int(piece.max()) + 1, self.width, others.shape[1]))
        for part, place in zip(self.parts, self.places, strict=True):
            out[:, part.of] += products_of(part.values, pieces_of(piece[place], len(out)), others[place])
        return out
