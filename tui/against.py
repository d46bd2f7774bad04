"""`diagnose REAL --against SIM`: what a simulator must gain, on the screen and in files."""

from argparse import Namespace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from tui import exit_codes

if TYPE_CHECKING:
    from bridge.vehicle.config import VehicleFile
    from identify.diagnose.against import Against
    from identify.dive import Dive


def run(arguments: Namespace) -> int:
    from bridge.vehicle.config import load_vehicle
    from identify.diagnose.against import against, plain
    from identify.ingest.open import read_dive
    from identify.report.against import against_report
    from tui import pages, show
    from tui.columns import column_map_for
    from tui.files import Files
    from tui.outputs import check_files

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
        for line in (*told(gap), *files.written):
            show.say(console, line)
    return files.code(exit_codes.DONE)


def told(found: "Against") -> tuple[str, ...]:
    """The verdict, then all other sentences, indented."""
    from identify.diagnose import wording, wording_verdict
    from identify.diagnose.against import cause_lines, lines, verdict_sentence

    sentences = (
        *cause_lines(found),
        *lines(found),
        *(f"Where: {line}." for line in wording_verdict.where_lines(found.vehicle)),
        *wording_verdict.shrink_lines(found.vehicle),
        *wording.next_lines(found.vehicle),
        *found.vehicle.notes,
        *(f"Of the simulator: {note}" for note in found.simulator.notes),
    )
    return (verdict_sentence(found), *(f"  {line}" for line in sentences))


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
