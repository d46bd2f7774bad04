"""The network of the source paper (Vangi et al., Table 1, Fig. 3): LSTM, two linear layers, a Tanh between."""

from collections.abc import Iterator
from contextlib import contextmanager

import torch
from torch import Tensor, nn

INPUTS, OUTPUTS = 7, 6


class PaperNetwork(nn.Module):
    """Maps a window of time steps and velocities (batch, window, 7) to the velocity at its last sample, (batch, 6).

    Table 1: LSTM 5 levels of 1024; linear 1024 to 512, dropout 0.2; Tanh; linear 512 to 6, dropout 0.2.
    """

    def __init__(self, hidden: int, depth: int, dropout: float) -> None:
        super().__init__()
        self.lstm = nn.LSTM(INPUTS, hidden, num_layers=depth, batch_first=True)
        self.head = nn.Sequential(
            nn.Linear(hidden, hidden // 2),
            nn.Dropout(dropout),
            nn.Tanh(),
            nn.Linear(hidden // 2, OUTPUTS),
            nn.Dropout(dropout),
        )

    def forward(self, windows: Tensor) -> Tensor:
        states, _ = self.lstm(windows)
        predicted: Tensor = self.head(states[:, -1])
        return predicted


@contextmanager
def repeatable(seed: int, threads: int) -> Iterator[None]:
    """Context in which the same seed gives the same numbers; torch's settings are restored afterwards."""
    threads_before = torch.get_num_threads()
    strict_before = torch.are_deterministic_algorithms_enabled()
    torch.set_num_threads(threads)
    torch.use_deterministic_algorithms(True)
    try:
        with torch.random.fork_rng():
            torch.manual_seed(seed)
            yield
    finally:
        torch.use_deterministic_algorithms(strict_before)
        torch.set_num_threads(threads_before)
