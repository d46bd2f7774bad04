"""Processes the intervals of a dive in stretches that fit a core's cache, on several cores."""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

import torch

T = TypeVar("T")

AT_A_TIME = 1024
"""Intervals per stretch on a processor: shorter stretches cost more in calls than they save in memory. A card takes
all at once."""

MOST_CORES = 4
"""The work between the stretches runs on one core alone: more cores than these would wait for it."""


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
    """Stretches that cover `count` intervals, in order."""
    each = AT_A_TIME if device.type == "cpu" else max(count, 1)
    ends = [(start, min(start + each, count)) for start in range(0, count, each)]
    return [Stretch(slice(start, stop), slice(start + 1, stop + 1)) for start, stop in ends]


def worked(work: Callable[[Stretch], T], over: list[Stretch]) -> list[T]:
    """Results of `work` for each stretch, in order."""
    if len(over) == 1:
        return [work(over[0])]
    with ThreadPoolExecutor(max_workers=min(_cores(), MOST_CORES)) as pool:
        return list(pool.map(work, over))


def _cores() -> int:
    """Number of cores that numerical libraries may use: OMP_NUM_THREADS, or all."""
    setting = os.environ.get("OMP_NUM_THREADS", "")
    return int(setting) if setting.isdecimal() and int(setting) > 0 else (os.cpu_count() or 1)
