"""`seatrial tui`: the terminal app."""

import argparse
import asyncio
import contextlib
import os
import sys
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path

import bridge.links.open
from bridge import clock as clocks
from bridge import exit_codes
from bridge.errors import LinkError
from bridge.links import secured
from bridge.links.addresses import listening, of_links, of_served
from bridge.links.link import Link
from bridge.text import say
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.mode import Mode
from gcs_plugin.feedforward import Switch
from gcs_plugin.peers import newest
from gcs_plugin.watch.watcher import Watcher
from tui import links, show
from tui.app import recorder, themes
from tui.app.app import SeatrialApp
from tui.app.desk import Desk
from tui.app.jobs import Jobs
from tui.app.keys import load_keymap, looking_work
from tui.app.recorder import end, next_dive, recorded, recording
from tui.app.screens.table import PLACES
from tui.app.station import LinkSource, Station
from tui.app.terminal import AnsweringDriver
from tui.web.server import PageServer, in_url, warning

MOST_FPS = 30.0
OF_RECORDING = "the recording"
"""Name of the link that the running recording serves; its port differs with every recording."""
PASSED_ON = ("vehicle", "out", "receipts", "fps", "theme", "keymap")
"""Options that are passed on to the app of each browser; its link is the recording's."""


def run(arguments: argparse.Namespace) -> int:
    if arguments.web:
        return _serve(arguments)
    if arguments.host or arguments.port is not None or arguments.control:
        raise exit_codes.UsageError("--host, --port and --control say how the page is served; give --web too")
    return _show(arguments)


def _serve(arguments: argparse.Namespace) -> int:
    """Serve the app as a page: this process starts the recording and serves, and each browser gets its own process."""
    if arguments.unrecorded or arguments.view_only:
        raise exit_codes.UsageError(
            "--web shows the recording, to look at unless --control is given; leave --unrecorded and --view-only out"
        )
    load_keymap(arguments.keymap, PLACES)
    host = arguments.host or "127.0.0.1"
    port = 8000 if arguments.port is None else arguments.port
    # An unreadable key is reported before anything starts.
    secured.Opener(arguments.sign_key, clocks.SystemClock(), secured.on_words)
    _open(arguments)
    command = [sys.executable, "-m", "tui", "tui"]
    for name in PASSED_ON:
        value = getattr(arguments, name)
        command += [] if value is None else [f"--{name}", str(value)]
    command += [] if arguments.control else ["--view-only"]

    def tell(sockets: list[tuple[str, int]]) -> None:
        words, what = show.words(), "with every control" if arguments.control else "view-only"
        for address, number in sockets:
            page = listening("TCP", address, number, f"the page, {what}")
            show.say(words, f"{page}: http://{in_url(address)}:{number}/")
        list_recording()
        if danger := warning(host, arguments.control):
            show.say(words, f"warning: {danger}")

    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(PageServer(command, host, port).run(tell))
    return exit_codes.DONE


def list_recording() -> None:
    """Print the network sockets that the running recording holds open."""
    if (holding := links.holding_now()) is not None:
        say(f"{links.words_of(holding)} goes on by itself, and has")
        for sentence in (of_served(holding.hub), *of_links(holding.links, "a link that is recorded")):
            say(sentence)


def list_sockets(arguments: argparse.Namespace) -> None:
    """Print the open network sockets; a terminal shows them before and after the app."""
    if arguments.unrecorded:
        for sentence in of_links(arguments.link, "the link"):
            say(sentence)
    elif (holding := links.holding_now()) is not None:
        list_recording()
        for sentence in of_links([holding.hub], "what it serves"):
            say(sentence)


def _show(arguments: argparse.Namespace) -> int:
    keymap = load_keymap(arguments.keymap, PLACES)
    vehicle = load_vehicle(arguments.vehicle) if arguments.vehicle else None
    in_browser = "TEXTUAL_DRIVER" in os.environ
    if not in_browser and not _is_terminal():
        raise exit_codes.UsageError(
            "the terminal app needs a terminal; `seatrial watch` writes lines to a pipe"
        )
    clock = clocks.SystemClock()
    # Its messages appear on the screen instead: see `refused`.
    opener = secured.Opener(arguments.sign_key, clock, lambda _: None, lambda _: None, secured.later)
    name, factory = _open(arguments, opener.open)
    source = LinkSource(factory, name, clock, lambda: opener.trouble(name), silent=arguments.view_only)
    station = Station(
        source,
        Watcher(vehicle),
        clock,
        recording,
        lambda known: Switch(Mode.OFF, known=newest([*known, *links.known_now(clock, *arguments.link[:1])])),
        1.0 / arguments.fps,
    )
    app = SeatrialApp(
        station,
        arguments.theme or themes.load_theme(),
        keymap,
        min(arguments.fps, MOST_FPS),
        driver=None if in_browser else AnsweringDriver,
        desk=Desk(
            arguments.vehicle or "",
            Path(arguments.out),
            Path(arguments.receipts),
            jobs=Jobs(looking_work) if arguments.view_only else Jobs(),
            record=_again(arguments),
            recorded=recorded,
            next_dive=None if arguments.view_only else next_dive,
            end_recording=None if arguments.view_only else end,
        ),
        view_only=arguments.view_only,
    )
    if not in_browser:
        list_sockets(arguments)
    station.start()
    try:
        app.run()
    finally:
        station.stop()
    return app.return_code or exit_codes.DONE


def _is_terminal() -> bool:
    """Whether a person sits at the terminal; Textual draws on standard error."""
    return sys.stdin.isatty() and sys.stderr.isatty()


def _again(arguments: argparse.Namespace) -> Callable[[], None] | None:
    """Return the function that restarts an ended recording; without --link it uses the links of that recording."""
    holding = links.holding_now()
    specs = arguments.link or (holding.links if holding is not None else ())
    if arguments.unrecorded or arguments.view_only or not specs:
        return None
    key = arguments.sign_key or (holding.sign_key if holding is not None else "")
    return partial(recorder.begin_again, recorder.options(specs, arguments.out, arguments.vehicle or "", key))


def _open(
    arguments: argparse.Namespace, open_one: Callable[[str], Link] | None = None
) -> tuple[str, Callable[[], Link]]:
    """Return the link's name and opener: of the running recording, of one begun here, or of the --unrecorded link."""
    if arguments.unrecorded:
        if len(arguments.link) != 1:
            raise exit_codes.UsageError("--unrecorded looks at one link; give it with --link")
        spec = arguments.link[0]
        return spec, lambda: (open_one or bridge.links.open.open_link)(spec)
    begins = bool(arguments.link) and not arguments.view_only
    holding = links.holding_now() if begins else links.usable_now()
    if holding is None:
        if arguments.view_only:
            raise exit_codes.UsageError(
                "no recording runs that could be looked at, and --view-only begins none; start `seatrial record`"
            )
        if not arguments.link:
            raise exit_codes.UsageError(
                "no link is named and no recording runs; give --link SPEC, or start `seatrial record`"
            )
        options = recorder.options(
            arguments.link, arguments.out, arguments.vehicle or "", arguments.sign_key or ""
        )
        holding = recorder.begin(options, clocks.SystemClock(), time.sleep)
    if not holding.hub:
        raise LinkError(
            f"{links.words_of(holding)} serves nobody; end it first, and start it without --hub none"
        )
    not_held = [link for link in arguments.link if not links.holds(holding, link)]
    if not_held:
        raise exit_codes.UsageError(
            f"{links.words_of(holding)} does not hold {', '.join(not_held)}; end it first, or leave --link out"
        )
    return OF_RECORDING, lambda: links.of_recording(links.holding_now())
