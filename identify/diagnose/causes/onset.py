"""Causes that begin within a dive: a propeller that breaks, a thruster that a knock turns, ballast that is lost.

A thruster that pushes steadily shows its beginning to a second, so that no coarse grid of times finds it: by the
filters run backwards, what each instant of a force saves is known at once, and so is what a force saves from any
instant on.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.causes.confidence import without_doubtful
from identify.diagnose.causes.evidence import NOTHING_NEW, Blocks, inverse
from identify.diagnose.causes.ranking import ranked_candidates
from identify.diagnose.causes.requirement import (
    BEGINNING_NATS,
    LEAST_GAIN,
    LEAST_TIMED_GAIN,
    sought_nats,
)
from identify.diagnose.causes.search import Explanation, explained_by, explained_further
from identify.diagnose.causes.selection import MOST_CAUSES, improved, without
from identify.diagnose.causes.shafts import Search
from identify.diagnose.causes.weighing import Fitted, Weighing
from identify.diagnose.filters.backwards import scores
from identify.diagnose.filters.innovations import means_before, push_of
from identify.diagnose.filters.nominal import Nominal
from identify.effects.course import Course
from identify.effects.effect import Act, Effect, beginning
from identify.estimators.timing.lateness import behind_filter
from identify.threads import side_by_side

STRETCHES, NEAR_TIMES, APART_S = 16, 8, 1.0
"""Number of stretches of a dive, of each of which the likeliest time is weighed in full; number of likely times near
the best of these that are weighed as well, and the least distance between them."""

MOST_ENDS, MOST_INSTANTS = 3, 300
"""Number of the likeliest beginnings and ends between which stretches are weighed in full, as of a force that a
controller makes up for at once; number of instants between which one is sought by squares known about, as of a force
that lasts."""

NEAR_ENDS_S, ENDS_TURNS = (-4.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 4.0), 2
"""Distances from the ends of the likeliest stretch at which it is weighed in full, one end after the other, and how
often."""

NEAR_SHARE = 0.25
"""Share of the nats asked for, by squares known about, from which an instant is weighed."""

HALF_SAVED = 0.5
"""Share of the nats asked for from which a stretch's ends are sought more closely: these lie within seconds of the
best, which gains little."""

LEAST_SQUARE = 0.02
"""Least share of a column's square that a late beginning is taken to have: a step alone shows."""

LEAST_ACTING_S = 20.0
"""Least time from the dive's start to a beginning, and from there to the dive's end: a hull that surfaces, or is hooked
at last, has lost no weight."""


ROUNDS = 2

LEAST_LASTING_S = 3 * LEAST_ACTING_S
"""Least length of a dive in which a beginning is looked for."""


def unsought(course: Course, library: Sequence[Effect]) -> tuple[str, ...]:
    """A sentence where causes of the library may begin within a dive, and the dive is too short to look for that."""
    lasts_s = float(course.since_s[-1])
    if lasts_s >= LEAST_LASTING_S or not any(effect.sudden for effect in library):
        return ()
    return (
        f"Causes that begin within the dive were not looked for: it lasts {lasts_s:.0f} s, and that takes "
        f"{LEAST_LASTING_S:.0f} s or more.",
    )


def with_beginnings(search: Search, library: Sequence[Effect], start_s: float) -> Search:
    """The search with causes that begin within the dive, if these are worth more than those found before.

    Once more after one was found: filters fitted with a beginning show its end. start_s: of the recording, from which
    its times are told.
    """
    for _ in range(ROUNDS):
        wider = _with_more(search, (*library, *search.beginnings), start_s)
        if wider is search:
            break
        before, search = search, wider
        if _begun_in(wider) <= _begun_in(before):
            break
    return search


def _begun_in(search: Search) -> set[str]:
    """Labels of the causes found that begin within the dive."""
    return {cause.effect.label for cause in search.explanation.causes if cause.effect.since_s}


def _with_more(search: Search, library: Sequence[Effect], start_s: float) -> Search:
    explanation = search.explanation
    weighing, fit = explanation.weighing, explanation.fit
    every = _likely_beginnings(weighing, fit, start_s)
    if not every:
        return search
    wide = replace(weighing, library=(*weighing.library, *every))
    better = improved(wide, wide.fitted(fit.causes))
    if _labels(better.causes) == _labels(fit.causes):
        explanation = _refitted_with_likeliest(explanation, wide, search.nominal, (*library, *every))
        better = explanation.fit
    spans_s = _spans_s(better.causes)
    if not spans_s:
        return search
    sudden = [effect for effect in weighing.library if effect.sudden]
    alike = (
        beginning(effect, since_s, start_s, until_s) for since_s, until_s in spans_s for effect in sudden
    )
    begun = tuple({effect.label: effect for effect in (*every, *alike)}.values())
    wider = (*library, *begun)
    further = explained_further(explanation, search.nominal, wider)
    every_begun = {effect.label: effect for effect in (*search.beginnings, *begun)}
    new = Search(
        search.nominal, *without_doubtful(further, search.nominal, wider), tuple(every_begun.values())
    )
    more_nats = max((sought_nats(cause.effect) for cause in new.explanation.causes), default=0.0)
    return new if new.worth > search.worth + max(more_nats, BEGINNING_NATS) else search


def _likely_beginnings(weighing: Weighing, fit: Fitted, start_s: float) -> tuple[Effect, ...]:
    """Every effect that may begin within a dive, from when it likeliest did, and over the stretch over which it
    likeliest acted, if it ended again; none where that is unlikely."""
    sudden = [effect for effect in weighing.library if effect.sudden]
    if not sudden or float(weighing.now.course.since_s[-1]) < LEAST_LASTING_S:
        return ()
    residuals = [
        _Residual.of(weighing, fit, fit, start_s),
        *(
            _Residual.of(weighing, weighing.fitted(without(fit.causes, k)), fit, start_s)
            for k in range(len(fit.causes))
        ),
    ]

    def likely_of(effect: Effect) -> set[tuple[float, float]]:
        push = _Pushed.of(weighing, effect)
        begins = {(residual.likeliest_s(push), math.inf) for residual in residuals}
        return begins | {residual.likeliest_stretch_s(push) for residual in residuals}

    likely_s = side_by_side(likely_of, sudden)
    return tuple(
        beginning(effect, since_s, start_s, until_s)
        for effect, spans_s in zip(sudden, likely_s, strict=True)
        for since_s, until_s in sorted(spans_s)
        if since_s
    )


def _spans_s(causes: Sequence[Cause]) -> list[tuple[float, float]]:
    """From when to when those of the causes that began acted."""
    return sorted({(each.effect.since_s, each.effect.until_s) for each in causes if each.effect.since_s})


def _labels(causes: Sequence[Cause]) -> set[str]:
    return {cause.effect.label for cause in causes}


def _refitted_with_likeliest(
    explanation: Explanation, wide: Weighing, nominal: Nominal, library: Sequence[Effect]
) -> Explanation:
    """The explanation with the likeliest beginning besides, or in the place of a cause, if the filters are far likelier
    once fitted with it.

    Filters without it take it for a disturbance, and weigh down what would show it.
    """
    best, rise = explanation, 0.0
    causes, known = explanation.causes, _labels(explanation.causes)
    for some in (causes, *(without(causes, k) for k in range(len(causes)))):
        fit = wide.fitted(some)
        ranked = ranked_candidates(wide.candidates_with_fit(fit), fit)
        begun = (cause for _, _, cause in ranked if cause.effect.since_s and cause.effect.label not in known)
        cause = next(begun, None)
        if cause is None or len(some) >= MOST_CAUSES:
            continue
        trial = explained_by((*fit.causes, cause), nominal, library, explanation.now)
        least = LEAST_TIMED_GAIN + sought_nats(cause.effect)
        if trial.now.log_posterior - explanation.now.log_posterior > max(least, rise):
            best, rise = trial, trial.now.log_posterior - explanation.now.log_posterior
    return best


@dataclass(frozen=True)
class _Pushed:
    """An effect's act along a course of times (n,), with its mean force over each step by axis, and the square (n,),
    about, of its column if it begins at each time: in each axis as much of the whole act's as of its force's square
    is later."""

    act: Act
    time_s: Array
    before_s: dict[int, Array]
    means: dict[int, Array]
    squares: Array

    @classmethod
    def of(cls, weighing: Weighing, effect: Effect) -> "_Pushed":
        course, axes = weighing.now.course, weighing.rows.axes
        act = Cause(effect, effect.start()).act(course)
        by_dof, column = push_of(act, course).by_dof, weighing.rows.blocks([act], course)
        pushed = [k for k, axis in enumerate(axes) if axis.problem.axis.dof in by_dof]
        before_s, means, squares, whole = {}, {}, np.zeros(len(course.time_s)), 0.0
        for k in pushed:
            axis = axes[k].problem.axis
            force = behind_filter(by_dof[axis.dof][:, None], course.step_s, axis.smoothing_s)
            means[k] = means_before(course.time_s, force, axis.before_s, axis.time_s)[:, 0]
            before_s[k] = axis.before_s
            square = float(np.sum(column.parts[k].values ** 2))
            later = _from_then_on(means[k] ** 2)
            squares += square * np.interp(course.time_s, axis.before_s, later) / max(float(later[0]), 1e-300)
            whole += square
        least = max(LEAST_SQUARE * whole, 1e-300)
        return cls(act, course.time_s, before_s, means, np.maximum(squares, least))

    def later(self, scores_of: Sequence[Array]) -> Array:
        """Derivative (n,) of the log likelihood by the size of the act if it begins at each time, given those by each
        axis's mean force."""
        out = np.zeros(len(self.time_s))
        for k, means in self.means.items():
            out += np.interp(self.time_s, self.before_s[k], _from_then_on(scores_of[k] * means))
        return out


def _from_then_on(values: Array) -> Array:
    """The sum (n,) of the values from each on."""
    return np.flip(np.cumsum(np.flip(values)))


@dataclass(frozen=True)
class _Residual:
    """What some causes leave of a dive, `left` (rows,), and the columns `known` to be projected out, with their
    `square`, and `free`, its inverse with the prior precision. least_nats: those a further cause must save in sample
    to be worth a look."""

    weighing: Weighing
    left: Array
    known: Blocks
    square: Array
    free: Array
    least_nats: float
    start_s: float

    @classmethod
    def of(cls, weighing: Weighing, some: Fitted, every: Fitted, start_s: float) -> "_Residual":
        """That of some of a fit's causes: another in the place of those left out must save more than they do."""
        rows = weighing.rows
        known = rows.nuisance.with_columns(rows.nuisance.blocks_of(some.slopes))
        precision = np.concatenate([rows.nominal_precision, np.zeros(some.slopes.shape[1])])
        square = known.square()
        free = inverse(square + np.diag(precision))
        left = some.value - known.times(free @ known.crossed(some.value[:, None]))[:, 0]
        instead = 0.5 * (some.residual_squares - every.residual_squares)
        least_nats = BEGINNING_NATS + (LEAST_GAIN if some is every else instead)
        return cls(weighing, left, known, square, free, least_nats, start_s)

    @property
    def course(self) -> Course:
        return self.weighing.now.course

    def likeliest_s(self, pushed: "_Pushed") -> float:
        """The time since the recording's start from which on an effect saves most in sample, of any size; 0 if that is
        too little."""
        saved, since_s = np.abs(pushed.later(self._scores)), self.course.since_s
        worth_a_look = 0.5 * saved**2 / pushed.squares >= NEAR_SHARE * self.least_nats
        able = (since_s >= LEAST_ACTING_S) & (since_s <= since_s[-1] - LEAST_ACTING_S) & self.course.recorded
        stretches = [some[worth_a_look[some]] for some in np.array_split(np.flatnonzero(able), STRETCHES)]
        if not any(map(len, stretches)):
            return 0.0
        _, best = self._begun([some[np.argmax(saved[some])] for some in stretches if len(some)], pushed.act)
        near = np.flatnonzero(
            able & worth_a_look & (np.abs(since_s - since_s[best]) < since_s[-1] / STRETCHES)
        )
        apart: list[np.intp] = [best]
        for i in near[np.argsort(-saved[near])]:
            if len(apart) <= NEAR_TIMES and np.abs(since_s[i] - since_s[apart]).min() >= APART_S:
                apart.append(i)
        nats, best = self._begun(apart, pushed.act)
        return self._of_recording_s(best) if nats > self.least_nats else 0.0

    def likeliest_stretch_s(self, pushed: "_Pushed") -> tuple[float, float]:
        """The times since the recording's start from and to which an effect saves most in sample, of any size; zeros if
        that is too little."""
        least_nats, since_s = self.least_nats + BEGINNING_NATS, self.course.since_s
        able = (since_s >= LEAST_ACTING_S) & (since_s <= since_s[-1] - LEAST_ACTING_S) & self.course.recorded
        at = np.flatnonzero(able)
        if not len(at):
            return 0.0, 0.0
        later = pushed.later(self._scores)
        stretches = [some for some in np.array_split(at, STRETCHES) if len(some)]
        rises = sorted((some[np.argmax(later[some])] for some in stretches), key=lambda i: -later[i])[
            :MOST_ENDS
        ]
        falls = sorted((some[np.argmin(later[some])] for some in stretches), key=lambda i: later[i])[
            :MOST_ENDS
        ]
        pairs = {(min(i, j), max(i, j)) for i in rises for j in falls}
        pairs.add(self._likeliest_pair(at[:: max(math.ceil(len(at) / MOST_INSTANTS), 1)], later, pushed))
        worth_a_look = [
            (i, j)
            for i, j in sorted(pairs)
            if since_s[j] - since_s[i] >= LEAST_ACTING_S
            and 0.5 * (later[i] - later[j]) ** 2 >= NEAR_SHARE * least_nats * pushed.squares[-1]
        ]
        if not worth_a_look:
            return 0.0, 0.0
        saved, (begin, end) = self._best(worth_a_look, pushed.act)
        if saved < HALF_SAVED * least_nats:
            return 0.0, 0.0
        steps = np.unique(np.round(np.array(NEAR_ENDS_S) / self.course.step_s).astype(np.intp))

        def near(instant: np.intp) -> list[np.intp]:
            return [i for i in (instant + steps).tolist() if 0 <= i < len(able) and able[i]]

        for _ in range(ENDS_TURNS):
            saved, (begin, end) = self._best([(i, end) for i in near(begin) if i < end], pushed.act)
            saved, (begin, end) = self._best([(begin, i) for i in near(end) if i > begin], pushed.act)
        lasts = since_s[end] - since_s[begin] >= LEAST_ACTING_S
        return (
            (self._of_recording_s(begin), self._of_recording_s(end))
            if lasts and saved > least_nats
            else (0.0, 0.0)
        )

    def _likeliest_pair(
        self, at: NDArray[np.intp], later: Array, pushed: "_Pushed"
    ) -> tuple[np.intp, np.intp]:
        """The likeliest begin and end among some instants, by squares known about: of a force that lasts."""
        square = np.maximum(pushed.squares[at][:, None] - pushed.squares[at], pushed.squares[-1])
        nats = (later[at][:, None] - later[at]) ** 2 / square
        nats[self.course.since_s[at] - self.course.since_s[at][:, None] < LEAST_ACTING_S] = 0.0
        begin, end = np.unravel_index(int(np.argmax(nats)), nats.shape)
        return at[begin], at[end]

    def _of_recording_s(self, at: np.intp) -> float:
        return round(float(self.course.time_s[at]) - self.start_s, 1)

    def _begun(self, at: Sequence[np.intp], act: Act) -> tuple[float, np.intp]:
        """The most nats that an act of any size saves in sample from one of these instants on, and that instant."""
        nats, (best, _) = self._best([(i, np.intp(len(self.course.time_s))) for i in at], act)
        return nats, best

    def _best(self, at: Sequence[tuple[np.intp, np.intp]], act: Act) -> tuple[float, tuple[np.intp, np.intp]]:
        """The most nats that an act of any size saves in sample over one of these stretches, and that stretch."""
        index = np.arange(len(self.course.time_s))
        within = [((index >= begin) & (index < end))[:, None] for begin, end in at]
        columns = self.weighing.rows.blocks(
            [act.each(partial(np.multiply, each)) for each in within], self.course
        )
        # All by products: the columns are zero in most axes, and what is left of them once the known ones are
        # projected out is in none.
        (by_known,) = self.known.products_between(columns, np.zeros(len(self.left), dtype=np.intp))
        taken, squares = self.free @ by_known, np.diag(columns.square())
        beyond = squares + np.sum(taken * (self.square @ taken - 2.0 * by_known), axis=0)
        saved = columns.crossed(self.left[:, None])[:, 0] - self._left_by_known @ taken
        nats = 0.5 * saved**2 / np.maximum(beyond, np.maximum(NOTHING_NEW * squares, 1e-300))
        best = int(np.argmax(nats))
        return float(nats[best]), at[best]

    @cached_property
    def _left_by_known(self) -> Array:
        """Products (m,) of the known columns with the remainder."""
        return self.known.crossed(self.left[:, None])[:, 0]

    @cached_property
    def _scores(self) -> list[Array]:
        """Derivatives of the log likelihood by each axis's mean force over each step."""
        rows = self.weighing.rows
        blocks = rows.nuisance.slices[: len(rows.axes)]
        return [scores(axis, self.left[mine]) for axis, mine in zip(rows.axes, blocks, strict=True)]
