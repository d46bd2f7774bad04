"""`seatrial note`: note an event in the running recording, with its time, or replace the notes of another dive."""

import argparse
from pathlib import Path

from bridge import exit_codes

EXAMPLE = 'seatrial note "tether caught on the ladder"'


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("text", nargs="+", metavar="TEXT", help="what happened")
    parser.add_argument(
        "--dive", metavar="DIVE", help="the folder of a dive: TEXT takes the place of its notes as a whole"
    )


def run(arguments: argparse.Namespace) -> int:
    from bridge.clock import SystemClock
    from bridge.text import printable
    from gcs_plugin.dives.folder import DiveFolder, load_folder
    from tui import show
    from tui.links import usable_now

    text = printable(" ".join(arguments.text)).strip()
    if not text:
        raise exit_codes.UsageError("a note without a word; say what happened")
    if arguments.dive:
        load_folder(Path(arguments.dive)).note(text)
        show.say(show.results(), f"noted of {arguments.dive}")
        return exit_codes.DONE
    holding = usable_now()
    if holding is None:
        raise exit_codes.UsageError(
            "no recording runs, so there is no dive to note it in; start `seatrial record`"
        )
    DiveFolder(Path(holding.folder)).add_event(holding.own_unix_s(SystemClock().unix_s()), text)
    show.say(show.results(), f"noted in {holding.folder}")
    return exit_codes.DONE
