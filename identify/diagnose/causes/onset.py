"""Causes that begin within a dive: a propeller that breaks, a mount that is knocked, ballast that is lost.

Tried only where the whole dive's causes leave something, for there is an effect for each time at which one may begin. A
thruster that pushes steadily shows its beginning to a second, so that no coarse grid of times finds it: by the filters
run backwards, what each instant of a force saves is known at once, and so is what a force saves from any instant on.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from bridge.arrays import Array
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.causes.confidence import without_doubtful
from identify.diagnose.causes.evidence import Blocks, inverse
from identify.diagnose.causes.search import explained_further
from identify.diagnose.causes.selection import improved, without
from identify.diagnose.causes.shafts import Search
from identify.diagnose.causes.weighing import Fitted, Weighing
from identify.diagnose.filters.backwards import scores
from identify.diagnose.filters.innovations import means_before, push_of
from identify.effects.course import Course
from identify.effects.effect import Act, Effect, beginning
from identify.estimators.timing.lateness import behind_filter
from identify.threads import side_by_side

STRETCHES = 16
"""Number of stretches of a dive, in each of which the likeliest time is weighed in full."""

LEAST_RISE = 5.0
"""Nats by which the causes must be worth more: the logarithm of the times in a dive that can be told apart, some 150.
"""


def with_beginnings(search: Search, library: Sequence[Effect], start_s: float) -> Search:
    """The search with causes that begin within the dive, if these are worth more than those found before.

    start_s: of the recording, from which its times are told.
    """
    explanation = search.explanation
    begun = _likely_beginnings(explanation.weighing, explanation.fit, start_s)
    if not begun:
        return search
    wider = (*library, *begun)
    further = explained_further(explanation, search.nominal, wider)
    new = Search(search.nominal, *without_doubtful(further, search.nominal, wider), begun)
    return new if new.worth > search.worth + LEAST_RISE else search


def _likely_beginnings(weighing: Weighing, fit: Fitted, start_s: float) -> tuple[Effect, ...]:
    """Every effect that may begin within a dive, from when it likeliest did, and from when each cause that did began;
    none if no cause did."""
    sudden = [effect for effect in weighing.library if effect.sudden]
    others = [fit, *(weighing.fitted(without(fit.causes, k)) for k in range(len(fit.causes)))]
    residuals = [_Residual.of(weighing, each, start_s) for each in others]
    likely_s = side_by_side(lambda effect: {each.likeliest_s(effect) for each in residuals}, sudden)
    every = [
        beginning(effect, at_s, start_s)
        for effect, times_s in zip(sudden, likely_s, strict=True)
        for at_s in sorted(times_s)
    ]
    wider = replace(weighing, library=(*weighing.library, *every))
    found = improved(wider, wider.fitted(fit.causes))
    begun_s = {cause.effect.since_s for cause in found.causes if cause.effect.since_s}
    alike = (beginning(effect, at_s, start_s) for at_s in sorted(begun_s) for effect in sudden)
    return tuple({effect.label: effect for effect in (*every, *alike)}.values()) if begun_s else ()


@dataclass(frozen=True)
class _Residual:
    """What some causes leave of a dive, `left` (rows,), and the columns `known` to be projected out, with `free`, the
    inverse of their square."""

    weighing: Weighing
    left: Array
    known: Blocks
    free: Array
    start_s: float

    @classmethod
    def of(cls, weighing: Weighing, fit: Fitted, start_s: float) -> "_Residual":
        rows = weighing.rows
        known = rows.nuisance.with_columns(rows.nuisance.blocks_of(fit.slopes))
        precision = np.concatenate([rows.nominal_precision, np.zeros(fit.slopes.shape[1])])
        free = inverse(known.square() + np.diag(precision))
        left = fit.value - known.times(free @ known.crossed(fit.value[:, None]))[:, 0]
        return cls(weighing, left, known, free, start_s)

    @property
    def course(self) -> Course:
        return self.weighing.now.course

    def likeliest_s(self, effect: Effect) -> float:
        """The time since the recording's start from which on the effect saves most in sample, of any size."""
        act = Cause(effect, effect.start()).act(self.course)
        saved = np.abs(self._scores(act)[1:])
        peaks = [
            int(some[np.argmax(saved[some])]) for some in np.array_split(np.arange(len(saved)), STRETCHES)
        ]
        tried_s = np.round(self.course.time_s[1:][peaks] - self.start_s, 1).tolist()
        nats = self._nats([act.each(partial(np.multiply, self._from(at_s))) for at_s in tried_s])
        return float(tried_s[int(np.argmax(nats))])

    def _from(self, at_s: float) -> Array:
        return np.asarray(self.course.time_s >= self.start_s + at_s, np.float64)[:, None]

    def _scores(self, act: Act) -> Array:
        """Derivative (n,) of the log likelihood by the size of an act that begins at each time of the course."""
        push, out = push_of(act, self.course), np.zeros(len(self.course.time_s))
        rows = self.weighing.rows
        for innovations, mine in zip(rows.axes, rows.nuisance.slices, strict=False):
            axis = innovations.problem.axis
            if axis.dof in push.by_dof:
                force = behind_filter(push.by_dof[axis.dof][:, None], self.course.step_s, axis.smoothing_s)
                means = means_before(self.course.time_s, force, axis.before_s, axis.time_s)[:, 0]
                later = np.flip(np.cumsum(np.flip(scores(innovations, self.left[mine]) * means)))
                out += np.interp(self.course.time_s, axis.before_s, later)
        return out

    def _nats(self, acts: Sequence[Act]) -> Array:
        """Nats that each act saves in sample, of its best size."""
        columns = self._columns(acts)
        return np.asarray((self.left @ columns) ** 2 / np.maximum(np.sum(columns**2, axis=0), 1e-300))

    def _columns(self, acts: Sequence[Act]) -> Array:
        """Columns (rows, k) of acts, with the known ones projected out."""
        columns = self.weighing.rows.columns(acts, self.course)
        return np.asarray(columns - self.known.times(self.free @ self.known.crossed(columns)))
