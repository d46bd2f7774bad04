# SPDX-License-Identifier: GPL-3.0-or-later
"""The module that MAVProxy loads: its commands, and a little work of each kind in every idle moment.

MAVProxy does not pass on to its modules the messages it sends, the link a message came on, or frames that it doesn't
know or takes for delayed. The `recv` and `write` of its links see all of these, every byte in order.
"""

import atexit
import contextlib
import sys
from collections import deque
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

from MAVProxy.modules.lib import mp_module

from bridge.clock import SystemClock
from bridge.errors import ConfigError, LinkError, SeatrialError
from bridge.text import printable
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.wire.framing import Frame, Framer
from gcs_plugin.bell import Bell
from gcs_plugin.fleet import Fleet
from gcs_plugin.mavproxy.help_and_completion import COMPLETERS, COMPLETIONS, USAGE, help_lines
from gcs_plugin.mavproxy.parameters import Parameters
from gcs_plugin.mavproxy.recordings import Recordings
from gcs_plugin.mavproxy.switching import Switching
from gcs_plugin.mavproxy.work import Work
from gcs_plugin.monitor.gap import gap_line
from gcs_plugin.watch.alarms import load_settings
from gcs_plugin.watch.picture import Picture
from gcs_plugin.watch.watcher import Watcher

MOST_WAITING: Final = 10_000
"""Chunks kept until the next `take`: half a minute of the busiest link."""


class Tap:
    """A link of MAVProxy, with the data that passed since the last call."""

    def __init__(self, connection: Any) -> None:
        self.connection = connection
        self.name: str = str(getattr(connection, "address", "MAVProxy's link"))
        self._chunks: deque[tuple[bool, bytes]] = deque(maxlen=MOST_WAITING)
        self._framers = {False: Framer(), True: Framer()}
        self._recv, self._write = connection.recv, connection.write
        connection.recv, connection.write = self._read_through, self._write_through

    def remove(self) -> None:
        """Restore the link's own methods."""
        for name, ours in (("recv", self._read_through), ("write", self._write_through)):
            # If someone wrapped the link after us, their wrapper keeps working through ours.
            if getattr(self.connection, name) == ours:
                delattr(self.connection, name)

    def take(self, now_s: float) -> list[tuple[bool, Frame]]:
        """Frames since the last call, in the order in which they passed; True for a frame that was sent."""
        chunks = [self._chunks.popleft() for _ in range(len(self._chunks))] or [(False, b""), (True, b"")]
        return [(sent, frame) for sent, data in chunks for frame in self._framers[sent].hear(data, now_s)]

    def _read_through(self, *words: Any, **named: Any) -> Any:
        data = self._recv(*words, **named)
        if data:
            self._chunks.append((False, bytes(data)))
        return data

    def _write_through(self, data: Any, *words: Any, **named: Any) -> Any:
        self._chunks.append((True, bytes(data)))
        return self._write(data, *words, **named)


LOOK_EVERY_S: Final = 1.0


def _ring() -> None:
    """The terminal's bell."""
    sys.stdout.write("\a")
    sys.stdout.flush()


LOAD_NAME: Final = "gcs_plugin.mavproxy"


class SeatrialModule(mp_module.MPModule):  # type: ignore[misc]
    """Dispatches each command to the class that carries it out; nothing here blocks."""

    def __init__(self, mpstate: Any) -> None:
        super().__init__(mpstate, LOAD_NAME, "sea trials", public=True, multi_vehicle=True)
        self._clock, self._fleet = SystemClock(), Fleet()
        self._taps: list[Tap] = []
        self._file = ""
        self._parameters = Parameters(self._fleet, self._clock, self.say_line)
        self._switching = Switching(self._fleet, self._clock, self.say_line)
        self._work = Work(self._clock, self.say_line)
        # Ctrl-C ends MAVProxy without unloading its modules, and does not reach a process in a group of its own.
        atexit.register(self._work.kill)
        self._recordings = Recordings(
            self._clock,
            self.say_line,
            lambda: [tap.name for tap in self._taps],
            lambda: load_vehicle(self._file) if self._file else None,
        )
        self._settings, self._look_s = load_settings(), 0.0
        self._bell = Bell(self._settings, _ring)
        self._picture: Picture | None = None
        self._watcher = self._new_watcher()
        self.add_command("seatrial", self.command, "sea trials: record, identify, upload", COMPLETIONS)
        for word, complete in COMPLETERS.items():
            self.add_completion_function(word, complete)
        self.add_completion_function("(SEATRIAL_VEHICLE)", self._vehicles)

    def command(self, words: list[str]) -> None:
        """Handle a `seatrial` command typed on the console."""
        try:
            if not self._do(words):
                self.say_line(USAGE)
        except SeatrialError as error:
            self.say_line(f"seatrial: {error}")

    def idle_task(self) -> None:
        """Process the frames that passed on all links, then advance everything in progress."""
        now_s = self._clock.boot_s()
        self._tap(self.mpstate.mav_master)
        for tap in self._taps:
            self._hear(tap, now_s)
        self._recordings.tick()
        self._switch(self._switching.tick())
        try:
            for message in self._parameters.tick():
                self._send(message)
        except SeatrialError as error:
            self.say_line(f"seatrial: {error}")
        self._work.tick()
        if now_s >= self._look_s + LOOK_EVERY_S:
            before = "" if self._picture is None else self._picture.twins
            self._look_s, self._picture = now_s, self._watcher.picture(now_s)
            if self._picture.twins and not before:
                self.say_line(f"seatrial: {self._picture.twins}")
            for alarm in self._bell.hear(self._picture.alarms, now_s):
                self.say_line(f"ALARM {alarm.words}")

    def unload(self) -> None:
        """Clean up when MAVProxy unloads the module or ends. What is on its way, parameters or a mode, OFF too, is sent
        no more: that is said."""
        self._work.kill()
        self._switching.cancel()
        self._parameters.end()
        atexit.unregister(self._work.kill)
        self._recordings.stop()
        self._tap([])
        self.remove_command("seatrial")

    def say_line(self, line: str) -> None:
        """Print a line on MAVProxy's console."""
        self.console.writeln(printable(line, "?"))

    def _do(self, words: list[str]) -> bool:
        match words:
            case ["status"]:
                self._status()
            case ["record", *arguments]:
                return self._recordings.command(arguments)
            case ["identify" | "diagnose" as verb, *arguments]:
                self._work.check_idle()
                named = bool(arguments) and not arguments[0].startswith("--")
                self._work.begin(
                    verb,
                    Path(arguments[0]) if named else self._recordings.newest(),
                    arguments[1:] if named else arguments,
                    self._file,
                )
            case ["cancel"]:
                if not any([self._work.cancel(), self._parameters.cancel(), self._switching.cancel()]):
                    self.say_line("nothing runs that could be ended")
            case ["params", *arguments]:
                return self._parameters.command(arguments)
            case ["ff", *arguments]:
                return self._switching.command(arguments)
            case ["vehicle", *arguments] if len(arguments) <= 1:
                self._vehicle(*arguments)
            case ["file", *arguments] if len(arguments) <= 1:
                self._vehicle_file(*arguments)
            case ["help", *arguments] if len(arguments) <= 1:
                for line in help_lines(arguments[0] if arguments else None):
                    self.say_line(line)
            case _:
                return False
        return True

    def _tap(self, connections: Sequence[Any]) -> None:
        """Tap `connections`, all links at present, and release the links that are not among them any more."""
        for tap in self._taps:
            if tap.connection not in connections:
                tap.remove()
        known = [tap.connection for tap in self._taps]
        kept = [tap for tap in self._taps if tap.connection in connections]
        self._taps = [*kept, *(Tap(connection) for connection in connections if connection not in known)]

    def _hear(self, tap: Tap, now_s: float) -> None:
        for sent, frame in tap.take(now_s):
            self._recordings.keep(frame, tap.name)
            if sent:
                continue
            self._watcher.feed(frame, now_s, tap.name)
            self._switching.on_frame(frame)
            news = self._fleet.on_frame(frame, tap.name, now_s)
            if news is not None and getattr(news.message, "target_system", 0) in (
                0,
                self.settings.source_system,
            ):
                self._parameters.on_news(news)
                self._switching.on_news(news)

    def _switch(self, messages: list[Any]) -> None:
        """Send the messages of a mode switch; if one vehicle's link is gone, the others still get theirs."""
        troubles = {}
        for message in messages:
            try:
                self._send(message)
            except SeatrialError as error:
                troubles[str(error)] = True
        for trouble in troubles:
            self.say_line(f"seatrial: {trouble}")

    def _send(self, message: Any) -> None:
        """Send on the link that last carried the vehicle, as MAVProxy, to keep its sequence numbers and signing
        valid."""
        link = self._fleet.link_of((message.target_system, message.target_component))
        tap = next((tap for tap in self._taps if tap.name == link), None)
        if tap is None:
            raise LinkError(
                f"the link of vehicle {message.target_system} is gone from MAVProxy; nothing was sent"
            )
        tap.connection.mav.send(message)

    def _status(self) -> None:
        now_s = self._clock.boot_s()
        sources = self._fleet.sources(now_s)
        for link, health in sources:
            lines = [f"{health.system}/{health.component} on {link}: heard {health.age_s:.1f} s ago"]
            lost = f", {health.loss:.1%} lost as seen here" if health.tells_loss else ""
            lines.append(f"{health.received} frames{lost}")
            peer = self._fleet.peers.get((health.system, health.component))
            if peer is not None and peer.is_vehicle:
                lines.append("ARMED" if self._fleet.peers.armed(health.system) else "disarmed")
                lines.append(self._switching.mode_words(health.system))
            self.say_line(", ".join(filter(None, lines)))
        if not sources:
            self.say_line("nothing heard yet")
        with contextlib.suppress(LinkError):
            self.say_line("meant: vehicle {}, component {}".format(*self._fleet.meant(now_s)))
        if self._picture is not None:
            if self._picture.twins:
                self.say_line(self._picture.twins)
            for alarm in self._picture.alarms:
                self.say_line(f"ALARM {alarm.words}")
            if self._picture.gap is not None:
                self.say_line(gap_line(self._picture.gap))
            elif self._picture.lacks:
                how = "" if self._file else "; name it: seatrial file NAME"
                self.say_line(f"not compared with its model: {self._picture.lacks}{how}")
        parts = self._recordings, self._work, self._parameters, self._switching
        for line in (line for part in parts for line in part.status()):
            self.say_line(line)

    def _new_watcher(self) -> Watcher:
        """A watcher of the vehicle meant, with the parameters that MAVProxy has read of it."""
        file = load_vehicle(self._file) if self._file else None
        return Watcher(file, self._fleet.chosen, settings=self._settings, accepted=self._read_of)

    def _read_of(self, system: int) -> dict[str, float]:
        """The parameters that MAVProxy has read of a vehicle, which may be another than MAVProxy's own target."""
        return {
            str(name): float(value)
            for (owner, _), values in self.mpstate.mav_param_by_sysid.items()
            if owner == system
            for name, value in values.items()
        }

    def _vehicle(self, name: str | None = None) -> None:
        now_s = self._clock.boot_s()
        if name is not None:
            if name != "any" and not name.isdecimal():
                raise LinkError(f"'{name}' is no system number; give one, or any")
            self._fleet.choose(None if name == "any" else int(name), now_s)
            # What was seen and rung of another vehicle is not this one's.
            self._watcher, self._picture = self._new_watcher(), None
            self._bell = Bell(self._settings, _ring)
        systems = ", ".join(map(str, self._fleet.systems(now_s))) or "none"
        meant = "any" if self._fleet.chosen is None else str(self._fleet.chosen)
        self.say_line(f"vehicle: {meant} (systems that beat: {systems})")

    def _vehicles(self, text: str) -> list[str]:
        """Completions of a vehicle's system number."""
        names = ["any", *map(str, self._fleet.systems(self._clock.boot_s()))]
        return [name for name in names if name.startswith(text)]

    def _vehicle_file(self, name: str | None = None) -> None:
        if name is not None:
            file: VehicleFile = load_vehicle(name)
            self._file = name
            self._watcher, self._picture = self._new_watcher(), None
            shape = file.configuration or "the recording's own"
            self.say_line(f"vehicle file: {file.path} ({file.vehicle.name}), configuration: {shape}")
        elif not self._file:
            raise ConfigError("no vehicle file is named; give NAME, or NAME:CONFIGURATION")
        else:
            self.say_line(f"vehicle file: {self._file}")
