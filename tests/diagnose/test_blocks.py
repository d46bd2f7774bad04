"""Columns that only some rows show are the same columns, and have the same products, as all rows with their zeros."""

import numpy as np
import pytest

from identify.diagnose.evidence import (
    Block,
    Blocks,
    equations_of,
    inverse,
    pieces_of,
    products_of,
    projected_out,
)

PIECE = np.concatenate([np.repeat(np.arange(4), 25), np.repeat(np.arange(4), 15)])


@pytest.fixture
def blocks():
    rng = np.random.default_rng(100_001)
    first = Block(np.array([0, 2]), rng.normal(size=(100, 2)))
    return Blocks((first, Block(np.array([1, 2, 4]), rng.normal(size=(60, 3)))), 5)


def test_a_column_is_zero_where_no_block_has_it(blocks):
    dense = blocks.dense()
    np.testing.assert_array_equal(dense[:100, 2], blocks.parts[0].values[:, 1])
    np.testing.assert_array_equal(dense[100:, 4], blocks.parts[1].values[:, 2])
    assert not dense[:100, 1].any()
    assert not dense[:, 3].any()


def test_products_within_pieces_are_those_of_all_rows(blocks):
    pieces = pieces_of(PIECE)
    np.testing.assert_allclose(blocks.products(PIECE), products_of(blocks.dense(), pieces), atol=1e-12)
    others = np.random.default_rng(100_002).normal(size=(160, 3))
    together = products_of(blocks.dense(), pieces, others)
    np.testing.assert_allclose(blocks.products_with(others, PIECE), together, atol=1e-12)


def test_some_columns_and_products_over_all_rows_are_those_of_all_rows(blocks):
    np.testing.assert_array_equal(blocks.some([4, 2]), blocks.dense()[:, [4, 2]])
    others = np.random.default_rng(100_004).normal(size=(160, 2))
    np.testing.assert_allclose(blocks.crossed(others), blocks.dense().T @ others, atol=1e-12)


def test_columns_put_after_others_come_last_and_leave_these_as_they_are(blocks):
    before = np.zeros((160, 2))
    before[:100, 1] = 3.0
    both = blocks.blocks_of(before).beside(blocks)
    np.testing.assert_array_equal(both.dense(), np.hstack([before, blocks.dense()]))
    assert 1 not in both.parts[1].of


def test_sums_of_columns_and_their_squares_are_those_of_all_rows(blocks):
    dense, by = blocks.dense(), np.zeros((5, 2))
    by[0, 0], by[2, 0], by[4, 1] = 2.0, -1.0, 3.0
    np.testing.assert_allclose(blocks.times(by), dense @ by, atol=1e-12)
    np.testing.assert_allclose(blocks.combined(by).dense(), dense @ by, atol=1e-12)
    np.testing.assert_allclose(blocks.square(), dense.T @ dense, atol=1e-12)
    # The second block alone has the fifth column, and so its multiple.
    assert 1 not in blocks.combined(by).parts[0].of


def test_columns_projected_out_one_after_another_or_together_leave_the_same():
    """Frisch and Waugh (1933), within each piece."""
    rng = np.random.default_rng(100_005)
    rows, piece = rng.normal(size=(160, 7)), np.repeat(np.arange(8), 20)
    products = products_of(rows, pieces_of(piece))
    together = equations_of(rows[:, 6], rows[:, :4], np.zeros(4), rows[:, 4:6], piece)
    first = projected(products, 2)
    second = projected(first, 2)
    np.testing.assert_allclose(second[:, :2, :2], together.held_square, atol=1e-5)
    np.testing.assert_allclose(second[:, :2, 2], together.held_right, atol=1e-5)


def projected(products: np.ndarray, k: int) -> np.ndarray:
    known, cross = products[:, :k, :k], products[:, :k, k:]
    by = cross, inverse(known.sum(axis=0)) @ cross.sum(axis=0)
    return projected_out(products[:, k:, k:], known, by, by)


def test_products_are_summed_over_all_stretches_of_a_piece():
    columns = np.random.default_rng(100_003).normal(size=(160, 2))
    by_piece = [columns[k == PIECE].T @ columns[k == PIECE] for k in range(4)]
    np.testing.assert_allclose(products_of(columns, pieces_of(PIECE)), by_piece, atol=1e-12)
