"""`seatrial watch`: the present state of a vehicle: a line per second in a pipe, a live table on a terminal."""

import argparse
import threading
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

from rich.live import Live

from bridge import clock as clocks
from bridge import command_line, exit_codes
from bridge.clock import Clock, utc_text
from bridge.links import secured
from bridge.links.reconnecting import Reconnecting
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.wire.framing import Framer
from gcs_plugin.bell import Bell
from gcs_plugin.dives.folder import DiveFolder
from gcs_plugin.params.last_accepted import accepted_values
from gcs_plugin.recording.state import Holding, hung, was_killed
from gcs_plugin.watch.alarms import load_settings
from gcs_plugin.watch.picture import Condition, Picture
from gcs_plugin.watch.watcher import Watcher
from tui import links, show
from tui.watch_text import POOR, header, line, plain, screen, tables

POLL_S = 0.1
EVERY_S = 1.0
ONCE_S = 3.0
"""How long --once looks."""

CLOCK_TIME = slice(11, None)
"""Of a time's text: the time of day."""


def run(arguments: argparse.Namespace) -> int:
    file, settings = _vehicle(arguments.vehicle, links.holding_of(arguments.link)), load_settings()
    bell = Bell(settings, show.results(arguments.json).bell)
    clock = clocks.SystemClock()
    opener = secured.Opener(arguments.sign_key, clock, secured.on_words)
    link = links.coming_back(links.link_for(arguments.link, opener.open), arguments.link, clock, opener.open)
    try:
        watcher = Watcher(
            file,
            arguments.system,
            clock.unix_s() - clock.boot_s(),
            settings,
            partial(accepted_values, Path(arguments.receipts), file.vehicle.name if file else ""),
            lambda: links.recorded_by(links.holding_of(arguments.link)),
        )
        reader = LinkReader(link, watcher, clock, lambda: opener.words(arguments.link or ""))
        if arguments.once:
            command_line.until_stopped(reader.listen, clock, arguments.seconds or ONCE_S, lambda _: None)
        else:
            _shown(reader, arguments, bell)
    finally:
        link.close()
    picture = reader.picture
    if arguments.once:
        console = show.results(arguments.json)
        show.say(console, *header(picture, links.holding_of(arguments.link), reader.wrong()))
        for table in tables(picture):
            show.put(console, table)
    show.write_json(plain(picture), arguments.json)
    if not reader.frames:
        show.say(show.words(), f"nothing arrived on {link.name}; check vehicle, cable and port")
    return code(reader.frames, picture, arguments.once)


def code(frames: int, picture: Picture, once: bool) -> int:
    """Return the exit code; poor sensors count only with `once`."""
    if not frames:
        return exit_codes.LINK
    poor = any(row.condition in (*POOR, Condition.AWAITED) for row in picture.sensors)
    return exit_codes.NO if once and poor else exit_codes.DONE


class LinkReader:
    """Reads a link, and keeps the newest picture of the vehicle, made once a second."""

    def __init__(
        self, link: Reconnecting, watcher: Watcher, clock: Clock, refused: Callable[[], str] = lambda: ""
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

    def listen(self, stop: threading.Event) -> None:
        """Read the link until `stop` is set."""
        framer = Framer()
        next_s = self._clock.boot_s() + EVERY_S
        while not stop.is_set():
            data = self._link.read(POLL_S)
            now_s = self._clock.boot_s()
            for frame in framer.feed(data):
                self.frames += 1
                self._watcher.feed(frame, now_s, self._name)
            if now_s >= next_s:
                next_s = max(next_s + EVERY_S, now_s)
                self.fault, self.picture = self.wrong(), self._watcher.picture(now_s)
        self.picture = self._watcher.picture(self._clock.boot_s())


def _shown(reader: LinkReader, arguments: argparse.Namespace, bell: Bell) -> None:
    console, clock = show.results(arguments.json), clocks.SystemClock()
    shown = newest = reader.picture
    holding: Holding | None = None

    def new() -> bool:
        nonlocal shown, newest, holding
        before, newest = newest, reader.picture
        if newest is before:
            return False
        holding = links.holding_now() or holding
        over = arguments.link is None and is_over(holding, clock.unix_s())
        shown = replace(newest, alarms=()) if over else newest
        bell.hear(shown.alarms, shown.now_s)
        return True

    if not console.is_terminal:

        def tell(_: float) -> None:
            if new():
                seen = line(shown, links.holding_of(arguments.link), reader.fault)
                show.say(console, f"{utc_text(clock.unix_s())[CLOCK_TIME]} {seen}")

        command_line.until_stopped(reader.listen, clock, arguments.seconds, tell)
        return
    with Live(console=console, auto_refresh=False) as live:

        def draw(_: float) -> None:
            if new():
                size = console.size
                seen = screen(shown, links.holding_of(arguments.link), size.width, size.height, reader.fault)
                live.update(seen, refresh=True)

        command_line.until_stopped(reader.listen, clock, arguments.seconds, draw)


def is_over(last: Holding | None, unix_s: float) -> bool:
    """Whether the recording by way of which a vehicle was watched has ended, and the dive with it. One that was killed,
    or that hangs, ends no dive: the vehicle may be under way."""
    if links.holding_now() is not None or hung(unix_s) is not None:
        return False
    return last is None or not was_killed(last.pid)


def _vehicle(named: str | None, holding: Holding | None) -> VehicleFile | None:
    if named is None and holding is not None:
        about = DiveFolder(Path(holding.folder)).about()
        if about.vehicle_path is not None:
            named = ":".join(filter(None, (about.vehicle_file, about.configuration)))
    return load_vehicle(named) if named else None
