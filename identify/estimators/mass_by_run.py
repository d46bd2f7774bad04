"""Whether runs that are taken for one vehicle respond alike: a mass by each run's own readings."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bridge.arrays import Array
from identify.dive import Run
from identify.doubt import Doubt, Outcome, coefficients_of
from identify.estimators.likelihood.axis import DAMPING, MASS, AxisLikelihood
from identify.estimators.missing_forces.forms import Kind
from identify.estimators.missing_forces.screening import Lack
from identify.words import axes_named, listed

FEWEST_RUNS, FEWEST_OF_A_KIND = 5, 2
LEAST_RATIO = 1.25
"""Of two kinds' masses: less is another trim of ballast, or a flaw of the model."""
CLEAR_SCORE, LEAST_SHARE = 6.0, 0.8
"""Standard errors by which two kinds are apart, and the share of all scatter of the runs that lies between them."""
VAGUE = 1.0
"""Standard deviation of the logarithm of a mass or a drag of a single run, before its readings."""


@dataclass(frozen=True)
class Kinds:
    """Runs of two kinds: those named in `heavy` respond as if `ratio` times as heavy as the others of `count`."""

    heavy: tuple[str, ...]
    ratio: float
    count: int


def unlike_doubts(kinds: Mapping[int, Kinds], lacks: Sequence[Lack]) -> tuple[Doubt, ...]:
    """A doubt about the values of the axes whose runs fall into the same two kinds, by degree of freedom.

    An axis that lacks a force of other axes' thrust tells of no second vehicle: each run has that force beside another
    share of its own thrust, and so seems of another mass.
    """
    crossed = {lack.dof for lack in lacks if lack.kind is Kind.ACROSS}
    alike: dict[tuple[str, ...], dict[int, Kinds]] = {}
    for dof, each in kinds.items():
        if dof not in crossed:
            alike.setdefault(each.heavy, {})[dof] = each
    return tuple(
        Doubt(
            coefficients_of(axes),
            f"In {axes_named(list(axes))} the runs {listed(names)} respond as if about "
            f"{max(each.ratio for each in axes.values()):.2g} times as heavy as the other "
            f"{max(each.count for each in axes.values()) - len(names)}",
            "they are hardly of one vehicle under the same conditions; give each kind a folder of its own.",
            Outcome.DISAGREES,
        )
        for names, axes in alike.items()
    )


def kinds_of_runs(problem: AxisLikelihood, theta: Array, runs: Sequence[Run]) -> Kinds | None:
    """The two kinds that a dive's runs fall into in an axis, near the fit of all; None if they are of one."""
    if len(problem.axis.runs) < FEWEST_RUNS:
        return None
    shifts, precisions = np.array([
        _word_of_run(rows.tolist(), gradient, information, {MASS, DAMPING, problem.quadratic_index})
        for rows, gradient, information in problem.score_by_run(theta)
    ]).T  # fmt: skip
    kinds = split(shifts, precisions, np.log(LEAST_RATIO))
    if kinds is None:
        return None
    axis = problem.axis
    begin_s = [float(axis.time_s[axis.runs[k]][0]) for k in kinds[0]]
    names = (run.name for run in runs if any(run.start_s <= at_s <= run.end_s for at_s in begin_s))
    return Kinds(tuple(names), float(np.exp(kinds[1])), len(runs))


def _word_of_run(
    rows: Sequence[int], gradient: Array, information: Array, of_hull: Collection[int]
) -> tuple[float, float]:
    """Step of the log mass by a run's own readings, with a drag and a trim of its own, and its precision; `of_hull`
    are the rows of mass and drag."""
    prior = np.array([VAGUE**-2 if row in of_hull else 0.0 for row in rows])
    covariance = np.linalg.pinv(information + np.diag(prior), hermitian=True)
    index = rows.index(MASS)
    return float(covariance[index] @ gradient), float(1.0 / covariance[index, index])


def split(shifts: Array, precisions: Array, least: float) -> tuple[tuple[int, ...], float] | None:
    """The runs of the upper of two kinds by values (r,) and their precisions (r,), and by how much it is above the
    other, at least `least`; None if they are of one kind."""
    order = np.argsort(shifts)
    whole = _scatter(shifts, precisions)
    best, clearest = None, CLEAR_SCORE
    for cut in range(FEWEST_OF_A_KIND, len(order) - FEWEST_OF_A_KIND + 1):
        light, heavy = order[:cut], order[cut:]
        within = _scatter(shifts[light], precisions[light]) + _scatter(shifts[heavy], precisions[heavy])
        apart = _mean(shifts[heavy], precisions[heavy]) - _mean(shifts[light], precisions[light])
        variance = 1.0 / precisions[light].sum() + 1.0 / precisions[heavy].sum()
        score = apart / np.sqrt(variance * max(1.0, within / (len(order) - 2)))
        if score > clearest and apart > least and within < (1.0 - LEAST_SHARE) * whole:
            best, clearest = (tuple(sorted(heavy.tolist())), apart), score
    return best


def _mean(values: Array, weights: Array) -> float:
    return float(np.average(values, weights=weights))


def _scatter(values: Array, weights: Array) -> float:
    return float(weights @ (values - _mean(values, weights)) ** 2)
