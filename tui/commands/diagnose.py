"""`seatrial diagnose`: location and causes of the gap between model and recording, and how far it shrinks."""

import argparse
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from rich.console import Console

from bridge import exit_codes
from bridge.errors import FitError, LogError, SeatrialError
from bridge.exit_codes import UsageError
from bridge.vehicle.config import VehicleFile, load_vehicle
from identify.diagnose.result import Diagnosis
from identify.diagnose.shrink.contradiction import contradicted
from identify.diagnose.shrink.shrink import csv_of
from identify.diagnose.simulators import comparison as against
from identify.diagnose.simulators.comparison import Against
from identify.diagnose.words import against as against_words
from identify.diagnose.words import diagnosis as wording
from identify.diagnose.words import gap as gap_words
from identify.dive import Dive
from identify.repeats.answer import plain, sentences
from identify.repeats.marks import Usual, usual_from
from identify.run.diagnose import diagnose, effects_without
from identify.run.identify import compiles_first, runs_as_json
from identify.run.recordings import Reading, runs_in, stray_bytes
from identify.run.repeats import judge, repeats, runs_as_dives
from tui import show
from tui.accept_diagnosis import accept, before_of, check_accepted
from tui.files import Files
from tui.parameter_files import Leave, read_identification
from tui.recordings import column_map_for, read_together, ruled_out

if TYPE_CHECKING:
    from identify.report.page import Report

NOT_ACCEPTED: Final = (
    "to make up for it: the same with --accept FILE writes a model for `seatrial params upload FILE`"
)


def run(arguments: argparse.Namespace) -> int:
    if arguments.against:
        return run_against(arguments)
    if arguments.predict and not arguments.check:
        raise exit_codes.UsageError("--predict tells of the check dive; give --check DIVE with it")
    file = load_vehicle(arguments.vehicle)
    runs = recordings_of(arguments.dives)
    checks = recordings_of([arguments.check]) if arguments.check else []
    columns = column_map_for(arguments.columns, [*map(str, (*runs, *checks))])
    reading, check = read_together(arguments.dives, file, columns), None
    if checks:
        try:
            check = read_together([arguments.check], file, columns)
        except SeatrialError as error:
            raise type(error)(f"the check dive {error}") from None
    remarks = [
        *reading.remarks,
        *(check.remarks if check else ()),
        *filter(None, map(stray_bytes, (*runs, *checks))),
    ]
    configuration = reading.configuration
    if arguments.accepted:
        usual = usual_accepted(Path(arguments.accepted), reading.file, configuration)
        if usual is not None and repeats(reading.dive, reading.file, configuration):
            return run_repeats(arguments, reading, usual)
    leave = Leave(doubts=arguments.despite_doubts)
    before = before_of(arguments.accepted, reading.dive, file, configuration, leave)
    impossible, why = ruled_out(runs)
    if compiles_first():
        show.say(show.words(), "compiling first, once after installation: this takes up to a minute more")
    with show.steps(f"diagnosing {reading.dive.name}") as progress:
        done = diagnose(
            reading.dive,
            reading.file,
            configuration,
            check=check.dive if check else None,
            check_file=check.file if check else None,
            without=(*(arguments.without or ()), *impossible),
            before=before,
            notes=[f"{remark}." for remark in (*remarks, *why)],
            progress=progress,
        )
    result = done.diagnosis
    # Write the files first: the reader of the table may leave before its end.
    with Files() as files:
        files.json(done.to_json(), arguments.json)
        dives = [dive for dive in (done.dive, done.check) if dive is not None]
        files.publish(arguments, partial(page_of, result), dives, done.file)
        if result.prediction is not None and arguments.predict:
            foretold = f"velocities of the check dive: {arguments.predict}"
            files.text(Path(arguments.predict), csv_of(result.prediction), foretold)
        if arguments.accept:
            accepted = partial(accept, Path(arguments.accept), result, done.dive, done.file)
            files.attempt(lambda: files.written.extend(accepted()))
        console = show.results(arguments.json)
        tell_diagnosis(console, result)
        show.say(console, *files.written)
        if not arguments.accept and is_for_upload(result):
            show.say(show.words(), NOT_ACCEPTED)
    return files.code(exit_codes.DONE)


def is_for_upload(result: Diagnosis) -> bool:
    """Whether causes were found that a vehicle may make up for: nothing speaks against these."""
    has_causes = result.accepted.effects and result.findings
    return bool(has_causes) and not result.first and not contradicted(result.heldout, result.check)


def usual_accepted(path: Path, file: VehicleFile, configuration: str) -> Usual | None:
    """Marks of accepted runs, if the JSON of `identify --together` holds them. Raises UsageError for a damaged file,
    and for one of another vehicle or configuration."""
    if path.suffix != ".json":
        return None
    identified = read_identification(path)
    kept = identified.get("repeats")
    if kept is None:
        return None
    check_accepted(path, str(identified["vehicle"]["name"]), identified["configuration"], file, configuration)
    try:
        return usual_from(kept)
    except LogError as error:
        raise UsageError(f"--accepted {path}: {error}") from None


def run_repeats(arguments: argparse.Namespace, reading: Reading, usual: Usual) -> int:
    """Judge runs that repeat one push by accepted ones."""
    for option in ("check", "predict", "accept", "report", "figures"):
        if getattr(arguments, option):
            raise UsageError(
                f"--{option}: runs that repeat one push are judged by what accepted ones have in common, which tells "
                "no model to check, accept or draw; leave it out"
            )
    dive = reading.dive
    judged = judge(runs_as_dives(dive), reading.file, reading.configuration, usual)
    left_out = len(runs_as_dives(dive)) - judged.runs
    do, were = ("does", "was") if left_out == 1 else ("do", "were")
    unlike = (
        (f"{left_out} more {do} not go from rest into a steady push, and {were} left out.",)
        if left_out
        else ()
    )
    said = (*sentences(judged), *unlike, *(f"{remark}." for remark in reading.remarks), *dive.notes)
    with Files() as files:
        words = {"dive": dive.name, "verdict": said[0], "notes": said[1:]}
        files.json({**plain(judged), **runs_as_json(dive), "told": words}, arguments.json)
        console = show.results(arguments.json)
        show.say(console, said[0], *(f"  {sentence}" for sentence in said[1:]), *files.written)
    return files.code(exit_codes.DONE)


def page_of(diagnosis: Diagnosis) -> "Report":
    from identify.report.diagnosis import diagnosis_report  # loads matplotlib

    return diagnosis_report(diagnosis)


def page_of_both(comparison: Against) -> "Report":
    """Return the report of a vehicle held against its simulator."""
    from identify.report.diagnosis import against_report  # loads matplotlib

    return against_report(comparison)


def run_against(arguments: argparse.Namespace) -> int:
    """`diagnose REAL --against SIM`: what a simulator must gain. Several runs of either are one dive."""
    for option in ("check", "predict", "accept", "accepted"):
        if getattr(arguments, option):
            raise exit_codes.UsageError(
                f"--{option} tells of the vehicle, --against of a simulator; run them one after the other"
            )
    file = load_vehicle(arguments.vehicle)
    places, of_simulator = recordings_of(arguments.dives), recordings_of([arguments.against])
    columns = column_map_for(arguments.columns, [*map(str, (*places, *of_simulator))])
    reading = read_together(arguments.dives, file, columns)
    try:
        of_sim = read_together([arguments.against], file, columns)
    except SeatrialError as error:
        raise type(error)(f"the simulator's {error}") from None
    real, sim = reading.dive, of_sim.dive
    configuration = configuration_of_both(real, sim, file)
    for each in (reading, of_sim):
        if repeats(each.dive, each.file, configuration):
            raise FitError(
                "its runs go from rest into one steady push, which tells no model to hold against a simulator's; give "
                "runs with several speeds, or judge these by accepted ones with --accepted",
                of=each.dive.source,
            )
    impossible, why = ruled_out(places)
    without = (*(arguments.without or ()), *impossible)
    with show.progress(f"{real.name} against {sim.name}") as tell:
        effects = effects_without(without, configuration, file) if without else None
        gap = against.against(
            real, sim, reading.file, of_sim.file, configuration, effects=effects, progress=tell
        )
    remarks = [
        *reading.remarks,
        *of_sim.remarks,
        *filter(None, map(stray_bytes, (*places, *of_simulator))),
        *why,
    ]
    notes = (*(f"{remark}." for remark in remarks), *gap.vehicle.notes)
    gap = replace(gap, vehicle=replace(gap.vehicle, notes=notes))
    # Files first: the reader of the table may close the pipe before its end.
    with Files() as files:
        files.json({**against.plain(gap), **runs_as_json(real)}, arguments.json)
        files.publish(arguments, partial(page_of_both, gap), (real, sim), file)
        console = show.results(arguments.json)
        tell_against(console, gap)
        show.say(console, *files.written)
    return files.code(exit_codes.DONE)


def recordings_of(paths: Sequence[str]) -> list[Path]:
    """The recordings that are runs of one dive, those in folders too. Raises LogError for a path that holds none."""
    return [place for path in paths for place in runs_in(Path(path))]


def configuration_of_both(real: Dive, sim: Dive, file: VehicleFile) -> str:
    """The configuration that the user named, otherwise that of the real dive. Raises LogError if the simulator says
    that it was in another."""
    real_index, its = real.configuration_index(), sim.configuration_index()
    configuration = file.configuration_of(real_index)
    if file.configuration is None and its is not None and file.vehicle.configuration_at(its) != configuration:
        raise LogError(
            f"{sim.name}: was driven in configuration '{file.vehicle.configuration_at(its)}', {real.name} in "
            f"'{configuration}'; drive the simulator in the same one"
        )
    return configuration


def tell_against(console: Console, comparison: Against) -> None:
    """Print the thrust and the verdict on a simulator, then all other sentences, indented."""
    show.say(console, *against_words.thrust_sentences(comparison), against_words.verdict_sentence(comparison))
    for line in (
        *against_words.difference_lines(comparison),
        *against_words.further_lines(comparison),
        *_where(comparison.vehicle),
        *wording.shrink_lines(comparison.vehicle),
        *wording.next_lines(comparison.vehicle),
        *comparison.vehicle.notes,
        *(f"Of the simulator: {note}" for note in comparison.simulator.notes),
    ):
        show.say(console, f"  {line}")


def tell_diagnosis(console: Console, diagnosis: Diagnosis) -> None:
    """Print the verdict, the causes and their parameters, where the gap lies, how far it shrinks, the next dive."""
    show.say(console, wording.verdict_sentence(diagnosis))
    lines = (
        *wording.cause_lines(diagnosis),
        *wording.character_lines(diagnosis),
        *_where(diagnosis),
        *gap_words.disturbance_line(diagnosis.gap.disturbance),
        *wording.shrink_lines(diagnosis),
        *wording.next_lines(diagnosis),
        *diagnosis.notes,
    )
    show.say(console, *(f"  {line}" for line in lines))


def _where(diagnosis: Diagnosis) -> tuple[str, ...]:
    """A line on the largest parts of the gap; none when the verdict is "no_gap"."""
    line = "" if diagnosis.verdict == "no_gap" else gap_words.where_line(diagnosis)
    return (f"Where the missing force lies, most of it first: {line}.",) if line else ()
