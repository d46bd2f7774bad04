"""Removes copies of a message that come right behind it.

Where several programs publish the same reading, or a relay sends it on several ways, a log holds each several times
over within a few milliseconds. By its median interval such a signal comes hundreds of times faster than anything was
read.

Chance and a coarse resolution repeat readings, too, but never nearly all of them equally often; a coarse sensor's that
are handed on in bursts differ within a burst as often as between two.
"""

from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from identify.dive import BETWEEN_BURSTS, BURST, Dive, Signal
from identify.words import listed

LEAST_SHARE: Final = 0.8
"""Least share of runs of equal values that have the same length: lost readings and chance make a few others."""
FEWEST_RUNS: Final = 20
MOST_CHANGES: Final = 0.2
"""Largest share of samples that differ from one right before, over that of the others: more are readings in bursts."""


def without_copies(dive: Dive) -> Dive:
    """The dive with the first of each reading alone where a signal holds it several times over, and a note."""
    kept: dict[str, Any] = {}
    times: dict[str, float] = {}
    for name, signal in dive.signals().items():
        copies = _copies(signal)
        if not come_equally_often(np.flatnonzero(~copies), len(signal)):
            continue
        kept[name] = Signal(signal.time_s[~copies], signal.value[~copies])
        times[name] = len(signal) / len(kept[name])
    if not kept:
        return dive
    named = listed([f"{name} {count:.2g} times" for name, count in times.items()])
    note = (
        f"The recording holds each reading several times over, one right behind the other ({named}), as where several "
        "programs send it: only the first of each is taken for a reading."
    )
    return replace(dive, **kept, notes=(*dive.notes, note))


def come_equally_often(first: NDArray[np.intp], count: int) -> bool:
    """Whether most of `count` repeated samples come in runs of one length above 1, or of one more; `first`:
    where each run begins. The rate of readings need not divide that at which they are sent.
    """
    lengths = np.diff(first, append=count)
    if len(first) < FEWEST_RUNS or np.mean(lengths > 1) <= LEAST_SHARE:
        return False
    usual = int(np.median(lengths))
    share = max(np.mean((lengths == usual + by) | (lengths == usual + by + 1)) for by in (-1, 0))
    return bool(share > LEAST_SHARE)


def _copies(signal: Signal) -> NDArray[np.bool_]:
    """Samples (n,) that repeat the one before and come much sooner than readings do."""
    if len(signal) < 2:
        return np.zeros(len(signal), np.bool_)
    steps_s = np.diff(signal.time_s)
    before, after = signal.value[:-1], signal.value[1:]
    same = ((before == after) | (np.isnan(before) & np.isnan(after))).all(axis=1)
    soon = steps_s < BURST * np.quantile(steps_s, BETWEEN_BURSTS)
    if soon.any() and np.mean(~same[soon]) > MOST_CHANGES * np.mean(~same[~soon]):
        return np.zeros(len(signal), np.bool_)
    return np.concatenate([[False], same & soon])
