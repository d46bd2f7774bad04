"""A black box: a small network from velocity and thrust to the missing force. It shrinks the gap and names nothing.

Its inputs exclude time and heading, because their effect differs from dive to dive. It is trained on three quarters
of a dive; the weights of the epoch that predicts the last quarter best are kept.
"""

import numpy as np
import torch
from torch import Tensor, nn

from bench.diagnosis.rivals.said import Said, missing, pushing
from bridge.arrays import Array
from identify.diagnose.nominal import Nominal
from identify.effects.course import Course

HIDDEN = 32
EPOCHS, RATE, DECAY = 300, 1e-2, 1e-3
TAUGHT = 0.75
SEED = 0


def named(nominal: Nominal) -> Said:
    """The missing force as the network has learnt it, without a name."""
    gap = missing(nominal)
    inputs = _inputs(nominal.course)
    centre, spread = inputs.mean(axis=0), np.maximum(inputs.std(axis=0), 1e-6)
    dofs = list(gap.dofs)
    network = _taught(
        torch.tensor(((inputs - centre) / spread)[gap.at], dtype=torch.float32),
        torch.tensor(gap.wrench[:, dofs], dtype=torch.float32),
    )

    def wrench(course: Course) -> Array:
        seen = torch.tensor((_inputs(course) - centre) / spread, dtype=torch.float32)
        out = np.zeros((len(seen), 6))
        with torch.no_grad():
            out[:, dofs] = network(seen).numpy() * gap.std[dofs]
        return out

    return Said((), (pushing("network", wrench),), nominal)


def _inputs(course: Course) -> Array:
    return np.column_stack([course.nu, course.wrench_of(course.thrust_n)])


def _taught(inputs: Tensor, wanted: Tensor) -> nn.Module:
    """Train the network, and return it as of the epoch that predicts the last part of the dive best."""
    taught = round(TAUGHT * len(inputs))
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(SEED)
        last = nn.Linear(HIDDEN, wanted.shape[1])
        network = nn.Sequential(
            nn.Linear(inputs.shape[1], HIDDEN), nn.Tanh(), nn.Linear(HIDDEN, HIDDEN), nn.Tanh(), last
        )
    nn.init.zeros_(last.weight)
    nn.init.zeros_(last.bias)
    optimizer = torch.optim.AdamW(network.parameters(), lr=RATE, weight_decay=DECAY)
    best, kept = float("inf"), {name: value.clone() for name, value in network.state_dict().items()}
    for _ in range(EPOCHS):
        optimizer.zero_grad()
        loss = nn.functional.mse_loss(network(inputs[:taught]), wanted[:taught])
        loss.backward()  # type: ignore[no-untyped-call]
        optimizer.step()
        with torch.no_grad():
            held = float(nn.functional.mse_loss(network(inputs[taught:]), wanted[taught:]))
        if held < best:
            best, kept = held, {name: value.clone() for name, value in network.state_dict().items()}
    network.load_state_dict(kept)
    return network
