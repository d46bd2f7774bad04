"""The source paper's full network on a CUDA card: our training step against the same network in plain eager PyTorch.

Ours runs LSTM and head in bfloat16 while Adam works on master weights in float32 (Micikevicius et al. 2018, section
3.1; losses stay in float32, the physics in float64), updates with one fused kernel, and replays the whole step as one
CUDA graph, so that nothing waits for Python. Plain is the loop of `bench.reproduce.paper.train` on the card.
Eager bfloat16 is that loop with our types, which separates the gain by precision from the gain by the graph.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import torch
from torch import Tensor

from bench.remembered import Data
from bench.reproduce.paper import (
    PaperNetwork,
    PaperOptions,
    Samples,
    data_loss,
    fixed_values,
    inverse_softplus,
    physics_loss,
    starting_values,
    tensors,
)
from bench.words import paragraph, table
from bridge.vehicle.config import Configuration

TIMED_STEPS, WARM_STEPS, COMPARED_STEPS = 50, 5, 20
ALIKE = 0.02
"""Largest relative difference between the two steps' losses: bfloat16 keeps eight bits."""

DATASHEET_BF16 = {
    "H200": 989e12, "H100 PCIe": 756e12, "H100": 989e12, "A100": 312e12, "L40S": 362e12, "L4": 121e12, "A10": 125e12,
}  # fmt: skip
"""Dense bfloat16 FLOP/s by NVIDIA's data sheets; a card that is not listed is compared only with its own matrix
product."""

MATRIX = 8192
NO_CARD = (
    "No CUDA card was found where this page was made, so the row of the full network on a GPU is left out."
)


Step = Callable[[Tensor], Tensor]
Adam = Callable[[list[dict[str, Any]]], torch.optim.Optimizer]


@dataclass(frozen=True)
class Trainer:
    """The paper's network with its parameters and optimiser, on one device.

    The network computes in its own type; `masters` are its weights as Adam sees them, the same tensors if that type
    is float32.
    """

    network: PaperNetwork
    masters: list[Tensor]
    raw: Tensor
    optimiser: torch.optim.Optimizer
    series: Tensor
    ends: Tensor
    back: Tensor
    physics: tuple[Tensor, ...]
    data: Samples
    fixed: dict[str, float]
    alpha: float

    def step(self, rows: Tensor) -> Tensor:
        """Update on the samples `rows` (batch,); return the network's own loss before it, mean |v_hat - v|^2."""
        windows = self.series[self.ends[rows][:, None] + self.back]
        weights = list(self.network.parameters())
        predicted = self.network(windows.to(weights[0].dtype))
        l_data = data_loss(predicted.float(), windows[:, -1, 1:])
        l_physics = physics_loss(self.raw, self.fixed, self.data, self.physics, rows)
        self.network.zero_grad(set_to_none=True)
        self.raw.grad = None
        torch.autograd.backward(l_physics + self.alpha * l_data.double())
        for master, weight in zip(self.masters, weights, strict=True):
            if master is not weight and weight.grad is not None:
                master.grad = weight.grad.float()
        self.optimiser.step()
        with torch.no_grad():
            for master, weight in zip(self.masters, weights, strict=True):
                if master is not weight:
                    weight.copy_(master)
        return l_data.detach()


def trainer(
    series: Tensor,
    ends: Tensor,
    data: Samples,
    configuration: Configuration,
    options: PaperOptions,
    dtype: torch.dtype,
    adam: Adam = torch.optim.Adam,
) -> Trainer:
    """A trainer on the device of `series`, computing in `dtype`; the same seed gives the same weights."""
    device = series.device
    torch.manual_seed(options.seed)
    network = PaperNetwork(options.hidden, options.depth, options.dropout).to(device)
    masters: list[Tensor] = list(network.parameters())
    if dtype != torch.float32:
        masters = [weight.detach().clone() for weight in masters]
        network = network.to(dtype)
    start = starting_values(configuration, data.dofs)
    raw = inverse_softplus(torch.tensor([start[name] for name in data.names], dtype=torch.float64)).to(device)
    raw.requires_grad_(True)
    groups: list[dict[str, Any]] = [
        {"params": masters, "lr": options.learning_rate},
        {"params": [raw], "lr": options.physical_rate},
    ]
    return Trainer(
        network,
        masters,
        raw,
        adam(groups),
        series,
        ends,
        torch.arange(1 - options.window, 1, device=device),
        tuple(t.to(device) for t in tensors(data)),
        data,
        fixed_values(configuration),
        options.alpha,
    )


def eager(one: Trainer, _batch: int) -> Step:
    """The trainer's step as Python runs it, operation by operation."""
    return one.step


def captured(one: Trainer, batch: int) -> Step:
    """The trainer's step as a CUDA graph; the weights are reset to their values before the capture."""
    kept = [*one.masters, *one.network.parameters(), one.raw]
    before = [value.detach().clone() for value in kept]
    rows = torch.arange(batch, device=one.series.device)
    side = torch.cuda.Stream()  # type: ignore[no-untyped-call]
    side.wait_stream(torch.cuda.current_stream())
    with torch.cuda.stream(side):
        for _ in range(WARM_STEPS):
            one.step(rows)
    torch.cuda.current_stream().wait_stream(side)
    graph = torch.cuda.CUDAGraph()
    with torch.cuda.graph(graph):
        loss = one.step(rows)
    with torch.no_grad():
        for value, was in zip(kept, before, strict=True):
            value.copy_(was)
        for state in one.optimiser.state.values():
            for moment in state.values():
                moment.zero_()

    def replay(chosen: Tensor) -> Tensor:
        rows.copy_(chosen)
        graph.replay()
        return loss.clone()

    return replay


def flops_a_sample(network: PaperNetwork, window: int) -> int:
    """Floating-point operations of a training step per sample: per weight two forward and four backward, `window`
    times in the LSTM. Adam's are not counted."""
    recurrent = sum(p.numel() for p in network.lstm.parameters())
    head = sum(p.numel() for p in network.head.parameters())
    return 6 * (recurrent * window + head)


def losses(step: Step, batches: list[Tensor]) -> list[float]:
    """The loss of each step."""
    return [float(step(rows)) for rows in batches]


def furthest_apart(plain: list[float], ours: list[float]) -> float:
    """The largest relative difference between two series of losses."""
    return max(abs(b - a) / abs(a) for a, b in zip(plain, ours, strict=True))


PLAIN, EAGER_BF16, OURS = "plain", "eager bfloat16", "ours"


@dataclass(frozen=True)
class Kind:
    """A way to train: the type of the computation, the optimiser, and the function that prepares a trainer's step."""

    name: str
    title: str
    dtype: torch.dtype
    adam: Adam
    ready: Callable[[Trainer, int], Step]


KINDS = (
    Kind(PLAIN, "plain eager PyTorch, float32", torch.float32, torch.optim.Adam, eager),
    Kind(EAGER_BF16, "the same in bfloat16, float32 masters", torch.bfloat16, torch.optim.Adam, eager),
    Kind(
        OURS,
        "ours: bfloat16, float32 masters, fused update, one CUDA graph",
        torch.bfloat16,
        partial(torch.optim.Adam, fused=True, capturable=True),
        captured,
    ),
)


def measured(
    series: Tensor, ends: Tensor, data: Samples, configuration: Configuration, options: PaperOptions
) -> Data:
    """Samples per second of each step on the card, the card's own peak, and how far the losses deviate from plain's."""
    device = torch.device("cuda")
    series, ends = series.to(device), ends.to(device)
    order = torch.Generator(device="cpu").manual_seed(options.seed)
    batches = [
        torch.randint(len(ends), (options.batch,), generator=order).to(device) for _ in range(TIMED_STEPS)
    ]
    still = replace(options, dropout=0.0)
    rates, shown = {}, {}
    for kind in KINDS:
        alike = trainer(series, ends, data, configuration, still, kind.dtype, kind.adam)
        shown[kind.name] = losses(kind.ready(alike, options.batch), batches[:COMPARED_STEPS])
        timed = trainer(series, ends, data, configuration, options, kind.dtype, kind.adam)
        rates[kind.name] = _rate(kind.ready(timed, options.batch), batches)
        flops = flops_a_sample(timed.network, options.window)
        weights = sum(p.numel() for p in timed.network.parameters())
    return {
        "card": torch.cuda.get_device_name(),
        "torch": str(torch.__version__),
        "weights": weights,
        "flops": flops,
        "samples_s": rates,
        "apart": {name: furthest_apart(shown[PLAIN], row) for name, row in shown.items() if name != PLAIN},
        "matrix_flops": _matrix_flops(device),
    }


def lines(data: Data) -> list[str]:
    """The page's part on the card."""
    card, flops, rates = data["card"], data["flops"], data["samples_s"]
    sheet = next((peak for name, peak in DATASHEET_BF16.items() if name in card), None)
    rows = []
    for kind in KINDS:
        done = flops * rates[kind.name]
        of_sheet = f"{100 * done / sheet:.0f} %" if sheet else "-"
        of_product = f"{100 * done / data['matrix_flops']:.0f} %"
        rows.append((kind.title, f"{rates[kind.name]:.0f}", f"{done / 1e12:.1f}", of_product, of_sheet))
    whole, precision = rates[OURS] / rates[PLAIN], rates[EAGER_BF16] / rates[PLAIN]
    apart = max(data["apart"].values())
    same = "the same within" if apart <= ALIKE else "NOT the same within"
    head = "the full network on a GPU", "samples/s", "TFLOP/s", "of its matrix product", "of its data sheet"
    return [
        *table(head, rows),
        "",
        *paragraph(
            f"Run on one {card}, torch {data['torch']}: {data['weights'] / 1e6:.1f} M weights, {flops / 1e9:.2f}",
            f"GFLOP a sample. Ours is {whole:.1f} times plain in float32: {precision:.1f} times by bfloat16 alone,",
            f"{whole / precision:.1f} times by the graph and the fused update. Over {COMPARED_STEPS} steps without",
            f"dropout the network's losses in bfloat16 are {same} {100 * ALIKE:.0f} % of plain's",
            f"({100 * apart:.2g} %). The matrix product is one of {MATRIX} x {MATRIX} in bfloat16,",
            f"{data['matrix_flops'] / 1e12:.0f} TFLOP/s.",
        ),
        "",
    ]


def _rate(step: Step, batches: list[Tensor]) -> float:
    """Samples per second."""
    for rows in batches[:WARM_STEPS]:
        step(rows)
    torch.cuda.synchronize()
    begun = time.perf_counter()
    for rows in batches:
        step(rows)
    torch.cuda.synchronize()
    return sum(len(rows) for rows in batches) / (time.perf_counter() - begun)


def _matrix_flops(device: torch.device) -> float:
    """FLOP/s of the card's own product of two large bfloat16 matrices."""
    a = torch.randn(MATRIX, MATRIX, device=device, dtype=torch.bfloat16)
    for _ in range(3):
        a @ a
    torch.cuda.synchronize()
    begun = time.perf_counter()
    for _ in range(TIMED_STEPS):
        a @ a
    torch.cuda.synchronize()
    return TIMED_STEPS * 2 * MATRIX**3 / (time.perf_counter() - begun)
