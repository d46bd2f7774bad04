"""`seatrial watch`: the present state of a vehicle: a line per second in a pipe, a live table on a terminal."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from bridge import exit_codes
from bridge.command_line import seconds
from bridge.links import secured

if TYPE_CHECKING:
    import threading
    from collections.abc import Callable

    from rich.console import RenderableType

    from bridge.clock import Clock
    from bridge.links.reconnecting import Reconnecting
    from bridge.vehicle.config import VehicleFile
    from gcs_plugin.recording.state import Holding
    from gcs_plugin.watch.picture import Picture
    from gcs_plugin.watch.watcher import Watcher

EXAMPLE = "seatrial watch --vehicle ruvifist --link udpin:127.0.0.1:14550"
POLL_S = 0.1
EVERY_S = 1.0
ONCE_S = 3.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--link", metavar="SPEC", help="a link (default: by way of the recording that runs)")
    secured.add_argument(parser)
    parser.add_argument(
        "--vehicle",
        metavar="FILE[:CONFIGURATION]",
        help="the vehicle file: which sensors it has (default: the one that the recording that runs names)",
    )
    parser.add_argument(
        "--system",
        type=int,
        metavar="N",
        help="which vehicle, where several beat on the link (default: the vehicle file's, else the first)",
    )
    parser.add_argument(
        "--seconds", type=seconds, metavar="N", help="stop after so long (default: at Ctrl-C)"
    )
    parser.add_argument(
        "--once",
        action="store_true",
        help=f"look for {ONCE_S:g} s, print the tables, and end with 1 where a sensor is missing or bad",
    )
    parser.add_argument(
        "--json", metavar="FILE", help="write the last picture as JSON; - for standard output"
    )


def run(arguments: argparse.Namespace) -> int:
    from bridge.clock import SystemClock
    from gcs_plugin.watch.watcher import Watcher
    from tui import show, watched
    from tui.files import check_file
    from tui.links import coming_back, holding_now, link_for

    check_file("--json", arguments.json)
    holding = holding_now()
    file = _vehicle(arguments.vehicle, holding)
    clock = SystemClock()
    opener = secured.Opener(arguments.sign_key, clock, secured.on_words)
    link = coming_back(link_for(arguments.link, opener.open), arguments.link, clock, opener.open)
    try:
        watcher = Watcher(file, arguments.system, clock.unix_s() - clock.boot_s())
        looked = Look(link, watcher, clock, lambda: opener.words(arguments.link or ""))
        if arguments.once:
            _quietly(looked, arguments.seconds or ONCE_S)
        else:
            _shown(looked, arguments)
    finally:
        link.close()
    picture = looked.picture
    if arguments.once:
        console = show.results(arguments.json)
        for sentence in watched.header(picture, holding_now(), looked.wrong()):
            show.say(console, sentence)
        for table in watched.tables(picture):
            show.put(console, table)
    show.write_json(watched.plain(picture), arguments.json)
    if not looked.frames:
        show.say(show.words(), f"nothing arrived on {link.name}; check vehicle, cable and port")
    return code(looked.frames, picture, arguments.once)


def code(frames: int, picture: "Picture", once: bool) -> int:
    """Return the exit code; poor sensors count only with `once`."""
    from tui import watched

    if not frames:
        return exit_codes.LINK
    poor = any(row.condition in watched.POOR for row in picture.sensors)
    return exit_codes.NO if once and poor else exit_codes.DONE


class Look:
    """A link being read, and the newest picture of the vehicle, made once a second."""

    def __init__(
        self,
        link: "Reconnecting",
        watcher: "Watcher",
        clock: "Clock",
        refused: "Callable[[], str]" = lambda: "",
    ) -> None:
        # A link that replaces a lost link keeps its name.
        self._link, self._name, self._watcher, self._clock = link, link.name, watcher, clock
        self._refused = refused
        self.frames = 0
        self.fault = ""
        self.picture: Picture = watcher.picture(clock.boot_s())

    def wrong(self) -> str:
        """Return why the link is down and which frames it refused; "" for neither."""
        return "; ".join(filter(None, (self._link.fault, self._refused())))

    def listen(self, stop: "threading.Event") -> None:
        """Read the link until `stop` is set."""
        from bridge.wire.framing import Framer

        framer = Framer()
        due_s = self._clock.boot_s() + EVERY_S
        while not stop.is_set():
            data = self._link.read(POLL_S)
            now_s = self._clock.boot_s()
            for frame in framer.feed(data):
                self.frames += 1
                self._watcher.feed(frame, now_s, self._name)
            if now_s >= due_s:
                due_s = max(due_s + EVERY_S, now_s)
                self.fault, self.picture = self.wrong(), self._watcher.picture(now_s)
        self.picture = self._watcher.picture(self._clock.boot_s())


def _quietly(looked: Look, seconds: float) -> None:
    from bridge.clock import SystemClock
    from bridge.command_line import until_stopped

    until_stopped(looked.listen, SystemClock(), seconds, lambda _: None)


def _shown(looked: Look, arguments: argparse.Namespace) -> None:
    from rich.live import Live

    from bridge.clock import SystemClock
    from bridge.command_line import until_stopped
    from gcs_plugin.dives.folder import utc_text
    from tui import show, watched
    from tui.links import holding_now

    console, clock = show.results(arguments.json), SystemClock()
    shown = looked.picture

    def new() -> bool:
        nonlocal shown
        before, shown = shown, looked.picture
        return shown is not before

    if not console.is_terminal:

        def tell(_: float) -> None:
            if new():
                line = watched.line(shown, holding_now(), looked.fault)
                show.say(console, f"{utc_text(clock.unix_s())} {line}")

        until_stopped(looked.listen, clock, arguments.seconds, tell)
        return
    with Live(console=console, auto_refresh=False) as live:

        def draw(_: float) -> None:
            if new():
                live.update(screen(shown, holding_now(), console.width, looked.fault), refresh=True)

        until_stopped(looked.listen, clock, arguments.seconds, draw)


def screen(picture: "Picture", holding: "Holding | None", width: int, fault: str = "") -> "RenderableType":
    """Return the tables for a terminal, with stale rows dimmed; `fault` says why nothing arrives."""
    from rich.console import Group
    from rich.text import Text

    from gcs_plugin.watch.picture import Freshness
    from tui import watched

    text = Text(no_wrap=True, overflow="ellipsis")
    for number, sentence in enumerate(watched.header(picture, holding, fault)):
        text.append(f"{sentence}\n", style="bold" if number == 0 else "")
    fresh = {
        "quantity": [trace.freshness for trace in picture.traces.values()],
        "sensor": [row.freshness for row in picture.sensors],
        "thruster": [row.freshness for row in picture.thrusters],
    }
    parts: list[RenderableType] = [text]
    for table in watched.tables(picture):
        kind = next(name for name in fresh if name in table.columns)
        styles = ["" if state is Freshness.FRESH else "dim" for state in fresh[kind]]
        parts += [table.drawn(width, styles), ""]
    return Group(*parts)


def _vehicle(named: str | None, holding: "Holding | None") -> "VehicleFile | None":
    """Return the named vehicle file, or that of the running recording."""
    from bridge.vehicle.config import load_vehicle
    from gcs_plugin.dives.folder import DiveFolder

    if named is None and holding is not None:
        about = DiveFolder(Path(holding.folder)).about()
        if about.vehicle_path is not None:
            named = ":".join(filter(None, (about.vehicle_file, about.configuration)))
    return load_vehicle(named) if named else None
