"""Tables of the diagnosis: by effect, by size over the noise floor, wrong names, calibration."""

import math
import statistics
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from bench.diagnosis.goals import by_size, figure_words
from bench.diagnosis.trials import Trial
from bench.words import blocks, counted, paragraph, table
from bridge.vehicle.config import load_vehicle
from identify.challenge.answer import UNMEASURED, VECTORS, errors
from identify.challenge.planted_effects import ABSORBED
from identify.challenge.score import BINS, Judged, Rate
from identify.effects.library import library

BY_EFFECT = (
    "effect", "named first, or its class", "smallest named", "which is", "largest missed", "median magnitude error",
    "said instead",
)  # fmt: skip


def judged(trial: Trial) -> Judged:
    return Judged(trial.truth, trial.answer)


def pooled_power(trials: Sequence[Trial], points: int) -> str:
    seen = [
        (float(trial.truth["size"]), judged(trial).named_first())
        for trial in trials
        if judged(trial).kind == "one"
    ]
    rows = [(f"{low:.2f} to {high:.2f}", figure_words(rate)) for low, high, rate in by_size(seen, points)]
    return blocks(
        paragraph(
            "How large it has to be: all effects together, by what a refit leaves of them over the noise floor of the",
            "dive (a force: rms over the standard deviation of the disturbance; a reading: over its sensor's noise;",
            "that of the degree of freedom where it is largest).",
        ),
        table(("size over the noise floor", "named first, or its class"), rows),
    )


def by_effect(trials: Sequence[Trial]) -> str:
    rows = []
    units = _units()
    names = sorted({dive.truth["effects"][0]["name"] for dive in trials})
    for name in names:
        of_effect = [dive for dive in trials if dive.truth["effects"][0]["name"] == name]
        hit = [dive for dive in of_effect if judged(dive).named_first()]
        missed = [dive for dive in of_effect if dive not in hit]
        rate = Rate(len(hit), len(of_effect))
        mark = " (a refit takes it up)" if name in ABSORBED else ""
        named = f"{rate.hits} of {rate.of}"
        least = _least(hit, units)
        rows.append((f"`{name}`{mark}", named, *least, _most(missed), _magnitude(hit), _instead(missed)))
    return table(BY_EFFECT, rows)


def calibration(trials: Sequence[Trial]) -> str:
    stated = [
        (named.probability, judged(trial).right(named)) for trial in trials for named in judged(trial).named
    ]
    stated = [(p, right) for p, right in stated if math.isfinite(p)]
    rows = []
    for k in range(BINS):
        in_bin = [(p, right) for p, right in stated if min(int(p * BINS), BINS - 1) == k]
        if in_bin:
            rate = Rate(sum(right for _, right in in_bin), len(in_bin))
            mean = statistics.fmean(p for p, _ in in_bin)
            span = f"{k / BINS:.1f} to {(k + 1) / BINS:.1f}"
            rows.append((span, len(in_bin), f"{mean:.3f}", figure_words(rate)))
    head = ("stated probability", "causes", "mean stated", "were there")
    return table(head, rows) if rows else "No probability was stated."


def unknowns(trials: Sequence[Trial]) -> str:
    rows = []
    keys = list(dict.fromkeys((dive.group, dive.truth["effects"][0]["name"]) for dive in trials))
    for group, name in keys:
        of_kind = [
            judged(dive) for dive in trials if (dive.group, dive.truth["effects"][0]["name"]) == (group, name)
        ]
        verdicts = Counter(dive.verdict for dive in of_kind)
        wrong = (d.named[0].name for d in of_kind if d.named and d.verdict not in ("unknown", "no_gap"))
        title = f"`{name}`, left out" if group == "left out" else f"`{name}`"
        rows.append((title, len(of_kind), verdicts["unknown"], counted(wrong, 3), verdicts["no_gap"]))
    return table(("hidden", "dives", "unknown", "explained, partly or ambiguous, by", "no gap"), rows)


def _instead(missed: Sequence[Trial]) -> str:
    cases = map(judged, missed)
    said = (
        case.named[0].name if case.named else case.verdict.replace("_", " ") or "refused" for case in cases
    )
    return counted(said, 3)


def _least(trials: Sequence[Trial], units: Mapping[tuple[str, str], str]) -> tuple[str, str]:
    """The smallest size over the floor, and the planted parameter there."""
    if not trials:
        return "-", "-"
    least = min(trials, key=lambda trial: float(trial.truth["size"]))
    return f"{least.truth['size']:.2f}", magnitude(least.truth["effects"][0], units)


def magnitude(effect: Mapping[str, Any], units: Mapping[tuple[str, str], str]) -> str:
    """The first parameter that measures the size of an effect; its length if it is a vector."""
    sized = {name: value for name, value in effect["parameters"].items() if name not in UNMEASURED}
    if not sized:
        return "-"
    name = next(iter(sized))
    parts = [other for other in sized if other in VECTORS] if name in VECTORS else [name]
    value = math.hypot(*(sized[part] for part in parts)) if len(parts) > 1 else sized[name]
    unit = units.get((effect["name"], name), "1")
    return f"{', '.join(parts)}: {value:.2g}{'' if unit == '1' else ' ' + unit}"


def _units() -> dict[tuple[str, str], str]:
    """Units of the library's parameters, by the names of effect and parameter."""
    file = load_vehicle("ruvifist:survey")
    effects = library(file.vehicle.configurations["survey"], file.vehicle.thrust_curve.lag_s)
    return {
        (effect.name, name): unit
        for effect in effects
        for name, (_, unit) in effect.answer_parameters(effect.start()).items()
    }


def _most(trials: Sequence[Trial]) -> str:
    return f"{max(float(dive.truth['size']) for dive in trials):.2f}" if trials else "-"


def _magnitude(trials: Sequence[Trial]) -> str:
    off: list[float] = []
    for trial in trials:
        effect, case = trial.truth["effects"][0], judged(trial)
        if case.named[0].name == effect["name"]:
            off += errors(effect["parameters"], case.named[0]).values()
    return f"{100 * statistics.median(off):.0f} %" if off else "-"
