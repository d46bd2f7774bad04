"""`seatrial tui`: the terminal app."""

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from tui import exit_codes, numbers

if TYPE_CHECKING:
    from bridge.link.base import Link

EXAMPLE = "seatrial tui --link udpin:127.0.0.1:14550 --vehicle ruvifist"
MOST_FPS = 30.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--link",
        action="append",
        default=[],
        metavar="SPEC",
        help="a link to record and to show; may be given again (default: what is being recorded)",
    )
    parser.add_argument(
        "--vehicle", metavar="FILE[:CONFIGURATION]", help="the vehicle file: what must be heard"
    )
    parser.add_argument(
        "--out", default="dives", metavar="FOLDER", help="takes the dive folder (default: dives)"
    )
    parser.add_argument(
        "--receipts",
        default="receipts",
        metavar="FOLDER",
        help="where uploads leave values before and receipt (default: receipts)",
    )
    parser.add_argument(
        "--unrecorded", action="store_true", help="look at the link itself, and record nothing"
    )
    parser.add_argument(
        "--fps", type=numbers.above_zero, default=4.0, metavar="N", help="refreshes a second (default: 4)"
    )
    parser.add_argument("--theme", choices=("dark", "light", "sunlight"), help="default: that of last time")
    parser.add_argument(
        "--keymap", type=Path, metavar="FILE", help="keys by action (default: ~/.config/seatrial/keymap.yaml)"
    )


def run(arguments: argparse.Namespace) -> int:
    import os

    from bridge.clock import SystemClock
    from bridge.vehicle.config import load_vehicle
    from bridge.vehicle.feedforward import Mode
    from gcs_plugin.ff_switch import Switch
    from gcs_plugin.watch.watcher import Watcher
    from tui.app import preferences
    from tui.app.app import SeatrialApp
    from tui.app.desk import Desk
    from tui.app.keymap import load_keymap
    from tui.app.recorder import recorded, recording
    from tui.app.screens.table import PLACES
    from tui.app.source import LinkSource
    from tui.app.station import Station
    from tui.app.terminal import AnsweringDriver

    keymap = load_keymap(arguments.keymap, PLACES)
    vehicle = load_vehicle(arguments.vehicle) if arguments.vehicle else None
    in_browser = "TEXTUAL_DRIVER" in os.environ
    if not in_browser and not _is_terminal():
        raise exit_codes.UsageError(
            "the terminal app needs a terminal; `seatrial watch` writes lines to a pipe"
        )
    name, factory = _open(arguments)
    clock = SystemClock()
    station = Station(
        LinkSource(factory, name, clock),
        Watcher(vehicle),
        clock,
        recording,
        lambda: Switch(Mode.OFF),
        1.0 / arguments.fps,
    )
    app = SeatrialApp(
        station,
        arguments.theme or preferences.load_theme(),
        keymap,
        min(arguments.fps, MOST_FPS),
        driver=None if in_browser else AnsweringDriver,
        desk=Desk(arguments.vehicle or "", Path(arguments.out), Path(arguments.receipts), recorded=recorded),
    )
    station.start()
    try:
        app.run()
    finally:
        station.stop()
    return app.return_code or exit_codes.DONE


def _is_terminal() -> bool:
    """Whether someone sits there; Textual draws on standard error."""
    import sys

    return sys.stdin.isatty() and sys.stderr.isatty()


def _open(arguments: argparse.Namespace) -> "tuple[str, Callable[[], Link]]":
    """The link to look at: of the recording that runs, or of one that is begun; with --unrecorded the link itself."""
    import time

    from bridge.clock import SystemClock
    from bridge.errors import LinkError
    from bridge.link.open import open_link
    from gcs_plugin.holder import held
    from tui.app import recorder
    from tui.links import holds, words_of

    if arguments.unrecorded:
        if len(arguments.link) != 1:
            raise exit_codes.UsageError("--unrecorded looks at one link; give it with --link")
        spec = arguments.link[0]
        return spec, lambda: open_link(spec)
    clock = SystemClock()
    holding = held(clock.unix_s())
    if holding is None:
        if not arguments.link:
            raise exit_codes.UsageError(
                "no link is named and no recording runs; give --link SPEC, or start `seatrial record`"
            )
        options = [word for link in arguments.link for word in ("--link", link)] + ["--out", arguments.out]
        options += ["--vehicle", arguments.vehicle] if arguments.vehicle else []
        holding = recorder.begin(options, clock, time.sleep)
    if not holding.hub:
        raise LinkError(f"{words_of(holding)} serves nobody; end it first, and start it without --hub none")
    others = [link for link in arguments.link if not holds(holding, link)]
    if others:
        raise exit_codes.UsageError(
            f"{words_of(holding)} does not hold {', '.join(others)}; end it first, or leave --link out"
        )
    return holding.hub, lambda: open_link(recorder.hub())
