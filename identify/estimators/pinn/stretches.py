"""The intervals of a dive, worked through by stretches that fit a core's cache, on as many cores as there are."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

import torch

T = TypeVar("T")

AT_A_TIME = 1024
"""Intervals of a stretch on a processor: fewer cost more in calls than they save in memory. A card takes them all."""

MOST_CORES = 4
"""What comes between the stretches keeps one core busy alone: more than these would wait for it."""


@dataclass(frozen=True)
class Stretch:
    """Some intervals: `before` and `after` are the nodes at their two ends, `nodes` both."""

    before: slice
    after: slice

    @property
    def intervals(self) -> slice:
        return self.before

    @property
    def nodes(self) -> slice:
        return slice(self.before.start, self.after.stop)


def stretches(count: int, device: torch.device) -> list[Stretch]:
    """All of `count` intervals, in order."""
    each = AT_A_TIME if device.type == "cpu" else max(count, 1)
    ends = [(start, min(start + each, count)) for start in range(0, count, each)]
    return [Stretch(slice(start, stop), slice(start + 1, stop + 1)) for start, stop in ends]


def worked(work: Callable[[Stretch], T], over: list[Stretch]) -> list[T]:
    """What `work` makes of each stretch, in their order."""
    if len(over) == 1:
        return [work(over[0])]
    with ThreadPoolExecutor(max_workers=min(_cores(), MOST_CORES)) as pool:
        return list(pool.map(work, over))


def _cores() -> int:
    """As many as numerical libraries may use: OMP_NUM_THREADS, or all."""
    said = os.environ.get("OMP_NUM_THREADS", "")
    return int(said) if said.isdecimal() and int(said) > 0 else (os.cpu_count() or 1)
