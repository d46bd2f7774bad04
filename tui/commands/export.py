"""`seatrial export`: write the identified model in the formats of other simulators, and list the parts left out.

`export DIVE --to mcap` writes a dive's signals as a file for Foxglove and PlotJuggler.
"""

import argparse
import sys
from pathlib import Path
from typing import Final

from bridge import exit_codes
from bridge.errors import ConfigError
from bridge.exit_codes import UsageError
from bridge.files import replacing
from bridge.text import typed
from bridge.vehicle.coefficients import OF_HULL
from bridge.vehicle.config import VehicleFile, load_vehicle
from gcs_plugin.params.identified import doubt_lines, estimates_in, sidecar_of
from identify.dive import Dive
from identify.effects.library import accepted_library
from identify.export.mcap import MODEL, PlotTopic, Written, flown, topics, write_mcap
from identify.export.model import Model, model_of
from identify.export.targets import TARGETS, export, is_held, with_effects
from identify.ingest.open import read_dive
from identify.run.recordings import read
from tui import show
from tui.files import Files
from tui.parameter_files import Leave, accepted_model, check_outcome, check_vehicle, read_identification
from tui.recordings import column_map_for, recording_at
from tui.show import STANDARD_OUTPUT


def run(arguments: argparse.Namespace) -> int:
    if arguments.to == MCAP:
        return export_dive(arguments)
    if arguments.to not in TARGETS:
        raise exit_codes.UsageError(
            f"--to {arguments.to}: no such target; the targets are {', '.join((*TARGETS, MCAP))}"
        )
    if arguments.columns:
        raise exit_codes.UsageError(
            f"--columns: has no use with --to {arguments.to}, which takes a model; leave it out"
        )
    if arguments.out == STANDARD_OUTPUT:
        arguments.out = None
    if arguments.json == STANDARD_OUTPUT and arguments.out is None:
        raise exit_codes.UsageError("--json -: standard output takes the file itself; add --out FILE")
    leave = Leave(doubts=arguments.despite_doubts)
    model, doubted = _model(arguments.file, arguments.vehicle, leave, arguments.to)
    exported = export(model, arguments.to)
    console = show.words() if arguments.out is None else show.results(arguments.json)
    with Files() as files:
        if arguments.out is None:
            sys.stdout.write(show.harmless(exported.text))
        else:
            files.text(Path(arguments.out), exported.text)
        files.json(
            {
                "target": arguments.to,
                "file": arguments.out,
                "left_out": [vars(part) for part in exported.left_out],
                "notes": exported.notes,
                "unknown": model.unknown,
                "doubted": doubted,
            },
            arguments.json,
        )
        show.say(console, *(f"warning: {line}" for line in doubt_lines(doubted, tuple(doubted))))
        if exported.left_out:
            show.say(console, f"what did not fit into {arguments.to} as it is:")
        show.say(console, *(f"{part.what}: {part.reason}" for part in exported.left_out))
        show.say(console, *(f"note: {note}" for note in exported.notes))
    return files.code(exit_codes.DONE)


def _model(given: str, vehicle: str | None, leave: Leave, target: str) -> tuple[Model, dict[str, str]]:
    """Return the model that MODEL names, and the doubts about its values. Raises UsageError if it names no model."""
    if given.endswith((".json", ".param")):
        if vehicle is None:
            raise exit_codes.UsageError(f"{given}: needs --vehicle FILE, for thrusters and weight; add it")
        return _in_file(Path(given), load_vehicle(vehicle), leave)
    try:
        file = load_vehicle(given)
    except ConfigError:
        if not Path(given).is_dir():
            raise
        raise exit_codes.UsageError(
            f"{given}: is a folder, and --to {target} takes a model; give the JSON that seatrial identify wrote of the "
            "dive, or the dive to --to mcap"
        ) from None
    if vehicle is not None:
        raise exit_codes.UsageError(f"{given}: is no identification, so --vehicle says nothing; leave it out")
    shapes = file.vehicle.configurations
    if file.configuration is None and len(shapes) > 1:
        raise exit_codes.UsageError(f"{given}: has {', '.join(shapes)}; name one: {given}:CONFIGURATION")
    configuration = file.configuration_chosen()
    coefficients = shapes[configuration].model
    if not coefficients:
        raise exit_codes.UsageError(
            f"{given}: configuration '{configuration}' has no model; give the JSON of seatrial identify, with "
            f"{typed('--vehicle', given)}"
        )
    return model_of(coefficients, file, configuration), {}


def _in_file(path: Path, file: VehicleFile, leave: Leave) -> tuple[Model, dict[str, str]]:
    """The model in the JSON of `identify`, or in a `.param` with its sidecar."""
    if path.suffix == ".json":
        data = read_identification(path)
        sidecar = sidecar_of(data, 0)
        check_outcome(path, sidecar.outcome, leave, "written")
        check_vehicle(path, sidecar.vehicle, sidecar.configuration, file)
        held = {each.name: each.value for each in estimates_in(data) if each.identifiable and each.value}
    else:
        held, sidecar = accepted_model(path, file, leave)
    # Accepted effects enter the model as effects; identified values enter as plain coefficients.
    hull = OF_HULL.keys() - {name for effect in sidecar.effects for name in effect.parameters}
    values = {name: value for name, value in held.items() if name in hull}
    if not (values or sidecar.effects):
        raise exit_codes.UsageError(f"{path}: holds no identifiable parameter; dive again, and identify that")
    intervals = {
        interval.coefficient: (interval.low95, interval.high95)
        for interval in sidecar.intervals.values()
        if is_held(interval.coefficient)
    }
    model = model_of(values, file, sidecar.configuration, intervals)
    doubted = {name: why for name, why in sidecar.doubted.items() if name in values}
    shape = file.vehicle.configurations[sidecar.configuration]
    effects = accepted_library(shape, file.vehicle.thrust_curve.lag_s)
    return with_effects(model, sidecar.effects, effects), doubted


MCAP: Final = "mcap"


def export_dive(arguments: argparse.Namespace) -> int:
    """Write a dive's signals, with --vehicle also its model's velocities. Raises UsageError, LogError, FitError."""
    if arguments.out in (None, STANDARD_OUTPUT):
        raise UsageError("--to mcap: is no text that can be shown; add --out FILE.mcap")
    columns = column_map_for(arguments.columns, (arguments.file,))
    dive, made, notes = _signals(arguments, columns)
    about = {"dive": dive.name, "sha256": dive.sha256, "notes": "\n".join(map(str, dive.notes))}
    console = show.results(arguments.json)
    with Files() as files:

        def file_it() -> None:
            out = Path(arguments.out)
            with replacing(out, "export again") as file:
                written = write_mcap(file, made, dive.unix_at_boot_s, about)
            show.say(console, *(f"note: {note}" for note in notes), _summary(out, written, dive))
            files.json(
                {
                    "target": MCAP,
                    "file": str(out),
                    "messages": dict(written.messages),
                    "log_time_minus_dive_time_s": written.origin_s,
                    "notes": notes,
                },
                arguments.json,
            )

        files.attempt(file_it)
    return files.code(exit_codes.DONE)


def _signals(arguments: argparse.Namespace, columns: Path | None) -> tuple[Dive, list[PlotTopic], list[str]]:
    if arguments.vehicle is None:
        dive = read_dive(Path(arguments.file), columns)
        return dive, list(topics(dive)), [str(note) for note in dive.notes]
    reading = read(recording_at(Path(arguments.file)), load_vehicle(arguments.vehicle), columns)
    model = flown(reading.dive, reading.file, reading.configuration)
    notes = [str(note) for note in (*reading.remarks, *reading.dive.notes)]
    if not model:
        notes.append(f"The dive is too short for the model's velocities, {MODEL}.")
    return reading.dive, [*topics(reading.dive), *model], notes


def _summary(out: Path, written: Written, dive: Dive) -> str:
    count = sum(written.messages.values())
    clock = "Unix time" if dive.unix_at_boot_s is not None else "the vehicle's clock, which begins in 1970"
    return f"written: {out}, {count} messages of {len(written.messages)} topics; the log's time is {clock}."
