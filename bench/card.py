"""The source paper's full network on a CUDA card: our training step against the same network in plain eager PyTorch.

Ours runs LSTM and head in bfloat16 while Adam works on master weights in float32 (Micikevicius et al. 2018, section
3.1; losses stay in float32, the physics in float64), updates with one fused kernel, and replays the whole step as one
CUDA graph, so that nothing waits for Python. Plain is the loop of `identify.estimators.paper.train` on the card.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import torch
from torch import Tensor

from bench.remembered import Data
from bridge.vehicle.config import Configuration
from identify.estimators.paper import PaperOptions, data_loss, inverse_softplus, physics_loss, tensors
from identify.estimators.paper_network import PaperNetwork
from identify.estimators.paper_physics import Samples, fixed_values, starting_values

TIMED_STEPS, WARM_STEPS, COMPARED_STEPS = 50, 5, 20
ALIKE = 0.02
"""The two steps' losses may differ by this share: bfloat16 keeps eight bits."""

DATASHEET_BF16 = {
    "H200": 989e12, "H100 PCIe": 756e12, "H100": 989e12, "A100": 312e12, "L40S": 362e12, "L4": 121e12, "A10": 125e12,
}  # fmt: skip
"""Dense bfloat16 FLOP/s by NVIDIA's data sheets; a card that is not here is told by its own matrix product alone."""

MATRIX = 8192
NO_CARD = (
    "No CUDA card was found where this page was made, so the row of the full network on a GPU is left out."
)


Step = Callable[[Tensor], Tensor]


@dataclass(frozen=True)
class Trainer:
    """The paper's network with its parameters and optimiser, on one device.

    The network computes in its own type; `masters` are its weights as Adam sees them, the very same tensors where that
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
        """One update on the samples `rows` (batch,); the network's own loss, mean |v_hat - v|^2, before it."""
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
) -> Trainer:
    """A trainer on the device of `series`, computing in `dtype`; the same weights for the same seed."""
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
    groups = [
        {"params": masters, "lr": options.learning_rate},
        {"params": [raw], "lr": options.physical_rate},
    ]
    if device.type == "cuda" and dtype != torch.float32:
        optimiser = torch.optim.Adam(groups, fused=True, capturable=True)
    else:
        optimiser = torch.optim.Adam(groups)
    return Trainer(
        network,
        masters,
        raw,
        optimiser,
        series,
        ends,
        torch.arange(1 - options.window, 1, device=device),
        tuple(t.to(device) for t in tensors(data)),
        data,
        fixed_values(configuration),
        options.alpha,
    )


def captured(one: Trainer, batch: int) -> Step:
    """The trainer's step as a CUDA graph; its weights begin again where they were before the capture."""
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
    """A training step's floating-point operations a sample: two a weight forward, four backward, the LSTM's `window`
    times. Adam's are left out.
    """
    recurrent = sum(p.numel() for p in network.lstm.parameters())
    head = sum(p.numel() for p in network.head.parameters())
    return 6 * (recurrent * window + head)


def losses(step: Step, batches: list[Tensor]) -> list[float]:
    """The loss of each step."""
    return [float(step(rows)) for rows in batches]


def furthest_apart(plain: list[float], ours: list[float]) -> float:
    """The largest relative difference of two rows of losses."""
    return max(abs(b - a) / abs(a) for a, b in zip(plain, ours, strict=True))


def measured(
    series: Tensor, ends: Tensor, data: Samples, configuration: Configuration, options: PaperOptions
) -> Data:
    """Samples per second of both steps on the card, their shares of its peak, and how far their losses part."""
    device = torch.device("cuda")
    series, ends = series.to(device), ends.to(device)
    order = torch.Generator(device="cpu").manual_seed(options.seed)
    batches = [
        torch.randint(len(ends), (options.batch,), generator=order).to(device) for _ in range(TIMED_STEPS)
    ]
    still = replace(options, dropout=0.0)
    rates, shown = {}, {}
    kinds: tuple[tuple[str, torch.dtype, Callable[[Trainer], Step]], ...] = (
        ("plain", torch.float32, lambda one: one.step),
        ("ours", torch.bfloat16, lambda one: captured(one, options.batch)),
    )
    for name, dtype, ready in kinds:
        alike = trainer(series, ends, data, configuration, still, dtype)
        shown[name] = losses(ready(alike), batches[:COMPARED_STEPS])
        one = trainer(series, ends, data, configuration, options, dtype)
        rates[name] = _rate(ready(one), batches)
        flops = flops_a_sample(one.network, options.window)
        weights = sum(p.numel() for p in one.network.parameters())
    return {
        "card": torch.cuda.get_device_name(),
        "torch": str(torch.__version__),
        "weights": weights,
        "flops": flops,
        "samples_s": rates,
        "apart": furthest_apart(shown["plain"], shown["ours"]),
        "matrix_flops": _matrix_flops(device),
    }


def lines(data: Data) -> list[str]:
    """The card's part of the page."""
    card, flops, rates = data["card"], data["flops"], data["samples_s"]
    sheet = next((peak for name, peak in DATASHEET_BF16.items() if name in card), None)
    rows = ["| the full network on a GPU | samples/s | TFLOP/s | of its matrix product | of its data sheet |"]
    rows.append("|---|---|---|---|---|")
    for name, title in (
        ("plain", "plain eager PyTorch, float32"),
        ("ours", "ours: bfloat16, one CUDA graph"),
    ):
        done = flops * rates[name]
        told = f"{100 * done / sheet:.0f} %" if sheet else "-"
        rows.append(
            f"| {title} | {rates[name]:.0f} | {done / 1e12:.1f} | {100 * done / data['matrix_flops']:.0f} % | {told} |"
        )
    same = "the same within" if data["apart"] <= ALIKE else "NOT the same within"
    return [
        *rows,
        "",
        f"Run on one {card}, torch {data['torch']}: {data['weights'] / 1e6:.1f} M weights, {flops / 1e9:.2f} GFLOP",
        f"a sample. Ours is {rates['ours'] / rates['plain']:.1f} times plain; over {COMPARED_STEPS} steps without",
        f"dropout the network's losses are {same} {100 * ALIKE:.0f} % ({100 * data['apart']:.2g} %). The matrix",
        f"product is one of {MATRIX} x {MATRIX} in bfloat16, {data['matrix_flops'] / 1e12:.0f} TFLOP/s.",
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
