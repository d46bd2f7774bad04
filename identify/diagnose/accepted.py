"""The result of accepting the likely causes: a model with its effects, parameters of the feed-forward, and doubts.

Only causes that are likelier present than absent are accepted, with the hull's coefficients fitted together with them.
Sentences name the effects that the feed-forward can't compensate. The doubts are those of any fit; they widen the
intervals by the coefficients' changes if the cause of a doubt were part of the model.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import (
    DAMPINGS,
    DOFS,
    MASSES,
    OF_HULL,
    QUADRATIC_NAMES,
    AcceptedEffect,
    effect_coefficients,
)
from bridge.vehicle.config import Configuration
from bridge.vehicle.feedforward import FEEDFORWARD_DOFS
from bridge.vehicle.parameters import bounds
from identify.checks.actuation.controller import READINGS
from identify.checks.fit.missing_forces import drag_doubts
from identify.checks.fit.thrust_timing import late_doubts
from identify.diagnose.accepted_before import all_accepted
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.causes.evidence import inverse
from identify.diagnose.causes.search import Explanation, explained_by
from identify.diagnose.filters.nominal import Nominal, hull_indices
from identify.diagnose.filters.regression import mean_indices, regression_of
from identify.diagnose.result import Accepted, Finding, Value
from identify.diagnose.shrink.shrunk import LIKELY
from identify.diagnose.words.causes import alike_words, effect_words, name_of, percent_bounded
from identify.doubt import Culprit, Doubt
from identify.effects.course import Course
from identify.effects.effect import Compensation, Effect
from identify.estimators.identifiability import is_too_heavy, is_too_light
from identify.estimators.likelihood.axis import MASS, AxisLikelihood
from identify.estimators.missing_forces.drag_and_timing import Multiplier, doubts_of, timing_of
from identify.statistics import Z95
from identify.words import capital, listed

MOST_CHANGE = 3.0
"""A logarithm that changes by more is unknown anyway."""

LEAST_KNOWN = 0.2
"""Relative standard error of a mass from which its axis is not sent, and the vehicle keeps its present values."""

WELL_KNOWN = 0.05
"""The same, misfit included, of an axis that has no feed-forward, and to which no quadratic drag was accepted: nothing
on board is lost by keeping what another dive told better."""

ROW = {name: row for row, name in enumerate(OF_HULL)}

HELD_BY_PID = QUADRATIC_NAMES[2:5]
"""Quadratic drag in heave, roll and pitch, which have no feed-forward."""


@dataclass(frozen=True)
class Known:
    """How well a fit with causes tells the hull's coefficients: covariance of the logarithms of the nominal parameters,
    and the row `at` of each index in theta."""

    now: Nominal
    covariance: Array
    at: Mapping[int, int]

    def stds(self) -> list[dict[int, float]]:
        """Standard errors of the logarithms of each axis's mass and drags, by their indices in its part of theta."""
        std = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        joint = self.now.joint
        return [
            {k: float(std[self.at[of_axis.start + k]]) for k in hull_indices(problem).values()}
            for problem, of_axis in zip(joint.problems, joint.slices, strict=True)
        ]

    def correlations(self) -> dict[frozenset[str], float]:
        """Correlations of the logarithms of the hull's coefficients, by pairs of names."""
        of = {
            name: self.at[of_axis.start + k]
            for problem, of_axis in zip(self.now.joint.problems, self.now.joint.slices, strict=True)
            for name, k in hull_indices(problem).items()
        }
        std = np.sqrt(np.maximum(np.diag(self.covariance), 1e-300))
        return {
            frozenset((first, second)): float(
                self.covariance[of[first], of[second]] / (std[of[first]] * std[of[second]])
            )
            for first, second in combinations(of, 2)
        }


@dataclass(frozen=True)
class Misfit:
    """Evidence against a fit with causes: doubts on masses and dampings, and `off` (18,), systematic errors of the
    logarithms of `OF_HULL`."""

    doubts: tuple[Doubt, ...]
    off: Array


NO_MISFIT = Misfit((), np.zeros(len(OF_HULL)))


def misfit_of(now: Nominal, quadratic: Collection[int]) -> Misfit:
    """Misfit of a fit with causes that include quadratic drag in the degrees of freedom `quadratic`.

    A dive that asks for other quadratic drag than accepted can't separate it from linear damping. Doubted degrees of
    freedom are left out: their thrust only seems late.
    """
    tests = {
        dof: test
        for dof, test in doubts_of(now.joint, now.theta).items()
        if dof not in now.feedback_unrecorded
    }
    late = {dof: test.late for dof, test in tests.items() if test.is_late}
    drag = {dof: test.drag for dof, test in tests.items() if test.lacks_drag}
    held_together = {dof: test for dof, test in drag.items() if dof in quadratic}
    lacking = {dof: test for dof, test in drag.items() if dof not in held_together}
    # A single step from zero: the form of these forces is a guess.
    steps = [test.size * test.leaning for test in (*drag.values(), *late.values())]
    off = np.sqrt(np.sum(np.square([np.zeros(len(OF_HULL)), *steps, *timing_of(tests)]), axis=0))
    return Misfit(
        (
            *late_doubts(late, [dof for dof in now.built.pushed if dof in tests]),
            *drag_doubts(lacking),
            *(_not_apart(dof, test) for dof, test in held_together.items()),
        ),
        np.minimum(off, MOST_CHANGE),
    )


def _not_apart(dof: int, tested: Multiplier) -> Doubt:
    more, less = ("more", "less") if tested.size > 0 else ("less", "more")
    return Doubt(
        (DAMPINGS[dof].name,),
        f"In {DOFS[dof]} {more} quadratic drag than was accepted and {less} linear damping would fit this dive better "
        f"({tested.score:+.0f} standard errors)",
        "the two hold together, at the speeds of this dive, and the interval of "
        "the linear one is widened by what is between them; coast down from full speed to tell them apart.",
        culprit=Culprit.MODEL,
    )


def accepted_of(findings: Sequence[Finding], known: Known, configuration: Configuration) -> Accepted:
    """The result of accepting these causes.

    `known` is of the nominal model fitted together with them, which includes causes absorbed by a refit.
    """
    quadratic, now = _quadratic_dofs(findings), known.now
    misfit = misfit_of(now, quadratic)
    values, sentences = _of_hull(known, configuration, misfit, quadratic, WELL_KNOWN)
    of_effects: dict[str, Value] = {}
    lasting = [finding for finding in findings if not finding.cause.effect.has_ended]
    sentences += [
        f"{capital(effect_words(finding.cause.effect))} is over, and is not accepted."
        for finding in findings
        if finding.cause.effect.has_ended
    ]
    for finding in lasting:
        coefficients = _coefficients(finding, now.course)
        if not coefficients:
            sentences.append(_uncompensated_note(finding))
        # Two forms of one cause, as of a centre of mass, add up.
        for name, value in coefficients.items():
            of_effects[name] = _sum(of_effects[name], value) if name in of_effects else value
        sentences += _remarks(finding)
    fit = {coefficient.name: coefficient for coefficient in effect_coefficients(configuration)}
    for name, value in of_effects.items():
        fault = fit[name].fault(value.value) if name in fit else f"{name} is of no thruster of this vehicle"
        if fault:
            sentences.append(f"{fault}: it is not sent to the vehicle; mend what it tells of.")
        elif not _includes(value, fit[name].neutral):
            values[name] = value
    effects = tuple(_effect(finding) for finding in lasting)
    doubts = tuple(finding for finding in misfit.doubts if not values.keys().isdisjoint(finding.about))
    return Accepted(values, effects, tuple(dict.fromkeys(sentences)), doubts)


def hull_with_all_causes(known: Known, configuration: Configuration) -> dict[str, Value]:
    """The hull's coefficients fitted together with all causes, accepted or not, of which `known` is."""
    return _of_hull(known, configuration)[0]


def _quadratic_dofs(findings: Sequence[Finding]) -> tuple[int, ...]:
    """Degrees of freedom with quadratic drag among the causes."""
    present = {name for cause in findings for name, value in cause.parameters.items() if value.value}
    return tuple(dof for dof, name in enumerate(QUADRATIC_NAMES) if name in present)


def _includes(value: Value | None, absent: float) -> bool:
    return value is not None and value.low95 <= absent <= value.high95


def _effect(finding: Finding) -> AcceptedEffect:
    """The effect without parameters that are undetermined or compatible with absence."""
    effect = finding.cause.effect
    untold = {
        p.name for p in effect.parameters if p.name not in finding.parameters and effect.telling is None
    }
    values = {
        p.name: p.none
        if p.name in untold or _includes(finding.parameters.get(p.name), p.none)
        else float(value)
        for p, value in zip(effect.parameters, finding.cause.values, strict=True)
    }
    return AcceptedEffect(effect.name, effect.throughout.label, values, effect.number)


def _of_hull(
    known: Known,
    configuration: Configuration,
    misfit: Misfit = NO_MISFIT,
    quadratic: Collection[int] = (),
    idle_known: float = np.inf,
) -> tuple[dict[str, Value], list[str]]:
    """The hull's determined coefficients, with intervals that include the misfit.

    `idle_known`: relative error of a mass, misfit included, from which an axis is left out that has no feed-forward.
    Coefficients biased by a closed loop through an unrecorded reading are left out. Where drag is linear and
    quadratic, by the vehicle file or by a cause in the degrees of freedom `quadratic`, either may be absent.
    """
    values, sentences, now = {}, [], known.now
    mass = now.course.mass
    kept = {c.name: bounds(c, configuration) for c in OF_HULL.values()}
    unrecorded = [problem for problem in now.joint.problems if problem.axis.dof in now.feedback_unrecorded]
    if unrecorded:
        sentences.append(_unrecorded_note(unrecorded))
    axes = zip(now.joint.problems, now.joint.slices, known.stds(), strict=True)
    for problem, of_axis, stds in axes:
        dof = problem.axis.dof
        theta = now.theta[of_axis]
        fitted = {
            OF_HULL[name]: (float(np.exp(theta[k])), stds[k]) for name, k in hull_indices(problem).items()
        }
        axis = fitted | {MASSES[dof]: (float(mass[dof]), stds[MASS])}
        if dof in now.feedback_unrecorded:
            continue
        outside = [c.name for c, (v, _) in axis.items() if not kept[c.name][0] <= v <= kept[c.name][1]]
        spread = float(np.hypot(stds[MASS], misfit.off[dof]))
        far = float(np.exp(Z95 * spread))
        if is_too_light(MASSES[dof], mass[dof] * far, configuration) or is_too_heavy(
            MASSES[dof], mass[dof] / far, configuration
        ):
            outside.append(MASSES[dof].name)
        acts = dof in FEEDFORWARD_DOFS or dof in quadratic
        if not (stds[MASS] < LEAST_KNOWN and (acts or spread < idle_known)) or outside:
            why = (
                f"{outside[0]} came out where no such vehicle can be"
                if outside
                else "this dive hardly tells them"
            )
            sentences.append(f"{listed([c.name for c in axis])} stay as the vehicle has them: {why}.")
            continue
        for coefficient, (value, std) in axis.items():
            reach = Z95 * float(np.hypot(std, misfit.off[ROW[coefficient.name]]))
            low, high = value * np.exp(-reach), value * np.exp(reach)
            is_one_drag_of_two = coefficient.kind != "mass" and (dof in quadratic or len(axis) > 2)
            if is_one_drag_of_two and reach >= 1.0:
                low, high = 0.0, value * (1.0 + reach)
            values[coefficient.name] = Value(float(value), coefficient.unit, float(low), float(high))
    return values, sentences


def _unrecorded_note(problems: Sequence[AxisLikelihood]) -> str:
    """A sentence that these axes keep their values, because an unrecorded reading closed their loop."""
    dofs = [problem.axis.dof for problem in problems]
    names = listed([name for problem in problems for name in hull_indices(problem)])
    used = listed(list(dict.fromkeys(READINGS[dof] for dof in dofs)))
    return (
        f"{names} stay as the vehicle has them: in {listed([DOFS[dof] for dof in dofs])} the controller used a reading "
        "that was not recorded, and a fit takes for mass what its thrust did about what disturbed the vehicle; record "
        f"the very {used} that the controller uses."
    )


def known_with_causes(causes: Sequence[Cause], now: Nominal) -> Known:
    """How well the filters of `now` tell the hull's coefficients, with the causes fitted too."""
    rows = regression_of(now.joint, now.theta, now.feedback_maybe_unrecorded)
    slopes = [
        cause.slope(now.course, p)
        for cause in causes
        if not cause.effect.refit_absorbs
        for p in np.flatnonzero(cause.present).tolist()
    ]
    columns = rows.nuisance.with_columns(rows.blocks(slopes, now.course))
    precision = np.concatenate([rows.nominal_precision, np.zeros(len(slopes))])
    kept = sorted({*now.joint.mass_indices, *mean_indices(now.joint)})
    covariance = inverse(columns.square() + np.diag(precision))
    return Known(now, covariance, {index: row for row, index in enumerate(kept)})


def _coefficients(finding: Finding, course: Course) -> dict[str, Value]:
    """A cause's values as coefficients of the feed-forward; empty if it has none."""
    compensation, nan = finding.cause.effect.compensation, float("nan")
    values: dict[str, Value] = {}
    for coefficient in () if compensation is None else compensation(course):
        if not coefficient.of:
            values[coefficient.name] = Value(coefficient.slope, coefficient.unit, nan, nan)
        elif coefficient.of in finding.parameters:
            values[coefficient.name] = _converted(finding.parameters[coefficient.of], coefficient)
    return values


def _converted(value: Value, by: Compensation) -> Value:
    low, high = sorted(by.slope * (end - by.none) for end in (value.low95, value.high95))
    return Value(by.slope * (value.value - by.none), by.unit, low, high)


def _sum(value: Value, other: Value) -> Value:
    reach = np.hypot(value.high95 - value.low95, other.high95 - other.low95) / 2
    total = value.value + other.value
    return Value(total, value.unit, float(total - reach), float(total + reach))


def _uncompensated_note(finding: Finding) -> str:
    cause_name = capital(name_of(finding))
    if finding.cause.effect.feedforward and finding.cause.effect.refit_absorbs:
        return f"{cause_name} is in the masses and dampings of this dive, which are sent."
    if finding.cause.effect.acts_on in ("reading", "log"):
        return (
            f"{cause_name} lies in what is read, not in how the vehicle moves: correct it where it is read."
        )
    if finding.cause.effect.acts_on == "water":
        return f"{cause_name} is the water's, of another day: the feed-forward can't make up for it."
    return f"{cause_name} is in the model, but the feed-forward can't make up for it."


def _remarks(finding: Finding) -> list[str]:
    remarks = []
    values = finding.parameters
    held = [name for name in HELD_BY_PID if name in values and not _includes(values[name], 0.0)]
    if held:
        remarks.append(
            f"{', '.join(held)}: there is no feed-forward in heave, roll and pitch, their PID holds them."
        )
    if finding.cause.effect.since_s:
        remarks.append(
            f"{capital(effect_words(finding.cause.effect))} is accepted as lasting, and is in the model from the start "
            "of the next dive: if it is mended, leave it out."
        )
    if finding.cause.effect.caveat:
        remarks.append(finding.cause.effect.caveat)
    if finding.is_ambiguous:
        remarks.append(
            f"{capital(effect_words(finding.cause.effect))} was accepted, though this dive can't tell it from "
            f"{', '.join(alike_words(finding))}."
        )
    return remarks


def likely_accepted(
    causes: Sequence[Finding],
    explanation: Explanation,
    known: Known,
    nominal: Nominal,
    library: Sequence[Effect],
    holds: Sequence[Cause],
    configuration: Configuration,
) -> Accepted:
    """The result of accepting the likely causes, in addition to the effects that the model `holds` already.

    `known`: of the explanation's causes.
    """
    likely = [cause for cause in causes if cause.probability >= LIKELY]
    whole = all_accepted(likely, holds)
    now = explanation.now
    keys = {item.cause.key for item in likely}
    kept = [cause for cause in explanation.causes if cause.key in keys]
    if len(kept) < len(explanation.causes):
        now = explained_by(kept, nominal, library, explanation.now).now
    if now is not explanation.now or holds:
        known = known_with_causes([item.cause for item in whole], now)
    made = accepted_of(whole, known, configuration)
    left = tuple(
        f"{capital(name_of(cause))} was not accepted: it is {percent_bounded(cause.probability)} probable, likelier "
        "absent than present."
        for cause in causes
        if cause.probability < LIKELY
    )
    return replace(made, sentences=(*left, *made.sentences))


def none_accepted(causes: Sequence[Finding]) -> str:
    """A clause on why nothing is accepted."""
    if not causes:
        return "no cause was found that could be accepted"
    listed_causes = listed(
        [f"{name_of(cause)} ({percent_bounded(cause.probability)} probable)" for cause in causes]
    )
    if all(cause.cause.effect.has_ended for cause in causes):
        return f"what was found is over, and so not accepted: {listed_causes}"
    return f"what was found is likelier absent than present, and so not accepted: {listed_causes}"
