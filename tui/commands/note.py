"""`seatrial note`: note an event in the running recording, with its time, or replace the notes of another dive."""

import argparse
from pathlib import Path

from bridge import clock as clocks
from bridge import exit_codes
from bridge.text import printable
from gcs_plugin.dives.folder import DiveFolder, load_folder
from tui import links, show


def run(arguments: argparse.Namespace) -> int:
    text = printable(" ".join(arguments.text)).strip()
    if not text:
        raise exit_codes.UsageError("a note without a word; say what happened")
    if arguments.dive:
        load_folder(Path(arguments.dive)).note(text)
        show.say(show.results(), f"noted of {arguments.dive}")
        return exit_codes.DONE
    holding = links.usable_now()
    if holding is None:
        raise exit_codes.UsageError(
            "no recording runs, so there is no dive to note it in; start `seatrial record`"
        )
    DiveFolder(Path(holding.folder)).add_event(holding.own_unix_s(clocks.SystemClock().unix_s()), text)
    show.say(show.results(), f"noted in {holding.folder}")
    return exit_codes.DONE
