"""`seatrial tui`: the terminal app."""

import argparse
import asyncio
import contextlib
import os
import sys
from pathlib import Path

from bridge import clock as clocks
from bridge import exit_codes
from bridge.errors import LinkError
from bridge.links import secured
from bridge.links.addresses import listening, of_links, of_served, parse_link
from bridge.text import say
from bridge.vehicle.config import load_vehicle
from gcs_plugin.dives.folder import list_folders
from gcs_plugin.recording.state import Holding, was_killed
from gcs_plugin.watch.alarms import load_settings
from tui import links, show
from tui.app import recorder, themes
from tui.app.app import SeatrialApp
from tui.app.connection import Connection
from tui.app.desk import DIVES, Desk
from tui.app.drawing import utc
from tui.app.jobs import Jobs
from tui.app.keys import load_keymap, looking_work
from tui.app.recorder import recorded
from tui.app.screens.table import PLACES
from tui.app.station import Station
from tui.app.terminal import AnsweringDriver

MOST_FPS = 30.0
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
    from tui.web.server import PageServer, in_url, warning  # its server takes half a second to load

    load_keymap(arguments.keymap, PLACES)
    host = arguments.host or "127.0.0.1"
    port = 8000 if arguments.port is None else arguments.port
    # An unreadable key is reported before anything starts.
    secured.Opener(arguments.sign_key, clocks.SystemClock(), secured.on_words)
    if _begins(arguments):
        named = (arguments.link, arguments.out, arguments.vehicle or "", arguments.sign_key or "")
        recorder.begin(recorder.options(*named), clocks.SystemClock())
    elif links.holding_now() is None:
        raise exit_codes.UsageError(
            "no link is named and no recording runs; give --link SPEC, or start `seatrial record`"
        )
    command = [sys.executable, "-m", "tui", "tui"]
    for name in PASSED_ON:
        value = getattr(arguments, name)
        command += [] if value is None else [f"--{name}", str(value)]
    command += [] if arguments.control else ["--view-only"]

    def tell(sockets: list[tuple[str, int]]) -> None:
        words, rights = show.words(), "with every control" if arguments.control else "view-only"
        for address, number in sockets:
            page = listening("TCP", address, number, f"the page, {rights}")
            show.say(words, f"{page}: http://{in_url(address)}:{number}/")
        list_recording()
        if danger := warning(host, arguments.control):
            show.say(words, f"warning: {danger}")

    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(PageServer(command, host, port).run(tell))
    return exit_codes.DONE


def list_recording() -> None:
    """Print the sockets that the running recording holds open, with the time: it may end before this is read."""
    if (holding := links.holding_now()) is not None:
        at = f"at {utc(clocks.SystemClock().unix_s())} UTC"
        say(f"{at} {links.words_of(holding)} ran by itself, with these sockets:")
        for sentence in (of_served(holding.hub), *of_links(holding.links, "a link that is recorded")):
            say(sentence)


def list_recorders(before: Holding | None = None) -> None:
    """Name the recording that ran `before` the app, if it has ended since, and every recorder that lives on, with how
    to end it."""
    living = links.recordings_now()
    if before is not None and before.pid not in {holding.pid for holding in living}:
        say(f"{links.words_of(before)} has ended since")
    for n, holding in enumerate(living):
        how = "Ctrl-C in its terminal ends it" if n else "`seatrial record --end` ends it"
        say(f"{links.words_of(holding)} goes on, of {', '.join(holding.links)}; {how}")


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
    alarms = load_settings()
    clock = clocks.SystemClock()
    # Its messages appear on the screen instead: see `refused`.
    opener = secured.Opener(arguments.sign_key, clock, lambda _: None, lambda _: None, secured.later)
    begins = _begins(arguments)
    connection = Connection(
        clock,
        tuple(arguments.link),
        arguments.link[0] if arguments.unrecorded else "",
        str(folder_of_dives(arguments.out)),
        (arguments.vehicle or "", vehicle),
        arguments.sign_key or "",
        opener.open,
        opener.trouble,
        Path(arguments.receipts),
        alarms,
        silent=arguments.view_only,
    )
    station = connection.station = Station(
        connection.source(),
        connection.watcher(),
        clock,
        connection.recording,
        connection.switch,
        1.0 / arguments.fps,
    )
    acts = not arguments.view_only
    app = SeatrialApp(
        station,
        arguments.theme or themes.load_theme(),
        keymap,
        min(arguments.fps, MOST_FPS),
        driver=None if in_browser else AnsweringDriver,
        desk=Desk(
            arguments.vehicle or "",
            folder_of_dives(arguments.out),
            Path(arguments.receipts),
            jobs=Jobs() if acts else Jobs(looking_work),
            record=connection.record if acts and not arguments.unrecorded else None,
            recorded=recorded,
            next_dive=connection.next_dive if acts else None,
            end_recording=connection.end if acts else None,
            links=connection.links,
            link=connection.link,
            connect=connection.connect if acts else None,
            name_vehicle=connection.name_vehicle if acts else None,
            was_killed=was_killed,
        ),
        view_only=arguments.view_only,
        begins=begins,
        alarms=alarms,
    )
    if not in_browser:
        list_sockets(arguments)
    listed = None if in_browser else links.holding_now()
    station.start()
    try:
        app.run()
    finally:
        station.stop()
    list_recorders(listed)
    return app.return_code or exit_codes.DONE


def _is_terminal() -> bool:
    """Whether a person sits at the terminal; Textual draws on standard error."""
    return sys.stdin.isatty() and sys.stderr.isatty()


def folder_of_dives(out: str) -> Path:
    """The folder named; the present one if it holds dives, and the usual folder of dives is not there."""
    folder, here = Path(out), Path()
    return here if folder == DIVES and not folder.exists() and list_folders(here) else folder


def _begins(arguments: argparse.Namespace) -> bool:
    """Whether the app is to begin a recording of the links named. Raises SeatrialError if the links can't be used."""
    if arguments.unrecorded:
        if len(arguments.link) != 1:
            raise exit_codes.UsageError("--unrecorded looks at one link; give it with --link")
        return False
    for link in arguments.link:
        parse_link(link)
    begins = bool(arguments.link) and not arguments.view_only
    holding = links.holding_now() if begins else links.usable_now()
    if holding is None:
        if arguments.view_only:
            raise exit_codes.UsageError(
                "no recording runs that could be looked at, and --view-only begins none; start `seatrial record`"
            )
        return begins
    if not holding.hub:
        raise LinkError(
            f"{links.words_of(holding)} serves nobody; end it first, and start it without --hub none"
        )
    not_held = [link for link in arguments.link if not links.holds(holding, link)]
    if not_held:
        raise exit_codes.UsageError(
            f"{links.words_of(holding)} does not hold {', '.join(not_held)}; end it first, or leave --link out"
        )
    return False
