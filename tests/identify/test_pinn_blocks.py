"""Block-tridiagonal equations by cyclic reduction come to what the dense matrix does, for any number of nodes."""

import pytest
import torch

from identify.estimators.pinn.blocks import factorise, selected_inverse, solve

NODES = [*range(1, 18), 33]


def tridiagonal(nodes, width=3):
    """A positive definite matrix: its blocks on and above the diagonal, and all of it."""
    draw = torch.Generator().manual_seed(nodes)
    first = torch.randn(nodes, width, width, generator=draw, dtype=torch.float64)
    second = torch.randn(nodes, width, width, generator=draw, dtype=torch.float64)
    rows = torch.zeros(nodes * width, nodes * width, dtype=torch.float64)
    for k in range(nodes):
        here = slice(k * width, (k + 1) * width)
        rows[here, here] = first[k]
        if k + 1 < nodes:
            rows[here, (k + 1) * width : (k + 2) * width] = second[k]
    dense = rows.mT @ rows + torch.eye(nodes * width, dtype=torch.float64)
    blocks = dense.reshape(nodes, width, nodes, width).transpose(1, 2)
    each = torch.arange(nodes)
    return blocks[each, each], blocks[each[:-1], each[1:]], dense


@pytest.mark.parametrize("nodes", NODES)
def test_the_solution_is_that_of_the_dense_matrix(nodes):
    diagonal, above, dense = tridiagonal(nodes)
    right = torch.arange(nodes * 3 * 2, dtype=torch.float64).sin().reshape(nodes, 3, 2)
    found = solve(factorise(diagonal, above), right)
    torch.testing.assert_close(found.flatten(0, 1), torch.linalg.solve(dense, right.flatten(0, 1)))


@pytest.mark.parametrize("nodes", NODES)
def test_the_log_determinant_is_that_of_the_dense_matrix(nodes):
    diagonal, above, dense = tridiagonal(nodes)
    torch.testing.assert_close(factorise(diagonal, above).log_det, torch.linalg.slogdet(dense).logabsdet)


@pytest.mark.parametrize("nodes", NODES)
def test_the_selected_inverse_holds_the_blocks_of_the_dense_one(nodes):
    diagonal, above, dense = tridiagonal(nodes)
    inverse = torch.linalg.inv(dense).reshape(nodes, 3, nodes, 3).transpose(1, 2)
    each = torch.arange(nodes)
    on, beside = selected_inverse(factorise(diagonal, above))
    torch.testing.assert_close(on, inverse[each, each])
    torch.testing.assert_close(beside, inverse[each[:-1], each[1:]])


@pytest.mark.parametrize("nodes", NODES)
def test_many_nodes_by_stretches_come_to_the_same(nodes, monkeypatch):
    diagonal, above, dense = tridiagonal(nodes)
    monkeypatch.setattr("identify.estimators.pinn.blocks.AT_A_TIME", 3)
    inverse = torch.linalg.inv(dense).reshape(nodes, 3, nodes, 3).transpose(1, 2)
    each = torch.arange(nodes)
    factor = factorise(diagonal, above)
    on, beside = selected_inverse(factor)
    torch.testing.assert_close(factor.log_det, torch.linalg.slogdet(dense).logabsdet)
    torch.testing.assert_close(on, inverse[each, each])
    torch.testing.assert_close(beside, inverse[each[:-1], each[1:]])


def test_what_is_given_is_left_as_it_was():
    diagonal, above, _ = tridiagonal(9)
    kept, right = diagonal.clone(), torch.ones(9, 3, 1, dtype=torch.float64)
    solve(factorise(diagonal, above), right)
    assert torch.equal(diagonal, kept)
    assert torch.equal(right, torch.ones_like(right))


def test_a_matrix_that_is_not_positive_definite_is_refused():
    diagonal, above, _ = tridiagonal(5)
    with pytest.raises(torch.linalg.LinAlgError):
        factorise(-diagonal, above)
