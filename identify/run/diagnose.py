"""Diagnose a dive: the causes of its gap, tried without those that are ruled out, measured on a check dive."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path
from typing import Any, Final

from bridge.errors import ConfigError, FitError, LogError
from bridge.vehicle.config import Prior, VehicleFile
from bridge.vehicle.effect_coefficients import AcceptedEffect
from identify.diagnose import diagnose as search
from identify.diagnose import wording
from identify.diagnose.result import Diagnosis, Finding, by_axis, plain
from identify.dive import Dive
from identify.effects.effect import Effect
from identify.effects.library import library
from identify.ingest.open import of_one_dive, recording_files
from identify.progress import Step, Steps, unheard
from identify.run.identify import runs_told

OF: Final = "diagnose"


@dataclass(frozen=True)
class Before:
    """An accepted model: values with their precision, effects, and notes on what of it was not taken."""

    values: Mapping[str, Prior] | None = None
    effects: tuple[AcceptedEffect, ...] = ()
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class Diagnosed:
    """A dive with its diagnosis; `check` is the dive on which the shrink was measured."""

    dive: Dive
    file: VehicleFile
    check: Dive | None
    diagnosis: Diagnosis

    def to_json(self) -> dict[str, Any]:
        """The answer, followed by the texts and values shown on a page."""
        words = with_words(self.diagnosis, "" if self.check is None else self.check.name)
        return words | runs_told(self.dive)


def diagnose(
    dive: Dive,
    file: VehicleFile,
    configuration: str,
    *,
    check: Dive | None = None,
    without: Collection[str] = (),
    before: Before = Before(),
    notes: Sequence[str] = (),
    progress: Steps = unheard,
) -> Diagnosed:
    """Diagnose a dive; `without` names effects that are not tried, `notes` come before those of the diagnosis.

    Raises ConfigError for a name that is no effect, LogError for a check dive that is of the same dive, and FitError,
    as `identify.diagnose.diagnose` does, for a recording that can't be diagnosed.
    """
    effects = effects_without(without, configuration, file) if without else None
    if check is not None:
        refuse_the_same(check, dive)
    try:
        searched_fit = search.diagnose(
            dive,
            file,
            configuration,
            check=check,
            effects=effects,
            accepted=before.values,
            effects_accepted=before.effects,
            progress=lambda share, words: progress(Step(OF, share, words)),
        )
    except FitError as error:
        if check is not None and error.of == check.source:
            raise FitError(error.reason, of=f"the check dive {check.source}") from None
        raise
    searched_fit = replace(searched_fit, notes=(*before.notes, *notes, *searched_fit.notes))
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


def effects_without(names: Collection[str], configuration: str, file: VehicleFile) -> tuple[Effect, ...]:
    """Return the library without the named effects. Raises ConfigError for a name that is not in the library."""
    effects = library(file.vehicle.configurations[configuration], file.vehicle.thrust_curve.lag_s)
    known = {effect.name for effect in effects}
    for name in names:
        if name not in known:
            raise ConfigError(
                f"there is no effect '{name}' to leave out; there are {', '.join(sorted(known))}"
            )
    return tuple(effect for effect in effects if effect.name not in names)


def with_words(diagnosis: Diagnosis, check: str = "") -> dict[str, Any]:
    """Add `told` to `plain`: sentences, evidence in nats, drifts of the dive itself. `check`: the check dive."""
    after = [item.total for item in diagnosis.gap.after if item.horizon_s == wording.DRIFT_S]
    more = {
        "dive": diagnosis.dive,
        "check": check,
        "configuration": diagnosis.configuration,
        "verdict": wording.verdict_sentence(diagnosis),
        "after": after[0] if after else None,
        "causes": [_cause(item) for item in diagnosis.findings],
        "tried": [
            {"name": wording.candidate_words(item.effect), "gain_nats": item.gain_nats, "why": item.why}
            for item in diagnosis.tried
            if not item.accepted and item.gain_nats > 0
        ],
        "heldout": None
        if diagnosis.heldout is None
        else {
            "before": diagnosis.heldout.before,
            "after": diagnosis.heldout.after,
            "by_axis": by_axis(diagnosis.heldout),
        },
        "disturbance": wording.disturbance_line(diagnosis.gap.disturbance),
        "character": wording.character_lines(diagnosis),
        "next": wording.next_lines(diagnosis),
        "notes": diagnosis.notes,
    }
    return {**plain(diagnosis), "told": more}


def _cause(finding: Finding) -> dict[str, Any]:
    return {
        "name": wording.name_of(finding),
        "gain_nats": finding.gain_nats,
        "sentence": wording.cause_sentence(finding),
        "alike": wording.alike_sentence(finding) if finding.also else "",
        "values": [
            wording.value_words(name, value) for name, value in wording.told_parameters(finding).items()
        ],
    }
