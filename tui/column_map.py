"""`seatrial import FILE --map`: the columns of a file, the signal proposed for each, and the column map."""

import argparse
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from bridge import exit_codes
from bridge.errors import LogError
from bridge.exit_codes import UsageError
from bridge.text import typed
from identify.ingest.files.streams import Stream
from identify.ingest.mapping.candidates import Choice, Confidence
from identify.ingest.mapping.map_text import FILTERED, map_text, uncertain
from identify.ingest.mapping.profiles import Profile
from identify.ingest.mapping.proposal import NothingKnown, Proposal
from identify.ingest.mapping.proposal_of_runs import propose, propose_runs
from identify.ingest.open import read_streams
from identify.ingest.ros.recorded import RECEIVED
from identify.run.joined_runs import kinds_of
from identify.run.recordings import runs_in
from tui import show
from tui.files import Files, check_new_file

BARS = "▁▂▃▄▅▆▇█"
LEVEL = BARS[0]
HEADER_NUMBER = ".header.seq"
"""Of ROS 1, by which a header counts the messages."""
SPARED = ("median", "unknown %", "course", "rate Hz")
"""Columns left out on a narrow terminal, the least important first."""


def propose_map(arguments: argparse.Namespace) -> int:
    """Show and write the column map that a file suggests. Raises UsageError, or LogError if nothing can be proposed."""
    for option in ("columns", "out", "vehicle"):
        if getattr(arguments, option):
            raise UsageError(
                f"--{option}: has no use with --map, which makes the column map first; leave it out"
            )
    path = Path(arguments.file)
    target = arguments.map or f"{path.name.split('.')[0]}-columns.yaml"
    if not arguments.map:
        check_new_file("--map", target)
    console = show.results(arguments.json)
    try:
        proposal, notes = _proposed(path)
    except NothingKnown as unknown:
        show.put(console, _fitting(_table(path, unknown.seen), console.width))
        raise
    show.put(console, _fitting(_table(path, proposal), console.width))
    show.say(console, *_questions(proposal), *(f"note: {note}" for note in notes))
    mapped = typed(path, "--columns", target)
    following = [
        f"seatrial import {mapped}",
        f"seatrial diagnose {mapped} --vehicle our.yaml --report gap.html",
    ]
    with Files() as files:
        if files.text(Path(target), map_text(proposal, path.name)):
            show.say(console, f"written: {target}. Read it, mend it, then:")
            console.print("\n".join(f"  {line}" for line in following), soft_wrap=True)
        files.json(_plain(proposal, notes, target, following), arguments.json)
    return files.code(exit_codes.DONE)


def _proposed(path: Path) -> tuple[Proposal, tuple[str, ...]]:
    """The column map that a file suggests, or the runs of a folder, with notes. Raises LogError."""
    places = runs_in(path)
    if places == [path]:
        recorded = read_streams(path)
        proposal = propose(recorded.streams, path)
        return proposal, (*recorded.notes, *proposal.notes)
    runs, notes, unread = dict[str, Sequence[Stream]](), list[str](), list[LogError]()
    for place in places:
        try:
            recorded = read_streams(place)
        except LogError as error:
            unread.append(error)
        else:
            runs[place.name] = recorded.streams
            notes += [f"{place.name}: {note}" for note in recorded.notes]
    if not runs:
        raise unread[0]
    proposal = propose_runs(runs, path)
    return proposal, (
        *(f"Left out: {error}." for error in unread),
        *notes,
        *kinds_of(list(runs)),
        *proposal.notes,
    )


def _table(path: Path, proposal: Proposal) -> show.Table:
    shown = [profile for profile in proposal.profiles if _worth_a_look(profile, proposal)]
    rows = []
    for profile in shown:
        signal, unit = proposal.taken_for(profile.name)
        rows.append((
            profile.name, signal or "not used", unit or "-",
            *(show.number(value, 4) for value in (profile.least, profile.median, profile.largest)),
            show.number(profile.rate_hz or None, 3), show.number(100.0 * profile.unknown, 2), drawn(profile),
        ))  # fmt: skip
    return show.Table(
        f"{path.name}: {_counted(proposal, shown)}",
        ("column", "taken for", "unit", "least", "median", "largest", "rate Hz", "unknown %", "course"),
        rows,
        numbers=("least", "median", "largest", "rate Hz", "unknown %"),
        stale=[not proposal.taken_for(profile.name)[0] for profile in shown],
    )


def _fitting(table: show.Table, width: int) -> show.Table:
    """The table without the columns of SPARED, as many as lines of `width` have no room for."""
    for heading in SPARED:
        if all(len(line) <= width for line in table.lines(width)):
            break
        at = table.columns.index(heading)
        rows = [(*row[:at], *row[at + 1 :]) for row in table.rows]
        table = replace(table, columns=[name for name in table.columns if name != heading], rows=rows)
    return table


def _worth_a_look(profile: Profile, proposal: Proposal) -> bool:
    """Whether a column is used, or may be: the covariances of a bag never change, one clock is enough, and the numbers
    of its messages are none."""
    if proposal.taken_for(profile.name)[0]:
        return True
    counts = profile.name.rpartition(".")[2] == RECEIVED or profile.name.endswith(HEADER_NUMBER)
    return not counts and (profile.is_text or profile.least < profile.largest)


def _counted(proposal: Proposal, shown: list[Profile]) -> str:
    count, hidden = len(proposal.profiles), len(proposal.profiles) - len(shown)
    return f"{count} columns" + (
        f", of which {hidden} not used, unchanging or a second clock, {'is' if hidden == 1 else 'are'} left out here"
        if hidden
        else ""
    )


def drawn(profile: Profile) -> str:
    """The course of a column as bars between its least and its largest mean; `words` for text."""
    if profile.is_text:
        return "words"
    known = [value for value in profile.course if math.isfinite(value)]
    if not known:
        return "-"
    low, span = min(known), max(known) - min(known)
    if span == 0:
        return LEVEL * len(known)
    return "".join(BARS[min(int((value - low) / span * len(BARS)), len(BARS) - 1)] for value in known)


def _questions(proposal: Proposal) -> list[str]:
    """The choices that the user should check, in sentences."""
    return [
        *([f"check time: {proposal.time_reason}"] if proposal.time_reason else []),
        *(f"check {choice.signal}: {reason}" for choice in proposal.choices for reason in uncertain(choice)),
        *([f"check velocity: {FILTERED}"] if proposal.columns.velocity_is_filtered else []),
    ]


def _plain(proposal: Proposal, notes: tuple[str, ...], target: str, following: list[str]) -> dict[str, Any]:
    return {
        "columns": [_profile(profile, proposal) for profile in proposal.profiles],
        "time": {"column": proposal.columns.time.column, "unit": proposal.columns.time.unit},
        "signals": [_choice(choice) for choice in proposal.choices],
        "notes": list(notes),
        "map": target,
        "next": following,
    }


def _profile(profile: Profile, proposal: Proposal) -> dict[str, Any]:
    signal, unit = proposal.taken_for(profile.name)
    return {
        "name": profile.name, "taken_for": signal, "unit": unit, "samples": profile.samples,
        "rate_hz": profile.rate_hz, "least": profile.least, "median": profile.median, "largest": profile.largest,
        "unknown_percent": 100.0 * profile.unknown, "is_text": profile.is_text,
    }  # fmt: skip


def _choice(choice: Choice) -> dict[str, Any]:
    columns = choice.columns
    return {
        "signal": choice.signal, "columns": list(columns.columns), "unit": columns.unit,
        "offset": list(columns.offset), "scale": list(columns.scale), "confidence": choice.confidence.value,
        "is_guess": choice.confidence is Confidence.GUESSED, "reasons": [*filter(None, choice.reasons)],
        "mends": [mend.problem for mend in choice.mends],
    }  # fmt: skip
