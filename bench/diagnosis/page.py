"""The section of docs/benchmarks.md: the diagnosis judged on dives with hidden effects."""

import statistics
from collections.abc import Sequence
from pathlib import Path

from bench.diagnosis import goals, tables
from bench.diagnosis.plan import BENCH, FULL, SHORT, planned
from bench.diagnosis.trials import Trial, measured
from bench.remembered import Remembered
from bench.stamp import CURVES, reached
from bench.words import blocks, paragraph
from identify.challenge.score import score

SOURCES = (reached("bench/diagnosis/page.py"), CURVES)
POINTS = 8


def section(cache: Path, short: bool) -> str:
    plan = planned(SHORT if short else FULL)
    return page(measured(plan, Remembered(cache / "diagnosis.jsonl"), "diagnosis"))


def page(trials: Sequence[Trial]) -> str:
    groups = {
        group: [trial for trial in trials if trial.group == group] for group in ("one", "novel", "left out")
    }
    scored = score(
        [trial.truth for trial in trials], {trial.name: trial.answer for trial in trials if trial.answer}
    )
    refused = [f"{trial.name} ({trial.refusal})" for trial in trials if trial.answer is None]
    return blocks(
        "## Diagnosis of hidden effects",
        _introduction(trials),
        goals.words(scored),
        f"Refused: {'; '.join(refused) if refused else 'none'}.",
        tables.pooled_power(groups["one"], POINTS),
        paragraph(
            "By effect, sizes over the noise floor; of a dive that named another cause first, that cause. A power",
            "curve of each effect is a section of its own, `power`, which is measured on request.",
        ),
        tables.by_effect(groups["one"]),
        paragraph(
            "Unknown effects: eight that no library has, and each effect once more with the library lacking it and its",
            "true class. Where another effect of the library makes up for one that it lacks, that one is named.",
            "Detectors were added for some of the very kinds that are planted here, so these figures say little of",
            "others; [unknown forces](#unknown-forces-drawn-by-a-grammar) were drawn after the code was fixed.",
        ),
        tables.unknowns([*groups["novel"], *groups["left out"]]),
        "Stated probabilities:",
        tables.calibration(trials),
    )


def _introduction(trials: Sequence[Trial]) -> str:
    count = {
        group: sum(trial.group == group for trial in trials)
        for group in dict.fromkeys(t.group for t in trials)
    }
    words = {
        "none": "without an effect",
        "one": "with one",
        "two": "with two",
        "novel": "with something that no library has",
        "left out": "with an effect that the library was made to lack",
    }
    counts = ", ".join(f"{count[group]} {words[group]}" for group in words if group in count)
    seconds = statistics.median(trial.seconds for trial in trials)
    first = min(int(trial.name.split()[-1]) for trial in trials)
    return paragraph(
        f"{len(trials)} simulated dives of 300 to 600 s: {counts}. Each draws a vehicle, its sensors, controller,",
        "disturbance and mission, and a size that runs over a factor of ten from where an effect begins to show. The",
        "planting simulator (`identify/challenge`) shares no equation with the library and plants other forms than it",
        f"fits. Seeds from {first} on; nothing is tuned on those from {BENCH} on. Median",
        f"{seconds:.1f} s of one core a dive.",
    )
