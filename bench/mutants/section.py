"""The section of docs/benchmarks.md: the share of drawn mutants that a test notices."""

import contextlib
from collections.abc import Sequence
from pathlib import Path

from rich.progress import track

from bench.mutants.changes import drawn
from bench.mutants.trials import ENOUGH_S, PATIENCE, START_S, Verdict, checkout
from bench.remembered import Remembered
from bench.stamp import ROOT
from bench.words import blocks, in_a_word, paragraph, table
from identify.challenge.score import Rate

FOLDERS = ("gcs_plugin/params", "bridge/vehicle", "identify/challenge", "identify/diagnose")
SOURCES = ("bench/mutants", *FOLDERS, "tests")
"""Code that the figures depend on (`bench.stamp`)."""

SEED, EACH, SHORT_EACH = 22, 50, 5
GOAL = 0.95


def section(cache: Path, short: bool) -> str:
    """The section, from the results in `cache`; Ctrl-C ends the run early, and the page is of the mutants so far."""
    kept, each = Remembered(cache / "mutants.jsonl"), SHORT_EACH if short else EACH
    mutants = [mutant for folder in FOLDERS for mutant in drawn(ROOT, folder, each, SEED)]
    verdicts: list[Verdict] = []
    with checkout(ROOT) as copy, contextlib.suppress(KeyboardInterrupt):
        copy.compile()
        verdicts.extend(copy.judged(mutant, kept) for mutant in track(mutants, "mutants"))
    return page(verdicts, len(mutants))


def page(verdicts: Sequence[Verdict], wanted: int) -> str:
    rows = [
        _row(folder, [verdict for verdict in verdicts if verdict.mutant.file.startswith(f"{folder}/")])
        for folder in FOLDERS
    ]
    share = _rate(verdicts).share
    partial, judged = "", in_a_word(share >= GOAL)
    if len(verdicts) < wanted:
        partial, judged = (
            f"The run was ended after {len(verdicts)} of them.",
            "not judged before all have run",
        )
    survivors = "\n".join(f"- `{verdict.mutant}`" for verdict in verdicts if verdict.by is None)
    return blocks(
        "## Small changes that no test notices",
        paragraph(
            f"{wanted} places in the code were drawn (seed {SEED}), the same number in each folder, every place of a",
            "folder as likely as any other: a comparison, an operator, `not`, `min` and `max`, a number, a condition,",
            "a returned value, a step of its own. Each is changed by itself on a copy of the tree. The test files that",
            "import the module, directly or by other modules, follow, those of its folder first, then the nearest,",
            f"until one fails or hangs ({PATIENCE:g} times as long as without the change, and {START_S:g} s), or until",
            f"they took {ENOUGH_S:g} s of a processor. Text, hints of types, decorators and `assert` stay; the type",
            "checker is not asked. A change that alters nothing that a user could see counts as one that survived.",
            partial,
        ),
        paragraph(
            f"Goal: {100 * GOAL:.0f} % noticed. {f'{100 * share:.1f} %' if verdicts else 'None has run'}: {judged}.",
            "Tests were added for changes of this draw that survived at first: another seed tells how other changes",
            "fare.",
        ),
        table(
            ("folder", "mutants", "noticed", "survived", "share (95 % bounds)"),
            [*rows, _row("all", verdicts)],
        ),
        "Survivors:" if survivors else "None survived.",
        survivors,
    )


def _row(name: str, verdicts: Sequence[Verdict]) -> tuple[object, ...]:
    rate = _rate(verdicts)
    low, high = rate.bounds()
    share = f"{100 * rate.share:.1f} % ({100 * low:.1f} to {100 * high:.1f})" if rate.of else "-"
    return name, rate.of, rate.hits, rate.of - rate.hits, share


def _rate(verdicts: Sequence[Verdict]) -> Rate:
    return Rate(sum(verdict.by is not None for verdict in verdicts), len(verdicts))
