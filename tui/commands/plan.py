"""`seatrial plan`: propose the next dive, and predict how well it would determine each parameter."""

import argparse
import math
from itertools import groupby
from pathlib import Path

from bridge import exit_codes
from bridge.errors import ConfigError
from bridge.files import size_to_read
from bridge.simulator.truth import load_truth
from bridge.text import typed
from bridge.vehicle.coefficients import COEFFICIENTS
from bridge.vehicle.config import VehicleFile, load_vehicle
from identify.planning.knowledge import NAMES, Knowledge
from identify.planning.limits import START_DEPTH_M, Limits, Tank
from identify.planning.propose import Proposal
from identify.planning.writing import (
    DOUBT_MARK,
    TITLE,
    instruction,
    interval,
    legend,
    mission_text,
    needs,
    notes,
    to_json,
)
from identify.progress import Steps
from identify.run.plan import after_dive, after_identification, before_dives, plan
from identify.run.recordings import read
from identify.statistics import Z95
from tui import show
from tui.accepted_priors import AGEING
from tui.files import Files
from tui.parameter_files import read_json
from tui.recordings import column_map_for, recording_at
from tui.show import Table
from tui.verbs import AXES

JSON_SUFFIX = ".json"


def run(arguments: argparse.Namespace) -> int:
    check_plan(arguments.out)
    file = load_vehicle(arguments.vehicle)
    limits = Limits(arguments.space, arguments.speed, depth_space_m=arguments.depth_space)
    dofs = [AXES[axis] for axis in AXES if axis in arguments.axes]
    with show.steps("plan") as progress:
        tank, changes = _tank(file, arguments.after, arguments.columns, progress)
        aims = dict.fromkeys(NAMES, arguments.to / 100 / Z95) if arguments.to else {}
        proposal = plan(tank, limits, 60 * arguments.minutes, dofs, progress, arguments.know, aims)
    knowledge, configuration = tank.knowledge, tank.configuration_name
    title = f"{file.vehicle.name}, configuration {configuration}: {proposal.duration_s:.0f} s"
    name = f"{arguments.vehicle.removesuffix(f':{configuration}')}:{configuration}"
    words = ("seatrial", "simulate", "--vehicle", name, "--mission", arguments.out)
    command = typed(*words) if dives_in_simulation(file, configuration) else ""
    text = mission_text(proposal, title, command, tank)
    with Files() as files:
        kept = files.text(Path(arguments.out), text)
        marked = legend(proposal, knowledge)
        remarks = tuple(
            dict.fromkeys(
                (*marked, room(limits), *joint(proposal, arguments.after), *changes, *notes(knowledge))
            )
        )
        mission = arguments.out if kept else None
        files.json(
            to_json(proposal, tank, limits)
            | {"after": arguments.after, "mission": mission, "notes": list(remarks)},
            arguments.json,
        )
        console = show.results(arguments.json)
        show.put(console, manoeuvre_table(f"plan for {title}", proposal))
        show.put(console, interval_table(proposal, knowledge))
        show.say(console, *marked)
        show.say(console, *(f"note: {sentence}" for sentence in remarks[len(marked) :]))
        if kept:
            simulation = f"; dive it in simulation: {command}" if command else ""
            show.say(console, f"mission, with how to dive it by hand: {arguments.out}{simulation}")
    return files.code(exit_codes.DONE)


def _tank(
    file: VehicleFile, source: str | None, columns: str | None, progress: Steps
) -> tuple[Tank, tuple[str, ...]]:
    """The vehicle with all that is known after `source`, a dive or the identification of one; None for no dive. And how
    the conditions of that dive change its file, in sentences: the next is taken to be made under the same. Raises
    UsageError for a column map that no recording here needs."""
    of_recording = source is not None and Path(source).suffix != JSON_SUFFIX
    if columns and not of_recording:
        raise exit_codes.UsageError(
            f"--columns {columns}: is for a recording that --after names, and none is named; leave it out"
        )
    if source is None:
        return before_dives(file), ()
    if not of_recording:
        return after_identification(read_json(Path(source)), file, source), ()
    reading = read(recording_at(Path(source)), file, column_map_for(columns, (source,)))
    tank = after_dive(reading.dive, reading.file, source, progress)
    return tank, tuple(f"{remark}." for remark in reading.remarks)


def dives_in_simulation(file: VehicleFile, configuration: str) -> bool:
    """Whether a simulated vehicle of this file makes a dive that can be identified: it has a gyro of its own, and a
    truth file or a model of its own."""
    try:
        load_truth(file, configuration)
    except ConfigError:
        return False
    return not {"imu", "fog"}.isdisjoint(file.vehicle.sensors.present())


def check_plan(path: str) -> None:
    """Raise UsageError if the path holds a file that `plan` did not write."""
    out = Path(path)
    if out.exists() and (size_to_read(out) is None or not _begins(out, TITLE.encode())):
        raise exit_codes.UsageError(f"--out {path}: exists and is no plan, so it stays; name another file")


def _begins(path: Path, words: bytes) -> bool:
    with path.open("rb") as file:
        return file.read(len(words)) == words


def manoeuvre_table(title: str, proposal: Proposal) -> Table:
    """Table of manoeuvres in diving order; identical consecutive manoeuvres share a row."""
    rows = []
    first = 1
    for _, same in groupby(proposal.parts, key=instruction):
        part, *more = same
        last = first + len(more)
        times = f", {1 + len(more)} times" if more else ""
        rows.append(
            (f"{first} to {last}" if more else str(first), f"{part.manoeuvre.duration_s:.0f}", needs(part),
             part.manoeuvre.sentence + times)
        )  # fmt: skip
        first = last + 1
    return show.Table(title, ("", "seconds", "room", "manoeuvre"), rows, numbers=("seconds",))


def room(limits: Limits) -> str:
    """Say how much room the plan uses, and which options set it."""
    return (
        f"The plan keeps to {limits.space_m:g} m across (--space) and {limits.heave_m:g} m up and down (--depth-space, "
        f"where not given as much as across, and never more than the {START_DEPTH_M:g} m of depth that it begins at)."
    )


def joint(proposal: Proposal, after: str | None) -> tuple[str, ...]:
    """Explain how to combine the dive with earlier knowledge; empty if nothing is known yet."""
    if not _known_before(proposal):
        return ()
    if after is None:
        return (
            "'± with known' joins the priors of the vehicle file and the new dive: identify it with this file. "
            "'± this dive alone' is what a file without them would give.",
        )
    source = (
        typed(after)
        if Path(after).suffix == JSON_SUFFIX
        else f"the JSON that seatrial identify writes of {after}"
    )
    mass, damping = (f"{100 * AGEING[kind]:g} %" for kind in ("mass", "damping"))
    return (
        f"'± with known' joins {after} and the new dive as if nothing had changed between them; identified by itself, "
        "the new dive gives '± this dive alone'.",
        f"To join them: seatrial prior {source} --vehicle YOUR.yaml first, then seatrial identify of the new dive with "
        f"that file. prior widens what it takes over by {mass} for masses and {damping} for dampings, for what may "
        "have changed since; only with a small --widen, as between two dives of one day, does the result come near "
        "'± with known'.",
    )


def _known_before(proposal: Proposal) -> bool:
    return any(math.isfinite(before) for before in proposal.before)


def interval_table(proposal: Proposal, knowledge: Knowledge) -> Table:
    """Table of how well each parameter is known before and after; parameters that stay unknown are left out.

    If anything is known before, a separate column gives the result of this dive alone. Parameters that the earlier
    dive doubted bear DOUBT_MARK.
    """
    joined = _known_before(proposal)
    widths = zip(COEFFICIENTS, proposal.before, proposal.alone, proposal.after, strict=True)
    rows = []
    for coefficient, before, alone, after in widths:
        if math.isfinite(after):
            value = knowledge.values[coefficient.name]
            mark = DOUBT_MARK if coefficient.name in knowledge.doubted else ""
            then = interval(coefficient.name, float(after), knowledge)
            shares = (before, alone, after) if joined else (before, after)
            rows.append(
                (f"{coefficient.name}{mark}", show.number(value), *map(_share, shares), show.number(then["low95"]),
                 show.number(then["high95"]), coefficient.unit)
            )  # fmt: skip
    after_columns = ("± this dive alone", "± with known") if joined else ("± after",)
    columns = ("name", "value", "± before", *after_columns, "95 % low", "95 % high", "unit")
    return show.Table(
        "what each parameter would be known to, in 95 % intervals", columns, rows, numbers=columns[1:-1]
    )


def _share(relative_std: float) -> str:
    """Half of the 95 % interval as a share of the value."""
    return f"{show.number(100 * Z95 * relative_std, 2)} %" if math.isfinite(relative_std) else "unknown"
