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


def test_operations_are_two_a_weight_forward_and_four_backward() -> None:
    network = PaperNetwork(16, 2, 0.0)
    lstm = sum(p.numel() for p in network.lstm.parameters())
    head = sum(
        p.numel() for layer in network.head if isinstance(layer, nn.Linear) for p in layer.parameters()
    )
    assert card.flops_a_sample(network, 20) == 6 * (20 * lstm + head)
