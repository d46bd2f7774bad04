"""`seatrial fly`: the vehicle flies a plan by itself, watched and recorded, until enough is known.

By way of the recording that runs, if one holds the link; else it is recorded here.
"""

import argparse
import hashlib
import math
import os
import re
import secrets
import select
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from functools import partial
from pathlib import Path
from types import FrameType
from typing import Any, Final

from rich.console import Console

from bridge import clock as clocks
from bridge import exit_codes, reports
from bridge.command_line import check_folder
from bridge.errors import LinkLost, ParamRejected
from bridge.exit_codes import UsageError
from bridge.flight.flight import COUNTDOWN_S, End
from bridge.flight.limits import FlightLimits, load_limits
from bridge.links import secured
from bridge.reports import Report
from bridge.vehicle.coefficients import DAMPINGS
from bridge.vehicle.config import VehicleFile, load_vehicle
from gcs_plugin.dives.folder import DiveFolder
from gcs_plugin.flying.plan import FlightPlan, load_plan
from gcs_plugin.flying.run import Outcome, PlanFlight, Progress, Wanted
from tui import links, show
from tui.flight_recording import Alongside, RecordedHere, RecordedThere, recorded_crew

MOST_AT_ONCE: Final = 1024
PRESSES: Final = re.compile(rb"\x1b[\[O]?[0-?]*[ -/]*[@-~]?|[^\x1b\x80-\xbf]")
"""The bytes of a key: an arrow or a function key sends several after ESC, and a letter beyond ASCII has several."""
NUMBERS: Final = 1 << 22
"""Orders are numbered from one of these: a float32 holds it exactly."""


def run(arguments: argparse.Namespace) -> int:
    limits, file_of_plan = load_limits(Path(arguments.limits)), Path(arguments.plan)
    plan = load_plan(file_of_plan)
    file = load_vehicle(arguments.vehicle)
    check_made_for(file, file_of_plan, plan)
    wanted = wanted_of(arguments, file, plan)
    console = show.results(arguments.json)
    for table in shown(plan, limits, wanted):
        show.put(console, table)
    if not arguments.armed:
        tell(console, "nothing was sent: --armed arms the vehicle and flies this; keep a hand on the sticks")
        show.write_json(proposed(file_of_plan, plan, limits, wanted), arguments.json)
        return exit_codes.DONE
    outcome, folder = flown(arguments, file, plan, limits, wanted)
    tell(console, sentence(outcome))
    tell(console, f"recorded in {folder.path}")
    show.write_json(
        to_json(outcome, wanted) | {"folder": str(folder.path), "plan": arguments.plan}, arguments.json
    )
    return exit_codes.DONE if outcome.all_known and outcome.end is End.FINISHED else exit_codes.NO


def first_number() -> int:
    """The number of a flight's first order. A vehicle does not obey one that it had lately: a clock, which may be set
    back, gives none."""
    return 1 + secrets.randbelow(NUMBERS)


def check_made_for(file: VehicleFile, file_of_plan: Path, plan: FlightPlan) -> None:
    """Raise UsageError if the plan was made for another vehicle, or for another configuration of this one."""
    named = f"{file.vehicle.name}:{file.configuration_chosen()}"
    if plan.vehicle and plan.vehicle != named:
        raise UsageError(
            f"{file_of_plan}: was planned for {plan.vehicle}, and --vehicle names {named}; plan again for that one"
        )


def wanted_of(arguments: argparse.Namespace, file: VehicleFile, plan: FlightPlan) -> Wanted:
    """The coefficients asked for. Raises UsageError for any that the plan does not tell of this hull."""
    shape = file.vehicle.configurations[file.configuration_chosen()]
    absent = [damping.name for damping in DAMPINGS] if shape.damping == "quadratic" else []
    tells = tuple(name for name in plan.coefficients if name not in absent)
    names = tuple(arguments.know or tells)
    if lacks := [name for name in names if name in absent]:
        raise UsageError(
            f"--know {' '.join(lacks)}: {file.path} has damping: quadratic, and no linear damping to tell; leave it out"
        )
    unknown = [name for name in names if name not in tells]
    if unknown:
        raise UsageError(
            f"--know {' '.join(unknown)}: the plan tells {', '.join(tells)} alone; plan other axes"
        )
    if not COUNTDOWN_S[0] <= arguments.countdown <= COUNTDOWN_S[1]:
        raise UsageError(
            f"--countdown {arguments.countdown:g}: give {COUNTDOWN_S[0]:g} to {COUNTDOWN_S[1]:g} seconds"
        )
    return Wanted(names, arguments.to / 100)


def flown(
    arguments: argparse.Namespace, file: VehicleFile, plan: FlightPlan, limits: FlightLimits, wanted: Wanted
) -> tuple[Outcome, DiveFolder]:
    """Fly the plan, recorded. Raises LinkError without a vehicle, ParamRejected for one of another configuration."""
    check_folder("--out", arguments.out)
    configuration = file.configuration_chosen()
    if not limits.shallowest_m <= plan.depth_m <= limits.deepest_m:
        raise UsageError(
            f"the plan begins at {plan.depth_m:g} m of depth, and the limits are {limits.shallowest_m:g} to "
            f"{limits.deepest_m:g} m; change one of them"
        )
    first_s = plan.pieces[0].duration_s
    if limits.time_s < first_s:
        raise UsageError(
            f"the first manoeuvre takes {first_s:g} s, and the limits give time_s {limits.time_s:g}; give more"
        )
    clock, words = clocks.SystemClock(), show.words()
    recording = _recording(arguments, file, configuration, clock, partial(tell, words))
    crew, how, identifying = recording.crew, "not begun", None
    try:
        crew.find(first_number(), arguments.system)
        if crew.veh_cfg is not None and crew.veh_cfg != file.vehicle.veh_cfg(configuration):
            raise ParamRejected(
                f"the vehicle is in configuration {crew.veh_cfg:.0f}, and --vehicle names '{configuration}'; nothing "
                "was sent, name the vehicle's own"
            )
        folder = recording.begin()
        identifying = Alongside(folder.path, file, configuration)
        flight = PlanFlight(crew, plan, limits, wanted, identifying, partial(tell, words), follower(wanted))
        with end_key() as pressed:
            if not reports.asked(os.environ):  # another program has an end key of its own
                show.say(
                    words,
                    "any key ends the flight: it holds its place; a second one disarms it. Sticks take over at any "
                    "touch",
                )
            flight.begin(arguments.countdown)
            how = "its end was not heard"
            while not flight.over:
                for _ in range(pressed()):
                    flight.key()
                flight.step()
            how = flight.outcome.words
    except LinkLost as error:
        raise LinkLost(f"{error}; a vehicle under way goes back by itself") from None
    finally:
        if identifying is not None:
            identifying.close()
        recording.end(f"flight: {how}")
    return flight.outcome, folder


def _recording(
    arguments: argparse.Namespace,
    file: VehicleFile,
    configuration: str,
    clock: clocks.Clock,
    say: Callable[[str], None],
) -> RecordedHere | RecordedThere:
    """The recording that runs, if it holds the link or none is named; else one made here. Raises LinkError."""
    holding = links.holding_now()
    if arguments.link is not None and not (holding is not None and links.holds(holding, arguments.link)):
        links.refuse_second([arguments.link])
        opener = secured.Opener(arguments.sign_key, clock, secured.on_words)
        link = opener.open(arguments.link)
        root = Path(arguments.out)
        return RecordedHere(*recorded_crew(link, file, configuration, root, clock, say, opener.open), say)
    return RecordedThere(links.link_for(arguments.link), file, configuration, clock, say)


def tell(console: Console, words: str) -> None:
    """Say a sentence; for a program that reads the progress, as a report."""
    if reports.asked(os.environ):
        show.tell_program(Report(reports.SAID, 0.0, words))
    else:
        show.say(console, words)


def follower(wanted: Wanted) -> Callable[[Progress], None]:
    """Reports a flight to a program that reads the progress: each width, with that asked for, by the name."""
    if not reports.asked(os.environ):
        return lambda _: None

    def follow(progress: Progress) -> None:
        known = {
            name: (width, wanted.share)
            for name in wanted.names
            if math.isfinite(width := progress.widths.get(name, math.inf))
        }
        show.tell_program(Report(reports.FLIGHT, progress.share, progress.words, values=known))

    return follow


def shown(plan: FlightPlan, limits: FlightLimits, wanted: Wanted) -> list[show.Table]:
    """The manoeuvres to be flown, with the lengths of their pieces, and the limits."""
    rows = [(title, " + ".join(f"{s:g}" for s in lengths)) for title, lengths in plan.manoeuvres.items()]
    within = [(name, f"{value:g}") for name, value in asdict(limits).items()]
    title = f"{plan.name}: until {', '.join(wanted.names)} are known to {100 * wanted.share:g} %"
    return [
        show.Table(title, ("manoeuvre", "seconds, piece by piece"), rows),
        show.Table("limits", ("limit", "value"), within, numbers=("value",)),
    ]


def proposed(
    file: Path, plan: FlightPlan, limits: FlightLimits, wanted: Wanted, refused: str = ""
) -> dict[str, Any]:
    """A plan to be flown, as plain data; `refused`: why it will not be, "" if it may."""
    return {
        "plan": plan.name,
        "file": str(file),
        "sha256": hashlib.sha256(file.read_bytes()).hexdigest(),
        "manoeuvres": plan.manoeuvres,
        "limits": asdict(limits),
        "know": list(wanted.names),
        "asked_percent": 100 * wanted.share,
        "refused": refused,
    }


def sentence(outcome: Outcome) -> str:
    known = (
        f"all that was asked for was known {outcome.known_s:.0f} s after the start"
        if outcome.all_known
        else "not all that was asked for is known"
    )
    way_out = (
        "; for link_s it heard nothing of this program: mend the link, or close what keeps this computer busy, and fly "
        "again"
        if outcome.end is End.LINK
        else ""
    )
    return (
        f"flight ended: {outcome.words}; {outcome.pieces} pieces, {outcome.flown_s:.0f} s of manoeuvres; {known}"
        f"{way_out}"
    )


def to_json(outcome: Outcome, wanted: Wanted) -> dict[str, Any]:
    """The outcome as plain data; widths in per cent, null for what is unknown."""
    return {
        "end": outcome.end.name.lower(),
        "words": outcome.words,
        "pieces": outcome.pieces,
        "manoeuvres_s": outcome.flown_s,
        "known_after_s": outcome.known_s if outcome.all_known else None,
        "seconds": outcome.seconds,
        "asked_percent": 100 * wanted.share,
        "widths_percent": {
            name: 100 * width if math.isfinite(width := outcome.widths.get(name, math.inf)) else None
            for name in wanted.names
        },
    }


@contextmanager
def end_key() -> Iterator[Callable[[], int]]:
    """How often a key was pressed since the last call: any key of a terminal, and Ctrl-C of any program. The end of the
    program that reads the progress counts as a key, for nobody has its end key any more."""
    interrupts, reader = 0, os.getppid() if reports.asked(os.environ) else None

    def on_interrupt(_number: int, _frame: FrameType | None) -> None:
        nonlocal interrupts
        interrupts += 1

    before = signal.signal(signal.SIGINT, on_interrupt)
    terminal = _keys_at_once()

    def pressed() -> int:
        nonlocal interrupts, reader
        count, interrupts = interrupts, 0
        if reader is not None and os.getppid() != reader:
            count, reader = count + 1, None
        if terminal and select.select([sys.stdin], [], [], 0.0)[0]:
            count += len(PRESSES.findall(os.read(sys.stdin.fileno(), MOST_AT_ONCE)))
        return count

    try:
        yield pressed
    finally:
        signal.signal(signal.SIGINT, before)
        if terminal:
            import termios

            termios.tcsetattr(sys.stdin, termios.TCSADRAIN, terminal)


def _keys_at_once() -> list[Any]:
    """Let the terminal give each key at once; return how it was set before, [] where no keys can be read."""
    if not sys.stdin.isatty():
        return []
    try:
        import termios
        import tty
    except ImportError:  # Windows: Ctrl-C alone
        return []
    before = termios.tcgetattr(sys.stdin)
    tty.setcbreak(sys.stdin)
    return before
