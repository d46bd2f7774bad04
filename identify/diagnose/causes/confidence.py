"""Confidence in the causes found: the covariance of their parameters, and whether each is present.

White innovations alone give intervals that are too narrow, because no form of a library is exact. Parts of a dive
then disagree on a parameter. The variance between parts beyond their noise is a random effect (DerSimonian and Laird
1986) that limits the mean. Other forms of a cause shift the parameter as well, and their value is as good an answer.

The wider interval decides presence: a cause that may as well be absent by it is dropped, because the remainder of
another cause's form looks like that. A sea is exempt. Its lines beat, so parts of a dive always disagree, and
held-out gain decides instead (`requirement.LEAST_TIMED_GAIN`). A lone cause is no other's remainder: it stays if one
value in all parts explains nearly as much as a value in each.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.diagnose.causes.candidates import Cause, other_forms
from identify.diagnose.causes.evidence import NOTHING_NEW, SCARCE, Blocks, inverse
from identify.diagnose.causes.requirement import LEAST_SHARE
from identify.diagnose.causes.search import Explanation, explained_by
from identify.diagnose.causes.weighing import Fitted, Weighing
from identify.diagnose.filters.nominal import Nominal, quadratic_of
from identify.diagnose.filters.regression import mean_indices
from identify.diagnose.gap.missing import disturbance_of, drowned
from identify.effects.course import Course
from identify.effects.effect import ALONG, Act, Effect
from identify.estimators.likelihood.axis import DAMPING
from identify.statistics import Z95
from identify.threads import both

Parts = NDArray[np.intp]

PART_PIECES = 3
"""Pieces in a part by time: a minute, several legs."""

CLASSES = 4
"""Parts by size of the cause, of equal information."""

EACH_S = 0.2
"""Interval at which forms are compared: vehicles respond more slowly."""

NEAR = 1e-3
"""Relative step of mass or damping for a cause's derivative."""

LEAST_CONFIDENCE = 0.95
"""Confidence with which all of a cause's parameters together must exclude absence."""

MOST_APART, BEYOND_CHANCE = 0.25, 50.0
"""Share of a lone cause's nats that values of its own in each part may add, and the nats that it must save, for its
presence to be certain. Forces of another kind that a cause mimics leave half as much and more."""

STEPS = (0.0025, 0.005, 0.01, 0.02, 0.04)
"""Shares of a parameter by which it is moved to see how far it is known."""

FALL = 0.5 * Z95**2
"""Nats by which a fit may be worse within its 95 % interval."""

LEAST_APART = 6.25
"""Nats by which a rival must be excluded: with fewer, the cause would be less than 50 % probable, without a reason."""


def covariance_of(weighing: Weighing, fit: Fitted) -> Array:
    """Covariance (k, k) of the parameters of a fit's causes; a late thrust is known no better than its stamps."""
    return _covariance(weighing, fit, coupled_nominal(weighing, fit.causes))


def _covariance(weighing: Weighing, fit: Fitted, nominal: Blocks) -> Array:
    """Covariance (k, k) given the m nominal columns."""
    rows, m = weighing.rows, nominal.width
    slopes_alone = rows.nuisance.blocks_of(fit.slopes)
    known = np.concatenate([rows.nominal_precision, np.zeros(len(fit.at))])
    square = nominal.with_columns(slopes_alone).square() + np.diag(known)
    within = inverse(square)[m:, m:]
    slopes, left = _beyond(nominal, square[:m, :m], fit)
    # Where priors of masses, dampings and scales tell a parameter too, the rows alone move it by this share of what
    # they say by themselves.
    in_all = np.maximum(np.einsum("ni,ni->i", slopes, fit.slopes), 1e-300)
    share = np.einsum("ni,ni->i", slopes, slopes) / in_all
    between = np.zeros(len(fit.at))
    for k in range(len(fit.causes)):
        of_cause = [i for i, (cause_index, _) in enumerate(fit.at) if cause_index == k]
        for parts in _partitions(weighing, slopes[:, of_cause]):
            between[of_cause] += share[of_cause] ** 2 * between_parts(slopes[:, of_cause], left, parts)
    shift = in_other_forms(weighing, fit, nominal)
    steps = [_step_std(weighing, fit, k, p) for k, p in fit.at]
    late = [weighing.now.stamped_s if fit.causes[k].effect.timing else 0.0 for k, _ in fit.at]
    more = between + np.square(steps) + np.square(late)
    return np.asarray(within + np.diag(more) + np.outer(shift, shift))


def _step_std(weighing: Weighing, fit: Fitted, k: int, p: int) -> float:
    """Standard error of a parameter on which the motion depends in steps, by how far off it hardly fits worse; 0 of any
    other parameter.

    A dead zone's width is known to the next command only, and no slope says how near that is.
    """
    cause = fit.causes[k]
    if not cause.effect.steep:
        return 0.0
    reach = 0.0
    for by in [side * share * float(cause.values[p]) for share in STEPS for side in (-1.0, 1.0)]:
        moved = [*fit.causes[:k], cause.moved(p, by), *fit.causes[k + 1 :]]
        if 0.5 * (weighing.residual_squares(moved) - fit.residual_squares) < FALL:
            reach = max(reach, abs(by))
    return reach / Z95


def _beyond(nominal: Blocks, square: Array, fit: Fitted) -> tuple[Array, Array]:
    """The slopes (rows, k) of a fit beyond the nominal columns, of that `square`, and the residual (rows,)."""
    columns = np.column_stack([fit.slopes, fit.value])
    columns -= nominal.times(inverse(square) @ nominal.crossed(columns))
    slopes = columns[:, :-1]
    return slopes, columns[:, -1] - slopes @ (inverse(slopes.T @ slopes) @ (slopes.T @ columns[:, -1]))


def is_certain(explanation: Explanation) -> bool:
    """Whether a lone cause is present beyond doubt: it saves much, all parts of the dive agree on it, and no error of
    the stamps makes it."""
    weighing, fit = explanation.weighing, explanation.fit
    if len(fit.causes) != 1 or fit.gain < BEYOND_CHANCE or not fit.at:
        return False
    rows, (cause,) = weighing.rows, fit.causes
    slopes, left = _beyond(rows.nuisance, rows.nuisance.square() + np.diag(rows.nominal_precision), fit)
    size = np.array([cause.values[p] - cause.effect.parameters[p].none for _, p in fit.at])
    if not np.isfinite(size).all():
        return False
    if cause.within_stamps(weighing.now.stamped_s):
        return False
    nats = 0.5 * float(np.sum((slopes @ size) ** 2))
    # Of several parameters the excesses are added, as if each were alone.
    apart = [_by_part(slopes, left, parts).excess for parts in _partitions(weighing, slopes)]
    return 0.5 * max(float(np.maximum(excess, 0.0).sum()) for excess in apart) < MOST_APART * nats


def in_other_forms(weighing: Weighing, fit: Fitted, nominal: Blocks) -> Array:
    """Shift (k,) of the parameters if other forms of the causes are admitted.

    Each form counts only beyond its least-squares fit by the cause's own slopes, masses and dampings, so that the
    cause's own form stays the nearest to both.
    """
    rows, course = weighing.rows, weighing.now.course
    m, k = nominal.width, len(fit.at)
    nuisance = nominal.with_columns(rows.nuisance.blocks_of(fit.slopes))
    table, shares, less = nuisance, [np.zeros(0)], [np.zeros((k, 0))]
    for index, cause in enumerate(fit.causes):
        act_of_cause, others = cause.act(course), list(other_forms(course, cause))
        indices = [i for i, (cause_index, _) in enumerate(fit.at) if cause_index == index]
        slopes = [cause.slope(course, fit.at[i][1]) for i in indices]
        by_slopes_alone, by_others = (
            np.column_stack([_along(course, act, act_of_cause) for act in acts])
            for acts in ([*slopes, *_nominal_acts(weighing.now)], others)
        )
        taken = np.linalg.lstsq(by_slopes_alone, by_others, rcond=1e-10)[0]
        beyond, row = by_others - by_slopes_alone @ taken, _along(course, act_of_cause, act_of_cause)
        share = (beyond**2).sum(axis=0) / max(float(row @ row), 1e-300)
        # Forms of a constant contribution equal it but for rounding.
        new = np.flatnonzero(share > NOTHING_NEW)
        table = table.with_columns(rows.blocks([others[i] for i in new], course))
        by_slopes = np.zeros((k, len(new)))
        by_slopes[indices] = taken[: len(indices), new]
        less.append(by_slopes)
        shares.append(share[new])
    beyond_slopes = np.eye(table.width)
    beyond_slopes[m : m + k, m + k :] -= np.hstack(less)
    square = beyond_slopes.T @ table.square() @ beyond_slopes
    right = beyond_slopes.T @ table.crossed(fit.value[:, None])[:, 0]
    free = np.concatenate([rows.nominal_precision, np.zeros(k)])
    # Prior width of a form: the share of the cause that a further cause must exceed.
    known = np.concatenate([free, np.concatenate(shares) / LEAST_SHARE])
    with_others = inverse(square + np.diag(known)) @ right
    alone = inverse(square[: m + k, : m + k] + np.diag(free)) @ right[: m + k]
    return np.asarray((with_others[: m + k] - alone)[m:])


def _along(course: Course, act: Act, like: Act) -> Array:
    """An act flattened to one row of the parts that `like` has; wrenches (shafts included) as accelerations."""
    every = max(round(EACH_S / course.step_s), 1)
    parts = []
    for name in ALONG:
        if name != "shaft_n" and (shape := getattr(like, name)) is not None:
            part = getattr(act, name)
            scale = np.maximum(course.mass, 1e-9) if name == "wrench" else 1.0
            parts.append(((np.zeros_like(shape) if part is None else part) / scale)[::every].reshape(-1))
    return np.concatenate(parts)


def _nominal_acts(now: Nominal) -> Iterator[Act]:
    """Wrench per unit of each mass and each drag that the hull's own model has."""
    course, quadratic = now.course, quadratic_of(now.joint, now.theta)
    for dof in range(6):
        unit = np.where(np.arange(6) == dof, 1.0, 0.0)
        yield Act(wrench=course.coriolis_of(unit, course.nu) + unit * course.nu_dot)
        yield Act(wrench=unit * course.nu)
        if quadratic[dof]:
            yield Act(wrench=unit * np.abs(course.nu) * course.nu)


def _partitions(weighing: Weighing, slopes: Array) -> Iterator[Parts]:
    """Partitions of the rows by the dependencies of a wrong form: time, size of the cause, degree of freedom or
    witness."""
    yield weighing.rows.piece // PART_PIECES
    size = ((slopes / np.maximum(np.sqrt(np.mean(slopes**2, axis=0)), 1e-300)) ** 2).sum(axis=1)
    order = np.argsort(size)
    share = np.cumsum(size[order]) / max(float(size.sum()), 1e-300)
    parts = np.empty(len(size), dtype=np.intp)
    parts[order] = np.minimum((CLASSES * share).astype(np.intp), CLASSES - 1)
    yield parts
    yield np.unique(weighing.rows.dof, return_inverse=True)[1]


@dataclass(frozen=True)
class ByPart:
    """Values (p, k) of each part, less the whole dive's, with their weights; 0 for parts with little information."""

    off: Array
    weight: Array

    @property
    def excess(self) -> Array:
        """Twice the nats (k,) that values of its own in each part save, beyond chance."""
        sum_ = np.maximum(self.weight.sum(axis=0), 1e-300)
        mean = (self.weight * self.off).sum(axis=0) / sum_
        freedom = np.maximum((self.weight > 0).sum(axis=0) - 1, 0)
        return np.asarray((self.weight * (self.off - mean) ** 2).sum(axis=0) - freedom)


def between_parts(slopes: Array, left: Array, parts: Parts) -> Array:
    """Between-part variance (k,) of each parameter's mean.

    slopes (rows, k), left (rows,): a regression and its residual. Parts with little information on a parameter are
    ignored.
    """
    by_part = _by_part(slopes, left, parts)
    weight = by_part.weight
    sum_, squares = np.maximum(weight.sum(axis=0), 1e-100), (weight**2).sum(axis=0)
    variance = np.maximum(by_part.excess, 0.0) / np.maximum(sum_ - squares / sum_, 1e-300)
    return np.asarray(np.where((weight > 0).sum(axis=0) > 1, variance * squares / sum_**2, 0.0))


def _by_part(slopes: Array, left: Array, parts: Parts) -> ByPart:
    total = np.einsum("ni,ni->i", slopes, slopes)
    off, weight = np.zeros((2, int(parts.max()) + 1, slopes.shape[1]))
    for part in range(len(off)):
        of_part = slopes[parts == part]
        square = of_part.T @ of_part
        informed = np.flatnonzero(np.diag(square) > SCARCE * total)
        if len(informed):
            covariance = inverse(square[np.ix_(informed, informed)])
            off[part, informed] = covariance @ (of_part[:, informed].T @ left[parts == part])
            weight[part, informed] = 1.0 / np.diag(covariance)
    return ByPart(off, weight)


def coupled_nominal(weighing: Weighing, causes: tuple[Cause, ...]) -> Blocks:
    """The nominal columns, with the causes' dependence on mass and drag included."""
    course, joint = weighing.now.course, weighing.now.joint
    of_hull = quadratic_of(joint, weighing.now.theta)
    kept = sorted({*joint.mass_indices, *mean_indices(joint)})
    acts: list[Act] = []
    at: list[int] = []
    for problem, of_axis, of_mass in zip(joint.problems, joint.slices, joint.mass_indices, strict=True):
        dof = problem.axis.dof
        more = np.where(np.arange(6) == dof, NEAR, 0.0)
        moves = [
            (replace(course, mass=course.mass * (1.0 + more)), of_mass),
            (replace(course, damping=course.damping * (1.0 + more)), of_axis.start + DAMPING),
        ]
        if of_hull[dof]:
            faster = replace(course, quadratic=course.quadratic + more * of_hull)
            moves.append((faster, of_axis.start + problem.quadratic_index))
        for moved, of in moves:
            for cause in causes:
                change = cause.act(moved).less(cause.act(course)).times(1.0 / NEAR)
                if not change.is_none:
                    acts.append(change)
                    at.append(kept.index(of))
    nominal = weighing.rows.nuisance
    if not acts:
        return nominal
    less = np.zeros((len(acts), nominal.width))
    less[range(len(at)), at] = -1.0
    together = nominal.with_columns(weighing.rows.blocks(acts, course))
    return together.combined(np.vstack([np.eye(nominal.width), less]))


def without_doubtful(
    explanation: Explanation, nominal: Nominal, library: Sequence[Effect]
) -> tuple[Explanation, NDArray[np.float64]]:
    """Drop causes that may be absent, first the cause that saves least in addition to the others.

    Causes at a bound that is a guess are dropped, and all causes of a dive in which the disturbance hides the
    thrust. Returns the remaining explanation, and the covariance (k, k) of its parameters.
    """
    if explanation.causes and drowned(disturbance_of(explanation.now)):
        explanation = explained_by((), nominal, library)
    while explanation.causes:
        within = tuple(cause for cause in explanation.causes if not cause.at_bound)
        if len(within) < len(explanation.causes):
            explanation = explained_by(within, nominal, library, explanation.now)
            continue
        absent, covariance = _covariances(explanation)
        shares = [
            1.0 if cause.effect.sea else _confidence(explanation.fit, absent, k)
            for k, cause in enumerate(explanation.causes)
        ]
        fewer = [
            (*explanation.causes[:k], *explanation.causes[k + 1 :])
            for k, share in enumerate(shares)
            if share <= LEAST_CONFIDENCE
        ]
        if not fewer or is_certain(explanation):
            return explanation, covariance
        # Of causes that trade with each other the shadows are dropped, however wide the interval of the cause that
        # casts them.
        best = max(fewer, key=lambda others: explanation.weighing.fitted(others).gain)
        explanation = explained_by(best, nominal, library, explanation.now)
    return explanation, np.zeros((0, 0))


def _covariances(explanation: Explanation) -> tuple[Array, Array]:
    """Covariances (k, k) of an explanation's parameters: if the causes may be absent, and if they are there.

    An absent cause depends on no mass or damping, however much its size does.
    """
    weighing, fit = explanation.weighing, explanation.fit
    return both(
        lambda: _covariance(weighing, fit, weighing.rows.nuisance), lambda: covariance_of(weighing, fit)
    )


def _confidence(fit: Fitted, covariance: NDArray[np.float64], k: int) -> float:
    """Confidence that a cause of a fit is present, by Wald's test of all its parameters."""
    cause = fit.causes[k]
    indices = [i for i, (cause_index, _) in enumerate(fit.at) if cause_index == k]
    distance = np.array(
        [cause.values[p] - cause.effect.parameters[p].none for _, p in (fit.at[i] for i in indices)]
    )
    return chi_squared(
        len(indices), float(distance @ np.linalg.pinv(covariance[np.ix_(indices, indices)]) @ distance)
    )


def chi_squared(freedom: int, at: float) -> float:
    """Probability that a chi-squared variable is at most `at` (Abramowitz and Stegun 1964, eqs 26.4.4 and 26.4.5).

    scipy has it, too, but a diagnosis needs nothing else of scipy.special, whose import takes 0.15 s.
    """
    half = 0.5 * at
    if half <= 0:
        return 0.0
    powers = [0.5 * freedom - k for k in range(1, freedom // 2 + 1)]
    beyond = math.erfc(math.sqrt(half)) if freedom % 2 else 0.0
    return 1.0 - beyond - sum(math.exp(p * math.log(half) - half - math.lgamma(p + 1.0)) for p in powers)
