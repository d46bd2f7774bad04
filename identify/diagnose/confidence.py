"""How well a dive tells the parameters of its causes: beside masses and dampings that are not known any better, and in
a form of theirs that is not quite true.

White innovations alone make too narrow intervals: that no form of a library is true shows in parts of a dive that
differ in what they make of a parameter by themselves. What lies between these, beyond their own noise, is a random
effect (DerSimonian and Laird 1986), and the mean over parts is known no better than it lets it be. It shows, too, where
another form of a cause fits beside its own: what that would make of the parameter is as good an answer.

Causes that a dive is sure of: those whose parameters it tells from none, as well as it tells them at all.

The search weighs causes by white innovations, each in a form of its own. What parts of the dive disagree on, and what
other forms, masses and dampings leave open, widens a cause's interval afterwards (`spread`): one that may as well be
absent then is no cause, for a rest of another's form looks so. Not so a sea: its lines beat, so that parts of a dive
disagree on them however high it is; what pieces held out gain by it (`search.LEAST_SEA_GAIN`) tells of it.

Which other causes would do as well in this dive, and by how much the best of those that would not does worse.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from bridge.effects.course import Course
from bridge.effects.effect import ALONG, Act, Effect
from identify.diagnose.candidates import Cause, other_forms
from identify.diagnose.evidence import NOTHING_NEW, SCARCE, inverse
from identify.diagnose.nominal import Nominal
from identify.diagnose.regression import mean_places
from identify.diagnose.search import LEAST_SHARE, LOOKED_AT, Explanation, explained_by, ranked_candidates
from identify.diagnose.seas import SEAS
from identify.diagnose.weighing import Fitted, Weighing
from identify.estimators.likelihood_axis import DAMPING

Array = NDArray[np.float64]
Parts = NDArray[np.intp]

PART_PIECES = 3
"""Pieces to a part of a dive by time: a minute, several legs, so that no leg is a part of its own."""

CLASSES = 4
"""Parts by how much a cause does, each of which tells as much of it."""

EACH_S = 0.2
"""Forms are compared so often: a vehicle takes longer to answer."""

NEAR = 1e-3
"""Share of itself by which a mass or a damping is moved to see what a cause changes by."""

LEAST_CONFIDENCE = 0.95
"""The confidence with which absence lies outside what the dive says of a cause's parameters, all of them together."""

AMBIGUOUS_NATS = 3.0
"""Nats on held-out pieces within which two causes are not told apart: odds of twenty to one."""

SAME_FORM = 1e-3
"""Of what a cause saves, what tells one form from another only: at tens of thousands of nats no form of a library is so
true that less would speak against a cause that adds all but the same."""

LEAST_LIKENESS = 0.5
"""Causes that add less alike than this are no names for one thing: where each does as well in the other's place, both
may be there, and neither is evidence against the other."""


def covariance_of(weighing: Weighing, fit: Fitted) -> Array:
    """(k, k): of the parameters of a fit's causes."""
    rows, m = weighing.rows, weighing.rows.nominal.shape[1]
    nominal = coupled_nominal(weighing, fit.causes)
    whole = np.hstack([nominal, fit.slopes])
    known = np.concatenate([rows.nominal_precision, np.zeros(len(fit.at))])
    within = inverse(whole.T @ whole + np.diag(known))[m:, m:]
    columns = np.column_stack([fit.slopes, fit.value])
    free = inverse(nominal.T @ nominal + np.diag(rows.nominal_precision))
    columns -= nominal @ (free @ (nominal.T @ columns))
    slopes = columns[:, :-1]
    left = columns[:, -1] - slopes @ (inverse(slopes.T @ slopes) @ (slopes.T @ columns[:, -1]))
    between = np.zeros(len(fit.at))
    for k in range(len(fit.causes)):
        own = [i for i, (of, _) in enumerate(fit.at) if of == k]
        for parts in _partitions(weighing, slopes[:, own]):
            between[own] += between_parts(slopes[:, own], left, parts)
    shift = in_other_forms(weighing, fit, nominal)
    return np.asarray(within + np.diag(between) + np.outer(shift, shift))


def in_other_forms(weighing: Weighing, fit: Fitted, nominal: Array) -> Array:
    """(k,): by how much the parameters move once other forms of the causes may take part.

    Of each form only what it does beyond its cause's own values, masses and dampings, by least squares over the
    dive: whatever size it takes, the cause's own form stays the one that comes nearest to both together.
    """
    rows, course = weighing.rows, weighing.now.course
    columns, shares = [nominal, fit.slopes], [np.zeros(0)]
    for k, cause in enumerate(fit.causes):
        own, others = cause.act(course), list(other_forms(course, cause))
        places = [i for i, (of, _) in enumerate(fit.at) if of == k]
        slopes = [cause.slope(course, fit.at[i][1]) for i in places]
        by_own, by_others = (
            np.column_stack([_along(course, act, own) for act in acts])
            for acts in ([*slopes, *_nominal_acts(course)], others)
        )
        taken = np.linalg.lstsq(by_own, by_others, rcond=1e-10)[0]
        beyond, whole = by_others - by_own @ taken, _along(course, own, own)
        share = (beyond**2).sum(axis=0) / max(float(whole @ whole), 1e-300)
        # A form of what never changes is what it is a form of, all but rounding.
        new = share > NOTHING_NEW
        more = rows.columns(others, course) - fit.slopes[:, places] @ taken[: len(places)]
        columns.append(more[:, new])
        shares.append(share[new])
    m, k = nominal.shape[1], len(fit.at)
    table, free = np.hstack(columns), np.concatenate([rows.nominal_precision, np.zeros(k)])
    # A form takes part by no more of the cause than what a further cause must exceed.
    known = np.concatenate([free, np.concatenate(shares) / LEAST_SHARE])
    square, right = table.T @ table, table.T @ fit.value
    with_others = inverse(square + np.diag(known)) @ right
    alone = inverse(square[: m + k, : m + k] + np.diag(free)) @ right[: m + k]
    return np.asarray((with_others[: m + k] - alone)[m:])


def _along(course: Course, act: Act, like: Act) -> Array:
    """What an act adds of all that another does, in one row; the wrench (in which shafts are) as accelerations."""
    every = max(round(EACH_S / course.step_s), 1)
    parts = []
    for name in ALONG:
        if name != "shaft_n" and (shape := getattr(like, name)) is not None:
            part = getattr(act, name)
            scale = np.maximum(course.mass, 1e-9) if name == "wrench" else 1.0
            parts.append(((np.zeros_like(shape) if part is None else part) / scale)[::every].reshape(-1))
    return np.concatenate(parts)


def _nominal_acts(course: Course) -> Iterator[Act]:
    """The wrench of one unit of each mass and damping."""
    for dof in range(6):
        unit = np.where(np.arange(6) == dof, 1.0, 0.0)
        yield Act(wrench=course.coriolis_of(unit, course.nu) + unit * course.nu_dot)
        yield Act(wrench=unit * course.nu)


def _partitions(weighing: Weighing, slopes: Array) -> Iterator[Parts]:
    """Ways to part the rows of a dive by what a wrong form depends on: when, how much of the cause there was, and in
    which degree of freedom or by which witness."""
    yield weighing.rows.piece // PART_PIECES
    size = ((slopes / np.maximum(np.sqrt(np.mean(slopes**2, axis=0)), 1e-300)) ** 2).sum(axis=1)
    order = np.argsort(size)
    told = np.cumsum(size[order]) / max(float(size.sum()), 1e-300)
    parts = np.empty(len(size), dtype=np.intp)
    parts[order] = np.minimum((CLASSES * told).astype(np.intp), CLASSES - 1)
    yield parts
    yield np.unique(weighing.rows.dof, return_inverse=True)[1]


def between_parts(slopes: Array, left: Array, parts: Parts) -> Array:
    """(k,): what the parts' disagreement adds to the variance of each parameter's mean. slopes (rows, k), left (rows,):
    a regression and what it leaves; a part that hardly tells of a parameter has no say in it."""
    total = np.einsum("ni,ni->i", slopes, slopes)
    off, weight = np.zeros((2, int(parts.max()) + 1, slopes.shape[1]))
    for part in range(len(off)):
        mine = slopes[parts == part]
        square = mine.T @ mine
        telling = np.flatnonzero(np.diag(square) > SCARCE * total)
        if len(telling):
            own = inverse(square[np.ix_(telling, telling)])
            off[part, telling] = own @ (mine[:, telling].T @ left[parts == part])
            weight[part, telling] = 1.0 / np.diag(own)
    sum_, squares = np.maximum(weight.sum(axis=0), 1e-300), (weight**2).sum(axis=0)
    mean = (weight * off).sum(axis=0) / sum_
    excess = (weight * (off - mean) ** 2).sum(axis=0) - np.maximum((weight > 0).sum(axis=0) - 1, 0)
    variance = np.maximum(excess, 0.0) / np.maximum(sum_ - squares / sum_, 1e-300)
    return np.asarray(np.where((weight > 0).sum(axis=0) > 1, variance * squares / sum_**2, 0.0))


def coupled_nominal(weighing: Weighing, causes: tuple[Cause, ...]) -> Array:
    """The nominal columns (rows, m) together with what the causes change by with a mass or a damping, that of which
    they are so many times as much."""
    course, joint = weighing.now.course, weighing.now.joint
    kept = sorted({*joint.mass_places, *mean_places(joint)})
    acts: list[Act] = []
    at: list[int] = []
    for problem, place, of_mass in zip(joint.problems, joint.places, joint.mass_places, strict=True):
        dof = problem.axis.dof
        more = np.where(np.arange(6) == dof, 1.0 + NEAR, 1.0)
        for moved, of in (
            (replace(course, mass=course.mass * more), of_mass),
            (replace(course, damping=course.damping * more), place.start + DAMPING),
        ):
            for cause in causes:
                change = cause.act(moved).less(cause.act(course)).times(1.0 / NEAR)
                if any(np.any(part) for f in fields(change) if (part := getattr(change, f.name)) is not None):
                    acts.append(change)
                    at.append(kept.index(of))
    out = weighing.rows.nominal.copy()
    if acts:
        for place_, column in zip(at, weighing.rows.columns(acts, course).T, strict=True):
            out[:, place_] -= column
    return out


def without_doubtful(
    found: Explanation, nominal: Nominal, library: Sequence[Effect]
) -> tuple[Explanation, NDArray[np.float64]]:
    """An explanation without the causes that may as well be absent, the least sure one left out first; and the
    covariance (k, k) of the parameters of those that stay."""
    while found.causes:
        covariance = covariance_of(found.weighing, found.fit)
        shares = [
            1.0 if cause.effect.name in SEAS else _confidence(found.fit, covariance, k)
            for k, cause in enumerate(found.causes)
        ]
        k = int(np.argmin(shares))
        if shares[k] > LEAST_CONFIDENCE:
            return found, covariance
        found = explained_by((*found.causes[:k], *found.causes[k + 1 :]), nominal, library)
    return found, np.zeros((0, 0))


def _confidence(fit: Fitted, covariance: NDArray[np.float64], k: int) -> float:
    """With which one cause of a fit is there: Wald's test of all its fitted parameters."""
    cause = fit.causes[k]
    places = [i for i, (of, _) in enumerate(fit.at) if of == k]
    far = np.array(
        [cause.values[p] - cause.effect.parameters[p].none for _, p in (fit.at[i] for i in places)]
    )
    return float(chi2.cdf(far @ np.linalg.pinv(covariance[np.ix_(places, places)]) @ far, len(places)))


@dataclass(frozen=True)
class AmbiguityGroup:
    """Of one cause. names: of those that do as well, likeness: |cosine| of what each adds with what the cause does,
    the nominal model and the other causes projected out; margin_nats: over the best explanation without any of them.
    """

    names: tuple[str, ...]
    likeness: dict[str, float]
    margin_nats: float


def ambiguity_of(found: Explanation, k: int) -> AmbiguityGroup:
    """The causes that this dive can't tell from the k-th, each fitted in its place beside the others."""
    fit, weighing = found.fit, found.weighing
    own = fit.causes[k]
    others = weighing.fitted((*fit.causes[:k], *fit.causes[k + 1 :]))
    names: list[str] = []
    likeness: dict[str, float] = {}
    best_apart = others.gain
    nearly = max(AMBIGUOUS_NATS, SAME_FORM * (fit.gain - others.gain))
    for _, _, cause in ranked_candidates(weighing.candidates_beside(others), others)[:LOOKED_AT]:
        if cause.effect.name == own.effect.name:
            continue
        tried = weighing.fitted((*others.causes, cause))
        if len(tried.causes) <= len(others.causes):
            continue
        if tried.gain > fit.gain - nearly:
            alike = cosine(weighing, others, own, tried.causes[-1])
            if cause.effect.name not in names and alike >= LEAST_LIKENESS:
                names.append(cause.effect.name)
                likeness[cause.effect.name] = alike
        else:
            best_apart = max(best_apart, tried.gain)
    return AmbiguityGroup(tuple(names), likeness, fit.gain - best_apart)


def cosine(weighing: Weighing, others: Fitted, one: Cause, other: Cause) -> float:
    """|cosine| of what two causes add to the rows, the nominal model and the slopes of the others projected out."""
    course = weighing.now.course
    columns = weighing.rows.columns([one.act(course), other.act(course)], course)
    known = np.column_stack([weighing.rows.nominal, others.slopes])
    a, b = (columns - known @ (inverse(known.T @ known) @ (known.T @ columns))).T
    return float(abs(a @ b) / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-300))
