"""`seatrial diagnose`: location and causes of the gap between model and recording, and how far it shrinks."""

import argparse
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from bridge import exit_codes
from bridge.command_line import add_vehicle
from tui.pages import add_figures

if TYPE_CHECKING:
    from bridge.vehicle.config import VehicleFile
    from identify.diagnose.result import Diagnosis
    from identify.dive import Dive

EXAMPLE = "seatrial diagnose dives/2026-11-20T0912Z-hovering --vehicle ruvifist --report gap.html"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("dive", metavar="DIVE", help="a dive folder, .tlog, .tlog.gz, .BIN or .csv")
    add_vehicle(parser)
    parser.add_argument(
        "--check",
        metavar="DIVE",
        help="another dive of that vehicle, to measure on it how far the gap shrinks",
    )
    parser.add_argument(
        "--against",
        metavar="SIM",
        help="a simulator's recording of that vehicle, driven with the same commands or nearly: say what it must gain",
    )
    parser.add_argument("--columns", metavar="MAP", help="YAML map from the columns of a CSV to signals")
    parser.add_argument("--json", metavar="FILE", help="write the answer as JSON; - for standard output")
    parser.add_argument("--report", metavar="HTML", help="write a page with what was found")
    add_figures(parser)
    parser.add_argument(
        "--predict",
        metavar="CSV",
        help="write the velocities of the check dive: measured, and foretold without and with the causes",
    )
    parser.add_argument(
        "--accepted",
        metavar="FILE",
        help="the JSON of identify, or a .param with its sidecar, that was accepted earlier: what has changed since is"
        " told, too",
    )
    parser.add_argument(
        "--accept",
        metavar="FILE",
        help="write the model with the causes as a .param with its sidecar, for `seatrial params upload`",
    )
    parser.add_argument(
        "--without",
        action="append",
        metavar="EFFECT",
        help="leave this effect out of those that are tried; may be given several times",
    )


def run(arguments: argparse.Namespace) -> int:
    from bridge.errors import SeatrialError
    from bridge.vehicle.config import load_vehicle
    from gcs_plugin.params.files import sidecar_path
    from identify.diagnose.shrink import csv_of
    from identify.run.diagnose import Before, diagnose
    from identify.run.identify import compiles_first
    from identify.run.recordings import read, stray_bytes
    from tui import pages, show
    from tui.accepted import accepted_before
    from tui.answers import tell_diagnosis
    from tui.files import PARAMETER_SUFFIXES, Files, check_file, check_files
    from tui.recordings import column_map_for, recording_at, ruled_out

    if arguments.against:
        return run_against(arguments)
    if arguments.predict and not arguments.check:
        raise exit_codes.UsageError("--predict tells of the check dive; give --check DIVE with it")
    targets = {"--json": arguments.json, "--report": arguments.report, "--predict": arguments.predict}
    targets["--accept"] = arguments.accept
    if arguments.accept:
        targets["the sidecar of --accept"] = str(sidecar_path(Path(arguments.accept)))
    check_files(targets)
    pages.check(arguments)
    check_file("--accept", arguments.accept, PARAMETER_SUFFIXES)
    file = load_vehicle(arguments.vehicle)
    places = [Path(path) for path in (arguments.dive, arguments.check) if path]
    columns = column_map_for(arguments.columns, [*map(str, places)])
    reading, check = read(recording_at(places[0]), file, columns), None
    if arguments.check:
        try:
            check = read(recording_at(places[1]), file, columns)
        except SeatrialError as error:
            raise type(error)(f"the check dive {error}") from None
    remarks = [*reading.remarks, *(check.remarks if check else ()), *filter(None, map(stray_bytes, places))]
    configuration = reading.configuration
    before = accepted_before(Path(arguments.accepted), configuration) if arguments.accepted else Before()
    impossible, why = ruled_out(places[0])
    if compiles_first():
        show.say(show.words(), "compiling first, once after installation: this takes up to a minute more")
    with show.steps(f"diagnosing {reading.dive.name}") as progress:
        done = diagnose(
            reading.dive,
            reading.file,
            configuration,
            check=check.dive if check else None,
            without=(*(arguments.without or ()), *impossible),
            before=before,
            notes=[f"{remark}." for remark in (*remarks, *why)],
            progress=progress,
        )
    result = done.diagnosis
    # Write the files first: the reader of the table may leave before its end.
    with Files() as files:
        files.json(done.to_json(), arguments.json)
        if pages.wanted(arguments):
            from identify.report.diagnosis import diagnosis_report

            dives = [dive for dive in (done.dive, done.check) if dive is not None]
            pages.publish(files, arguments, partial(diagnosis_report, result), dives, done.file)
        if result.prediction is not None and arguments.predict:
            foretold = f"velocities of the check dive: {arguments.predict}"
            files.text(Path(arguments.predict), csv_of(result.prediction), foretold)
        if arguments.accept:
            accepted = partial(accept, Path(arguments.accept), result, done.dive, done.file)
            files.attempt(lambda: files.written.extend(accepted()))
        console = show.results(arguments.json)
        tell_diagnosis(console, result)
        for sentence in files.written:
            show.say(console, sentence)
    return files.code(exit_codes.DONE)


def accept(path: Path, diagnosis: "Diagnosis", dive: "Dive", file: "VehicleFile") -> tuple[str, ...]:
    """Write the accepted model as a parameter file; return sentences on the effects that the feed-forward can't
    compensate and on how to upload the file. Without an accepted effect no file is written.
    """
    from bridge.vehicle.coefficients import BY_NAME
    from gcs_plugin.params.identified import doubt_lines
    from identify.batch.rows import clauses
    from identify.checks.contradictions import contradictions
    from identify.diagnose.accepted import none_accepted
    from identify.identification import Outcome, worst
    from tui.parameter_files import write_accepted

    if diagnosis.first:
        return (
            f"{path} was not written: the motion does not go the way the thrust pushes; mend how the sensors or the "
            "thrusters are said to be mounted first.",
        )
    if not diagnosis.accepted.effects:
        return (f"{path} was not written: {none_accepted(diagnosis.findings)}.",)
    if not diagnosis.accepted.tells:
        return (
            *diagnosis.accepted.sentences,
            f"{path} was not written: nothing is left of it that could be sent.",
        )
    fitted = diagnosis.accepted.values.keys()
    of_recording = [
        doubt
        for doubt in contradictions(dive, file, diagnosis.configuration, fitted)
        if not fitted.isdisjoint(doubt.about)
    ]
    doubts = [*diagnosis.accepted.doubts, *of_recording]
    doubted = {
        name: why for name, why in clauses(doubts, BY_NAME).items() if name in diagnosis.accepted.values
    }
    outcome = worst(doubt.outcome for doubt in doubts)
    write_accepted(path, diagnosis, dive, file, doubted, outcome)
    how = f"accepted: {path}; {_sends(path, diagnosis)}"
    if diagnosis.verdict in ("partly", "unknown"):
        how += " with --despite-doubts, because something is left that no cause explains"
    elif outcome is not Outcome.CONVERGED:
        contradicted = worst(doubt.outcome for doubt in of_recording) is not Outcome.CONVERGED
        why = "the recording contradicts itself" if contradicted else "the model does not fit the dive"
        how += f" with --despite-doubts, because {why}"
    return (*diagnosis.accepted.sentences, *doubt_lines(doubted, tuple(doubted)), how)


def _sends(path: Path, diagnosis: "Diagnosis") -> str:
    """Describe the effect of uploading the file to the vehicle."""
    from bridge.vehicle.coefficients import BY_NAME
    from identify.diagnose.wording import sorted_by_likelihood

    likely, _ = sorted_by_likelihood(diagnosis.findings)
    upload = f"seatrial params upload {path} sends"
    by_masses = any(finding.cause.effect.feedforward == "nominal" for finding in likely)
    if by_masses or any(name not in BY_NAME for name in diagnosis.accepted.values):
        return f"{upload} it to the vehicle"
    if not diagnosis.accepted.values:
        return "nothing in it is for the vehicle; export and simulate --accepted take it"
    return (
        "the feed-forward can make up for none of its causes; "
        f"{upload} only the masses and dampings that were fitted beside them"
    )


def run_against(arguments: argparse.Namespace) -> int:
    """`diagnose REAL --against SIM`: what a simulator must gain."""
    from bridge.vehicle.config import load_vehicle
    from identify.diagnose.against import against, plain
    from identify.ingest.open import read_dive
    from identify.report.diagnosis import against_report
    from tui import pages, show
    from tui.answers import tell_against
    from tui.files import Files, check_files
    from tui.recordings import column_map_for

    for option in ("check", "predict", "accept"):
        if getattr(arguments, option):
            raise exit_codes.UsageError(
                f"--{option} tells of the vehicle, --against of a simulator; run them one after the other"
            )
    check_files({"--json": arguments.json, "--report": arguments.report})
    pages.check(arguments)
    file = load_vehicle(arguments.vehicle)
    columns = column_map_for(arguments.columns, (arguments.dive, arguments.against))
    real, sim = (read_dive(Path(path), columns, file) for path in (arguments.dive, arguments.against))
    configuration = configuration_of_both(real, sim, file)
    with show.progress(f"{real.name} against {sim.name}") as tell:
        gap = against(real, sim, file, configuration, progress=tell)
    # Files first: the reader of the table may close the pipe before its end.
    with Files() as files:
        files.json(plain(gap), arguments.json)
        if pages.wanted(arguments):
            pages.publish(files, arguments, partial(against_report, gap), (real, sim), file)
        console = show.results(arguments.json)
        tell_against(console, gap)
        for line in files.written:
            show.say(console, line)
    return files.code(exit_codes.DONE)


def configuration_of_both(real: "Dive", sim: "Dive", file: "VehicleFile") -> str:
    """The configuration that the user named, otherwise that of the real dive. Raises LogError if the simulator says
    that it was in another."""
    from bridge.errors import LogError

    real_index, its = real.configuration_index(), sim.configuration_index()
    configuration = file.configuration_of(real_index)
    if file.configuration is None and its is not None and file.vehicle.configuration_at(its) != configuration:
        raise LogError(
            f"{sim.name}: was driven in configuration '{file.vehicle.configuration_at(its)}', {real.name} in "
            f"'{configuration}'; drive the simulator in the same one"
        )
    return configuration
