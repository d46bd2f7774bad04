"""Effects that were accepted earlier: they are in the model before. Causes are looked for on top of them, and among
these a change of one."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bridge.effects.accepted import AcceptedEffect
from bridge.effects.course import Course
from bridge.effects.effect import Act, Effect, Told
from identify.diagnose.cause import Cause
from identify.diagnose.diagnosis import Found, Value
from identify.diagnose.nominal import Nominal, refitted
from identify.diagnose.simulator import lasting
from identify.diagnose.witness import Witness
from identify.diagnose.words import SINCE, effect_words, listed, value_words

Array = NDArray[np.float64]

PASSES = 2
"""What an effect adds depends on the velocity, and this on what the effect adds."""


def known_of(
    accepted: Sequence[AcceptedEffect], library: Sequence[Effect]
) -> tuple[tuple[Cause, ...], tuple[str, ...]]:
    """Accepted effects as causes, and in sentences which are not taken along: those of the water or the tether of one
    dive, and those that the library lacks.

    One that a refit takes up is in the accepted masses and dampings, and counted once.
    """
    by_label = {(effect.label, effect.number): effect for effect in library}
    causes, left = [], []
    for one in accepted:
        effect = by_label.get((one.label, one.number))
        if effect is None or {p.name for p in effect.parameters} != set(one.parameters):
            left.append(f"{one.label} (this library has no such effect)")
            continue
        cause = Cause(effect, np.array([one.parameters[p.name] for p in effect.parameters]))
        if not lasting(cause):
            left.append(f"{effect_words(effect)} (of that dive alone)")
        elif not effect.refit_absorbs and cause.present.any():
            causes.append(cause)
    return tuple(causes), (f"Accepted, but not in the model before: {', '.join(left)}.",) if left else ()


def held(causes: Sequence[Cause]) -> tuple[str, ...]:
    """Which accepted effects the model before holds, in a sentence; nothing without any."""
    told = []
    for cause in causes:
        shown = {p.name for p, has in zip(cause.effect.parameters, cause.present, strict=True) if has}
        values = [
            value_words(name, Value(value, unit, np.nan, np.nan))
            for name, (value, unit) in cause.effect.told(cause.values).items()
            if name != "thruster" and (name in shown or cause.effect.telling is not None)
        ]
        told.append(f"{effect_words(cause.effect)} ({', '.join(values)})")
    return (f"The model before holds what was accepted: {listed(told)}.",) if told else ()


def holding(nominal: Nominal, causes: Sequence[Cause]) -> Nominal:
    """A dive less what accepted causes add to its forces, its readings and what else tells of them; its parameters and
    noise levels found anew."""
    if not causes:
        return nominal
    now = nominal
    for _ in range(PASSES):
        now = refitted(nominal, [cause.act(now.course) for cause in causes])
    seen = tuple(_without(one, now.acts, now.course) for one in nominal.witnesses)
    return replace(now, acts=(), witnesses=seen, holds=tuple(causes))


def _without(witness: Witness, acts: Sequence[Act], course: Course) -> Witness:
    off = witness.off.copy()
    for act in acts:
        if (seen := witness.of(act, course)) is not None:
            off -= seen
    return replace(witness, off=off)


def since(library: Sequence[Effect], causes: Sequence[Cause]) -> tuple[Effect, ...]:
    """The library with a change of it in place of each accepted effect.

    One that is absent at infinity stays as it is: what it adds on top is a limit of its own.
    """
    of = {cause.effect.label: cause for cause in causes if np.isfinite(cause.effect.none()).all()}
    return tuple(_change(of[effect.label]) if effect.label in of else effect for effect in library)


def _change(cause: Cause) -> Effect:
    """A change of an accepted effect: its parameters are differences, 0 where nothing has changed."""
    effect, before = cause.effect, cause.values
    parameters = tuple(
        replace(p, start=p.start - p.none, low=p.low - value, high=p.high - value, none=0.0)
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


def altogether(found: Sequence[Found], causes: Sequence[Cause]) -> tuple[Found, ...]:
    """What a model holds once causes are accepted beside those that it held: each of these with its change in it."""
    changes = {one.cause.key: one for one in found if one.cause.effect.variant == SINCE}
    mine = tuple(_summed(cause, changes.get(cause.key)) for cause in causes)
    return (*mine, *(one for one in found if one.cause.effect.variant != SINCE))


def _summed(cause: Cause, change: Found | None) -> Found:
    values = cause.values if change is None else cause.values + change.cause.values
    whole = Cause(cause.effect, values)
    absent = {p.name: p.none for p in cause.effect.parameters} if cause.effect.telling is None else {}
    parameters = {}
    for name, (value, unit) in whole.effect.told(values).items():
        by = None if change is None else change.parameters.get(name)
        if by is not None:
            ends = value + by.low95 - by.value, value + by.high95 - by.value
        else:
            # How well it was known when it was accepted stands with its file; what is absent surely is.
            ends = (value, value) if value == absent.get(name) else (np.nan, np.nan)
        parameters[name] = Value(value, unit, *ends)
    if change is None:
        return Found(whole, (), {}, 1.0, parameters, 0.0)
    return replace(change, cause=whole, parameters=parameters)
