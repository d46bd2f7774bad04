"""A share over cases that come in correlated groups, as the coefficients of one mission, and its uncertainty."""

from collections.abc import Hashable, Sequence

import numpy as np

from identify.statistics import wilson


def effective_count(hits: Sequence[bool], groups: Sequence[Hashable]) -> float:
    """Number of independent cases that would know the share of `hits` as well as these, whose `groups` are independent.

    Binomial variance over the variance of a share of clusters of unequal size (Cochran 1977, section 3.12; the
    effective size of Kish 1965, section 8.2), and at most the number of cases. If all cases agree, their spread gives
    no information, and the number of groups counts.
    """
    place = {name: i for i, name in enumerate(dict.fromkeys(groups))}
    group = np.array([place[name] for name in groups])
    size, hit = np.bincount(group), np.bincount(group, weights=np.asarray(hits, dtype=float))
    rate, count = float(hit.sum() / size.sum()), len(size)
    if count < 2 or rate in (0.0, 1.0):
        return float(count)
    variance = count / (count - 1) * float(np.sum((hit - rate * size) ** 2)) / float(size.sum()) ** 2
    return min(rate * (1 - rate) / variance, float(size.sum())) if variance > 0 else float(size.sum())


def share95(hits: Sequence[bool], groups: Sequence[Hashable]) -> tuple[float, float, float]:
    """The share of hits and its 95 % bounds: Wilson's, by the effective count."""
    rate = float(np.mean(hits))
    return rate, *wilson(rate, effective_count(hits, groups))
