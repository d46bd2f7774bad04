"""The power of the diagnosis: the size from which each effect is named; rows kept in the repository.

It takes a few hours, so finished rows are packed at every end, even by an interruption, and a later run continues
from them.
"""

import gzip
import json
from collections.abc import Container, Sequence
from functools import partial
from pathlib import Path

from bench.diagnosis import goals
from bench.diagnosis.plan import FULL, SHORT, Planned, power_planned
from bench.diagnosis.tables import judged
from bench.diagnosis.trials import trial, trial_job
from bench.remembered import Data, Job, Remembered, pack
from bench.stamp import CURVES, ROOT, reached, stamp
from bench.words import blocks, paragraph, table
from identify.challenge.score import CLEAR, Rate

POINTS = 3
CARRIED = ("identify/effects/", "bridge/vehicle/")


def _decides(path: str) -> bool:
    return path.startswith(CARRIED) or not path.startswith(
        ("bridge/", "identify/ingest/", "identify/report/")
    )


DECIDED = (
    reached("bench/diagnosis/trials.py", "identify/challenge/score.py", belongs=_decides),
    CURVES,
)
"""Code that plants an effect and names it, without the link and the files between: its values are tested separately,
and a change there does not discard rows of the power curves, which take hours."""
SOURCES = (*DECIDED, *(f"bench/diagnosis/{name}.py" for name in ("goals", "power", "tables")))


def section(cache: Path, results: Path, short: bool) -> str:
    """The section, from the results in `cache` and in the packed file `results`; runs the missing dives."""
    kept = Remembered(cache / "power.jsonl")
    plan = power_planned(SHORT if short else FULL)
    jobs = jobs_of(plan)
    unpack(kept, results, jobs)
    try:
        rows = list(kept.fill(jobs, "power of the diagnosis").values())
    finally:
        done = sorted(key for key in jobs if key in kept)
        pack(({"key": key, "data": kept.get(key, dict)} for key in done), results)
    return page(rows, plan[0].seed, results)


def jobs_of(plan: Sequence[Planned]) -> dict[str, Job]:
    """A job per dive, by a key that holds the stamp of the code."""
    return {f"{dive.name}:{stamp(*DECIDED)}": partial(power_job, dive) for dive in plan}


def power_job(planned: Planned) -> Data:
    """Diagnose a dive: hidden effect, its size over the noise floor, whether it or its class came first, and the
    answer."""
    answered = trial(trial_job(planned))
    answer_judged = judged(answered)
    return {
        "effect": answered.truth["effects"][0]["name"],
        "size": answered.truth["size"],
        "hit": answer_judged.named_first(),
        "said": answer_judged.named[0].name if answer_judged.named else answer_judged.verdict,
    }


def unpack(kept: Remembered, results: Path, wanted: Container[str]) -> None:
    """Take in the rows of a packed file that are wanted and not yet known."""
    if not results.exists():
        return
    for line in gzip.decompress(results.read_bytes()).decode().splitlines():
        row = json.loads(line)
        if row["key"] in wanted and row["key"] not in kept:
            kept.put(row["key"], row["data"])


def page(rows: Sequence[Data], first: int, results: Path) -> str:
    """The section from its rows, of seeds from `first` on, which are packed in `results`."""
    names = sorted({str(row["effect"]) for row in rows})
    lines = []
    for name in names:
        of_effect = [(float(row["size"]), bool(row["hit"])) for row in rows if row["effect"] == name]
        for low, high, rate in goals.by_size(of_effect, POINTS):
            lines.append((f"`{name}`", f"{low:.2f} to {high:.2f}", goals.figure_words(rate)))
    return blocks(
        "## Power of the diagnosis",
        paragraph(
            f"How large each effect has to be to be named: {len(rows)} dives as in the section on the diagnosis,",
            f"seeds from {first} on, {len(names)} effects each alone; those that a refit takes up whole have",
            f"nothing to be seen by. A point holds {goals.EACH_POINT} dives or more, or all of its effect, cut by",
            f"size. Every row is in `{results.relative_to(ROOT)}`.",
        ),
        _over_all(rows),
        table(("effect", "size over the noise floor", "named first, or its class"), lines),
    )


def _over_all(rows: Sequence[Data]) -> str:
    """The rates of all dives, and of those with a size of CLEAR or more over the floor."""
    shown = [row for row in rows if row["size"] >= CLEAR]
    unseen = sum(not row["hit"] and row["said"] == "no_gap" for row in rows)
    missed = sum(not row["hit"] for row in rows)
    return paragraph(
        f"Of all: {goals.figure_words(_named(rows))}. Of those {CLEAR:g} or more over the floor:",
        f"{goals.figure_words(_named(shown))}. Of the {missed} that were not named, {unseen} were",
        "taken for no gap.",
    )


def _named(rows: Sequence[Data]) -> Rate:
    return Rate(sum(bool(row["hit"]) for row in rows), len(rows))
