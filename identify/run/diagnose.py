"""Diagnose a dive: the causes of its gap, tried without those that are ruled out, measured on a check dive."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, Final

from bridge.errors import ConfigError, FitError, LogError
from bridge.vehicle.coefficients import DAMPINGS, OF_HULL, QUADRATICS, AcceptedEffect
from bridge.vehicle.config import Configuration, Damping, Prior, VehicleFile
from identify.diagnose import diagnose as search
from identify.diagnose.result import Diagnosis, Finding, Value, by_axis, plain
from identify.diagnose.words import causes as cause_words
from identify.diagnose.words import diagnosis as wording
from identify.diagnose.words import drift as drift_words
from identify.diagnose.words import gap as gap_words
from identify.dive import Dive
from identify.effects.effect import Effect
from identify.effects.library import library
from identify.ingest.open import recording_files
from identify.ingest.same_dive import of_one_dive
from identify.progress import Step, Steps, ignore_step
from identify.run.identify import runs_as_json
from identify.statistics import Z95
from identify.words import listed, significant, unit, with_interval

OF: Final = "diagnose"


@dataclass(frozen=True)
class Before:
    """An accepted model: values with their precision, effects, and notes on parts that were not taken.

    `by_number`: whether each value that the dive contradicts is reported, since no dive was used to fit it.
    """

    values: Mapping[str, Prior] | None = None
    effects: tuple[AcceptedEffect, ...] = ()
    notes: tuple[str, ...] = ()
    by_number: bool = False


LEAST_DRAG: Final = 1e-9
"""A drag that is published as none, N/(m/s) and alike: only a positive value has a logarithm."""


def published(configuration: Configuration, hull: Damping) -> Before:
    """The `model` of a vehicle file's configuration as an accepted model, each number known to its `model_std`.

    `hull`: the drag that the hull of the dive has. Of a degree of freedom with one of two drags stated, the other is
    none; a mass or a drag that the model does not state is held against nothing. Raises ConfigError without a model,
    or if it has a drag that the hull of the dive lacks.
    """
    if not configuration.model:
        raise ConfigError(
            "its configuration has no model: write the published numbers there, as model: {M_u: ...}"
        )
    lacking = {"linear": QUADRATICS, "quadratic": DAMPINGS, "both": ()}[hull]
    strange = [c.name for c in lacking if configuration.model.get(c.name)]
    if strange:
        raise ConfigError(
            f"its model has {', '.join(strange)}, and the hull of the dive has damping: {hull}; write damping: both "
            "into the vehicle file of the dive"
        )
    values = dict(configuration.model)
    for pair in zip(DAMPINGS, QUADRATICS, strict=True):
        if any(values.get(c.name) for c in pair):
            values |= {c.name: 0.0 for c in pair if c.name not in values}
    of_hull = {c.name for c in OF_HULL.values() if c not in lacking}
    priors = {
        name: Prior(
            max(value, LEAST_DRAG), max(value, LEAST_DRAG) * configuration.model_std, "published", "thrust"
        )
        for name, value in values.items()
        if name in of_hull and (value > 0 or OF_HULL[name].kind != "mass")
    }
    return Before(priors, by_number=True)


def contradicted(held: Mapping[str, Prior], numbers: Mapping[str, Value]) -> tuple[str, ...]:
    """A sentence on the values that differ from a dive's `numbers` by more than both are known, 95 %; () for none."""
    off = []
    for name in OF_HULL:
        prior, fitted = held.get(name), numbers.get(name)
        if (
            prior is None
            or fitted is None
            or not abs(fitted.value - prior.value)
            > math.hypot((fitted.high95 - fitted.low95) / 2, Z95 * prior.std)
        ):
            continue
        number, interval = with_interval(fitted.value, fitted.low95, fitted.high95)
        was = significant(prior.value if prior.value > LEAST_DRAG else 0.0)
        off.append(f"{name} {was} (the dive: {number}, {interval} {unit(fitted.unit)})")
    return (f"Of the numbers of the model before, the dive contradicts {listed(off)}.",) if off else ()


@dataclass(frozen=True)
class Diagnosed:
    """A dive with its diagnosis; `check` is the dive on which the shrink was measured."""

    dive: Dive
    file: VehicleFile
    check: Dive | None
    diagnosis: Diagnosis

    def to_json(self) -> dict[str, Any]:
        words = with_words(self.diagnosis, "" if self.check is None else self.check.name)
        return words | runs_as_json(self.dive)


def diagnose(
    dive: Dive,
    file: VehicleFile,
    configuration_name: str,
    *,
    check: Dive | None = None,
    check_file: VehicleFile | None = None,
    without: Collection[str] = (),
    before: Before = Before(),
    notes: Sequence[str] = (),
    progress: Steps = ignore_step,
) -> Diagnosed:
    """Diagnose a dive; `without` names effects that are not tried, `notes` come before those of the diagnosis, and
    `check_file` is the vehicle file under the conditions of the check dive, None if these are the dive's.

    Raises ConfigError for a name that is no effect, LogError for a check dive that is of the same dive, and FitError,
    as `identify.diagnose.diagnose` does, for a recording that can't be diagnosed.
    """
    effects = effects_without(without, configuration_name, file) if without else None
    if check is not None:
        refuse_the_same(check, dive)
    try:
        searched_fit = search.diagnose(
            dive,
            file,
            configuration_name,
            check=check,
            check_file=check_file,
            effects=effects,
            accepted=before.values,
            effects_accepted=before.effects,
            progress=lambda share, words: progress(Step(OF, share, words)),
        )
    except FitError as error:
        if check is not None and error.of == check.source:
            raise FitError(error.reason, of=f"the check dive {check.source}") from None
        raise
    off = contradicted(before.values or {}, searched_fit.numbers) if before.by_number else ()
    searched_fit = replace(searched_fit, notes=(*before.notes, *off, *notes, *searched_fit.notes))
    return Diagnosed(dive, file, check, searched_fit)


def refuse_the_same(check: Dive, dive: Dive) -> None:
    """Raise LogError if the check dive is the dive itself: the gap can't be measured on data that was fitted."""
    for held, other in product(_sources(check), _sources(dive)):
        if how := of_one_dive(recording_files(held), recording_files(other)):
            raise LogError(
                f"the check dive {held}: {how} {other}, so it can't show how far the gap shrinks; give another dive"
            )


def _sources(dive: Dive) -> list[Path]:
    """The recordings of a dive that are files: one made in memory has none."""
    sources = [run.source for run in dive.runs] or [dive.source]
    return [source for source in sources if source.exists()]


def effects_without(names: Collection[str], configuration_name: str, file: VehicleFile) -> tuple[Effect, ...]:
    """Return the library without the named effects. Raises ConfigError for a name that is not in the library."""
    effects = library(file.vehicle.configurations[configuration_name], file.vehicle.thrust_curve.lag_s)
    known = {effect.name for effect in effects}
    for name in names:
        if name not in known:
            raise ConfigError(
                f"there is no effect '{name}' to leave out; there are {', '.join(sorted(known))}"
            )
    return tuple(effect for effect in effects if effect.name not in names)


def with_words(diagnosis: Diagnosis, check: str = "") -> dict[str, Any]:
    """Add `told` to `plain`: sentences, evidence in nats, drifts of the dive itself, and of a cause whether it is the
    change of an accepted one. `check`: the check dive."""
    after = [item.total for item in diagnosis.gap.after if item.horizon_s == drift_words.DRIFT_S]
    more = {
        "dive": diagnosis.dive,
        "check": check,
        "configuration": diagnosis.configuration,
        "verdict": wording.verdict_sentence(diagnosis),
        "after": after[0] if after else None,
        "by_axis": by_axis(drift_words.of_dive(diagnosis.gap)),
        "causes": [_cause(item) for item in diagnosis.findings],
        "tried": [
            {"name": cause_words.candidate_words(item.effect), "gain_nats": item.gain_nats, "why": item.why}
            for item in diagnosis.tried
            if not item.accepted and item.gain_nats > 0
        ],
        "heldout": None
        if diagnosis.heldout is None
        else {
            "before": diagnosis.heldout.before,
            "after": diagnosis.heldout.after,
            "by_axis": by_axis(diagnosis.heldout.by_axis),
        },
        "disturbance": gap_words.disturbance_line(diagnosis.gap.disturbance),
        "character": wording.character_lines(diagnosis),
        "next": wording.next_lines(diagnosis),
        "notes": diagnosis.notes,
    }
    return {**plain(diagnosis), "told": more}


def _cause(finding: Finding) -> dict[str, Any]:
    return {
        "name": cause_words.name_of(finding),
        "gain_nats": finding.gain_nats,
        "sentence": cause_words.cause_sentence(finding),
        "alike": cause_words.alike_sentence(finding) if finding.is_ambiguous else "",
        "changed": finding.cause.effect.variant == cause_words.SINCE,
        "values": [
            cause_words.value_words(name, value)
            for name, value in cause_words.shown_parameters(finding).items()
        ],
    }
