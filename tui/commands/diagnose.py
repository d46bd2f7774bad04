"""`seatrial diagnose`: location and causes of the gap between model and recording, and how far it shrinks."""

import argparse
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

from rich.console import Console

from bridge import exit_codes
from bridge.errors import ConfigError, FitError, LogError, SeatrialError
from bridge.exit_codes import UsageError
from bridge.vehicle.coefficients import BY_NAME, DAMPINGS, OF_HULL, QUADRATICS, effect_coefficients
from bridge.vehicle.config import Configuration, VehicleFile, load_vehicle
from bridge.version import installed
from gcs_plugin.params import float32
from gcs_plugin.params.files import Interval, Sidecar
from gcs_plugin.params.identified import doubt_lines, origin, write_with_sidecar
from identify.batch.rows import clauses
from identify.checks.contradictions import contradictions
from identify.diagnose import against, wording
from identify.diagnose.accepted import none_accepted
from identify.diagnose.against import Against
from identify.diagnose.result import Diagnosis
from identify.diagnose.shrink import csv_of
from identify.diagnose.wording import sorted_by_likelihood
from identify.dive import Dive
from identify.glance.foretold import began
from identify.identification import Outcome, worst
from identify.repeats.answer import plain, sentences
from identify.repeats.marks import Usual, usual_from
from identify.run.diagnose import Before, diagnose, effects_without, published
from identify.run.identify import compiles_first, runs_as_json
from identify.run.recordings import Reading, runs_in, stray_bytes
from identify.run.repeats import judge, repeats, runs_as_dives
from tui import show
from tui.commands.prior import accepted_in
from tui.files import Files
from tui.parameter_files import Leave, check_outcome, read_identification
from tui.recordings import column_map_for, read_together, ruled_out

if TYPE_CHECKING:
    from identify.foretell import Foresight
    from identify.report.page import Report

NOT_ACCEPTED: Final = (
    "to make up for it: the same with --accept FILE writes a model for `seatrial params upload FILE`"
)
FORETELLING: Final = "foretelling the next dive"


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
    leave, before = Leave(doubts=arguments.despite_doubts), Before()
    if arguments.accepted:
        usual = usual_accepted(Path(arguments.accepted))
        if usual is not None and repeats(reading.dive, reading.file, configuration):
            return run_repeats(arguments, reading, usual)
        before = before_of(arguments.accepted, file, configuration, leave)
    impossible, why = ruled_out(runs)
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
        if result.accepted.effects and not arguments.accept:
            show.say(show.words(), NOT_ACCEPTED)
    return files.code(exit_codes.DONE)


def usual_accepted(path: Path) -> Usual | None:
    """Marks of accepted runs, if the JSON of `identify --together` holds them. Raises UsageError for a damaged file."""
    if path.suffix != ".json":
        return None
    kept = read_identification(path).get("repeats")
    try:
        return None if kept is None else usual_from(kept)
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
    unlike = (
        (f"{left_out} more do not go from rest into a steady push, and were left out.",) if left_out else ()
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


def accept(path: Path, diagnosis: Diagnosis, dive: Dive, file: VehicleFile) -> tuple[str, ...]:
    """Write the accepted model as a parameter file; return sentences on the effects that the feed-forward can't
    compensate and on how to upload the file. Without an accepted effect no file is written.
    """
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
        name: why for name, why in clauses(doubts, OF_HULL).items() if name in diagnosis.accepted.values
    }
    outcome = worst(doubt.outcome for doubt in doubts)
    from identify.foretell import foretell, foretold_lines  # loads scipy.optimize

    with show.progress(FORETELLING) as tell:
        foresight = foretell(
            diagnosis.accepted,
            diagnosis.hull,
            dive,
            file,
            diagnosis.configuration,
            lambda share: tell(share, FORETELLING),
        )
    write_accepted(path, diagnosis, dive, file, doubted, outcome, foresight)
    shape = file.vehicle.configurations[diagnosis.configuration]
    how = f"accepted: {path}; {_sends(path, diagnosis, shape)}"
    if diagnosis.verdict in ("partly", "unknown"):
        how += " with --despite-doubts, because something is left that no cause explains"
    elif outcome is not Outcome.CONVERGED:
        contradicted = worst(doubt.outcome for doubt in of_recording) is not Outcome.CONVERGED
        why = "the recording contradicts itself" if contradicted else "the model does not fit the dive"
        how += f" with --despite-doubts, because {why}"
    return (
        *diagnosis.accepted.sentences,
        *doubt_lines(doubted, tuple(doubted)),
        *foretold_lines(foresight),
        how,
    )


def _sends(path: Path, diagnosis: Diagnosis, shape: Configuration) -> str:
    """Describe the effect of uploading the file to the vehicle."""
    likely, _ = sorted_by_likelihood(diagnosis.findings)
    upload = f"seatrial params upload {path} sends"
    by_masses = any(finding.cause.effect.feedforward == "nominal" for finding in likely)
    hull = coefficients_of_hull(shape)
    if by_masses or any(name not in hull for name in diagnosis.accepted.values):
        return f"{upload} it to the vehicle"
    if not diagnosis.accepted.values:
        return "nothing in it is for the vehicle; export and simulate --accepted take it"
    return (
        "the feed-forward can make up for none of its causes; "
        f"{upload} only the masses and dampings that were fitted beside them"
    )


def coefficients_of_hull(shape: Configuration) -> Collection[str]:
    """Names of the coefficients of the hull's own model; the others are effects."""
    return BY_NAME if shape.damping == "linear" else OF_HULL


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
    for each in (real, sim):
        if repeats(each, reading.file, configuration):
            raise FitError(
                "its runs go from rest into one steady push, which tells no model to hold against a simulator's; give "
                "runs with several speeds, or judge these by accepted ones with --accepted",
                of=each.source,
            )
    impossible, why = ruled_out(places)
    without = (*(arguments.without or ()), *impossible)
    with show.progress(f"{real.name} against {sim.name}") as tell:
        effects = effects_without(without, configuration, file) if without else None
        gap = against.against(real, sim, reading.file, configuration, effects=effects, progress=tell)
    remarks = [*reading.remarks, *filter(None, map(stray_bytes, (*places, *of_simulator))), *why]
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
    show.say(console, *against.thrust_sentences(comparison), against.verdict_sentence(comparison))
    for line in (
        *against.difference_lines(comparison),
        *against.further_lines(comparison),
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
        *wording.disturbance_line(diagnosis.gap.disturbance),
        *wording.shrink_lines(diagnosis),
        *wording.next_lines(diagnosis),
        *diagnosis.notes,
    )
    show.say(console, *(f"  {line}" for line in lines))


def _where(diagnosis: Diagnosis) -> tuple[str, ...]:
    """A line on the largest parts of the gap; none when the verdict is "no_gap"."""
    line = "" if diagnosis.verdict == "no_gap" else wording.where_line(diagnosis)
    return (f"Where the missing force lies, most of it first: {line}.",) if line else ()


def before_of(accepted: str, file: VehicleFile, configuration: str, leave: Leave) -> Before:
    """The model that --accepted names: that of a vehicle file, or else of an identification or a diagnosis.

    Raises UsageError as `accepted_before` and `published` do.
    """
    name, _, _ = accepted.rpartition(":")
    if not any(part.endswith((".yaml", ".yml")) for part in (accepted, name)):
        return accepted_before(Path(accepted), file, configuration, leave)
    try:
        given = load_vehicle(accepted)
        shape = given.vehicle.configurations[
            given.vehicle.configuration_named(given.configuration or configuration)
        ]
        return published(shape, file.vehicle.configurations[configuration].damping)
    except ConfigError as error:
        raise UsageError(f"--accepted {accepted}: {error}") from None


def accepted_before(path: Path, file: VehicleFile, configuration: str, leave: Leave) -> Before:
    """Read a file of `identify` or of `diagnose --accept`, without ageing.

    A value that its identification doubts is not taken, unless `leave` lets it pass: its error would be reported as a
    change of the vehicle. Raises UsageError for a file of another configuration, for a fit that did not converge though
    none of its values is doubted, and for a file in which every value is doubted.
    """
    read = accepted_in(path, 0.0, Leave(doubts=True))
    if not read.doubted:
        check_outcome(path, read.outcome or Outcome.CONVERGED.value, leave, "compared")
    # A diagnosis looks for changes of the hull's own model.
    hull = coefficients_of_hull(file.vehicle.configurations[configuration])
    priors = {name: prior for name, prior in read.priors.items() if name in hull}
    if read.configuration != configuration:
        raise UsageError(
            f"--accepted {path}: is of configuration '{read.configuration}', the dive of '{configuration}'; give what "
            "was accepted for that one"
        )
    lines = doubt_lines(read.doubted, priors)
    if leave.doubts:
        return Before(priors, read.effects, tuple(f"Of what was accepted, {line}." for line in lines))
    taken = {name: prior for name, prior in priors.items() if name not in read.doubted}
    if not taken:
        raise UsageError(
            f"--accepted {path}: all that it holds is doubted ({lines[0]}), so no change could be told from it; give "
            "that of another dive, or --despite-doubts"
        )
    notes = tuple(f"Of what was accepted, {line}; it was not held against this dive." for line in lines)
    return Before(taken, read.effects, notes)


def write_accepted(
    path: Path,
    diagnosis: Diagnosis,
    dive: Dive,
    file: VehicleFile,
    doubted: Mapping[str, str],
    by_recording: Outcome,
    foresight: "Foresight",
) -> None:
    """Write the result of accepting a diagnosis as a parameter file with its sidecar.

    `doubted`: the recording's evidence against values, by coefficient, and `by_recording` the outcome it leads to. If
    a gap is left that no cause explains, the outcome is that data and model disagree. `foresight` is kept for
    comparison with the next dive. Raises ParamRejected.
    """
    accepted, configuration = diagnosis.accepted, diagnosis.configuration
    outcome = Outcome.DISAGREES if diagnosis.verdict in ("partly", "unknown") else by_recording
    veh_cfg = file.vehicle.veh_cfg(configuration)
    shape = file.vehicle.configurations[configuration]
    ids = {item.name: item.parameter_id(veh_cfg) for item in OF_HULL.values()}
    ids |= {item.name: item.parameter_id(veh_cfg) for item in effect_coefficients(shape)}
    values = {ids[name]: float32.rounded(item.value) for name, item in accepted.values.items()}
    # Zero takes back an effect that was accepted earlier and is no longer, whichever tool sends the file.
    values |= {i: 0.0 for item in effect_coefficients(shape) if (i := ids[item.name]) not in values}
    if shape.damping == "quadratic":
        # No linear damping is a part of this hull's model.
        squared = [item.dof for item in QUADRATICS if item.name in accepted.values]
        values |= {ids[DAMPINGS[dof].name]: 0.0 for dof in squared}
    names = ", ".join(effect.label for effect in accepted.effects)
    words = (
        origin(file.vehicle.name, configuration, "diagnose", dive.name),
        f"accepted: {names}",
        f"outcome: {outcome.value}",
        *doubt_lines(doubted, tuple(doubted)),
    )
    write_with_sidecar(
        path,
        values,
        words,
        Sidecar(
            dive.sha256,
            file.sha256,
            configuration,
            "diagnose",
            installed(),
            {
                ids[name]: Interval(name, item.unit, item.low95, item.high95)
                for name, item in accepted.values.items()
                if math.isfinite(item.low95) and math.isfinite(item.high95)
            },
            file.vehicle.name,
            dive.name,
            outcome.value,
            dived=began(dive),
            dive_opening=dive.opening,
            effects=accepted.effects,
            doubted=dict(doubted),
            foretold=foresight.rows,
            credits=foresight.credits,
        ),
    )
