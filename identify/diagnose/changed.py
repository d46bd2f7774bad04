"""Masses and dampings that changed since earlier acceptance, and the causes that a refit absorbs whole.

Some causes are absorbed entirely by a refit of the nominal model. Each shifts masses and dampings in its own pattern:
weaker thrust shifts all alike, a payload the masses by its kilograms. The shift since acceptance is regressed on
these patterns by generalised least squares (Aitken 1935), weighted by the precision of both values, with the causes
of the dive fitted too.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import DAMPINGS, MASSES, QUADRATICS
from bridge.vehicle.config import Prior
from identify.diagnose.causes.ambiguity import LEAST_LIKENESS
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.causes.evidence import Blocks, inverse
from identify.diagnose.causes.requirement import LEAST_GAIN
from identify.diagnose.causes.search import Explanation
from identify.diagnose.causes.weighing import Fitted, Weighing
from identify.diagnose.feedforward_gain import braking_of, feedforward_gain_by
from identify.diagnose.filters.nominal import Nominal, hull_indices
from identify.diagnose.filters.regression import mean_indices
from identify.diagnose.findings import probability
from identify.diagnose.gap.missing import Missing
from identify.diagnose.gap.simulation import EACH
from identify.diagnose.result import Finding, Tried, Value
from identify.effects.course import Course
from identify.effects.effect import Act, Effect
from identify.estimators.missing_forces.screening import LEAST_FORCE
from identify.statistics import Z95

ALIKE_NATS = 2.0
"""Margin within which two changes are ambiguous."""

MOST = 2


@dataclass(frozen=True)
class Shift:
    """Relative shift (k,) from this dive's parameters to the accepted values, with precision (k, k).

    patterns (e, k): shift by removal of one unit of each effect.
    """

    size: Array
    precision: Array
    effects: tuple[Effect, ...]
    patterns: Array

    def without(self, chosen: Sequence[int]) -> tuple[Array, Array, Array]:
        """Residual shift (k,) with some effects taken out, their sizes (c,) and covariance."""
        columns = self.patterns[list(chosen)].T
        covariance = np.linalg.pinv(columns.T @ self.precision @ columns, hermitian=True)
        sizes = covariance @ (columns.T @ self.precision @ self.size)
        return np.asarray(self.size - columns @ sizes), np.asarray(sizes), np.asarray(covariance, np.float64)

    def nats(self, chosen: Sequence[int]) -> float:
        """Nats saved by some effects together."""
        if not chosen:
            return 0.0
        left, _, _ = self.without(chosen)
        return 0.5 * float(self.size @ self.precision @ self.size - left @ self.precision @ left)

    def excess(self, chosen: Sequence[int]) -> float:
        """By how much the squares that some effects leave exceed what both sides are known to, at least 1 (Birge 1932);
        1 for the first of them, to which all of the shift may be due."""
        if len(chosen) < 2:
            return 1.0
        left, _, _ = self.without(chosen)
        free = max(len(self.size) - len(chosen), 1)
        return max(1.0, float(left @ self.precision @ left) / free)

    def best_further(self, chosen: Sequence[int]) -> list[tuple[float, int]]:
        """Nats and index of each further effect, best first; other forms of a chosen effect are left out."""
        taken, base = {self.effects[k].name for k in chosen}, self.nats(chosen)
        return sorted(
            (
                ((self.nats([*chosen, k]) - base) / self.excess([*chosen, k]), k)
                for k, effect in enumerate(self.effects)
                if effect.name not in taken
            ),
            reverse=True,
        )


def shift_of(explanation: Explanation, accepted: Mapping[str, Prior], library: Sequence[Effect]) -> Shift:
    """The shift of masses and dampings known both from the dive and from acceptance."""
    weighing, now = explanation.weighing, explanation.now
    equations, indices = _equations_with_causes(weighing, explanation.fit)
    covariance = equations.inverse[: len(indices), : len(indices)]
    names, at, prior = [], [], []
    for name, index in _coefficient_indices(now):
        if name in accepted:
            names.append(name)
            at.append(indices.index(index))
            prior.append(accepted[name])
    theta = now.theta[[indices[k] for k in at]]
    fitted = np.exp(theta)
    value, std = np.array([p.value for p in prior]), np.array([p.std for p in prior])
    covariance_both = covariance[np.ix_(at, at)] + np.diag((std / fitted) ** 2)
    effects = tuple(item for item in library if item.refit_absorbs and len(item.parameters) == 1)
    patterns = [
        _pattern(effect, weighing, equations)[at]
        if _is_push(effect, now.course)
        else _direct_pattern(effect, now, names)
        for effect in effects
    ]
    precision = np.asarray(np.linalg.inv(covariance_both), dtype=np.float64)
    return Shift(value / fitted - 1.0, precision, effects, np.array(patterns))


def changes_of(
    shift: Shift, explanation: Explanation, missing: Missing
) -> tuple[tuple[Finding, ...], tuple[Tried, ...]]:
    """The causes of a significant shift, and all candidates."""
    chosen: list[int] = []
    also: dict[int, dict[str, float]] = {}
    while len(chosen) < MOST:
        ranked = shift.best_further(chosen)
        if not ranked or ranked[0][0] < LEAST_GAIN:
            break
        best, k = ranked[0]
        also[k] = {
            shift.effects[other].name: alike
            for nats, other in ranked[1:]
            if best - nats < ALIKE_NATS
            and shift.effects[other].name != shift.effects[k].name
            and (alike := _likeness(shift, k, other)) >= LEAST_LIKENESS
        }
        chosen.append(k)
    causes = tuple(_finding(shift, chosen, i, also[k], explanation, missing) for i, k in enumerate(chosen))
    remaining = [(gain, k, False) for gain, k in shift.best_further(chosen)]
    of_causes = [(cause.gain_nats, k, True) for cause, k in zip(causes, chosen, strict=True)]
    tried = (Tried(shift.effects[k], nats, yes) for nats, k, yes in (*of_causes, *remaining))
    return causes, tuple(tried)


def beyond_the_curve(
    findings: Sequence[Finding], course: Course
) -> tuple[tuple[Finding, ...], tuple[Finding, ...]]:
    """The changes, and those that push, but less than LEAST_FORCE of the thrust in every degree of freedom: no thrust
    curve is known better."""
    least = LEAST_FORCE * course.wrench_of(course.thrust_n).std(axis=0)

    def is_slight(finding: Finding) -> bool:
        push = _as_wrench(finding.cause.act(course), course).std(axis=0)
        return bool(push.any() and np.all(push <= least))

    slight = tuple(filter(is_slight, findings))
    return tuple(each for each in findings if each not in slight), slight


def _finding(
    shift: Shift,
    chosen: Sequence[int],
    i: int,
    also: dict[str, float],
    explanation: Explanation,
    missing: Missing,
) -> Finding:
    effect = shift.effects[chosen[i]]
    (parameter,) = effect.parameters
    _, sizes, covariance = shift.without(chosen)
    if sizes[i] < 0 and effect.less:
        effect = replace(effect, sentence=effect.less, is_less=True)
    cause = Cause(effect, np.clip(effect.none() + sizes[i], parameter.low, parameter.high))
    half = Z95 * float(np.sqrt(covariance[i, i]))
    values = {
        name: Value(value, unit, value - half, value + half)
        for name, (value, unit) in effect.answer_parameters(cause.values).items()
    }
    others = [k for k in chosen if k != chosen[i]]
    nats = (shift.nats(chosen) - shift.nats(others)) / (shift.excess(chosen) if i else 1.0)
    wrench = _as_wrench(cause.act(explanation.now.course), explanation.now.course)
    braking = braking_of(explanation.causes, explanation.now)
    gain = (
        feedforward_gain_by(missing.wrench - wrench[::EACH], missing, explanation.now, braking)
        if effect.feedforward
        else None
    )
    return Finding(cause, tuple(also), also, probability(nats), values, nats, gain)


def _likeness(shift: Shift, number: int, other: int) -> float:
    a, b, p = shift.patterns[number], shift.patterns[other], shift.precision
    return float(abs(a @ p @ b) / max(np.sqrt((a @ p @ a) * (b @ p @ b)), 1e-300))


@dataclass(frozen=True)
class _Equations:
    """The columns of the nominal parameters, and after them of the causes' parameters, and the covariance `inverse`
    (k, k) of all their sizes."""

    columns: Blocks
    inverse: Array


def _equations_with_causes(weighing: Weighing, fit: Fitted) -> tuple[_Equations, list[int]]:
    """The equations of the nominal parameters, with the causes' parameters fitted too; their indices in theta.

    The thrust is held to its curve, without a scale.
    """
    joint = weighing.now.joint
    indices = sorted({*joint.mass_indices, *mean_indices(joint)})
    nominal = weighing.rows.nuisance
    columns = nominal.with_columns(nominal.blocks_of(fit.slopes))
    square = columns.square()
    square[weighing.rows.scales, :] = square[:, weighing.rows.scales] = 0.0
    known = np.concatenate([weighing.rows.nominal_precision, np.zeros(fit.slopes.shape[1])])
    return _Equations(columns, inverse(square + np.diag(known))), indices


def _coefficient_indices(now: Nominal) -> list[tuple[str, int]]:
    """Name and index in theta of each mass and drag; a mass as in its own axis' equation."""
    return [
        (name, of_axis.start + k)
        for problem, of_axis in zip(now.joint.problems, now.joint.slices, strict=True)
        for name, k in hull_indices(problem).items()
    ]


def _is_push(effect: Effect, course: Course) -> bool:
    act = effect.act(course, effect.start())
    return act.mass is None and act.damping is None


def _pattern(effect: Effect, weighing: Weighing, equations: _Equations) -> Array:
    """Shift of the nominal parameters, logarithmic, by removal of one unit of a force or reading error."""
    course = weighing.now.course
    unit = effect.act(course, effect.none() + 1.0)
    crossed = equations.columns.crossed(weighing.rows.columns([unit], course))[:, 0]
    crossed[weighing.rows.scales] = 0.0
    return np.asarray(equations.inverse @ crossed)


def _direct_pattern(effect: Effect, now: Nominal, names: Sequence[str]) -> Array:
    """Relative shift by removal of one unit of a direct change of masses and drags."""
    act = effect.act(now.course, effect.none() + 1.0)
    share = {}
    for dof in range(6):
        share[MASSES[dof].name] = 0.0 if act.mass is None else -act.mass[dof] / now.course.mass[dof]
        less = 0.0 if act.damping is None else -act.damping[dof]
        share[DAMPINGS[dof].name] = less / max(now.course.damping[dof], 1e-9)
        less = 0.0 if act.quadratic is None else -act.quadratic[dof]
        share[QUADRATICS[dof].name] = less / max(now.course.quadratic[dof], 1e-9)
    return np.array([share[name] for name in names])


def _as_wrench(act: Act, course: Course) -> Array:
    """Wrench (n, 6) of an act, including that of its change of masses and dampings."""
    out = np.zeros_like(course.nu) if act.wrench is None else act.wrench.copy()
    if act.mass is not None:
        out -= act.mass * course.nu_dot + course.coriolis_of(act.mass, course.nu)
    if act.damping is not None:
        out -= act.damping * course.nu
    return out
