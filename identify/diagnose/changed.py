"""Changes since earlier acceptance: of accepted effects, of masses and dampings, and of a simulator's model.

Some causes are absorbed entirely by a refit of the nominal model. Each shifts masses and dampings in its own pattern:
weaker thrust shifts all alike, a payload the masses by its kilograms. The shift since acceptance is regressed on
these patterns by generalised least squares (Aitken 1935), weighted by the precision of both values, with the causes
of the dive fitted too.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import DAMPINGS, MASSES, QUADRATICS, AcceptedEffect
from bridge.vehicle.config import Prior
from identify.diagnose.candidates import Cause
from identify.diagnose.cause_words import SINCE, effect_words, value_words
from identify.diagnose.confidence import LEAST_LIKENESS
from identify.diagnose.evidence import inverse
from identify.diagnose.feedforward_gain import braking_of, feedforward_gain_by
from identify.diagnose.findings import probability
from identify.diagnose.gap import Missing
from identify.diagnose.nominal import Nominal, hull_indices, refitted
from identify.diagnose.regression import mean_indices
from identify.diagnose.requirement import LEAST_GAIN
from identify.diagnose.result import Diagnosis, Finding, Tried, Value
from identify.diagnose.search import Explanation
from identify.diagnose.simulation import EACH
from identify.diagnose.weighing import Fitted, Weighing
from identify.effects.course import Course
from identify.effects.effect import Act, Effect, Told
from identify.estimators.likelihood_axis import AxisLikelihood
from identify.statistics import Z95
from identify.words import listed

PASSES = 2
"""Fixed-point passes: an effect depends on velocity, and velocity on the effect."""

ALIKE_NATS = 2.0
"""Margin within which two changes are ambiguous."""

MOST = 2


@dataclass(frozen=True)
class AcceptedCauses:
    """Accepted effects as causes: `lasting` ones of the vehicle, and `passing` ones of one dive's water or tether.

    unknown: words on the effects that the library lacks.
    """

    lasting: tuple[Cause, ...]
    passing: tuple[Cause, ...] = ()
    unknown: tuple[str, ...] = ()

    def in_force(self, fitted: Nominal) -> Nominal:
        """The dive `fitted` less the lasting effects, and less each passing one that the dive bears out: without it the
        filters are less likely by LEAST_GAIN."""
        now, causes = with_accepted(fitted, self.lasting), self.lasting
        for cause in self.passing:
            trial = with_accepted(fitted, (*causes, cause))
            if trial.log_posterior > now.log_posterior + LEAST_GAIN:
                now, causes = trial, (*causes, cause)
        return now

    def sentences(self, held: Sequence[Cause]) -> tuple[str, ...]:
        """Accepted causes that the model holds, and those it does not."""
        kept = {cause.key for cause in held}
        gone = [effect_words(cause.effect) for cause in self.passing if cause.key not in kept]
        left = [*self.unknown, *(f"{words} (of that dive alone)" for words in gone)]
        without = (f"Accepted, but not in the model before: {listed(left)}.",) if left else ()
        return (*_held_sentence(held), *without)


def accepted_causes(accepted: Sequence[AcceptedEffect], library: Sequence[Effect]) -> AcceptedCauses:
    """Accepted effects as causes. An effect that a refit absorbs is part of the accepted masses and dampings, and left
    out."""
    by_label = {(effect.label, effect.number): effect for effect in library}
    lasting: list[Cause] = []
    passing: list[Cause] = []
    unknown = []
    for effect_accepted in accepted:
        effect = by_label.get((effect_accepted.label, effect_accepted.number))
        if effect is None or {p.name for p in effect.parameters} != set(effect_accepted.parameters):
            unknown.append(f"{effect_accepted.label} (this library has no such effect)")
            continue
        cause = Cause(effect, np.array([effect_accepted.parameters[p.name] for p in effect.parameters]))
        if not effect.refit_absorbs and cause.present.any():
            (lasting if effect.lasting else passing).append(cause)
    return AcceptedCauses(tuple(lasting), tuple(passing), tuple(unknown))


def _held_sentence(causes: Sequence[Cause]) -> tuple[str, ...]:
    """A sentence on the accepted effects in the model before; empty without any."""
    sentences_of = []
    for cause in causes:
        shown = {p.name for p, has in zip(cause.effect.parameters, cause.present, strict=True) if has}
        values = [
            value_words(name, Value(value, unit, np.nan, np.nan))
            for name, (value, unit) in cause.effect.told(cause.values).items()
            if name != "thruster" and (name in shown or cause.effect.telling is not None)
        ]
        sentences_of.append(f"{effect_words(cause.effect)} ({', '.join(values)})")
    return (f"The model before holds what was accepted: {listed(sentences_of)}.",) if sentences_of else ()


def with_accepted(nominal: Nominal, causes: Sequence[Cause]) -> Nominal:
    """A dive less the accepted causes' forces, reading errors and witness contributions, fitted again."""
    if not causes:
        return nominal
    now = nominal
    for _ in range(PASSES):
        now = refitted(nominal, [cause.act(now.course) for cause in causes], now)
    seen = tuple(replace(witness, off=witness.left(now.acts)) for witness in nominal.witnesses)
    return replace(now, acts=(), witnesses=seen, accepted=tuple(causes))


def library_with_changes(library: Sequence[Effect], causes: Sequence[Cause]) -> tuple[Effect, ...]:
    """The library with each accepted effect replaced by a change of it.

    An effect that is absent at infinity stays: its addition is a limit of its own.
    """
    of = {cause.effect.label: cause for cause in causes if np.isfinite(cause.effect.none()).all()}
    return tuple(_change(of[effect.label]) if effect.label in of else effect for effect in library)


def _change(cause: Cause) -> Effect:
    """A change of an accepted effect: parameters are differences, 0 for no change."""
    effect, before = cause.effect, cause.values
    parameters = tuple(
        replace(
            p,
            start=p.start - p.none,
            low=p.low - value,
            high=p.high - value,
            none=0.0,
            sure=(p.sure[0] - value, p.sure[1] - value),
            seldom_above=p.seldom_above - value,
        )
        for p, value in zip(effect.parameters, before.tolist(), strict=True)
    )

    def act(course: Course, by: Array) -> Act:
        return effect.act(course, before + by).less(effect.act(course, before))

    def telling(by: Array) -> Told:
        was = effect.told(before)
        return {
            name: (value - was[name][0], unit)
            for name, (value, unit) in effect.told(before + by).items()
            if name != "thruster"
        }

    return replace(
        effect,
        sentence=f"{effect.sentence}, other than it was accepted (told is by how much)",
        parameters=parameters,
        act=act,
        variant=SINCE,
        telling=None if effect.telling is None else telling,
    )


def all_accepted(findings: Sequence[Finding], causes: Sequence[Cause]) -> tuple[Finding, ...]:
    """The effects of a model with causes accepted in addition to its earlier effects, each with its change included."""
    changes = {finding.cause.key: finding for finding in findings if finding.cause.effect.variant == SINCE}
    changed = tuple(_with_change(cause, changes.get(cause.key)) for cause in causes)
    return (*changed, *(finding for finding in findings if finding.cause.effect.variant != SINCE))


def _with_change(cause: Cause, change: Finding | None) -> Finding:
    values = cause.values if change is None else cause.values + change.cause.values
    whole = Cause(cause.effect, values)
    absent = {p.name: p.none for p in cause.effect.parameters} if cause.effect.telling is None else {}
    parameters = {}
    for name, (value, unit) in whole.effect.told(values).items():
        by = None if change is None else change.parameters.get(name)
        if by is not None:
            ends = value + by.low95 - by.value, value + by.high95 - by.value
        else:
            # The interval at acceptance is in its own file; an absent parameter is certain.
            ends = (value, value) if value == absent.get(name) else (np.nan, np.nan)
        parameters[name] = Value(value, unit, *ends)
    if change is None:
        return Finding(whole, (), {}, 1.0, parameters, 0.0)
    return replace(change, cause=whole, parameters=parameters)


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
    covariance, indices = _nominal_covariance(weighing, explanation.fit)
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
        _pattern(effect, weighing, covariance)[at]
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
    cause = Cause(effect, np.clip(effect.none() + sizes[i], parameter.low, parameter.high))
    half = Z95 * float(np.sqrt(covariance[i, i]))
    values = {
        name: Value(value, unit, value - half, value + half)
        for name, (value, unit) in effect.told(cause.values).items()
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


def _nominal_covariance(weighing: Weighing, fit: Fitted) -> tuple[Array, list[int]]:
    """Covariance of the nominal parameters, with the causes' parameters fitted too, and their indices in theta.

    The thrust is held to its curve, without a scale.
    """
    joint = weighing.now.joint
    indices = sorted({*joint.mass_indices, *mean_indices(joint)})
    nominal = weighing.rows.nuisance
    square = nominal.with_columns(nominal.blocks_of(fit.slopes)).square()
    square[weighing.rows.scales, :] = square[:, weighing.rows.scales] = 0.0
    known = np.concatenate([weighing.rows.nominal_precision, np.zeros(fit.slopes.shape[1])])
    return inverse(square + np.diag(known))[: len(indices), : len(indices)], indices


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


def _pattern(effect: Effect, weighing: Weighing, inverse: Array) -> Array:
    """Shift of the nominal parameters, logarithmic, by removal of one unit of a force or reading error."""
    course = weighing.now.course
    unit = effect.act(course, effect.none() + 1.0)
    column = weighing.rows.columns([unit], course)
    return np.asarray(inverse @ weighing.rows.nuisance.crossed(column)[: len(inverse), 0])


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


LEAST = 1e-9
"""A drag that is accepted as zero."""

HELD_STD = 1e-3
"""Relative width of masses and dampings held at the simulator's values, against a refit."""


@dataclass(frozen=True)
class Simulator:
    """A simulator's model.

    values: coefficients of the nominal model by name, as far as its recording determines them; causes: its own
    effects, which hold on any dive.
    """

    values: Mapping[str, Value]
    causes: tuple[Cause, ...]

    def filters_of(self, nominal: Nominal) -> Nominal:
        """A dive's filters with the simulator's parameters and effects alone; trims and noise levels are the dive's
        own.

        Of an interval for a mass or damping, the value nearest to the dive's is held: an undetermined value is no
        error of the simulator.
        """
        joint = nominal.joint
        theta = nominal.theta.copy()
        for problem, of_axis in zip(joint.problems, joint.slices, strict=True):
            for k, log in self._logs(problem, nominal.theta[of_axis]).items():
                theta[of_axis.start + k] = log
        held = tuple(
            self._held(problem, nominal.theta[of_axis])
            for problem, of_axis in zip(joint.problems, joint.slices, strict=True)
        )
        locked = replace(joint, problems=held, apart_prior=self._apart(nominal))
        acts = [cause.act(nominal.course) for cause in self.causes]
        return refitted(replace(nominal, joint=locked, theta=theta), acts)

    def _held(self, problem: AxisLikelihood, theta: Array) -> AxisLikelihood:
        mean, precision = problem.prior_mean.copy(), problem.prior_precision.copy()
        for k, log in self._logs(problem, theta).items():
            mean[k], precision[k] = log, HELD_STD**-2
        return replace(problem, prior_mean=mean, prior_precision=precision)

    def _apart(self, nominal: Nominal) -> Array:
        prior = nominal.joint.apart_prior.copy()
        for k, dof in enumerate(nominal.joint.apart):
            mass = self.values.get(MASSES[dof].name)
            if mass is not None:
                prior[k] = _nearest(mass, float(np.log(nominal.course.mass[dof]))), HELD_STD**-2
        return prior

    def _logs(self, problem: AxisLikelihood, theta: Array) -> dict[int, float]:
        """Logarithms of an axis's mass and drags by their indices in its theta; empty if the simulator lacks the mass
        or the drag, of two drags the linear."""
        indices = hull_indices(problem)
        if not {*list(indices)[:2]} <= self.values.keys():
            return {}
        return {
            k: _nearest(self.values[name], theta[k]) for name, k in indices.items() if name in self.values
        }


def priors_of(simulator: Simulator) -> dict[str, Prior]:
    """Its masses and dampings with their widths, as priors for the real dive."""
    return {
        name: Prior(
            value.value, (value.high95 - value.low95) / (2 * Z95), "the simulator's recording", "thrust"
        )
        for name, value in simulator.values.items()
        if value.high95 > value.low95
    }


def _nearest(value: Value, log_here: float) -> float:
    """The logarithm within the interval that is nearest to `log_here`."""
    low, high = np.log(np.maximum([value.low95, value.high95], LEAST))
    return float(np.clip(log_here, low, high))


def simulator_of(diagnosis: Diagnosis) -> Simulator:
    """Build the simulator's model from the diagnosis of its own recording."""
    causes = tuple(finding.cause for finding in diagnosis.findings if finding.cause.effect.lasting)
    return Simulator(diagnosis.numbers, causes)
