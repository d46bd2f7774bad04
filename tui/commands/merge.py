"""`seatrial merge`: what other recorders kept of a dive, on one clock with it."""

import argparse

from tui import exit_codes

EXAMPLE = "seatrial merge dives/2026-11-20T0912Z-hovering 00000042.BIN"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("dive", metavar="DIVE", help="the dive folder to put them to")
    parser.add_argument(
        "files",
        nargs="+",
        metavar="FILE",
        help="what another recorder made of the dive: the autopilot's log (.BIN), or a .tlog of the vehicle's or of "
        "another ground station's; they stay as they are",
    )
    parser.add_argument("--json", metavar="FILE", help="write what came of it as JSON; - for standard output")


def run(arguments: argparse.Namespace) -> int:
    from pathlib import Path

    from gcs_plugin.folder import load_folder
    from tui import show
    from tui.merging import merge
    from tui.outputs import check_file

    check_file("--json", arguments.json)
    folder = load_folder(Path(arguments.dive))
    done = []
    try:
        for name in arguments.files:
            done.append(merge(folder, Path(name)))
            show.say(show.results(arguments.json), done[-1].words)
    finally:
        show.write_json(
            [{"file": str(one.file), "into": str(one.into), "told": one.words} for one in done],
            arguments.json,
        )
    return exit_codes.DONE
