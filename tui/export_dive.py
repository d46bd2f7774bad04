"""`seatrial export DIVE --to mcap`: a dive's signals as a file for Foxglove and PlotJuggler."""

import argparse
from pathlib import Path
from typing import Final

from bridge import exit_codes
from bridge.exit_codes import UsageError
from bridge.files import replacing
from bridge.vehicle.config import load_vehicle
from identify.dive import Dive
from identify.export.flown import MODEL, flown
from identify.export.mcap import Written, write_mcap
from identify.export.signals import Topic, topics
from identify.ingest.open import read_dive
from identify.run.recordings import read
from tui import show
from tui.files import Files
from tui.recordings import column_map_for, recording_at

MCAP: Final = "mcap"


def export_dive(arguments: argparse.Namespace) -> int:
    """Write a dive's signals, with --vehicle also its model's velocities. Raises UsageError, LogError, FitError."""
    if arguments.out is None:
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


def _signals(arguments: argparse.Namespace, columns: Path | None) -> tuple[Dive, list[Topic], list[str]]:
    """The dive, its topics, and notes on them."""
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
