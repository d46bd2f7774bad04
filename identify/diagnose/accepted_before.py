"""Effects that a crew accepted before a dive: its model holds them, and changes of them are looked for."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import AcceptedEffect
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.causes.requirement import LEAST_GAIN
from identify.diagnose.filters.nominal import Nominal, refitted
from identify.diagnose.result import Finding, Value
from identify.diagnose.words.causes import SINCE, effect_words, value_words
from identify.effects.course import Course
from identify.effects.effect import Act, AnswerParameters, Effect
from identify.words import listed

PASSES = 2
"""Fixed-point passes: an effect depends on velocity, and velocity on the effect."""


@dataclass(frozen=True)
class AcceptedCauses:
    """Accepted effects as causes: `lasting`, of the vehicle, and `passing`, of one dive's water or tether.

    unknown: words on the effects that the library lacks.
    """

    lasting: tuple[Cause, ...]
    passing: tuple[Cause, ...] = ()
    unknown: tuple[str, ...] = ()

    def in_force(self, fitted: Nominal) -> Nominal:
        """The dive `fitted` without the lasting effects, and without each passing one that it confirms.

        It confirms an effect with which the filters are likelier by more than LEAST_GAIN nats.
        """
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
            unknown.append(
                f"{effect_accepted.label} (this library has no such effect, the hull's own model has it, "
                "or the recording lacks what shows it)"
            )
            continue
        cause = Cause(effect, np.array([effect_accepted.parameters[p.name] for p in effect.parameters]))
        if not effect.refit_absorbs and cause.present.any():
            (lasting if effect.lasting else passing).append(cause)
    return AcceptedCauses(tuple(lasting), tuple(passing), tuple(unknown))


def _held_sentence(causes: Sequence[Cause]) -> tuple[str, ...]:
    """A sentence on the accepted effects in the model before; empty without any."""
    held = []
    for cause in causes:
        shown = {p.name for p, has in zip(cause.effect.parameters, cause.present, strict=True) if has}
        values = [
            value_words(name, Value(value, unit, np.nan, np.nan))
            for name, (value, unit) in cause.effect.answer_parameters(cause.values).items()
            if name != "thruster" and (name in shown or cause.effect.telling is not None)
        ]
        held.append(f"{effect_words(cause.effect)} ({', '.join(values)})")
    return (f"The model before holds what was accepted: {listed(held)}.",) if held else ()


def with_accepted(nominal: Nominal, causes: Sequence[Cause]) -> Nominal:
    """A dive without what the accepted causes contribute to forces, readings and witnesses, fitted again."""
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
            exact=(p.exact[0] - value, p.exact[1] - value),
            seldom_above=p.seldom_above - value,
        )
        for p, value in zip(effect.parameters, before.tolist(), strict=True)
    )

    def act(course: Course, by: Array) -> Act:
        return effect.act(course, before + by).less(effect.act(course, before))

    def telling(by: Array) -> AnswerParameters:
        was = effect.answer_parameters(before)
        return {
            name: (value - was[name][0], unit)
            for name, (value, unit) in effect.answer_parameters(before + by).items()
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
    """All effects of a model once `findings` are accepted: the earlier ones with their changes, and the new ones."""
    changes = {finding.cause.key: finding for finding in findings if finding.cause.effect.variant == SINCE}
    changed = tuple(_with_change(cause, changes.get(cause.key)) for cause in causes)
    return (*changed, *(finding for finding in findings if finding.cause.effect.variant != SINCE))


def _with_change(cause: Cause, change: Finding | None) -> Finding:
    values = cause.values if change is None else cause.values + _determined(change)
    whole = Cause(cause.effect, values)
    absent = {p.name: p.none for p in cause.effect.parameters} if cause.effect.telling is None else {}
    parameters = {}
    for name, (value, unit) in whole.effect.answer_parameters(values).items():
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


def _determined(change: Finding) -> Array:
    """The values (p,) of a change, 0 where the dive does not determine it."""
    effect, values = change.cause.effect, change.cause.values
    if effect.telling is not None:
        return values
    return np.where([p.name in change.parameters for p in effect.parameters], values, 0.0)
