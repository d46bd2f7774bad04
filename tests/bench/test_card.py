"""The training step for a CUDA card, as far as a processor can tell."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import nn

from bench import card
from bench.reproduce.paper import SMALL, PaperNetwork, Samples
from bridge.vehicle.config import load_vehicle

SHAPE = load_vehicle("ruvifist:survey").vehicle.configurations["survey"]
OPTIONS = replace(SMALL, window=5, dropout=0.0)
FOUND = {
    "card": "NVIDIA H200", "torch": "2.13.0", "weights": 38_300_000, "flops": 4_600_000_000,
    "samples_s": {"plain": 5_000.0, "eager bfloat16": 20_000.0, "ours": 50_000.0},
    "apart": {"eager bfloat16": 0.003, "ours": 0.004}, "matrix_flops": 700e12,
}  # fmt: skip


def _trainer(dtype: torch.dtype) -> card.Trainer:
    rng = np.random.default_rng(0)
    nu = 0.1 * rng.standard_normal((60, 6))
    data = Samples(nu[4:], np.zeros((56, 6)), 40.0 * nu[4:], np.zeros((56, 6)), (0, 5))
    series = torch.tensor(np.column_stack([np.full(60, 0.1), nu]), dtype=torch.float32)
    return card.trainer(series, torch.arange(4, 60), data, SHAPE, OPTIONS, dtype)


@pytest.mark.soak
def test_bfloat16_with_master_weights_trains_as_float32_does() -> None:
    batches = list(torch.split(torch.arange(56), 14)) * 5
    plain = card.losses(_trainer(torch.float32).step, batches)
    ours = card.losses(_trainer(torch.bfloat16).step, batches)
    assert card.furthest_apart(plain, ours) < card.ALIKE
    assert plain[-1] < 0.9 * plain[0]


@pytest.mark.parametrize("kind", [kind for kind in card.KINDS if kind.ready is card.eager])
def test_what_is_compared_without_a_graph_takes_a_step(kind: card.Kind) -> None:
    one = _trainer(kind.dtype)
    assert type(one.optimiser) is kind.adam
    first, second = (float(kind.ready(one, 14)(torch.arange(14))) for _ in range(2))
    assert second < first


def test_small_updates_are_kept_in_the_masters() -> None:
    one = _trainer(torch.bfloat16)
    before = [master.clone() for master in one.masters]
    one.step(torch.arange(14))
    assert all(weight.dtype == torch.bfloat16 for weight in one.network.parameters())
    for master, was, weight in zip(one.masters, before, one.network.parameters(), strict=True):
        assert not torch.equal(master, was)
        assert torch.equal(weight, master.bfloat16())


def test_the_masters_of_float32_are_the_weights_themselves() -> None:
    one = _trainer(torch.float32)
    assert all(m is w for m, w in zip(one.masters, one.network.parameters(), strict=True))


def test_operations_are_two_a_weight_forward_and_four_backward() -> None:
    network = PaperNetwork(16, 2, 0.0)
    lstm = sum(p.numel() for p in network.lstm.parameters())
    head = sum(
        p.numel() for layer in network.head if isinstance(layer, nn.Linear) for p in layer.parameters()
    )
    assert card.flops_a_sample(network, 20) == 6 * (20 * lstm + head)


def test_the_page_names_the_card_and_its_shares() -> None:
    page = "\n".join(card.lines(FOUND))
    assert "NVIDIA H200" in page
    assert "| the same in bfloat16, float32 masters | 20000 | 92.0 | 13 % | 9 % |" in page
    assert "| 50000 | 230.0 | 33 % | 23 % |" in page
    assert "the same within 2 %" in " ".join(page.split())
