"""Proposes a common column map for several runs of the same form: files of a folder, or runs in a table."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from bridge.arrays import Array
from bridge.errors import LogError
from identify.ingest.files.run_column import labels, run_column_in, split_table
from identify.ingest.files.streams import Stream, some_of
from identify.ingest.mapping.candidates import SIGNALS, Choice, Confidence
from identify.ingest.mapping.column_map import Columns, RunColumn
from identify.ingest.mapping.profiles import profiles
from identify.ingest.mapping.proposal import Proposal, map_of, propose_single
from identify.ingest.mapping.time_column import of_day
from identify.words import listed

MOST_ASKED = 12
"""Runs that are looked at, the longest: enough that a majority of them is no chance."""


def propose(streams: Sequence[Stream], path: Path) -> Proposal:
    """The column map that the streams of a file suggest; of a table that holds several runs, that of the most of them.

    Raises LogError if no column is a time; NothingKnown if no other column is known by its name.
    """
    column = run_column_in(streams)
    if not column:
        return propose_single(streams, path)
    proposal = propose_runs({name: (rows,) for name, rows in split_table(streams[0], column)}, path)
    note = f"'{column}' changes where the clock starts anew, so it is taken for the number of the run."
    return replace(
        proposal, columns=replace(proposal.columns, runs=RunColumn(column)), notes=(note, *proposal.notes)
    )


def propose_runs(runs: Mapping[str, Sequence[Stream]], path: Path) -> Proposal:
    """The column map of runs by name: of each signal that for which the most of them have evidence.

    Runs with other columns than the most are not asked; they, and those that speak for another map, are named in the
    notes. Raises LogError as `propose_single`.
    """
    forms = Counter(map(_form, runs.values()))
    usual, _ = forms.most_common(1)[0]
    alike = {name: streams for name, streams in runs.items() if _form(streams) == usual}
    notes = []
    if strange := [name for name in runs if name not in alike]:
        notes.append(
            f"Other columns than the other {len(alike)} runs {'has' if len(strange) == 1 else 'have'} "
            f"{some_of(strange)}: the map may not serve there."
        )
    longest = sorted(alike, key=lambda name: -_rows(alike[name]))[:MOST_ASKED]
    asked: dict[str, Proposal] = {}
    refused = None
    for name in longest:
        try:
            asked[name] = propose_single(alike[name], path)
        except LogError as error:
            refused = refused or error
    if refused is not None and not asked:
        raise refused
    first = next(iter(asked.values()))
    choices = tuple(filter(None, (_agreed(signal, asked, notes) for signal in SIGNALS)))
    merged = _behind_one_another(
        [alike[name] for name in longest] + [of for name, of in alike.items() if name not in longest]
    )
    time, reason = of_day(merged, first.columns.time) or (first.columns.time, first.time_reason)
    columns = map_of(time, choices)
    # Ranges are those of all runs; a rate is known within one.
    shown = zip(profiles(merged, columns), first.profiles, strict=True)
    said = dict.fromkeys(note for proposal in asked.values() for note in proposal.notes)
    return Proposal(
        columns,
        choices,
        tuple(replace(whole, rate_hz=of_run.rate_hz) for whole, of_run in shown),
        (*notes, *said),
        reason,
    )


def _form(streams: Sequence[Stream]) -> frozenset[str]:
    """All columns of a run."""
    return frozenset(
        stream.full_name(field) for stream in streams for field in (*stream.columns, *stream.text)
    )


def _rows(streams: Sequence[Stream]) -> int:
    return max((len(cells) for stream in streams for cells in stream.columns.values()), default=0)


def _agreed(signal: str, asked: Mapping[str, Proposal], notes: list[str]) -> Choice | None:
    """The choice for a signal that the most runs have evidence for; None if most have none. `notes` get a sentence on
    runs with evidence for another."""
    groups: dict[Columns, dict[str, Choice]] = {}
    for name, proposal in asked.items():
        for choice in proposal.choices:
            if choice.signal == signal:
                groups.setdefault(choice.columns, {})[name] = choice
    if 2 * sum(map(len, groups.values())) < len(asked):
        return None
    evidence = {columns: [n for n, c in of.items() if _shows(c)] for columns, of in groups.items()}
    best = max(groups, key=lambda columns: (len(evidence[columns]), len(groups[columns])))
    against = [name for columns, names in evidence.items() if columns != best for name in names]
    if against:
        speak = "speaks" if len(against) == 1 else "speak"
        notes.append(
            f"{signal.capitalize()}: {listed(against)} of {len(asked)} runs {speak} for another unit, sign or column "
            "than the others; look at one alone, and if it is of another vehicle, give it a folder of its own."
        )
    return max(groups[best].values(), key=lambda choice: (_shows(choice), len(choice.mends)))


def _shows(choice: Choice) -> bool:
    return bool(choice.mends) or choice.confidence is not Confidence.GUESSED


def _behind_one_another(runs: Sequence[Sequence[Stream]]) -> tuple[Stream, ...]:
    """The rows of all runs, stream by stream, in the first run's order; a column is of numbers or of words as there."""
    named = [{stream.name: stream for stream in run} for run in runs]
    return tuple(
        Stream(
            name,
            {field: np.concatenate([_cells(run[name], field) for run in named]) for field in stream.columns},
            {
                field: tuple(np.concatenate([labels(run[name], field) for run in named]))
                for field in stream.text
            },
        )
        for name, stream in named[0].items()
    )


def _cells(stream: Stream, field: str) -> Array:
    """The numbers (n,) of a column; NaN in each row of a column of words."""
    return stream.columns.get(field, np.full(len(stream.text.get(field, ())), np.nan))
