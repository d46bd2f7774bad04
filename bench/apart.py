"""How far apart the two methods of `identify` are on the drawn missions, and how often that would be a disagreement."""

import math
from collections.abc import Sequence

import numpy as np

from bench.accuracy_trials import Stated, Trial
from bench.words import paragraph
from identify.comparison import LEAST_DIFFERENCE
from identify.comparison import apart as beyond_intervals
from identify.estimators.table import SIDE_BY_SIDE


def distances(trials: Sequence[Trial]) -> dict[int, list[float]]:
    """Distances over the larger standard error, by seed that both methods answered, of all coefficients that both
    state."""
    return {seed: [_distance(*pair) for pair in pairs] for seed, pairs in _pairs(trials).items()}


def _pairs(trials: Sequence[Trial]) -> dict[int, list[tuple[Stated, Stated]]]:
    first, second = ({t.seed: t for t in trials if t.method == method} for method in SIDE_BY_SIDE)
    return {
        seed: [
            (coefficient, second[seed].stated[name])
            for name, coefficient in first[seed].stated.items()
            if name in second[seed].stated
        ]
        for seed in first
        if seed in second
    }


def _distance(one: Stated, other: Stated) -> float:
    return abs(math.log(other.value / one.value)) / max(one.std, other.std)


def lines(trials: Sequence[Trial]) -> list[str]:
    """The paragraph of the page; empty if one of the two methods was not run."""
    by_seed = distances(trials)
    sizes = [size for of_seed in by_seed.values() for size in of_seed if math.isfinite(size)]
    if not sizes:
        return []
    beyond = sum(any(beyond_intervals(*pair) for pair in pairs) for pairs in _pairs(trials).values())
    return paragraph(
        f"The two methods of `identify` are {np.median(sizes):.2f} standard errors apart in the median, "
        f"{np.percentile(sizes, 99):.2f} in the 99th percentile and {max(sizes):.1f} at most, of {len(sizes)}",
        f"coefficients that both state. {beyond} of {len(by_seed)} missions hold one beyond both intervals and by",
        f"{100 * LEAST_DIFFERENCE:g} % or more, which `identify` calls a disagreement.",
    )
