"""How well a dive tells the parameters of its causes: beside masses and dampings that are not known any better, and in
a form of theirs that is not quite true.

White innovations alone make too narrow intervals: that no form of a library is true shows in parts of a dive that
differ in what they make of a parameter by themselves. What lies between these, beyond their own noise, is a random
effect (DerSimonian and Laird 1986), and the mean over parts is known no better than it lets it be.
"""

from collections.abc import Iterator
from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from bridge.effects.effect import Act
from identify.diagnose.cause import Cause
from identify.diagnose.evidence import SCARCE, inverse
from identify.diagnose.ground import Fitted, Ground
from identify.diagnose.whitened import of_the_mean
from identify.estimators.likelihood_axis import DAMPING

Array = NDArray[np.float64]
Parts = NDArray[np.intp]

LONG = 3
"""Pieces to a part of a dive by time: a minute, several legs, so that no leg is a part of its own."""

CLASSES = 4
"""Parts by how much a cause does, each of which tells as much of it."""

NEAR = 1e-3
"""Share of itself by which a mass or a damping is moved to see what a cause changes by."""


def covariance_of(ground: Ground, fit: Fitted) -> Array:
    """(k, k): of the parameters of a fit's causes."""
    rows, m = ground.rows, ground.rows.nominal.shape[1]
    nominal = leaning(ground, fit.causes)
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
        for parts in _cuts(ground, slopes[:, own]):
            between[own] += between_parts(slopes[:, own], left, parts)
    return np.asarray(within + np.diag(between))


def _cuts(ground: Ground, slopes: Array) -> Iterator[Parts]:
    """Ways to part the rows of a dive by what a wrong form depends on: when, how much of the cause there was, and in
    which degree of freedom or by which witness."""
    yield ground.rows.piece // LONG
    size = ((slopes / np.maximum(np.sqrt(np.mean(slopes**2, axis=0)), 1e-300)) ** 2).sum(axis=1)
    order = np.argsort(size)
    told = np.cumsum(size[order]) / max(float(size.sum()), 1e-300)
    parts = np.empty(len(size), dtype=np.intp)
    parts[order] = np.minimum((CLASSES * told).astype(np.intp), CLASSES - 1)
    yield parts
    yield np.unique(ground.rows.dof, return_inverse=True)[1]


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


def leaning(ground: Ground, causes: tuple[Cause, ...]) -> Array:
    """The nominal columns (rows, m) together with what the causes change by with a mass or a damping, that of which
    they are so many times as much."""
    course, joint = ground.now.course, ground.now.joint
    kept = sorted({*joint.mass_places, *of_the_mean(joint)})
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
    out = ground.rows.nominal.copy()
    if acts:
        for place_, column in zip(at, ground.rows.columns(acts, course).T, strict=True):
            out[:, place_] -= column
    return out
