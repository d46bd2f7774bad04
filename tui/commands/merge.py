"""`seatrial merge`: add other recorders' logs of a dive to its folder, on the dive's clock."""

import argparse

from bridge import exit_codes

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

    from gcs_plugin.dives.folder import load_folder
    from tui import show
    from tui.files import check_file
    from tui.merging import Merged, merge_all

    check_file("--json", arguments.json)
    folder = load_folder(Path(arguments.dive))
    done: list[str] = []
    refused: list[str] = []
    came: list[dict[str, str | None]] = []
    try:
        for outcome in merge_all(folder, [Path(name) for name in arguments.files]):
            if isinstance(outcome, Merged):
                done.append(outcome.file.name)
                came.append({"file": str(outcome.file), "into": str(outcome.into), "told": outcome.words})
                show.say(show.results(arguments.json), outcome.words)
            else:
                refused.append(outcome.file.name)
                came.append({"file": str(outcome.file), "into": None, "told": outcome.words})
                show.complain(outcome.words)
        if done and refused:
            show.say(show.words(), f"merged: {', '.join(done)}; not merged: {', '.join(refused)}")
    finally:
        show.write_json(came, arguments.json)
    return exit_codes.BAD_INPUT if refused else exit_codes.DONE
