"""Which other causes would do as well in this dive, and by how much the best of those that would not does worse."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.diagnose.cause import Cause
from identify.diagnose.evidence import inverse
from identify.diagnose.ground import Fitted, Ground
from identify.diagnose.search import LOOKED_AT, Explanation, candidates

Array = NDArray[np.float64]

AS_GOOD = 3.0
"""Nats on held-out pieces within which two causes are not told apart: odds of twenty to one."""

SAME_FORM = 1e-3
"""Of what a cause saves, what tells one form from another only: at tens of thousands of nats no form of a library is so
true that less would speak against a cause that adds all but the same."""

LEAST_LIKENESS = 0.5
"""Causes that add less alike than this are no names for one thing: where each does as well in the other's place, both
may be there, and neither is evidence against the other."""


@dataclass(frozen=True)
class Alike:
    """Of one cause. names: of those that do as well, likeness: |cosine| of what each adds with what the cause does,
    the nominal model and the other causes projected out; margin_nats: over the best explanation without any of them.
    """

    names: tuple[str, ...]
    likeness: dict[str, float]
    margin_nats: float


def alike_of(found: Explanation, k: int) -> Alike:
    """The causes that this dive can't tell from the k-th, each fitted in its place beside the others."""
    fit, ground = found.fit, found.ground
    own = fit.causes[k]
    others = ground.fitted((*fit.causes[:k], *fit.causes[k + 1 :]))
    names: list[str] = []
    likeness: dict[str, float] = {}
    best_apart = others.gain
    nearly = max(AS_GOOD, SAME_FORM * (fit.gain - others.gain))
    for _, _, cause in candidates(ground.beside(others), others)[:LOOKED_AT]:
        if cause.effect.name == own.effect.name:
            continue
        tried = ground.fitted((*others.causes, cause))
        if len(tried.causes) <= len(others.causes):
            continue
        if tried.gain > fit.gain - nearly:
            alike = cosine(ground, others, own, tried.causes[-1])
            if cause.effect.name not in names and alike >= LEAST_LIKENESS:
                names.append(cause.effect.name)
                likeness[cause.effect.name] = alike
        else:
            best_apart = max(best_apart, tried.gain)
    return Alike(tuple(names), likeness, fit.gain - best_apart)


def cosine(ground: Ground, others: Fitted, one: Cause, other: Cause) -> float:
    """|cosine| of what two causes add to the rows, the nominal model and the slopes of the others projected out."""
    course = ground.now.course
    columns = ground.rows.columns([one.act(course), other.act(course)], course)
    known = np.column_stack([ground.rows.nominal, others.slopes])
    a, b = (columns - known @ (inverse(known.T @ known) @ (known.T @ columns))).T
    return float(abs(a @ b) / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-300))
