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
    from tui.merging import Merged, merge_all
    from tui.outputs import check_file

    check_file("--json", arguments.json)
    folder = load_folder(Path(arguments.dive))
    done: list[str] = []
    refused: list[str] = []
    came: list[dict[str, str | None]] = []
    try:
        for one in merge_all(folder, [Path(name) for name in arguments.files]):
            if isinstance(one, Merged):
                done.append(one.file.name)
                came.append({"file": str(one.file), "into": str(one.into), "told": one.words})
                show.say(show.results(arguments.json), one.words)
            else:
                refused.append(one.file.name)
                came.append({"file": str(one.file), "into": None, "told": one.words})
                show.say(show.words(), f"seatrial: {' '.join(one.words.split())}")
        if done and refused:
            show.say(show.words(), f"merged: {', '.join(done)}; not merged: {', '.join(refused)}")
    finally:
        show.write_json(came, arguments.json)
    return exit_codes.BAD_INPUT if refused else exit_codes.DONE
