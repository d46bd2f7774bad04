"""Joins runs of a vehicle into a dive: in sequence on a common clock, each with its own state and trim.

The runs share masses, damping, thrust, delays and noise levels. The motion between two runs is unknown
(`Dive.breaks_s`), so each recursion begins anew. A note names a change of ballast between runs.
"""

import hashlib
import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations, pairwise
from pathlib import Path
from typing import Any, Final

import numpy as np

from bridge.arrays import Array
from bridge.errors import FitError, LogError
from bridge.vehicle.coefficients import HEAVE
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive, Note, Run, Signal
from identify.estimators.mass_by_run import FEWEST_RUNS, split
from identify.estimators.refusals import refuse_unpushed
from identify.ingest.files.streams import some_of
from identify.run.recordings import Reading
from identify.statistics import left_of
from identify.thrust.wrench import wrench
from identify.words import listed, significant

APART_S: Final = 3.0
"""Least time between two runs on the common clock: half of it exceeds every delay that is tried, and the memory of the
filters of forces and readings."""

TICKS_HZ: Final = 50.0
"""Runs are moved by whole ticks of the grid of `identify.estimators.axes.build`, so that their forces do not change."""

LEAST_RUN_S: Final = 3.0
OVERLAP_S: Final = 1.0
"""Two clocks of one vehicle may differ by this much before its runs count as recorded at the same time."""

NAMED: Final = 5
NOTHING: Final[Mapping[str, str]] = {}


def together(readings: Sequence[Reading], unread: Mapping[str, str] = NOTHING) -> Reading:
    """Join runs in order of their time, or of their names, so that their order as arguments doesn't matter.

    A run in which no thruster pushed is left out, and named, as are those that are `unread`, by name with the reason. A
    single reading stays as it is. Raises LogError for the
    same recording twice, or recordings that can't be of one vehicle under the same conditions; FitError if nothing was
    pushed in any.
    """
    if len(readings) == 1 and not unread:
        return readings[0]
    _refuse_twice([reading.dive for reading in readings])
    readings = _in_order(readings)
    first = readings[0]
    configuration_name = _refuse_others(readings)
    used, left_out = [], dict(unread)
    for reading in readings:
        if reason := _useless(reading, configuration_name):
            left_out[reading.dive.name] = reason
        else:
            used.append(reading.dive)
    if not used:
        name, reason = next(iter(left_out.items()))
        raise FitError(f"no run of {len(readings)} can be used; of the first, {name}: {reason}")
    dive = joined(used, left_out)
    dive = replace(dive, notes=(*dive.notes, *ballast_note(dive, first.file, configuration_name)))
    remarks = tuple(dict.fromkeys(remark for reading in readings for remark in reading.remarks))
    return Reading(dive, first.file, remarks)


def joined(dives: Sequence[Dive], left_out: Mapping[str, str] = NOTHING) -> Dive:
    """One dive of several, in this order; a signal that some of them lack is left out of all.

    Raises LogError if one of them has other thruster commands than the others.
    """
    _refuse_other_commands(dives)
    moved_s = _moves_s(dives)
    everywhere = [name for name in dives[0].signals() if all(name in dive.signals() for dive in dives)]
    signals: dict[str, Any] = {}
    for name in everywhere:
        in_a_row = [dive.signals()[name] for dive in dives]
        times: list[Array] = [signal.time_s + by_s for signal, by_s in zip(in_a_row, moved_s, strict=True)]
        signals[name] = Signal(np.concatenate(times), np.vstack([signal.value for signal in in_a_row]))
    runs = tuple(
        Run(dive.name, dive.source, dive.sha256, dive.span_s[0] + by_s, dive.span_s[1] + by_s)
        for dive, by_s in zip(dives, moved_s, strict=True)
    )
    frozen: dict[str, tuple[tuple[float, float], ...]] = {}
    for dive, by_s in zip(dives, moved_s, strict=True):
        for name, spans in dive.frozen.items():
            moved = tuple((start_s + by_s, end_s + by_s) for start_s, end_s in spans)
            frozen[name] = (*frozen.get(name, ()), *moved)
    counts = Counter[str]()
    for dive in dives:
        counts.update(dive.counts)
    none: dict[str, Any] = dict.fromkeys(set(dives[0].signals()) - set(everywhere))
    unix_s = dives[0].unix_at_boot_s
    holding = {dive.commands_hold for dive in dives}
    return replace(
        dives[0],
        **none,
        **signals,
        name=_name(dives),
        source=_source(dives),
        sha256=hashlib.sha256("".join(dive.sha256 for dive in dives).encode()).hexdigest(),
        opening="",
        commands_hold=holding.pop() if len(holding) == 1 else None,
        stamped_s=max(dive.stamped_s for dive in dives),
        unix_at_boot_s=None if unix_s is None else unix_s - moved_s[0],
        frozen=frozen,
        counts=counts,
        runs=runs,
        left_out=tuple(left_out.items()),
        reckoned=max(
            (dive.reckoned for dive in dives if dive.reckoned), key=lambda each: each.share, default=None
        ),
        notes=_notes(dives, everywhere, left_out),
    )


def _in_order(readings: Sequence[Reading]) -> list[Reading]:
    """In order of time if each run is dated, otherwise of names; runs of one name by their contents."""

    def begins_s(dive: Dive) -> float:
        return math.nan if dive.unix_at_boot_s is None else dive.unix_at_boot_s + dive.span_s[0]

    dated = all(math.isfinite(begins_s(reading.dive)) for reading in readings)
    return sorted(
        readings,
        key=lambda reading: (
            begins_s(reading.dive) if dated else 0.0,
            _by_numbers(reading.dive.name),
            reading.dive.sha256,
        ),
    )


def _by_numbers(name: str) -> list[tuple[int, str]]:
    """The parts of a name that order it by the numbers in it: run 2 before run 10."""
    parts = (part for part in re.split(r"(\d+)", name) if part)
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]


def _refuse_twice(dives: Sequence[Dive]) -> None:
    for first, second in combinations(dives, 2):
        if first.sha256 == second.sha256 or (first.opening and first.opening == second.opening):
            raise LogError(
                f"{first.source} and {second.source} hold the same recording, and would count twice; give it once"
            )
        if _at_the_same_time(first, second):
            raise LogError(
                f"{first.source} and {second.source} were recorded at the same time, and would count twice; give one "
                "of them, or put them together with `seatrial merge`"
            )


def _at_the_same_time(first: Dive, second: Dive) -> bool:
    if first.unix_at_boot_s is None or second.unix_at_boot_s is None:
        return False
    (start_s, end_s), (began_s, ended_s) = (
        tuple(boot_s + dive.unix_at_boot_s for boot_s in dive.span_s if dive.unix_at_boot_s is not None)
        for dive in (first, second)
    )
    return min(end_s, ended_s) - max(start_s, began_s) > OVERLAP_S


def _refuse_others(readings: Sequence[Reading]) -> str:
    """The configuration of all. Raises LogError if it is not one, or the conditions are not."""
    first = readings[0]
    for reading in readings[1:]:
        if reading.file != first.file:
            raise LogError(
                f"was dived under other conditions than {first.dive.source}, in water of "
                "another density or with another ballast, so the two are not one dive; leave one out",
                reading.dive.source,
            )
        if reading.configuration != first.configuration:
            raise LogError(
                f"was dived in configuration '{reading.configuration}', {first.dive.source} in "
                f"'{first.configuration}', so the two are not one dive; leave one out",
                reading.dive.source,
            )
    return first.configuration


def _refuse_other_commands(dives: Sequence[Dive]) -> None:
    first = dives[0]
    for dive in dives[1:]:
        expected, present = _commands(first), _commands(dive)
        if expected != present:
            raise LogError(
                f"has {present}, {first.source} has {expected}, so they are not runs of one vehicle; "
                "leave one out",
                dive.source,
            )
        if dive.velocity is not None and dive.velocity_is_filtered != first.velocity_is_filtered:
            raise LogError(
                f"its velocity and that of {first.source} are not of the same kind, as only one comes "
                "out of an autopilot's filter; leave one out",
                dive.source,
            )


def _commands(dive: Dive) -> str:
    signal = dive.thruster_commands
    if signal is None or not len(signal):
        return "no commands of single thrusters"
    return f"{signal.value.shape[1]} thruster commands in {'us' if dive.pwm is not None else 'N'}"


def _useless(reading: Reading, configuration_name: str) -> str:
    """Why nothing can be learnt from a run; "" if something can."""
    dive = reading.dive
    if dive.duration_s < LEAST_RUN_S:
        return f"it lasts {significant(dive.duration_s, 2)} s"
    try:
        refuse_unpushed(dive, reading.file, configuration_name)
    except FitError as error:
        return error.reason
    return ""


def _moves_s(dives: Sequence[Dive]) -> list[float]:
    """By how much the times of each are moved; the first stays."""
    moves = [0.0]
    for before, dive in pairwise(dives):
        least_s = before.span_s[1] + moves[-1] + APART_S - dive.span_s[0]
        moves.append(math.ceil(least_s * TICKS_HZ) / TICKS_HZ)
    return moves


def _name(dives: Sequence[Dive]) -> str:
    if len(dives) == 1:
        return dives[0].name
    return f"{len(dives)} runs, {dives[0].name} to {dives[-1].name}"


def _source(dives: Sequence[Dive]) -> Path:
    """The table that holds all of them, otherwise the folder of the first."""
    first = dives[0].source
    return first if all(dive.source == first for dive in dives) else first.parent


def kinds_of(names: Sequence[str]) -> tuple[str, ...]:
    """A sentence on runs whose names are of a few kinds, but for their numbers; () for one kind, or many."""
    kinds: dict[str, list[str]] = {}
    for name in names:
        kinds.setdefault(re.sub(r"\d+", "", name), []).append(name)
    if not 2 <= len(kinds) <= len(names) / 2:
        return ()
    said = listed([f"{of[0]} and {len(of) - 1} more" if len(of) > 1 else of[0] for of in kinds.values()])
    return (
        f"The names of the runs are of {len(kinds)} kinds ({said}), and all are taken for one vehicle under the same "
        "conditions; if they are not, give each kind a folder.",
    )


def _notes(dives: Sequence[Dive], everywhere: Sequence[str], left_out: Mapping[str, str]) -> tuple[str, ...]:
    lasting_s = sum(dive.duration_s for dive in dives)
    names = [dive.name for dive in dives]
    said = names if len(names) <= 2 * NAMED else [*names[:NAMED], f"{len(names) - NAMED} more"]
    more = [
        f"{len(dives)} runs are one dive of {lasting_s:.0f} s: {listed(said)}.",
        *kinds_of(names),
        *(f"The run {name} was left out: {reason}." for name, reason in left_out.items()),
    ]
    for name in dict.fromkeys(name for dive in dives for name in dive.signals()):
        if name not in everywhere:
            lack = [dive.name for dive in dives if name not in dive.signals()]
            more.append(
                f"The runs' {name} was left out, as {len(lack)} of them {'lacks' if len(lack) == 1 else 'lack'} it, "
                f"first {lack[0]}."
            )
    notes: dict[str, list[str]] = {}
    for dive in dives:
        for note in dive.notes:
            notes.setdefault(note, []).append(dive.name)
    for note, of in notes.items():
        words = f"{of[0] if len(of) == 1 else f'{len(of)} runs, first {of[0]}'}: {note}"
        more.append(Note(words, note.kind) if isinstance(note, Note) else words)
    return tuple(more)


WINDOW_S, STEP_S = 2.0, 0.1
"""Long against the delays of thrust and readings, short against a run."""
LEAST_SHARE: Final = 0.003
"""Of the dry weight, by which two kinds of runs differ: less is a trapped bubble, or the sea."""


def ballast_note(dive: Dive, file: VehicleFile, configuration_name: str) -> tuple[str, ...]:
    """A sentence on runs that are heavier in the water than the others; () if all are equal, or the dive does not show
    it.

    Over windows, the thrust in heave is a steady push of each run, and shares of acceleration, drag and turning that
    all runs have in common.
    """
    numbers, thrust, shapes = _windows(dive, file, configuration_name)
    runs = np.unique(numbers)
    if len(runs) < FEWEST_RUNS:
        return ()
    of_run = (numbers[:, None] == runs).astype(np.float64)
    columns = np.hstack([of_run, shapes])
    fitted, *_ = np.linalg.lstsq(columns, thrust, rcond=None)
    noise = float(np.var(left_of(columns, thrust)))
    precisions = of_run.sum(axis=0) / max(noise, np.finfo(np.float64).tiny)
    weight_n = file.vehicle.configurations[configuration_name].dry_mass_kg * file.vehicle.water.gravity_m_s2
    kinds = split(-fitted[: len(runs)], precisions, LEAST_SHARE * weight_n)
    if kinds is None:
        return ()
    heavy, by_n = kinds
    names = some_of([dive.runs[int(runs[k])].name for k in heavy])
    return (
        f"In the water, {names} {'is' if len(heavy) == 1 else 'are'} heavier by {significant(by_n, 2)} N than the "
        "other runs, as after a change of ballast, and one model is fitted to all; if ballast was changed, give each "
        "kind a folder.",
    )


def _windows(dive: Dive, file: VehicleFile, configuration_name: str) -> tuple[Array, Array, Array]:
    """The run (n,) of each window, its mean thrust in heave (n,), N, and the mean motion (n, k) that thrust is needed
    for; empty if a signal is missing."""
    nothing = np.zeros(0), np.zeros(0), np.zeros((0, 1))
    velocity, gyro = dive.velocity, dive.gyro
    if velocity is None or gyro is None or dive.velocity_is_filtered:
        return nothing
    velocity, gyro = velocity.finite(), gyro.finite()
    if min(len(velocity), len(gyro)) < 2:
        return nothing
    try:
        thrust = wrench(dive, file, configuration_name).along(HEAVE)
    except FitError:
        return nothing
    steps = round(WINDOW_S / STEP_S)
    numbers, means, shapes = [], [], []
    for number, run in enumerate(dive.runs):
        count = int((run.end_s - run.start_s) / WINDOW_S)
        time_s = run.start_s + STEP_S * np.arange(count * steps + 1, dtype=np.float64)
        edges_s = time_s[::steps]
        (u, v, w), (p, q, _) = velocity.at(time_s).T, gyro.at(time_s).T
        inside = np.column_stack([w, np.abs(w) * w, u * q, v * p])[:-1]
        numbers.append(np.full(count, number))
        means.append(thrust.mean_between(edges_s[:-1], edges_s[1:])[:, 0])
        shapes.append(
            np.column_stack([np.diff(w[::steps]), inside.reshape(count, steps, inside.shape[1]).mean(axis=1)])
        )
    return np.concatenate(numbers), np.concatenate(means), np.vstack(shapes)
