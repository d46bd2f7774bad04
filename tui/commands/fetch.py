"""`seatrial fetch`: fetch the part of a dive that the vehicle stored and the ground did not receive."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from bridge import exit_codes
from bridge.command_line import above_zero, seconds
from bridge.links import secured
from bridge.text import say_warning

if TYPE_CHECKING:
    from bridge.clock import Clock
    from gcs_plugin.dives.folder import DiveFolder

EXAMPLE = "seatrial fetch dives/2026-11-20T0912Z-hovering --link udpin:192.168.2.1:14550"
FIND_S = 10.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "dive",
        nargs="?",
        metavar="DIVE",
        help="the dive folder to make whole (default: that of the recording that runs, which then goes on in a new "
        "one; else the newest in --out)",
    )
    parser.add_argument(
        "--new",
        action="store_true",
        help="make a dive folder of what the vehicle kept since it was switched on, for a dive of which nothing was "
        "heard",
    )
    parser.add_argument("--minutes", type=above_zero, metavar="N", help="of --new: its last minutes alone")
    parser.add_argument(
        "--out", default="dives", metavar="FOLDER", help="where the dives are (default: dives)"
    )
    parser.add_argument("--name", default="", help="of --new: the end of the dive folder's name")
    parser.add_argument(
        "--vehicle", metavar="FILE[:CONFIGURATION]", help="of --new: the vehicle file to name in dive.yaml"
    )
    parser.add_argument(
        "--link", metavar="SPEC", help="the link to the vehicle (default: that of the recording that runs)"
    )
    parser.add_argument(
        "--system", type=int, metavar="N", help="of --new: its MAVLink system, where several beat"
    )
    secured.add_argument(parser)
    parser.add_argument(
        "--patience",
        type=seconds,
        default=60.0,
        metavar="N",
        help="give up after so many seconds without an answer; what was fetched is kept (default: 60)",
    )
    parser.add_argument("--json", metavar="FILE", help="write what came of it as JSON; - for standard output")


def run(arguments: argparse.Namespace) -> int:
    from bridge.clock import SystemClock
    from bridge.command_line import check_folder
    from bridge.errors import LinkError, LogError
    from bridge.exit_codes import UsageError
    from bridge.vehicle.config import load_vehicle
    from gcs_plugin.dives.folder import About, about_vehicle
    from gcs_plugin.fetch.boots import NOTHING_OF_IT
    from gcs_plugin.params.client import ParameterClient
    from tui import show
    from tui.fetched import Fetcher
    from tui.files import check_file
    from tui.links import coming_back, link_for

    check_file("--json", arguments.json)
    check_folder("--out", arguments.out)
    if arguments.new and arguments.dive:
        raise UsageError(f"{arguments.dive}: --new makes a folder of its own; leave one of both out")
    if arguments.minutes and not arguments.new:
        raise UsageError("--minutes is for --new; a dive that was heard has its own beginning and end")
    file = load_vehicle(arguments.vehicle) if arguments.vehicle else None
    about = about_vehicle(file, file.configuration or "") if file else About()
    clock = SystemClock()
    opener = secured.Opener(arguments.sign_key, clock, secured.on_words)
    folder = None if arguments.new else dive_of(arguments, clock)
    first = link_for(arguments.link, opener.open)
    link = coming_back(first, arguments.link, clock, opener.open, say_warning)
    try:
        with show.progress("fetching") as tell:
            fetcher = Fetcher(link, clock, arguments.patience, tell)
            if folder is not None:
                done = fetcher.whole(folder)
            else:
                vehicle = ParameterClient(link, clock).find_vehicle(FIND_S, arguments.system)
                name = arguments.name or about.configuration
                done = fetcher.new(Path(arguments.out), vehicle, arguments.minutes, name, about)
    except (LinkError, LogError) as error:
        if (
            folder is None
            or arguments.link
            or not (isinstance(error, LinkError) or str(error) == NOTHING_OF_IT)
        ):
            raise
        raise type(error)(f"{error}{asked_by_way(folder)}") from None
    finally:
        link.close()
    show.say(show.results(arguments.json), done.words)
    outcome: dict[str, object] = {
        "recording": str(done.path),
        "frames": done.frames,
        "missing": done.missing,
    }
    outcome |= {"fetched_bytes": done.fetched_bytes, "damaged": done.damaged}
    outcome |= {"holes": [vars(hole) for hole in done.holes], "lost": done.lost, "beyond": done.beyond}
    show.write_json(outcome, arguments.json)
    return exit_codes.DONE if done.is_whole else exit_codes.NO


def asked_by_way(folder: "DiveFolder") -> str:
    """Name the recording that a fetch without --link went through, which may be another vehicle's; "" if none runs."""
    from tui.links import holding_now, words_of

    holding = holding_now()
    if holding is None:
        return ""
    return (
        f" (asked by way of {words_of(holding)}, on {', '.join(holding.links)}: where that is another vehicle than "
        f"that of {folder.path}, name its own link with --link)"
    )


def dive_of(arguments: argparse.Namespace, clock: "Clock") -> "DiveFolder":
    """Return the dive in question. If it is being recorded, end it: the recording goes on in a new folder.

    Raises UsageError if there is no dive, LinkError if its recording hangs.
    """
    import time

    from bridge.exit_codes import UsageError
    from gcs_plugin.dives.folder import list_folders, load_folder
    from gcs_plugin.recording import orders
    from tui import show
    from tui.links import holder_of, holding_now, usable_now

    holding = holding_now() if arguments.dive else usable_now()
    recorded = Path(holding.folder) if holding is not None else None
    asked = holder_of(arguments.link) if arguments.link else None
    if arguments.dive:
        path = Path(arguments.dive)
    elif asked is not None:
        path = Path(asked.folder)
    elif recorded is not None:
        path = recorded
    else:
        made = [folder.path for folder in list_folders(Path(arguments.out)) if folder.heard()]
        if not made:
            raise UsageError(f"{arguments.out}: holds no dive to make whole; name one, or give --new")
        path = made[-1]
    if recorded is not None and path.resolve() == recorded.resolve():
        finished, following = orders.next_dive(clock, time.sleep)
        show.say(show.words(), f"{finished} is over; the recording goes on in {following}")
    return load_folder(path)
